#include "tools/bump_files.h"

#include <algorithm>
#include <cmath>

#include "mesh_out/bump.h"
#include "mesh_out/io/exr_file.h"
#include "mesh_out/io/relief_file.h"
#include "stats/core/file_set.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

MapBorder border_of(const ReliefTile& tile) {
    return tile.tileable ? MapBorder::wrap : MapBorder::open;
}

/// Two channels of one map as one image.
Image interleaved(const Image& u, const Image& v) {
    Image out(u.width, u.height, 2);
    for (std::size_t i = 0; i < u.pixels.size(); ++i) {
        out.pixels[2 * i] = u.pixels[i];
        out.pixels[2 * i + 1] = v.pixels[i];
    }
    return out;
}

double rms(const Image& map) {
    double squares = 0;
    for (const float value : map.pixels)
        squares += double{value} * value;
    return std::sqrt(squares / static_cast<double>(map.pixels.size()));
}

/// What of the offsets no height field has [m per texel, root mean square].
double rms_left(const Image& offsets, const Image& heights, MapBorder border) {
    Image left = bump_offsets(heights, border);
    for (std::size_t i = 0; i < left.pixels.size(); ++i)
        left.pixels[i] -= offsets.pixels[i];
    return rms(left);
}

void write(const std::filesystem::path& path, const ExrImage& exr, const Console& console) {
    FileSet output(path.parent_path()); // of one file, whatever else is in its folder
    output.add_by(
        [&](const std::filesystem::path& folder) { write_exr(folder / path.filename(), exr); });
    check_cancelled(console.progress);
    output.publish(path.filename());
}

} // namespace

nlohmann::ordered_json convert_bumps(const std::filesystem::path& from,
                                     const std::filesystem::path& out, BumpForm form,
                                     const Console& console) {
    const bool to_offsets = form == BumpForm::offsets;
    const ReliefTile read = read_relief(from, to_offsets ? "Y" : "u");
    ExrImage exr;
    exr.attributes = {{"wrap", read.tileable ? "periodic" : "none"}};
    if (read.pixel_m > 0)
        exr.attributes.emplace_back("pixel_m", shortest(read.pixel_m));
    nlohmann::ordered_json json = {{"file", out.string()},
                                   {"size_px", {read.heights.width, read.heights.height}},
                                   {"tileable", read.tileable}};
    if (to_offsets) {
        exr.channels = {"u", "v"};
        exr.image = bump_offsets(read.heights, border_of(read));
        for (const char* channel : {"u_unit", "v_unit"})
            exr.attributes.emplace_back(channel, "m per texel");
    } else {
        const Image offsets = interleaved(read.heights, read_relief(from, "v").heights);
        report_stage(console.progress, "summing offsets");
        exr.channels = {"Y"};
        exr.image = bump_heights(offsets, border_of(read), console.progress);
        exr.attributes.emplace_back("Y_unit", "m");
        json["offsets_rms_m"] = rms(offsets);
        json["left_rms_m"] = rms_left(offsets, exr.image, border_of(read));
    }
    write(out, exr, console);
    const auto [lo, hi] = std::minmax_element(exr.image.pixels.begin(), exr.image.pixels.end());
    console.say("{}: {} x {} {}{}, {} to {} {}", out.string(), exr.image.width, exr.image.height,
                to_offsets ? "offsets to the right and up" : "heights, their mean 0",
                read.tileable ? ", tileable" : "", rounded(1e3 * *lo), rounded(1e3 * *hi),
                to_offsets ? "mm per texel" : "mm");
    if (!to_offsets)
        console.say("{}: {} % of the offsets (root mean square) is what no height field has",
                    out.string(),
                    rounded(1e2 * json["left_rms_m"].get<double>() /
                            std::max(json["offsets_rms_m"].get<double>(), 1e-300)));
    json["lowest_m"] = *lo;
    json["highest_m"] = *hi;
    return json;
}

} // namespace taihu
