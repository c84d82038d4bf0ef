#include "vdb_ops/coarser_solid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/components_detail.h"
#include "vdb_ops/dense_detail.h"
#include "vdb_ops/distance_map_detail.h"
#include "vdb_ops/flips_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
constexpr const char* kWho = "coarser solid";
constexpr int kBand = 3;     ///< voxels of the result on either side of its surface
constexpr int kCoarsest = 8; ///< so that a part with its margins has about 2^25 voxels
constexpr int kPart = 256;   ///< voxels of the solid that distances are found for together

constexpr double kCover = 2; ///< voxels of the result that balls may leave uncovered

/// The box of a solid, `margin` voxels larger, in parts of at most kPart voxels an axis; those that
/// a leaf comes within the margin of.
std::vector<CoordBBox> parts_near(const FloatGrid& solid, int margin) {
    CoordBBox box;
    if (!solid.tree().evalLeafBoundingBox(box))
        return {};
    box.expand(margin);
    Coord n;
    for (int a = 0; a < 3; ++a)
        n[a] = (box.dim()[a] + kPart - 1) / kPart;
    const auto from = [&](int i, int a) {
        return static_cast<int>(box.min()[a] + std::int64_t{box.dim()[a]} * i / n[a]);
    };
    std::vector<CoordBBox> leaves;
    for (auto leaf = solid.tree().cbeginLeaf(); leaf; ++leaf) {
        leaves.push_back(leaf->getNodeBoundingBox());
        leaves.back().expand(margin);
    }
    std::vector<CoordBBox> parts;
    for (int x = 0; x < n.x(); ++x)
        for (int y = 0; y < n.y(); ++y)
            for (int z = 0; z < n.z(); ++z) {
                const CoordBBox part(from(x, 0), from(y, 1), from(z, 2), from(x + 1, 0) - 1,
                                     from(y + 1, 1) - 1, from(z + 1, 2) - 1);
                if (std::any_of(leaves.begin(), leaves.end(),
                                [&](const CoordBBox& leaf) { return leaf.hasOverlap(part); }))
                    parts.push_back(part);
            }
    return parts;
}

/// The least multiple of `n` that is not below `x`.
int up_to(int x, int n) {
    return x + ((-x) % n + n) % n;
}

/// Every n-th voxel of a level set, by true distances, grown; null when none is inside.
FloatGrid::Ptr sampled(const FloatGrid& solid, const CoarserSettings& settings,
                       const Progress* progress) {
    const Lattice own = lattice_of(solid);
    const int n = settings.coarser;
    const auto far = static_cast<float>(kBand * n * own.voxel_m),
               grow = static_cast<float>(settings.grow_m), voxel = static_cast<float>(own.voxel_m);
    const int reach = static_cast<int>(std::ceil((grow + far) / voxel)) + 1;
    auto out = empty_level_set({own.voxel_m * n, own.origin, kBand});
    auto accessor = out->getAccessor();
    bool any_inside = false;
    for (const CoordBBox& part : parts_near(solid, reach)) {
        const Coord first = part.min() - Coord(reach), size = part.dim() + Coord(2 * reach);
        const DenseLattice lattice{
            .n = {size.x(), size.y(), size.z()},
            .voxel_m = own.voxel_m,
            .coarser = 1,
            .origin =
                own.origin + Vec3{1. * first.x(), 1. * first.y(), 1. * first.z()} * own.voxel_m};
        const std::vector<float> d = signed_distances(
            lattice, dense_values(solid, lattice, progress), own.half_width_vox, progress);
        for (int x = up_to(part.min().x(), n); x <= part.max().x(); x += n)
            for (int y = up_to(part.min().y(), n); y <= part.max().y(); y += n)
                for (int z = up_to(part.min().z(), n); z <= part.max().z(); z += n) {
                    const Coord at = Coord(x, y, z) - first;
                    const float value = d[lattice.at(at.x(), at.y(), at.z())] * voxel - grow;
                    const Coord to(x / n, y / n, z / n);
                    any_inside = any_inside || value < 0;
                    if (std::abs(value) < far)
                        accessor.setValue(to, value);
                    else if (value < 0)
                        accessor.setValueOff(to, -far);
                }
    }
    if (!any_inside)
        return nullptr;
    openvdb::tools::signedFloodFill(out->tree(), true, 1, 1);
    return out;
}

/// The voxels of voids that are sealed in `grown` and were not in `solid`.
openvdb::MaskTree shut(const FloatGrid& grown, const FloatGrid& solid, int coarser) {
    openvdb::MaskTree mask;
    openvdb::CoordBBox box;
    grown.tree().evalLeafBoundingBox(box);
    const Components now(grown, box, box);
    CleanChoice choice = choose_parts(now.parts(), now.contacts(),
                                      CleanSettings{.n_pieces = {}, .fill_bubbles = true});
    if (!choice.any_filled())
        return mask;
    solid.tree().evalLeafBoundingBox(box);
    const Components before(solid, box, box);
    for (std::uint32_t p = 0; p < choice.filled.size(); ++p)
        if (choice.filled[p]) {
            const Coord first = now.parts()[p].first;
            const Coord at(first.x() * coarser, first.y() * coarser, first.z() * coarser);
            choice.filled[p] = !box.isInside(at) || before.part(at) == Components::kOutside;
        }
    now.mark(choice.filled, mask);
    return mask;
}

/// Balls in the marked voids, the largest first, that come within kCover voxels of all of them.
std::vector<Sphere> balls_in(const FloatGrid& grown, const openvdb::MaskTree& mask, double grow_m,
                             const Progress* progress) {
    openvdb::CoordBBox box;
    mask.evalActiveVoxelBoundingBox(box);
    const DenseLattice lattice = dense_lattice(grown, box, 1, 1, kWho);
    const Lattice own = lattice_of(grown);
    const Vec3 from = (lattice.origin - own.origin) / own.voxel_m;
    const Coord first(static_cast<int>(std::lround(from.x)), static_cast<int>(std::lround(from.y)),
                      static_cast<int>(std::lround(from.z)));
    std::vector<float> values = dense_values(grown, lattice, progress);
    std::vector<std::uint8_t> open(lattice.size());
    tbb::parallel_for(0, lattice.n[0], [&](int x) {
        const openvdb::tree::ValueAccessor<const openvdb::MaskTree> marked(mask);
        for (int y = 0; y < lattice.n[1]; ++y)
            for (int z = 0; z < lattice.n[2]; ++z) {
                const std::size_t i = lattice.at(x, y, z);
                const Coord at(x * lattice.coarser, y * lattice.coarser, z * lattice.coarser);
                open[i] = marked.isValueOn(first + at);
                const float size = std::max(std::abs(values[i]), 1e-6f);
                values[i] = open[i] ? -size : size;
            }
    });
    const std::vector<float> depths = signed_distances(lattice, values, 0, progress);
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < open.size(); ++i)
        if (open[i])
            order.push_back(i);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return depths[a] < depths[b]; });
    std::vector<Sphere> balls;
    for (const std::size_t i : order) {
        if (!open[i])
            continue;
        const int x = static_cast<int>(i / lattice.stride(0)),
                  y = static_cast<int>(i % lattice.stride(0) / lattice.stride(1)),
                  z = static_cast<int>(i % lattice.stride(1));
        const double depth = -static_cast<double>(depths[i]), r = depth + kCover;
        balls.push_back({lattice.place(x, y, z), depth * lattice.voxel_m + grow_m});
        const int n = static_cast<int>(r);
        for (int u = std::max(x - n, 0); u <= std::min(x + n, lattice.n[0] - 1); ++u)
            for (int v = std::max(y - n, 0); v <= std::min(y + n, lattice.n[1] - 1); ++v)
                for (int w = std::max(z - n, 0); w <= std::min(z + n, lattice.n[2] - 1); ++w)
                    if (length_squared(Vec3{1. * (u - x), 1. * (v - y), 1. * (w - z)}) <= r * r)
                        open[lattice.at(u, v, w)] = 0;
    }
    return balls;
}

} // namespace

CoarserSolid coarser_solid(const FloatGrid& solid, const CoarserSettings& settings,
                           Progress* progress) {
    if (settings.coarser < 1 || settings.coarser > kCoarsest)
        throw Error(Fault::bad_argument, std::string(kWho) + ": coarser is " +
                                             std::to_string(settings.coarser) + ", must be 1..8");
    const double voxel_m = settings.coarser * lattice_of(solid).voxel_m;
    if (!(settings.grow_m >= 0 && settings.grow_m <= voxel_m))
        throw Error(Fault::bad_argument, std::string(kWho) + ": grow_m is " +
                                             shortest(settings.grow_m) + ", must be 0.." +
                                             shortest(voxel_m));
    report_stage(progress, "on coarser voxels");
    CoarserSolid result;
    result.solid = sampled(solid, settings, progress);
    if (!result.solid)
        return result;
    const openvdb::MaskTree filled = shut(*result.solid, solid, settings.coarser);
    if (filled.empty())
        return result;
    result.closed = balls_in(*result.solid, filled, settings.grow_m, progress);
    result.solid = flip(*result.solid, filled, openvdb::CoordBBox::inf(), progress);
    return result;
}

} // namespace taihu
