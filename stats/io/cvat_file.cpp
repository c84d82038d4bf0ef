#include "stats/io/cvat_file_detail.h"

#include <algorithm>

#include <pugixml.hpp>

#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/io/utf_detail.h"

namespace taihu {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20; // a tree takes up to 20 times its text

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what);
}

std::vector<std::pair<double, double>> read_points(std::string_view text,
                                                   const std::string& where) {
    std::vector<std::pair<double, double>> points;
    while (!text.empty()) {
        const std::string_view point = text.substr(0, text.find(';'));
        text.remove_prefix(std::min(point.size() + 1, text.size()));
        const std::size_t comma = std::min(point.find(','), point.size());
        const auto x = parse_number(trimmed(point.substr(0, comma)));
        const auto y = parse_number(trimmed(point.substr(std::min(comma + 1, point.size()))));
        if (!x || !y)
            refuse(where, "point '" + printable(point) + "' is not x,y; mark it again");
        points.emplace_back(*x, *y);
    }
    return points;
}

int read_side(const pugi::xml_node& image, const char* key, const std::string& where) {
    const pugi::xml_attribute attribute = image.attribute(key);
    if (!attribute)
        return 0;
    const auto value = parse_number(attribute.value());
    const auto side = value ? picture_side(*value) : std::nullopt;
    if (!side)
        refuse(where, std::string(key) + " is '" + printable(attribute.value()) +
                          "'; must be a whole number in 1..1000000");
    return *side;
}

void read_image(const pugi::xml_node& image, const std::string& where, Annotations& result) {
    const std::string photo = image.attribute("name").value();
    if (photo.empty())
        refuse(where, "has no name; export it again");
    Mark mark;
    mark.photo = result.photo(photo);
    const int width = read_side(image, "width", where), height = read_side(image, "height", where);
    if ((width == 0) != (height == 0))
        refuse(where, "has only one of width and height; export it again");
    result.set_size(mark.photo, width, height);
    std::size_t i = 0;
    for (const pugi::xml_node& shape : image.children()) {
        if (shape.type() != pugi::node_element)
            continue;
        const std::string_view kind = shape.name();
        mark.item = "shape " + std::to_string(++i) + " of '" + printable(photo) + "'";
        if (kind == "polyline") {
            if (!shape.attribute("label") || !shape.attribute("points"))
                refuse(place_of(result, mark), "has no label or no points; export it again");
            mark.label = shape.attribute("label").value();
            result.add_polyline(
                mark, read_points(shape.attribute("points").value(), place_of(result, mark)), kind);
        } else if (kind != "tag") { // a tag is a word about the whole photo
            result.leave_out(kind);
        }
    }
}

} // namespace

Annotations read_cvat(std::string_view text, const std::string& name) {
    if (text.size() > kMostBytes)
        refuse(name, std::to_string(text.size()) + " bytes of XML, at most " +
                         std::to_string(kMostBytes) + " are read; split it");
    if (!is_utf8(text))
        refuse(name, "is not UTF-8 text; save it as UTF-8");
    pugi::xml_document document;
    const pugi::xml_parse_result parsed =
        document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!parsed) {
        const auto at = static_cast<std::size_t>(std::max<std::ptrdiff_t>(parsed.offset, 0));
        const std::string_view before = text.substr(0, std::min(at, text.size()));
        refuse(name + ":" + std::to_string(1 + std::count(before.begin(), before.end(), '\n')),
               "not XML: " + std::string(parsed.description()) + "; correct the file");
    }
    const pugi::xml_node root = document.child("annotations");
    if (!root)
        refuse(name, "is XML of another kind, root '" +
                         printable(document.document_element().name()) +
                         "'; export as CVAT for images 1.1");
    Annotations result;
    result.file = name;
    std::size_t i = 0;
    for (const pugi::xml_node& child : root.children()) {
        const std::string_view kind = child.name();
        if (kind == "image")
            read_image(child, name + ": image " + std::to_string(++i), result);
        else if (kind == "track")
            result.leave_out("track of a video");
    }
    return result;
}

} // namespace taihu
