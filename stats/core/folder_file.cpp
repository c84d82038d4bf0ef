#include "stats/core/folder_file.h"

#include <algorithm>

#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {

namespace fs = std::filesystem;

bool is_plain_name(std::string_view name) {
    return !name.empty() && name.size() <= 255 && name != "." && name != ".." &&
           name.find('/') == std::string_view::npos && printable(name, 255) == name;
}

std::optional<fs::path> file_in(const fs::path& folder, std::string_view name) {
    if (!is_plain_name(name))
        throw Error(Fault::bad_argument,
                    "'" + printable(name) + "' is no plain name; give one without folders");
    const fs::path path = folder / name;
    std::error_code failed;
    if (!fs::is_regular_file(path, failed))
        return std::nullopt;
    const fs::path inside = fs::canonical(folder, failed), real = fs::canonical(path, failed);
    if (failed ||
        std::mismatch(inside.begin(), inside.end(), real.begin(), real.end()).first != inside.end())
        throw Error(Fault::bad_input,
                    path.string() + ": a link out of its folder; put the file itself there");
    return path;
}

} // namespace taihu
