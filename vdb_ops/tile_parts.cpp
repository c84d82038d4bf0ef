#include "vdb_ops/tile_parts_detail.h"

#include <algorithm>

#include "stats/core/error.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

constexpr double kMostTiles = 0x1p20;

int floor_divided(int a, int b) {
    return a >= 0 ? a / b : -((-a + b - 1) / b);
}

/// Whether `a` begins before `b`.
bool begins_before(const Components::Part& a, const Components::Part& b) {
    const Coord i = a.first >> 3, j = b.first >> 3;
    return i != j ? i < j : a.first < b.first;
}

} // namespace

TileLattice::TileLattice(const CoordBBox& box, int tile_voxels) : edge_(tile_voxels) {
    if (box.empty())
        return;
    double n = 1;
    for (int axis = 0; axis < 3; ++axis) {
        if (box.min()[axis] < -(1 << 30) || box.max()[axis] > (1 << 30))
            throw Error(Fault::bad_argument,
                        "tiles: the solid reaches beyond voxel 2^30; use a larger voxel, or move "
                        "the solid nearer to the origin");
        first_[axis] = floor_divided(box.min()[axis], edge_);
        n_[axis] = floor_divided(box.max()[axis], edge_) - first_[axis] + 1;
        n *= n_[axis];
    }
    if (n > kMostTiles)
        throw Error(Fault::unsupported, "tiles: the box of the solid holds " + std::to_string(n) +
                                            " tiles, at most 2^20 are handled; use larger tiles");
    size_ = static_cast<std::size_t>(n);
}

Coord TileLattice::index(std::size_t n) const {
    const auto ny = static_cast<std::size_t>(n_.y()), nz = static_cast<std::size_t>(n_.z());
    return {static_cast<int>(n / (ny * nz)), static_cast<int>(n / nz % ny),
            static_cast<int>(n % nz)};
}

CoordBBox TileLattice::tile(std::size_t n) const {
    const Coord i = first_ + index(n);
    return CoordBBox::createCube(Coord(i.x() * edge_, i.y() * edge_, i.z() * edge_), edge_);
}

CoordBBox TileLattice::world() const {
    return size_ == 0 ? CoordBBox() : CoordBBox(tile(0).min(), tile(size_ - 1).max());
}

bool TileLattice::before(std::size_t n, int axis, std::size_t& number) const {
    const std::size_t strides[3] = {static_cast<std::size_t>(n_.y()) *
                                        static_cast<std::size_t>(n_.z()),
                                    static_cast<std::size_t>(n_.z()), 1};
    if (index(n)[axis] == 0)
        return false;
    number = n - strides[axis];
    return true;
}

std::uint32_t TileParts::find(std::uint32_t part) {
    while (parent_[part] != part)
        part = parent_[part] = parent_[parent_[part]];
    return part;
}

std::uint32_t TileParts::global(std::size_t tile, std::uint32_t part) const {
    return part == Components::kOutside ? 0 : offset_[tile] + part;
}

void TileParts::add(std::size_t tile, const Components& components) {
    // Part 0 of a tile is the void around, which all tiles share.
    offset_.push_back(static_cast<std::uint32_t>(parts_.size() - 1));
    const auto& own = components.parts();
    if (parts_.size() + own.size() > 0xfffffff0u)
        throw Error(Fault::unsupported,
                    "clean: more than 2^32 parts in tiles; use a larger voxel, or no cleaning");
    for (std::uint32_t p = 1; p < own.size(); ++p) {
        parent_.push_back(static_cast<std::uint32_t>(parts_.size()));
        parts_.push_back(own[p]);
    }
    for (const auto& [solid, empty] : components.contacts())
        contacts_.push_back({global(tile, solid), global(tile, empty)});
    join_before(tile, components);
    for (int axis = 0; axis < 3; ++axis) {
        auto& face = faces_[tile][static_cast<std::size_t>(axis)];
        face = components.face(axis, true);
        for (std::uint32_t& p : face)
            p = global(tile, p);
    }
}

/// Joins the parts that continue from the tiles before this one.
void TileParts::join_before(std::size_t tile, const Components& components) {
    for (int axis = 0; axis < 3; ++axis) {
        std::size_t number = 0;
        if (!tiles_.before(tile, axis, number))
            continue;
        auto& theirs = faces_.at(number)[static_cast<std::size_t>(axis)];
        const std::vector<std::uint32_t> ours = components.face(axis, false);
        Components::Contact last{0, 0};
        for (std::size_t i = 0; i < ours.size(); ++i) {
            const std::uint32_t a = theirs[i], b = global(tile, ours[i]);
            if (last == Components::Contact{a, b})
                continue;
            last = {a, b};
            if (parts_[a].solid == parts_[b].solid) {
                const std::uint32_t p = find(a), q = find(b);
                parent_[std::max(p, q)] = std::min(p, q);
            } else {
                contacts_.push_back(parts_[a].solid ? last : Components::Contact{b, a});
            }
        }
        theirs = {}; // nobody else meets it
    }
}

const CleanCounts& TileParts::choose(const CleanSettings& settings) {
    faces_.clear();
    std::vector<Components::Part> whole;
    std::vector<std::uint32_t> number(parts_.size());
    for (std::uint32_t p = 0; p < parts_.size(); ++p) {
        const std::uint32_t root = find(p);
        if (root == p) { // roots come first: they are the smallest
            number[p] = static_cast<std::uint32_t>(whole.size());
            whole.push_back(parts_[p]);
            continue;
        }
        number[p] = number[root];
        Components::Part& part = whole[number[p]];
        if (part.n_voxels == 0 || begins_before(parts_[p], part))
            part.first = parts_[p].first;
        part.n_voxels += parts_[p].n_voxels;
    }
    parent_ = std::move(number);
    parts_ = {};
    for (auto& [solid, empty] : contacts_) {
        solid = parent_[solid];
        empty = parent_[empty];
    }
    choice_ = choose_parts(whole, contacts_, settings);
    contacts_ = {};
    return choice_.counts;
}

bool TileParts::any(std::size_t tile) const {
    const std::size_t end = tile + 1 < offset_.size() ? offset_[tile + 1] + 1 : parent_.size();
    for (std::size_t p = offset_[tile] + 1; p < end; ++p)
        if (choice_.removed[parent_[p]] || choice_.filled[parent_[p]])
            return true;
    return false;
}

void TileParts::mark(std::size_t tile, const Components& components, openvdb::MaskTree& removed,
                     openvdb::MaskTree& filled) const {
    std::vector<char> removed_here, filled_here;
    for (std::uint32_t p = 0; p < components.parts().size(); ++p) {
        removed_here.push_back(choice_.removed[parent_[global(tile, p)]]);
        filled_here.push_back(choice_.filled[parent_[global(tile, p)]]);
    }
    components.mark(removed_here, removed);
    components.mark(filled_here, filled);
}

} // namespace taihu
