#include "mesh_out/io/relief_file.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "mesh_out/io/exr_file.h"
#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {

ReliefTile read_relief(const std::filesystem::path& path, const char* channel) {
    const auto refuse = [&](const std::string& what) {
        throw Error(Fault::bad_input, path.string() + ": " + what + "; make it again");
    };
    const std::vector<std::string> wanted = {channel};
    ExrImage exr = read_exr(path, wanted);
    ReliefTile tile;
    tile.pixel_m = 0;
    for (const auto& [key, value] : exr.attributes) {
        if (key == "pixel_m") {
            const auto pixel_m = parse_number(value);
            if (!pixel_m || !(*pixel_m > 0 && *pixel_m <= 1e6))
                refuse("'pixel_m' is '" + printable(value, 20) + "', must be a length [m]");
            tile.pixel_m = *pixel_m;
        }
        if (key == "wrap")
            tile.tileable = value == "periodic";
    }
    const Image& image = exr.image;
    if (image.width < 2 || image.height < 2)
        refuse("has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
               " heights, must have 2 x 2 or more");
    if (!std::all_of(image.pixels.begin(), image.pixels.end(),
                     [](float h) { return std::isfinite(h); }))
        refuse(std::string("channel '") + channel + "' has a value that is not finite");
    tile.heights = std::move(exr.image);
    return tile;
}

} // namespace taihu
