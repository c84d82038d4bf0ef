#include "stats/io/annotations_detail.h"

#include <cmath>

#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {

std::size_t Annotations::photo(const std::optional<std::string>& name) {
    const auto [found, is_new] = index_.try_emplace(name, photos.size());
    if (is_new)
        photos.push_back({name, 0, 0});
    return found->second;
}

void Annotations::set_size(std::size_t photo, int width_px, int height_px) {
    MarkedPhoto& p = photos[photo];
    const auto text = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h); };
    if (width_px == 0 || (p.width_px == width_px && p.height_px == height_px))
        return;
    if (p.width_px != 0)
        throw Error(Fault::bad_input, file + ": image '" + printable(p.name.value_or(file)) +
                                          "' is " + text(width_px, height_px) + " px here and " +
                                          text(p.width_px, p.height_px) +
                                          " px before; mark one copy of the photo");
    p.width_px = width_px;
    p.height_px = height_px;
}

void Annotations::leave_out(std::string_view kind) {
    static constexpr std::size_t kMostKinds = 16; // a file must not make a warning of any length
    const std::string name = printable(kind);
    const bool fits = other_shapes.size() < kMostKinds || other_shapes.contains(name);
    ++other_shapes[fits ? name : "something else"];
}

void Annotations::add_polyline(Mark mark, const std::vector<std::pair<double, double>>& points,
                               std::string_view kind) {
    if (points.size() != 2)
        return leave_out(std::string(kind) + " of " + (points.size() < 2 ? "less" : "more") +
                         " than two points");
    mark.x1 = points[0].first;
    mark.y1 = points[0].second;
    mark.x2 = points[1].first;
    mark.y2 = points[1].second;
    marks.push_back(std::move(mark));
}

std::string place_of(const Annotations& file, const Mark& mark) {
    return file.file + (mark.line > 0 ? ":" + std::to_string(mark.line) : ": " + mark.item);
}

std::optional<int> picture_side(double value) {
    if (!(value >= 1 && value <= 1e6) || value != std::floor(value))
        return std::nullopt;
    return static_cast<int>(value);
}

std::string last_part(std::string_view path) {
    return std::string(path.substr(path.find_last_of("/\\") + 1)); // npos + 1 is 0
}

} // namespace taihu
