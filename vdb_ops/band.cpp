#include "vdb_ops/band_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Interpolation.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/redistance.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr int kSide = 10; // a leaf and one voxel around it
constexpr std::array<int, 3> kStep = {kSide * kSide, kSide, 1};

/// A leaf of values and those across its six faces.
struct HeatLeaf {
    std::array<float, 512> values, next;
    std::array<const HeatLeaf*, 6> beside{}; ///< -x +x -y +y -z +z; null: none
};

int halo_index(int x, int y, int z) {
    return (x + 1) * kStep[0] + (y + 1) * kStep[1] + z + 1;
}

/// next = values + rate * (the sum of the six neighbours - 6 values); beyond the leaves there is
/// what is at their edge.
void heat_step(HeatLeaf& leaf, float rate) {
    std::array<float, kSide * kSide * kSide> halo;
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
            std::copy_n(&leaf.values[static_cast<std::size_t>(x * 64 + y * 8)], 8,
                        &halo[static_cast<std::size_t>(halo_index(x, y, 0))]);
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2, edge = face % 2 ? 7 : 0;
        const HeatLeaf* beside = leaf.beside[static_cast<std::size_t>(face)];
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j) {
                const std::array<int, 3> own = axis == 0   ? std::array{edge, i, j}
                                               : axis == 1 ? std::array{i, edge, j}
                                                           : std::array{i, j, edge};
                std::array<int, 3> there = own, at = own;
                there[static_cast<std::size_t>(axis)] = beside ? 7 - edge : edge;
                at[static_cast<std::size_t>(axis)] += face % 2 ? 1 : -1;
                const auto& values = (beside ? *beside : leaf).values;
                halo[static_cast<std::size_t>(halo_index(at[0], at[1], at[2]))] =
                    values[static_cast<std::size_t>(there[0] * 64 + there[1] * 8 + there[2])];
            }
    }
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
            const float* p = &halo[static_cast<std::size_t>(halo_index(x, y, 0))];
            float* out = &leaf.next[static_cast<std::size_t>(x * 64 + y * 8)];
            for (int z = 0; z < 8; ++z, ++p)
                out[z] = *p + rate * (p[-kStep[0]] + p[kStep[0]] + p[-kStep[1]] + p[kStep[1]] +
                                      p[-1] + p[1] - 6 * *p);
        }
}

} // namespace

FloatGrid::Ptr wide_band(const FloatGrid& solid, double reach_m, const char* who,
                         Progress* progress) {
    const Lattice lattice = lattice_of(solid);
    const double need = reach_m / lattice.voxel_m + 2;
    if (!(need <= static_cast<double>(kWidestBand_vox)))
        throw Error(Fault::bad_argument, std::string(who) + ": the surface would move by up to " +
                                             rounded(reach_m) + " m, " + rounded(need) +
                                             " voxels, at most 1000 are handled; use less, or "
                                             "a larger voxel");
    return redistance(solid, std::max(lattice.half_width_vox, static_cast<float>(need)), progress);
}

FloatGrid::Ptr settled(const FloatGrid::Ptr& moved, float half_width_vox, Progress* progress) {
    const auto band = half_width_vox * static_cast<float>(moved->voxelSize().x());
    std::vector<Leaf*> leaves;
    moved->tree().getNodes(leaves);
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
            for (std::size_t l = range.begin(); l < range.end(); ++l)
                for (openvdb::Index i = 0; i < 512; ++i)
                    leaves[l]->setValueOn(i, std::clamp(leaves[l]->getValue(i), -band, band));
        });
    openvdb::tools::changeLevelSetBackground(moved->tree(), band);
    return redistance(*moved, half_width_vox, progress);
}

BandReader::BandReader(FloatGrid::ConstPtr grid)
    : grid_(std::move(grid)), accessor_(grid_->getConstAccessor()),
      voxel_m_(grid_->voxelSize().x()) {
    const openvdb::Vec3d o = grid_->indexToWorld(openvdb::Vec3d(0, 0, 0));
    origin_ = {o.x(), o.y(), o.z()};
}

Vec3 BandReader::normal(const Coord& c) const {
    return normalized({value(c.offsetBy(1, 0, 0)) - value(c.offsetBy(-1, 0, 0)),
                       value(c.offsetBy(0, 1, 0)) - value(c.offsetBy(0, -1, 0)),
                       value(c.offsetBy(0, 0, 1)) - value(c.offsetBy(0, 0, -1))});
}

double BandReader::at(const Vec3& p) const {
    const Vec3 v = (p - origin_) / voxel_m_;
    return static_cast<double>(
        openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(v.x, v.y, v.z)));
}

Vec3 BandReader::normal_at(const Vec3& p) const {
    Vec3 slope;
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 step;
        step[axis] = voxel_m_;
        slope[axis] = at(p + step) - at(p - step);
    }
    return normalized(slope);
}

FloatGrid::Ptr blurred(const FloatGrid& grid, double sigma_m, const Progress* progress) {
    constexpr double kRate = 0.125; // the fastest that overturns nothing; variance 1 / 4 a step
    const double sigma = sigma_m / grid.voxelSize().x();
    const int n_steps = std::max(1, static_cast<int>(std::ceil(sigma * sigma / (2 * kRate))));
    const auto rate = static_cast<float>(sigma * sigma / (2 * n_steps));
    auto out = grid.deepCopy();
    std::vector<Leaf*> leaves;
    out->tree().getNodes(leaves);
    std::vector<HeatLeaf> heat(leaves.size());
    const auto each = [&](auto&& fn) {
        check_cancelled(progress);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, heat.size(), 32),
                          [&](const auto& range) {
                              for (std::size_t l = range.begin(); l < range.end(); ++l)
                                  fn(l);
                          });
    };
    std::vector<std::pair<Coord, std::size_t>> numbers(leaves.size());
    for (std::size_t l = 0; l < leaves.size(); ++l)
        numbers[l] = {leaves[l]->origin(), l};
    std::sort(numbers.begin(), numbers.end());
    each([&](std::size_t l) {
        std::copy_n(leaves[l]->buffer().data(), 512, heat[l].values.begin());
        for (int face = 0; face < 6; ++face) {
            Coord c = leaves[l]->origin();
            c[face / 2] += face % 2 ? 8 : -8;
            const auto at =
                std::lower_bound(numbers.begin(), numbers.end(), std::pair{c, std::size_t{0}});
            if (at != numbers.end() && at->first == c)
                heat[l].beside[static_cast<std::size_t>(face)] = &heat[at->second];
        }
    });
    for (int step = 0; step < n_steps; ++step) {
        each([&](std::size_t l) { heat_step(heat[l], rate); });
        each([&](std::size_t l) { heat[l].values = heat[l].next; });
    }
    each([&](std::size_t l) {
        std::copy_n(heat[l].values.begin(), 512, leaves[l]->buffer().data());
    });
    return out;
}

} // namespace taihu
