#include "mesh_out/covering_balls_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace taihu {

std::vector<Sphere> balls_over_cubes(std::span<const Vec3> points, double radius_m) {
    std::vector<std::array<std::int64_t, 3>> cubes;
    cubes.reserve(points.size());
    for (const Vec3& p : points) {
        const Vec3 at = p / radius_m;
        cubes.push_back({std::llround(at.x), std::llround(at.y), std::llround(at.z)});
    }
    std::sort(cubes.begin(), cubes.end());
    cubes.erase(std::unique(cubes.begin(), cubes.end()), cubes.end());
    std::vector<Sphere> balls;
    for (const auto& [x, y, z] : cubes)
        balls.push_back({Vec3{double(x), double(y), double(z)} * radius_m, radius_m});
    return balls;
}

std::vector<Sphere> balls_apart(std::span<const Vec3> points, double radius_m) {
    std::vector<Sphere> balls;
    for (const Vec3& p : points)
        if (std::none_of(balls.begin(), balls.end(),
                         [&](const Sphere& s) { return length(p - s.center) <= s.radius_m; }))
            balls.push_back({p, radius_m});
    return balls;
}

} // namespace taihu
