#include "stats/io/via_file_detail.h"

#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/io/json_detail.h"

namespace taihu {
namespace {

using nlohmann::json;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what);
}

// A text, or the one option of a set of check boxes that is ticked.
std::string attribute_text(const json& value) {
    if (value.is_string())
        return value.get<std::string>();
    std::string ticked;
    if (value.is_object())
        for (const auto& [option, on] : value.items())
            if (on == true)
                ticked += (ticked.empty() ? "" : "+") + option;
    return ticked;
}

std::string label_of(const json& attributes) {
    for (const char* key : {"label", "type", "name", "class"})
        if (attributes.contains(key))
            return attribute_text(attributes[key]);
    return attributes.size() == 1 ? attribute_text(attributes.front()) : std::string();
}

std::vector<double> coordinates(const json& shape, const char* key, const std::string& where) {
    const auto found = shape.find(key);
    std::vector<double> values;
    if (found == shape.end() || !found->is_array())
        refuse(where, "'" + std::string(key) + "' is no list; mark the region again");
    for (const json& value : *found) {
        if (!value.is_number())
            refuse(where, "'" + std::string(key) + "' holds " + value.type_name() +
                              ", must be numbers; mark the region again");
        values.push_back(value.get<double>());
    }
    return values;
}

void add_region(Annotations& result, Mark mark, const json& shape, const json& attributes) {
    const std::string where = place_of(result, mark);
    if (!shape.is_object() || !attributes.is_object())
        refuse(where, "its attributes are no objects; save the annotations again");
    const std::string kind = json_text(shape, where, "name");
    if (kind != "polyline")
        return result.leave_out(kind);
    const auto x = coordinates(shape, "all_points_x", where);
    const auto y = coordinates(shape, "all_points_y", where);
    if (x.size() != y.size())
        refuse(where, std::to_string(x.size()) + " x and " + std::to_string(y.size()) +
                          " y coordinates; mark the region again");
    std::vector<std::pair<double, double>> points;
    for (std::size_t i = 0; i < x.size(); ++i)
        points.emplace_back(x[i], y[i]);
    mark.label = label_of(attributes);
    result.add_polyline(std::move(mark), points, kind);
}

const json& images_of(const json& file) {
    const auto project = file.find("_via_img_metadata");
    return project == file.end() ? file : *project;
}

} // namespace

bool is_via(const json& file) {
    if (!file.is_object())
        return false;
    if (file.contains("_via_img_metadata"))
        return true;
    return !file.empty() && file.front().is_object() && file.front().contains("filename") &&
           file.front().contains("regions");
}

Annotations read_via(const json& file, const std::string& name) {
    Annotations result;
    result.file = name;
    const json& images = images_of(file);
    if (!images.is_object())
        refuse(name, "its images are no object; save the annotations again");
    for (const auto& [key, image] : images.items()) {
        const std::string where = name + ": image '" + printable(key) + "'";
        if (!image.is_object() || !image.contains("regions") || !image["regions"].is_structured())
            refuse(where, "has no regions; save the annotations again");
        Mark mark;
        const std::string photo = json_text(image, where, "filename");
        mark.photo = result.photo(photo);
        std::size_t i = 0;
        for (const json& region : image["regions"]) { // a list, in version 1 an object
            mark.item = "regions[" + std::to_string(i++) + "] of '" + printable(photo) + "'";
            if (!region.is_object() || !region.contains("shape_attributes") ||
                !region.contains("region_attributes"))
                refuse(place_of(result, mark), "has no attributes; save the annotations again");
            add_region(result, mark, region["shape_attributes"], region["region_attributes"]);
        }
    }
    return result;
}

Annotations read_via_table(const Table& table, const std::string& name) {
    Annotations result;
    result.file = name;
    const auto file = table.column("filename"), shape = table.column(kViaShapeColumn),
               attributes = table.column("region_attributes");
    const auto value = [&](std::size_t row, std::size_t column) {
        return parse_json(table.cell(row, column), name + ":" + std::to_string(table.line(row)) +
                                                       ": column " + std::to_string(column + 1));
    };
    for (std::size_t row = 0; row < table.n_rows(); ++row) {
        Mark mark;
        mark.photo = result.photo(std::string(table.cell(row, file)));
        mark.line = table.line(row);
        const json region = value(row, shape);
        if (region.is_object() && region.empty()) // a photo without regions has one such row
            continue;
        add_region(result, std::move(mark), region, value(row, attributes));
    }
    return result;
}

} // namespace taihu
