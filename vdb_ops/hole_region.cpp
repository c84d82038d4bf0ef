#include <algorithm>
#include <cmath>

#include <openvdb/tools/Interpolation.h>

#include "stats/core/error.h"
#include "vdb_ops/analytic_field.h"
#include "vdb_ops/hole_region_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

class BoxRegion final : public HoleRegion {
public:
    explicit BoxRegion(const Box& box) : box_(box) {}
    Box box() const override { return box_; }
    Box tight() const override { return box_; }
    double volume_m3() const override { return box_.volume(); }
    bool inside(const Vec3& p) const override { return box_.contains(p); }
    bool meets(const Sphere& ball) const override {
        return box_distance(ball.center - box_.center(), box_.size() * 0.5) < ball.radius_m;
    }

private:
    Box box_;
};

class SolidRegion final : public HoleRegion {
public:
    explicit SolidRegion(const openvdb::FloatGrid& grid)
        : grid_(grid), lattice_(lattice_of(grid)), accessor_(grid.getConstAccessor()) {
        openvdb::CoordBBox box;
        if (!grid.tree().evalLeafBoundingBox(box))
            throw Error(Fault::bad_argument, "holes: the solid is empty; give one that is not");
        box_.include(world(box.min()));
        box_.include(world(box.max()));
    }
    Box box() const override { return box_; }
    Box tight() const override {
        Box box;
        for (auto leaf = accessor_.tree().cbeginLeaf(); leaf; ++leaf)
            for (auto v = leaf->cbeginValueOn(); v; ++v)
                if (*v < 0) {
                    // An inside voxel's own distance leads on to the surface.
                    const Vec3 p = world(v.getCoord());
                    const Vec3 d = Vec3{1, 1, 1} * static_cast<double>(*v);
                    box.include(p + d);
                    box.include(p - d);
                }
        if (box.empty())
            throw Error(Fault::bad_argument,
                        "holes: the solid is thinner than its voxel; use a smaller voxel");
        return box;
    }
    double volume_m3() const override { return taihu::volume_m3(grid_); }
    bool inside(const Vec3& p) const override {
        const Vec3 i = (p - lattice_.origin) / lattice_.voxel_m;
        return openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(i.x, i.y, i.z)) < 0;
    }
    bool meets(const Sphere& ball) const override {
        const Vec3 c = (ball.center - lattice_.origin) / lattice_.voxel_m;
        const double r = ball.radius_m / lattice_.voxel_m;
        if (!box_.contains(ball.center)) // nor is a place far off one that the grid can be asked at
            return any_solid_leaf(c, r);
        const float d =
            openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(c.x, c.y, c.z));
        if (d < 0.999f * lattice_.half_width_vox * static_cast<float>(lattice_.voxel_m))
            return d < ball.radius_m; // in the band, or inside
        return any_solid_leaf(c, r);
    }

private:
    Vec3 world(const openvdb::Coord& c) const {
        return lattice_.origin +
               Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice_.voxel_m;
    }

    /// Beyond the band: look for solid voxels in the leaves that the ball meets.
    bool any_solid_leaf(const Vec3& c, double r) const {
        openvdb::Coord lo, hi;
        for (int axis = 0; axis < 3; ++axis) {
            const double first = (box_.lo[axis] - lattice_.origin[axis]) / lattice_.voxel_m;
            const double last = (box_.hi[axis] - lattice_.origin[axis]) / lattice_.voxel_m;
            if (!(c[axis] + r >= first && c[axis] - r <= last)) // not a number: not near
                return false;
            lo[axis] = static_cast<int>(std::floor(std::max(c[axis] - r, first))) & ~7;
            hi[axis] = static_cast<int>(std::ceil(std::min(c[axis] + r, last)));
        }
        for (int x = lo.x(); x <= hi.x(); x += 8)
            for (int y = lo.y(); y <= hi.y(); y += 8)
                for (int z = lo.z(); z <= hi.z(); z += 8)
                    if (leaf_meets(openvdb::Coord(x, y, z), c, r))
                        return true;
        return false;
    }

    bool leaf_meets(const openvdb::Coord& origin, const Vec3& c, double r) const {
        const Vec3 middle{origin.x() + 3.5, origin.y() + 3.5, origin.z() + 3.5};
        if (box_distance(c - middle, {3.5, 3.5, 3.5}) >= r)
            return false;
        const auto* leaf = accessor_.probeConstLeaf(origin);
        if (!leaf)
            return accessor_.getValue(origin) < 0;
        for (openvdb::Index v = 0; v < 512; ++v) {
            const openvdb::Coord p = leaf->offsetToGlobalCoord(v);
            // The surface lies a part of a voxel beyond a solid voxel: its own distance.
            if (const float d = leaf->getValue(v);
                d < 0 && length(Vec3{double(p.x()), double(p.y()), double(p.z())} - c) +
                                 d / lattice_.voxel_m <
                             r)
                return true;
        }
        return false;
    }

    const openvdb::FloatGrid& grid_;
    Lattice lattice_;
    mutable openvdb::FloatGrid::ConstAccessor accessor_; // a cache: one thread
    Box box_;
};

} // namespace

std::unique_ptr<HoleRegion> hole_region(const Box& box) {
    if (box.empty() || !(box.volume() > 0) || !is_finite(box.lo) || !is_finite(box.hi))
        throw Error(Fault::bad_argument, "holes: the box has no volume; give three lengths > 0");
    return std::make_unique<BoxRegion>(box);
}

std::unique_ptr<HoleRegion> hole_region(const openvdb::FloatGrid& solid) {
    return std::make_unique<SolidRegion>(solid);
}

} // namespace taihu
