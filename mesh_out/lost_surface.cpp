#include "mesh_out/lost_surface_detail.h"

#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

#include "mesh_out/face_error_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;
constexpr int kDim = Leaf::DIM;
constexpr float kNear = 0.8660254f;   ///< voxels: half the diagonal of one
constexpr float kTowards = 0.5f;      ///< cosine of what still is towards the surface
constexpr float kNoSlope = 0.3f;      ///< of a voxel a voxel: both sides are equally near
constexpr double kFarthest_vox = 1.5; ///< that a point may be from where it was looked for

/// The values of a leaf and one voxel around it [voxels].
class Halo {
public:
    Halo(const openvdb::FloatGrid& solid, const Coord& origin, float per_m) {
        const openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> in(solid.tree());
        std::size_t i = 0;
        for (int x = -1; x <= kDim; ++x)
            for (int y = -1; y <= kDim; ++y)
                for (int z = -1; z <= kDim; ++z)
                    all_[i++] = in.getValue(origin.offsetBy(x, y, z)) * per_m;
    }

    /// Whether there is a surface near a voxel that no neighbour shows.
    bool hides_surface(int x, int y, int z) const {
        const float own = at(x, y, z);
        if (!(std::fabs(own) <= kNear))
            return false;
        const std::array<float, 3> slope = {(at(x + 1, y, z) - at(x - 1, y, z)) / 2,
                                            (at(x, y + 1, z) - at(x, y - 1, z)) / 2,
                                            (at(x, y, z + 1) - at(x, y, z - 1)) / 2};
        const float steep =
            std::sqrt(slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2]);
        const float towards = own < 0 ? 1.f : -1.f; // up the slope from inside
        for (int i = -1; i <= 1; ++i)
            for (int j = -1; j <= 1; ++j)
                for (int k = -1; k <= 1; ++k) {
                    if ((at(x + i, y + j, z + k) < 0) == (own < 0))
                        continue;
                    const float along =
                        towards * (slope[0] * float(i) + slope[1] * float(j) + slope[2] * float(k));
                    const float far = std::sqrt(float(i * i + j * j + k * k));
                    if (steep < kNoSlope || along >= kTowards * far * steep)
                        return false;
                }
        return true;
    }

private:
    static constexpr int kSide = kDim + 2;
    float at(int x, int y, int z) const {
        return all_[static_cast<std::size_t>(((x + 1) * kSide + y + 1) * kSide + z + 1)];
    }
    std::array<float, kSide * kSide * kSide> all_{};
};

} // namespace

std::vector<Vec3> lost_surface(const openvdb::FloatGrid& solid, const FieldProbe& field,
                               Progress* progress) {
    const Lattice lattice = lattice_of(solid);
    std::vector<const Leaf*> leaves;
    solid.tree().getNodes(leaves);
    std::vector<std::vector<Vec3>> found(leaves.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
        check_cancelled(progress);
        const Coord origin = leaves[n]->origin();
        const Halo halo(solid, origin, static_cast<float>(1 / lattice.voxel_m));
        for (int x = 0; x < kDim; ++x)
            for (int y = 0; y < kDim; ++y)
                for (int z = 0; z < kDim; ++z) {
                    if (!halo.hides_surface(x, y, z))
                        continue;
                    const Vec3 at =
                        lattice.origin + Vec3{double(origin.x() + x), double(origin.y() + y),
                                              double(origin.z() + z)} *
                                             lattice.voxel_m;
                    const double farthest_m = kFarthest_vox * lattice.voxel_m;
                    if (const auto p = surface_point_near(field, at, farthest_m);
                        p && length(*p - at) <= farthest_m)
                        found[n].push_back(*p);
                }
    });
    std::vector<Vec3> all;
    for (const auto& part : found)
        all.insert(all.end(), part.begin(), part.end());
    return all;
}

} // namespace taihu
