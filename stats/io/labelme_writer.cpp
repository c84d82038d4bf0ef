#include "stats/io/labelme_writer.h"

#include <cmath>

#include "stats/core/error.h"
#include "stats/io/json_detail.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "labelme: " + what);
}

std::string shape_of(const Segment& s) {
    const auto point = [](double x, double y) {
        return '[' + shortest(x) + ", " + shortest(y) + ']';
    };
    return "    {\"label\": " + json_quoted(s.label) + ", \"points\": [" + point(s.x1, s.y1) +
           ", " + point(s.x2, s.y2) +
           "], \"group_id\": null, \"description\": \"\", \"shape_type\": \"line\", "
           "\"flags\": {}}";
}

} // namespace

std::string format_labelme(const std::string& image, int width_px, int height_px,
                           std::span<const Segment> segments) {
    if (image.empty() || image.find_first_of("/\\") != std::string::npos)
        refuse("the photo's name is " + json_quoted(image) +
               "; give the name of a file beside this one");
    for (const int side : {width_px, height_px})
        if (side < 1 || side > 1'000'000)
            refuse("a side of the photo is " + std::to_string(side) + " px; must be in 1..1000000");
    std::string shapes;
    for (std::size_t i = 0; i < segments.size(); ++i) {
        const Segment& s = segments[i];
        const double length = std::hypot(s.x2 - s.x1, s.y2 - s.y1);
        if (!s.has_ends || !(length > 0 && std::isfinite(length)))
            refuse("segments[" + std::to_string(i) + "] has " +
                   (s.has_ends ? "length " + shortest(length) : std::string("no ends")) +
                   "; a line has two that differ");
        shapes += (i > 0 ? ",\n" : "\n") + shape_of(s);
    }
    return "{\n  \"version\": \"5.4.1\",\n  \"flags\": {},\n  \"shapes\": [" + shapes +
           (shapes.empty() ? "" : "\n  ") + "],\n  \"imagePath\": " + json_quoted(image) +
           ",\n  \"imageData\": null,\n  \"imageHeight\": " + std::to_string(height_px) +
           ",\n  \"imageWidth\": " + std::to_string(width_px) + "\n}\n";
}

} // namespace taihu
