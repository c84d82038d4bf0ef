#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "vdb_ops/plane_image_detail.h"

namespace taihu {

Box solid_box(const openvdb::FloatGrid& grid, const std::string& where) {
    const Lattice lattice = lattice_of(grid);
    openvdb::CoordBBox voxels;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto v = leaf->cbeginValueOn(); v; ++v)
            if (*v < 0)
                voxels.expand(v.getCoord());
    if (voxels.empty())
        throw Error(Fault::bad_argument,
                    where + ": grid '" + grid.getName() + "' is empty; give a solid that is not");
    Box box;
    for (const openvdb::Coord& c : {voxels.min(), voxels.max()})
        box.include(lattice.origin +
                    Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice.voxel_m);
    return box.dilated(lattice.voxel_m);
}

double support(const Box& box, const Vec3& n) {
    const Vec3 half = box.size() * 0.5;
    return half.x * std::abs(n.x) + half.y * std::abs(n.y) + half.z * std::abs(n.z);
}

Circle circle_of(const Sphere& ball, const SectionPlane& plane) {
    const Vec3 c = ball.center - plane.origin;
    const double height = dot(c, plane.normal), r = ball.radius_m;
    if (!(std::abs(height) < r))
        return {};
    return {dot(c, plane.u), dot(c, plane.v), std::sqrt((r - height) * (r + height))};
}

void PlaneImage::sample(const SectionPlane& plane, const openvdb::FloatGrid& rock,
                        const openvdb::FloatGrid* base, const Progress* progress) {
    kind.resize(static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv));
    tbb::parallel_for(tbb::blocked_range<int>(0, nv, 64), [&](const auto& rows) {
        const SolidSampler here(rock), whole(base ? *base : rock);
        for (int j = rows.begin(); j < rows.end(); ++j) {
            check_cancelled(progress);
            for (int i = 0; i < nu; ++i) {
                const Vec3 p = point(plane, i, j);
                const bool inside = !base || whole.solid(p);
                kind[at(i, j)] = !inside ? air : here.solid(p) ? solid : hole;
            }
        }
    });
    if (!base)
        take_region(0, air);
}

std::vector<std::size_t> PlaneImage::take_region(std::size_t first, std::uint8_t to) {
    const std::uint8_t from = kind[first];
    std::vector<std::size_t> region = {first};
    kind[first] = to;
    const auto width = static_cast<std::size_t>(nu);
    const auto visit = [&](std::size_t p) {
        if (kind[p] == from) {
            kind[p] = to;
            region.push_back(p);
        }
    };
    for (std::size_t k = 0; k < region.size(); ++k) {
        const std::size_t p = region[k];
        if (p % width > 0)
            visit(p - 1);
        if (p % width + 1 < width)
            visit(p + 1);
        if (p >= width)
            visit(p - width);
        if (p + width < kind.size())
            visit(p + width);
    }
    return region;
}

RegionEllipse ellipse_of(const PlaneImage& image, std::span<const std::size_t> region) {
    const auto n = static_cast<double>(region.size());
    const auto width = static_cast<std::size_t>(image.nu);
    RegionEllipse e;
    double xx = 0, xy = 0, yy = 0;
    for (const std::size_t p : region) {
        e.x += static_cast<double>(p % width) / n;
        e.y += static_cast<double>(p / width) / n;
    }
    for (const std::size_t p : region) {
        const double dx = static_cast<double>(p % width) - e.x;
        const double dy = static_cast<double>(p / width) - e.y;
        xx += dx * dx / n;
        xy += dx * dy / n;
        yy += dy * dy / n;
    }
    // A quarter of the squared semi-axis; the spread of a pixel itself, 1/12, belongs to it.
    const double mean = 0.5 * (xx + yy), spread = std::hypot(0.5 * (xx - yy), xy);
    e.major = 4 * std::sqrt(mean + spread + 1.0 / 12);
    e.minor = 4 * std::sqrt(std::max(0.0, mean - spread) + 1.0 / 12);
    // Of the two ways to write the eigenvector, the one that does not cancel.
    const double ax = xx >= yy ? 0.5 * (xx - yy) + spread : xy;
    const double ay = xx >= yy ? xy : 0.5 * (yy - xx) + spread;
    if (const double l = std::hypot(ax, ay); l > 0)
        e.dx = ax / l, e.dy = ay / l;
    return e;
}

} // namespace taihu
