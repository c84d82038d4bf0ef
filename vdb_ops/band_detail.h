#pragma once
#include <vector>

#include <openvdb/openvdb.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/progress.h"
#include "stats/core/vec3.h"

namespace taihu {

// Operations on level sets voxel by voxel: on a band as wide as the surface moves, with distances
// made true again afterwards. The same bits on any number of threads.

/// A level set on a band of `reach_m` and two voxels more, and at least its own.
/// \throws Error as redistance(); bad_argument: more than 1000 voxels, named after `who`.
openvdb::FloatGrid::Ptr wide_band(const openvdb::FloatGrid& solid, double reach_m, const char* who,
                                  Progress* progress);

/// Of values that moved, a level set on a band of this half width; `moved` is used up.
openvdb::FloatGrid::Ptr settled(const openvdb::FloatGrid::Ptr& moved, float half_width_vox,
                                Progress* progress);

/// Reads a level set for one thread.
class BandReader {
public:
    explicit BandReader(openvdb::FloatGrid::ConstPtr grid);

    Vec3 place(const openvdb::Coord& c) const {
        return origin_ + Vec3{1. * c.x(), 1. * c.y(), 1. * c.z()} * voxel_m_;
    }
    double value(const openvdb::Coord& c) const {
        return static_cast<double>(accessor_.getValue(c));
    }
    /// Of length 1, or 0 where there is none.
    Vec3 normal(const openvdb::Coord& c) const;
    /// Anywhere, linear along each axis of a cell.
    double at(const Vec3& p) const;
    Vec3 normal_at(const Vec3& p) const;

private:
    openvdb::FloatGrid::ConstPtr grid_;
    openvdb::FloatGrid::ConstAccessor accessor_;
    double voxel_m_;
    Vec3 origin_;
};

/// The value of every voxel of the leaves of `grid` becomes fn(voxel, value), with a function that
/// make() returns for a few leaves on one thread. It must not turn the side of voxels at the edge
/// of the band.
template <class Make>
void set_values(openvdb::FloatGrid& grid, const Progress* progress, Make&& make) {
    std::vector<openvdb::FloatTree::LeafNodeType*> leaves;
    grid.tree().getNodes(leaves);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 8), [&](const auto& range) {
        check_cancelled(progress);
        const auto fn = make();
        for (std::size_t l = range.begin(); l < range.end(); ++l)
            for (openvdb::Index i = 0; i < 512; ++i) {
                const openvdb::Coord c = leaves[l]->offsetToGlobalCoord(i);
                const auto value = static_cast<double>(leaves[l]->getValue(i));
                leaves[l]->setValueOnly(i, static_cast<float>(fn(c, value)));
            }
    });
}

/// A Gaussian blur of the values by `sigma_m`, within leaves: by the heat equation, so half a voxel
/// is as good as ten. Time O(leaves * (sigma / voxel)^2).
openvdb::FloatGrid::Ptr blurred(const openvdb::FloatGrid& grid, double sigma_m,
                                const Progress* progress);

} // namespace taihu
