#include "vdb_ops/clean.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "vdb_ops/components_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;

/// Which parts change side.
struct Choice {
    std::vector<char> flips; // by part
    CleanResult counts;
};

Choice choose(const std::vector<Components::Part>& parts, const CleanSettings& settings) {
    Choice choice;
    choice.flips.assign(parts.size(), 0);
    std::vector<std::size_t> solids;
    for (std::size_t p = 0; p < parts.size(); ++p)
        if (parts[p].solid)
            solids.push_back(p);
    if (solids.empty())
        throw Error(Fault::bad_input,
                    "clean: nothing is left of the solid; use fewer or smaller holes");
    std::sort(solids.begin(), solids.end(), [&](std::size_t a, std::size_t b) {
        return parts[a].n_voxels != parts[b].n_voxels ? parts[a].n_voxels > parts[b].n_voxels
                                                      : parts[a].first < parts[b].first;
    });
    choice.counts.n_pieces = solids.size();
    for (std::size_t i = settings.n_pieces.value_or(solids.size()); i < solids.size(); ++i) {
        choice.flips[solids[i]] = 1;
        ++choice.counts.n_pieces_removed;
    }
    return choice;
}

/// A leaf and its surroundings after the choice, as far as the band reaches.
class Neighbourhood {
public:
    Neighbourhood(const openvdb::FloatGrid::ConstAccessor& accessor, const Components& components,
                  const std::vector<char>& flips, const Coord& leaf, int reach)
        : reach_(reach), size_(8 + 2 * reach) {
        const auto n = static_cast<std::size_t>(size_);
        old_.reserve(n * n * n);
        for (int x = 0; x < size_; ++x)
            for (int y = 0; y < size_; ++y)
                for (int z = 0; z < size_; ++z) {
                    const Coord c = leaf.offsetBy(x - reach, y - reach, z - reach);
                    old_.push_back(accessor.getValue(c));
                    flipped_.push_back(flips[components.part(c)]);
                    any_flipped_ |= flipped_.back() != 0;
                }
        if (any_flipped_)
            find_crossings();
    }

    bool any_flipped() const { return any_flipped_; }
    float old(int x, int y, int z) const { return old_[index(x + reach_, y + reach_, z + reach_)]; }
    bool flipped(int x, int y, int z) const {
        return flipped_[index(x + reach_, y + reach_, z + reach_)] != 0;
    }
    /// Distance [voxels] from a voxel of the leaf to the nearest place where a grid edge crosses
    /// the surface that stays, or the one that goes; at most `far`.
    float to_staying(int x, int y, int z, float far) const {
        return nearest(staying_, x, y, z, far);
    }
    float to_going(int x, int y, int z, float far) const { return nearest(going_, x, y, z, far); }

private:
    using Points = std::vector<std::array<float, 3>>;
    static float nearest(const Points& points, int x, int y, int z, float far) {
        float best2 = far * far;
        for (const auto& c : points) {
            const float dx = c[0] - static_cast<float>(x), dy = c[1] - static_cast<float>(y),
                        dz = c[2] - static_cast<float>(z);
            best2 = std::min(best2, dx * dx + dy * dy + dz * dz);
        }
        return std::sqrt(best2);
    }
    std::size_t index(int x, int y, int z) const {
        return static_cast<std::size_t>((x * size_ + y) * size_ + z);
    }
    void find_crossings() {
        const std::size_t strides[3] = {index(1, 0, 0), index(0, 1, 0), 1};
        for (int x = 0; x < size_; ++x)
            for (int y = 0; y < size_; ++y)
                for (int z = 0; z < size_; ++z) {
                    const int at[3] = {x, y, z};
                    const std::size_t p = index(x, y, z);
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        if (at[axis] + 1 == size_)
                            continue;
                        const std::size_t q = p + strides[axis];
                        if ((old_[p] < 0) == (old_[q] < 0))
                            continue;
                        std::array<float, 3> point = {static_cast<float>(x - reach_),
                                                      static_cast<float>(y - reach_),
                                                      static_cast<float>(z - reach_)};
                        point[axis] += old_[p] / (old_[p] - old_[q]);
                        (flipped_[p] || flipped_[q] ? going_ : staying_).push_back(point);
                    }
                }
    }

    int reach_, size_;
    bool any_flipped_ = false;
    std::vector<float> old_;
    std::vector<char> flipped_;
    Points staying_, going_; // in voxels from the leaf's first
};

/// Rebuild the values of one leaf whose surroundings changed.
void rebuild_leaf(Leaf& leaf, const Neighbourhood& near, float half_width, float voxel) {
    const float background = half_width * voxel;
    for (int v = 0; v < 512; ++v) {
        const int x = v / 64, y = v / 8 % 8, z = v % 8;
        const float old = near.old(x, y, z);
        const bool flipped = near.flipped(x, y, z);
        if (!flipped && std::fabs(old) >= background)
            continue;
        // Looked for a voxel beyond the band: crossings of edges are a little farther than the
        // surface.
        const float d = near.to_staying(x, y, z, half_width + 1);
        // The nearest surface stays: its exact distance is better than the one rebuilt.
        if (!flipped && near.to_going(x, y, z, half_width + 1) >= d)
            continue;
        const float value = std::min(d * voxel, background);
        const auto offset = static_cast<openvdb::Index>(v);
        leaf.setValueOnly(offset, (old < 0) != flipped ? -value : value);
        leaf.setActiveState(offset, value < background);
    }
}

/// The grid with the chosen parts on the other side. Only leaves near them are touched.
openvdb::FloatGrid::Ptr flip_parts(const openvdb::FloatGrid& grid, const Components& components,
                                   const std::vector<char>& flips, Progress* progress) {
    const Lattice lattice = lattice_of(grid);
    const auto& old = components.leaves();
    const std::vector<char> changing = components.blocks_with(flips);
    std::vector<std::unique_ptr<Leaf>> leaves(old.size());
    tbb::parallel_for(std::size_t{0}, old.size(), [&](std::size_t i) {
        check_cancelled(progress);
        leaves[i] = std::make_unique<Leaf>(*old[i]);
        if (!components.near_any(old[i]->origin(), changing))
            return;
        const auto accessor = grid.getConstAccessor();
        const Neighbourhood near(accessor, components, flips, old[i]->origin(),
                                 static_cast<int>(std::ceil(lattice.half_width_vox)) + 2);
        if (near.any_flipped())
            rebuild_leaf(*leaves[i], near, lattice.half_width_vox,
                         static_cast<float>(lattice.voxel_m));
    });
    auto result = openvdb::FloatGrid::create(grid.background());
    result->setTransform(grid.transform().copy());
    result->setGridClass(openvdb::GRID_LEVEL_SET);
    auto accessor = result->getAccessor();
    for (auto& leaf : leaves)
        if (!leaf->isEmpty())
            accessor.addLeaf(leaf.release());
    // A new tree: tiles take the side of the leaves that are left, whatever was there before.
    openvdb::tools::signedFloodFill(result->tree(), true, 1, 1);
    return result;
}

} // namespace

CleanResult clean(const openvdb::FloatGrid& solid, const CleanSettings& settings,
                  Progress* progress) {
    lattice_of(solid);
    if (solid.tree().leafCount() == 0)
        throw Error(Fault::bad_input,
                    "clean: nothing is left of the solid; use fewer or smaller holes");
    CleanResult result;
    openvdb::FloatGrid::Ptr grid;
    {
        const Components components(solid);
        const Choice choice = choose(components.parts(), settings);
        result = choice.counts;
        grid = choice.counts.n_pieces_removed > 0
                   ? flip_parts(solid, components, choice.flips, progress)
                   : solid.deepCopy();
    }
    const double before = volume_m3(solid), without_pieces = volume_m3(*grid);
    result.removed_m3 = before - without_pieces;
    // After the pieces: a bubble inside a removed piece went with it, one around it is whole now.
    const Components components(*grid);
    std::vector<char> flips(components.parts().size(), 0);
    for (std::size_t p = 0; p < flips.size(); ++p) {
        flips[p] = !components.parts()[p].solid && !components.parts()[p].outside;
        result.n_bubbles += flips[p] != 0;
    }
    if (settings.fill_bubbles && result.n_bubbles > 0) {
        result.n_bubbles_filled = result.n_bubbles;
        grid = flip_parts(*grid, components, flips, progress);
        result.filled_m3 = volume_m3(*grid) - without_pieces;
    }
    result.solid = grid;
    return result;
}

} // namespace taihu
