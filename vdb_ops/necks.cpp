#include "vdb_ops/necks_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "vdb_ops/components_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/redistance.h"

namespace taihu {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;

enum Side : char { kVoid, kUnknown, kStays, kGoes };

/// The sides of all voxels in leaves, grown from the cores into the rest of the solid.
class Territories {
public:
    /// \param depth  the solid with a band that reaches the cores.
    Territories(const openvdb::FloatGrid& depth, const Components& cores,
                const std::vector<char>& stays, const std::vector<char>& goes)
        : accessor_(depth.getConstAccessor()), cores_(cores), stays_(stays), goes_(goes) {
        depth.tree().getNodes(leaves_);
        sides_.resize(leaves_.size());
        for (std::size_t i = 0; i < leaves_.size(); ++i) {
            number_[leaves_[i]] = i;
            for (openvdb::Index v = 0; v < 512; ++v)
                sides_[i][v] =
                    first_side(leaves_[i]->offsetToGlobalCoord(v), leaves_[i]->getValue(v));
        }
    }

    void grow(Progress* progress) {
        for (std::size_t i = 0; i < leaves_.size(); ++i)
            for (openvdb::Index v = 0; v < 512; ++v)
                if (sides_[i][v] == kUnknown)
                    look_around(leaves_[i]->offsetToGlobalCoord(v), 0);
        for (std::size_t d = 0; d < steps_.size(); ++d) {
            check_cancelled(progress);
            std::vector<Step> now = std::move(steps_[d]);
            // Those that stay first, so that they win at ties.
            std::stable_partition(now.begin(), now.end(),
                                  [](const Step& s) { return s.side == kStays; });
            for (const Step& s : now) {
                char* side = at(s.to);
                if (!side || *side != kUnknown)
                    continue;
                *side = s.side;
                spread(s.to, s.side, d);
            }
        }
    }

    void mark(openvdb::MaskTree& mask) const {
        for (std::size_t i = 0; i < leaves_.size(); ++i) {
            if (std::find(sides_[i].begin(), sides_[i].end(), char(kGoes)) == sides_[i].end())
                continue;
            auto* bits = mask.touchLeaf(leaves_[i]->origin());
            for (openvdb::Index v = 0; v < 512; ++v)
                if (sides_[i][v] == kGoes)
                    bits->setValueOn(v);
        }
    }

private:
    struct Step {
        Coord to;
        Side side;
    };
    static constexpr std::size_t kLengths[4] = {0, 10, 14, 17}; // of steps by axes changed, tenths

    Side core_side(const Coord& voxel) const {
        const std::uint32_t part = cores_.part(voxel);
        return stays_[part] ? kStays : goes_[part] ? kGoes : kUnknown;
    }
    Side first_side(const Coord& voxel, float value) const {
        return value < 0 ? core_side(voxel) : kVoid;
    }
    /// The side of a voxel in a leaf, or null. Neighbours mostly lie in the leaf asked for last.
    char* at(const Coord& voxel) {
        if (const Coord origin = voxel & ~7; origin != last_) {
            const Leaf* leaf = accessor_.probeConstLeaf(voxel);
            last_ = origin;
            last_sides_ = leaf ? &sides_[number_.at(leaf)] : nullptr;
        }
        return last_sides_ ? &(*last_sides_)[Leaf::coordToOffset(voxel)] : nullptr;
    }
    template <class Visit>
    static void neighbours(const Coord& voxel, Visit&& visit) {
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z)
                    if (const int n = (x != 0) + (y != 0) + (z != 0); n > 0)
                        visit(voxel.offsetBy(x, y, z), kLengths[n]);
    }
    void push(const Coord& to, Side side, std::size_t distance) {
        if (distance >= steps_.size())
            steps_.resize(distance + 1);
        steps_[distance].push_back({to, side});
    }
    /// Steps from the cores next to a voxel that is in none.
    void look_around(const Coord& voxel, std::size_t distance) {
        neighbours(voxel, [&](const Coord& from, std::size_t length) {
            const char* side = at(from);
            const bool is_core = side ? *side == kStays || *side == kGoes
                                      : accessor_.getValue(from) < 0 && core_side(from) != kUnknown;
            if (is_core)
                push(voxel, side ? static_cast<Side>(*side) : core_side(from), distance + length);
        });
    }
    void spread(const Coord& from, Side side, std::size_t distance) {
        neighbours(from, [&](const Coord& to, std::size_t length) {
            const char* there = at(to);
            if (there && *there == kUnknown)
                push(to, side, distance + length);
        });
    }

    openvdb::FloatGrid::ConstAccessor accessor_;
    const Components& cores_;
    const std::vector<char>&stays_, &goes_;
    std::vector<const Leaf*> leaves_;
    std::unordered_map<const Leaf*, std::size_t> number_; // looked up, never gone through
    std::vector<std::array<char, 512>> sides_;
    Coord last_ = Coord::max();
    std::array<char, 512>* last_sides_ = nullptr;
    std::vector<std::vector<Step>> steps_; // by distance, tenths of a voxel
};

/// The same solid, shallower by `by_m`: negative only in its cores.
openvdb::FloatGrid::Ptr cores_of(const openvdb::FloatGrid& depth, float by_m) {
    auto cores = depth.deepCopy();
    for (auto leaf = cores->tree().beginLeaf(); leaf; ++leaf)
        for (openvdb::Index v = 0; v < 512; ++v)
            leaf->setValueOnly(v, leaf->getValue(v) + by_m);
    return cores;
}

/// Numbers of the cores, the largest first.
std::vector<std::uint32_t> ranked(const Components& cores) {
    std::vector<std::uint32_t> order;
    const auto& parts = cores.parts();
    for (std::uint32_t p = 0; p < parts.size(); ++p)
        if (parts[p].solid)
            order.push_back(p);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return parts[a].n_voxels != parts[b].n_voxels ? parts[a].n_voxels > parts[b].n_voxels
                                                      : parts[a].first < parts[b].first;
    });
    return order;
}

} // namespace

Necked find_necked(const openvdb::FloatGrid& solid, double min_neck_m, std::size_t n_stay,
                   Progress* progress) {
    const Lattice lattice = lattice_of(solid);
    const auto half = static_cast<float>(min_neck_m / 2);
    const float wide = std::ceil(half / static_cast<float>(lattice.voxel_m)) + 2;
    const auto depth =
        wide > lattice.half_width_vox ? widen_band(solid, wide, progress) : solid.deepCopy();
    openvdb::CoordBBox box;
    if (!depth->tree().evalLeafBoundingBox(box))
        return {};
    const auto deep = cores_of(*depth, half);
    const Components cores(*deep, box, box), pieces(*depth, box, box);
    const std::vector<std::uint32_t> order = ranked(cores);
    std::vector<char> stays(cores.parts().size(), 0), goes(stays), held(pieces.parts().size(), 0);
    Necked necked;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::uint32_t piece = pieces.part(cores.parts()[order[i]].first);
        if (i < n_stay) {
            stays[order[i]] = 1;
            held[piece] = 1;
        } else if (held[piece]) {
            goes[order[i]] = 1;
            ++necked.n_parts;
        }
    }
    necked.n_pieces = static_cast<std::size_t>(std::count(held.begin(), held.end(), char{1}));
    if (necked.n_parts == 0)
        return necked;
    Territories territories(*depth, cores, stays, goes);
    territories.grow(progress);
    cores.mark(goes, necked.voxels);
    territories.mark(necked.voxels);
    return necked;
}

} // namespace taihu
