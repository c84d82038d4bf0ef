#include "stats/io/holes_file.h"

#include <array>
#include <cmath>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/io/table_detail.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr std::array<const char*, 3> kPlaces = {"x_m", "y_m", "z_m"};

/// The first coordinate that is too far off; 3: none is.
int far_axis(const Vec3& p) {
    int axis = 0;
    while (axis < 3 && std::abs(p[axis]) <= kMostHole_m)
        ++axis;
    return axis;
}

} // namespace

std::vector<Sphere> read_holes(const std::filesystem::path& path) {
    static constexpr std::array<std::string_view, 5> kKnown = {"x_m", "y_m", "z_m", "radius_m",
                                                               "diameter_m"};
    const std::string text = read_file(path, std::size_t{1} << 30);
    const Table table(text, base_name(path));
    table.check_header(kKnown);
    const auto x = table.column("x_m"), y = table.column("y_m"), z = table.column("z_m");
    const auto diameter = table.find("diameter_m");
    if (diameter && table.find("radius_m"))
        table.refuse_line(0, "has radius_m and diameter_m; keep one of them");
    const std::size_t size = diameter ? *diameter : table.column("radius_m");

    std::vector<Sphere> holes;
    holes.reserve(table.n_rows());
    for (std::size_t row = 0; row < table.n_rows(); ++row) {
        const double radius = table.number(row, size) * (diameter ? 0.5 : 1);
        if (!(radius > 0))
            table.refuse(row, size, "must be > 0, drop the row or fix the number");
        if (!(radius <= kMostHole_m))
            table.refuse(row, size, "must be at most 1e9 m, drop the row or check the unit");
        const Vec3 center{table.number(row, x), table.number(row, y), table.number(row, z)};
        if (const int axis = far_axis(center); axis < 3)
            table.refuse(row, table.column(kPlaces[static_cast<std::size_t>(axis)]),
                         "must be within 1e9 m, drop the row or check the unit");
        holes.push_back({center, radius});
    }
    return holes;
}

std::string format_holes(std::span<const Sphere> holes, std::span<const std::string> comments) {
    std::string text;
    for (const std::string& comment : comments) {
        text += "# ";
        for (const char c : comment) {
            text += c == '\r' ? ' ' : c;
            if (c == '\n')
                text += "# ";
        }
        text += '\n';
    }
    text += "x_m,y_m,z_m,radius_m\n";
    for (std::size_t i = 0; i < holes.size(); ++i) {
        const Sphere& hole = holes[i];
        const auto refuse = [&](const char* what, double value, const char* must) {
            throw Error(Fault::bad_argument, "holes[" + std::to_string(i) + "]: " + what + " is " +
                                                 shortest(value) + ", must be " + must +
                                                 " m; use another scale, or check the unit");
        };
        if (!(hole.radius_m > 0 && hole.radius_m <= kMostHole_m))
            refuse("radius_m", hole.radius_m, "> 0 and at most 1e9");
        if (const int axis = far_axis(hole.center); axis < 3)
            refuse(kPlaces[static_cast<std::size_t>(axis)], hole.center[axis], "within 1e9");
        for (const double value : {hole.center.x, hole.center.y, hole.center.z})
            text += shortest(value) + ',';
        text += shortest(hole.radius_m) + '\n';
    }
    return text;
}

} // namespace taihu
