#include "vdb_ops/relief_around.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLeastPixel = 1e-12;   ///< between points / size of the object: they are counted
constexpr double kNearestToAxis = 1e-3; ///< of the radius: nearer than this, longitudes are held

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "relief around: " + what);
}

/// Into 0..n - 1; a line of points that is mirrored at both ends has a period of 2 (n - 1).
long wrapped(long i, long n, bool tileable) {
    const long period = tileable ? n : 2 * (n - 1);
    i = ((i % period) + period) % period;
    return tileable || i < n ? i : period - i;
}

/// The axis along which a vector is longest.
int main_axis(const Vec3& v) {
    const double x = std::abs(v.x), y = std::abs(v.y), z = std::abs(v.z);
    return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

/// Seen from outside along an axis, +Y up; on top and bottom v runs away from the one who looks
/// along -Z.
ReliefAround::Place along_axis(const Vec3& p, int axis, bool positive, double weight) {
    const double side = positive ? 1 : -1;
    Vec3 u, v{0, 1, 0};
    if (axis == 0)
        u = {0, 0, -side};
    else if (axis == 1)
        u = {1, 0, 0}, v = {0, 0, -side};
    else
        u = {side, 0, 0};
    return {dot(p, u), dot(p, v), u, v, weight};
}

/// Of the faces round each vertex, by area.
std::vector<Vec3> mean_normals(const TriMesh& mesh) {
    std::vector<Vec3> normals(mesh.positions.size());
    for (const Triangle& t : mesh.triangles) {
        const Vec3& a = mesh.positions[t[0]];
        const Vec3 n = cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
        for (const std::uint32_t v : t)
            normals[v] += n;
    }
    for (Vec3& n : normals)
        n = length(n) > 0 ? normalized(n) : Vec3{0, 1, 0};
    return normals;
}

} // namespace

ReliefAround::ReliefAround(Image heights, double pixel_m, bool tileable, ReliefMap map,
                           const Box& frame, double sharpness)
    : heights_(std::move(heights)), pixel_m_(pixel_m), tileable_(tileable), map_(map),
      middle_(frame.lo * 0.5 + frame.hi * 0.5), stretch_u_(1), stretch_v_(1),
      sharpness_(sharpness) {
    if (heights_.channels != 1 || heights_.width < 2 || heights_.height < 2)
        refuse("a tile of " + std::to_string(heights_.width) + " x " +
               std::to_string(heights_.height) + " points and " +
               std::to_string(heights_.channels) + " channels; must be 2 x 2 or more, of 1");
    if (!(pixel_m > 0) || !std::isfinite(pixel_m))
        refuse("points every " + std::to_string(pixel_m) + " m; must be finite and > 0");
    if (!std::all_of(heights_.pixels.begin(), heights_.pixels.end(),
                     [](float h) { return std::isfinite(h); }))
        refuse("a height that is not finite; make the tile again");
    if (pixel_m < kLeastPixel * frame.longest())
        refuse("points every " + shortest(pixel_m) + " m are too many for an object of " +
               shortest(frame.longest()) + " m; give the tile's side");
    if (!(sharpness >= 1 && sharpness <= 64))
        refuse("sharpness is " + std::to_string(sharpness) + ", must be 1..64");
    const Vec3 size = frame.size();
    if (!(frame.longest() > 0) || !is_finite(size))
        refuse("the object has no extent; give one that has");
    radius_m_ = map == ReliefMap::cylinder ? (size.x + size.z) / 4 : (size.x + size.y + size.z) / 6;
    if (map == ReliefMap::sphere || map == ReliefMap::cylinder) {
        // Mirrored tiles go round in pairs.
        const auto fit = [&](double round_m, int n_points, int multiple) {
            const double tile_m = (n_points - !tileable) * pixel_m * multiple;
            return std::max(1.0, std::round(round_m / tile_m)) * tile_m / round_m;
        };
        stretch_u_ = fit(2 * kPi * radius_m_, heights_.width, tileable ? 1 : 2);
        if (map == ReliefMap::sphere)
            stretch_v_ = fit(kPi * radius_m_, heights_.height, 1);
    }
}

std::vector<ReliefAround::Place> ReliefAround::places(const Vec3& p, const Vec3& normal) const {
    const Vec3 d = p - middle_;
    if (map_ == ReliefMap::planar)
        return {along_axis(d, 2, true, 1)};
    if (map_ == ReliefMap::cube) {
        const int axis = main_axis(normal);
        return {along_axis(d, axis, normal[axis] > 0, 1)};
    }
    if (map_ == ReliefMap::triplanar) {
        std::vector<Place> places;
        std::array<double, 3> weight{};
        double sum = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            weight[axis] = std::pow(std::fabs(normal[static_cast<int>(axis)]), sharpness_);
            sum += weight[axis];
        }
        for (int axis = 0; axis < 3; ++axis)
            if (const double w = weight[static_cast<std::size_t>(axis)] / sum; w > 0)
                places.push_back(along_axis(d, axis, normal[axis] > 0, w));
        return places;
    }
    const double rho = std::max(std::hypot(d.x, d.z), kNearestToAxis * radius_m_);
    const double longitude = std::atan2(d.x, d.z);
    const Vec3 east{d.z / rho, 0, -d.x / rho};
    Place place{
        longitude * radius_m_ * stretch_u_, d.y, east * (radius_m_ * stretch_u_ / rho), {0, 1, 0}};
    if (map_ == ReliefMap::sphere) {
        const double r = std::max(length(d), kNearestToAxis * radius_m_);
        const Vec3 up{-d.x * d.y / (rho * r), rho / r, -d.z * d.y / (rho * r)};
        place.v_m = std::atan2(d.y, rho) * radius_m_ * stretch_v_;
        place.along_v = up * (radius_m_ * stretch_v_ / r);
    }
    return {place};
}

double ReliefAround::at(long column, long row) const {
    const auto x = static_cast<int>(wrapped(column, heights_.width, tileable_)),
               y = static_cast<int>(wrapped(row, heights_.height, tileable_));
    return static_cast<double>(*heights_.at(x, y));
}

ReliefAround::Sample ReliefAround::sample(const Place& place) const {
    // The tile's first row is its top; its middle lies at u = v = 0, mirrors far from there.
    const double x = (heights_.width - 1) / 2. + place.u_m / pixel_m_,
                 y = (heights_.height - 1) / 2. - place.v_m / pixel_m_;
    const double x0 = std::floor(x), y0 = std::floor(y), a = x - x0, b = y - y0;
    const auto i = static_cast<long>(x0), j = static_cast<long>(y0);
    const auto bilinear = [&](auto&& value) {
        return (value(i, j) * (1 - a) + value(i + 1, j) * a) * (1 - b) +
               (value(i, j + 1) * (1 - a) + value(i + 1, j + 1) * a) * b;
    };
    const double twice = 2 * pixel_m_;
    return {bilinear([&](long c, long r) { return at(c, r); }),
            bilinear([&](long c, long r) { return (at(c + 1, r) - at(c - 1, r)) / twice; }),
            bilinear([&](long c, long r) { return (at(c, r - 1) - at(c, r + 1)) / twice; })};
}

double ReliefAround::height_m(const Vec3& p, const Vec3& normal) const {
    double height = 0;
    for (const Place& place : places(p, normal))
        height += place.weight * sample(place).height_m;
    return height;
}

Vec3 ReliefAround::gradient(const Vec3& p, const Vec3& normal) const {
    Vec3 sum;
    for (const Place& place : places(p, normal)) {
        const Sample s = sample(place);
        sum += (place.along_u * s.slope_u + place.along_v * s.slope_v) * place.weight;
    }
    return sum;
}

Vec3 ReliefAround::bumped(const Vec3& p, const Vec3& normal) const {
    const Vec3 g = gradient(p, normal);
    return normalized(normal - (g - normal * dot(g, normal)));
}

TriMesh ReliefAround::displaced(const TriMesh& mesh) const {
    TriMesh out = mesh;
    if (mesh.normals.empty())
        out.normals = mean_normals(mesh);
    tbb::parallel_for(std::size_t{0}, mesh.positions.size(), [&](std::size_t v) {
        const Vec3 &p = mesh.positions[v], n = out.normals[v];
        out.positions[v] = p + n * height_m(p, n);
        out.normals[v] = bumped(p, n);
    });
    return out;
}

Image without_short_waves(const Image& heights, double pixel_m, bool tileable, double least_m) {
    Image out = heights;
    const long width = heights.width, height = heights.height;
    const auto smoothed = [&](long reach, bool along_rows) {
        const Image before = out;
        tbb::parallel_for(0L, height, [&](long y) {
            for (long x = 0; x < width; ++x) {
                const auto at = [&](long by) {
                    const long column = along_rows ? wrapped(x + by, width, tileable) : x,
                               row = along_rows ? y : wrapped(y + by, height, tileable);
                    return *before.at(static_cast<int>(column), static_cast<int>(row));
                };
                *out.at(static_cast<int>(x), static_cast<int>(y)) =
                    0.5f * at(0) + 0.25f * (at(-reach) + at(reach));
            }
        });
    };
    for (long reach = 1; 4 * pixel_m * double(reach) <= least_m && reach < width; reach *= 2) {
        smoothed(reach, true);
        smoothed(reach, false);
    }
    return out;
}

} // namespace taihu
