#include "mesh_out/lost_surface_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <tbb/parallel_for.h>

#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;
constexpr int kDim = Leaf::DIM;
constexpr float kNear = 0.8660254f;   ///< voxels: half the diagonal of one
constexpr float kBent = 0.35f;        ///< voxels, from a straight line through three values
constexpr float kOffSlope = 0.06f;    ///< of differences, from 1
constexpr double kNearPart_vox = 0.5; ///< the same of an eighth of a voxel, and some more
constexpr double kFarthest_vox = 1;   ///< that a point may be from where it was looked for
constexpr double kOn_vox = 1e-4;      ///< on the surface

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

    /// Whether the surface comes near a voxel, and there seems to be more than one smooth sheet of
    /// it: of one, differences have the length 1 but for the square of its curvature.
    bool bends(int x, int y, int z) const {
        const float own = at(x, y, z);
        if (!(std::fabs(own) <= kNear))
            return false;
        float slope2 = 0, bent = 0;
        for (const auto& [i, j, k] : {std::array{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
            const float more = at(x + i, y + j, z + k), less = at(x - i, y - j, z - k);
            slope2 += (more - less) * (more - less) / 4;
            bent = std::max(bent, std::fabs(more + less - 2 * own));
        }
        return bent > kBent || std::fabs(slope2 - 1) > 2 * kOffSlope;
    }

private:
    static constexpr int kSide = kDim + 2;
    float at(int x, int y, int z) const {
        return all_[static_cast<std::size_t>(((x + 1) * kSide + y + 1) * kSide + z + 1)];
    }
    std::array<float, kSide * kSide * kSide> all_{};
};

/// Looks for the field's surface near points, and keeps what was not extracted.
class Seeker {
public:
    Seeker(const openvdb::FloatGrid& solid, const FieldProbe& field,
           const SurfaceDistance& extracted, double least_m)
        : solid_(solid.tree()), lattice_(lattice_of(solid)), field_(field), extracted_(extracted),
          voxel_m_(lattice_.voxel_m), least_m_(least_m) {}

    /// On every primitive near `p`, or where those meet that cut off its nearest point.
    void seek(const Vec3& p) {
        if (std::fabs(field_.at(p).value_m) > kNearPart_vox * voxel_m_)
            return;
        near_.clear();
        field_.near(p, kFarthest_vox * voxel_m_, near_);
        for (const Primitive one : near_)
            if (const auto y = surface_point(one, p);
                y && extracted_(*y) > least_m_ && !was_cleaned(*y))
                found.push_back(*y);
    }
    std::vector<Vec3> found;

private:
    /// Whether voxels near `p` have another sign than the field: bubbles that were filled, pieces
    /// that were removed.
    bool was_cleaned(const Vec3& p) const {
        const Vec3 at = (p - lattice_.origin) / voxel_m_;
        const Coord first(static_cast<int>(std::floor(at.x)), static_cast<int>(std::floor(at.y)),
                          static_cast<int>(std::floor(at.z)));
        for (int k = 0; k < 64; ++k) {
            const Coord c = first.offsetBy(k / 16 - 1, k / 4 % 4 - 1, k % 4 - 1);
            const Vec3 corner =
                lattice_.origin + Vec3{double(c.x()), double(c.y()), double(c.z())} * voxel_m_;
            if ((solid_.getValue(c) < 0) != (field_.at(corner).value_m < 0))
                return true;
        }
        return false;
    }
    std::optional<Vec3> surface_point(Primitive one, const Vec3& p) const {
        PrimitiveSet set(one);
        for (std::size_t i = 0; i < PrimitiveSet::kMost; ++i) {
            const auto y = onto(field_, set, p, kFarthest_vox * voxel_m_);
            if (!y)
                return std::nullopt;
            const FieldProbe::Nearest there = field_.at(*y);
            if (std::fabs(there.value_m) <= kOn_vox * voxel_m_)
                return y;
            if (!set.add(there.primitive))
                return std::nullopt;
        }
        return std::nullopt;
    }

    openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> solid_;
    Lattice lattice_;
    const FieldProbe& field_;
    const SurfaceDistance& extracted_;
    double voxel_m_, least_m_;
    std::vector<Primitive> near_;
};

} // namespace

std::vector<Vec3> lost_surface(const openvdb::FloatGrid& solid, const FieldProbe& field,
                               const SurfaceDistance& extracted, double least_m,
                               Progress* progress) {
    const Lattice lattice = lattice_of(solid);
    std::vector<const Leaf*> leaves;
    solid.tree().getNodes(leaves);
    std::vector<std::vector<Vec3>> found(leaves.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
        check_cancelled(progress);
        const Coord origin = leaves[n]->origin();
        const Halo halo(solid, origin, static_cast<float>(1 / lattice.voxel_m));
        Seeker seeker(solid, field, extracted, least_m);
        for (int x = 0; x < kDim; ++x)
            for (int y = 0; y < kDim; ++y)
                for (int z = 0; z < kDim; ++z) {
                    if (!halo.bends(x, y, z))
                        continue;
                    const Vec3 at{double(origin.x() + x), double(origin.y() + y),
                                  double(origin.z() + z)};
                    seeker.seek(lattice.origin + at * lattice.voxel_m);
                    for (int part = 0; part < 8; ++part)
                        seeker.seek(lattice.origin +
                                    (at + Vec3{part & 1 ? .25 : -.25, part & 2 ? .25 : -.25,
                                               part & 4 ? .25 : -.25}) *
                                        lattice.voxel_m);
                }
        found[n] = std::move(seeker.found);
    });
    std::vector<Vec3> all;
    for (const auto& part : found)
        all.insert(all.end(), part.begin(), part.end());
    return all;
}

} // namespace taihu
