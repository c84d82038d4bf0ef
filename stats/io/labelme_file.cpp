#include "stats/io/labelme_file_detail.h"

#include "stats/core/error.h"
#include "stats/io/json_detail.h"

namespace taihu {
namespace {

using nlohmann::json;

std::vector<std::pair<double, double>> read_points(const json& shape, const std::string& where) {
    const auto found = shape.find("points");
    if (found == shape.end() || !found->is_array())
        throw Error(Fault::bad_input, where + ": 'points' is no list; mark the shape again");
    std::vector<std::pair<double, double>> points;
    for (const json& p : *found) {
        if (!p.is_array() || p.size() != 2 || !p[0].is_number() || !p[1].is_number())
            throw Error(Fault::bad_input, where + ": point " + std::to_string(points.size() + 1) +
                                              " is not two numbers; mark the shape again");
        points.emplace_back(p[0].get<double>(), p[1].get<double>());
    }
    return points;
}

// Older files have no size, or null.
int read_side(const json& file, const char* key, const std::string& name) {
    const auto found = file.find(key);
    if (found == file.end() || found->is_null())
        return 0;
    const auto side = picture_side(json_number(file, name, key, 1, 1e6));
    if (!side)
        throw Error(Fault::bad_input, name + ": '" + key + "' is no whole number; correct it");
    return *side;
}

} // namespace

bool is_labelme(const json& file) {
    return file.is_object() && file.contains("shapes") && file["shapes"].is_array();
}

Annotations read_labelme(const json& file, const std::string& name) {
    Annotations result;
    result.file = name;
    const bool has_path = file.contains("imagePath") && file["imagePath"].is_string();
    const std::size_t photo = result.photo(
        has_path ? std::optional(last_part(json_text(file, name, "imagePath"))) : std::nullopt);
    const int width = read_side(file, "imageWidth", name);
    const int height = read_side(file, "imageHeight", name);
    if (width > 0 && height > 0)
        result.set_size(photo, width, height);
    std::size_t i = 0;
    for (const json& shape : file["shapes"]) {
        Mark mark;
        mark.photo = photo;
        mark.item = "shapes[" + std::to_string(i++) + "]";
        const std::string where = name + ": " + mark.item;
        if (!shape.is_object())
            throw Error(Fault::bad_input, where + ": is no object; mark the shape again");
        const std::string type =
            shape.contains("shape_type") ? json_text(shape, where, "shape_type") : "polygon";
        if (type != "line" && type != "linestrip") {
            result.leave_out(type);
            continue;
        }
        mark.label = json_text(shape, where, "label");
        const auto points = read_points(shape, where);
        if (type == "line" && points.size() != 2)
            throw Error(Fault::bad_input, where + ": a line of " + std::to_string(points.size()) +
                                              " points; it must have two, mark it again");
        result.add_polyline(std::move(mark), points, type);
    }
    return result;
}

} // namespace taihu
