#include "vdb_ops/flips_detail.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "vdb_ops/kernels_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using Leaf = openvdb::FloatTree::LeafNodeType;
using TopNode = openvdb::FloatTree::RootNodeType::ChildNodeType; // 4096^3 voxels
using Node = TopNode::ChildNodeType;                             // 128^3 voxels, 16^3 leaves
using MaskNode = openvdb::MaskTree::RootNodeType::ChildNodeType::ChildNodeType;
using MaskAccessor = openvdb::tree::ValueAccessor<const openvdb::MaskTree>;

int reach_vox(float half_width_vox) {
    return static_cast<int>(std::ceil(half_width_vox)) + 2;
}

/// A place where a grid edge crosses the surface, in voxels from a leaf's first.
using Crossing = std::array<float, 3>;

/// Crossings about a leaf by columns along z, in a cube of `size` voxels with the leaf in its
/// middle.
class Crossings {
public:
    explicit Crossings(int size) : size_(size) {
        first_.reserve(static_cast<std::size_t>(size * size) + 1);
    }
    /// The next column begins, y fastest.
    void begin_column() { first_.push_back(static_cast<std::uint32_t>(points_.size())); }
    void add(const Crossing& p) { points_.push_back(p); }
    bool empty() const { return points_.empty(); }
    /// Those of the columns (x, y0) to (x, y1), cut to what there is.
    std::pair<const Crossing*, const Crossing*> columns(int x, int y0, int y1) const {
        const std::size_t row = static_cast<std::size_t>(x * size_);
        const std::size_t begin = row + static_cast<std::size_t>(std::max(y0, 0)),
                          end = row + static_cast<std::size_t>(std::min(y1, size_ - 1)) + 1;
        return {points_.data() + first_[begin],
                points_.data() + (end < first_.size() ? first_[end] : points_.size())};
    }
    int size() const { return size_; }

private:
    int size_;
    std::vector<Crossing> points_;
    std::vector<std::uint32_t> first_; ///< by column
};

/// row[8] = min(row, the squared distances of voxels (x, y, 0..7)) to the points from `p` to `end`.
TAIHU_CLONES
void nearer_row(const Crossing* p, const Crossing* end, float x, float y, float* row) {
    float best[8];
    std::copy_n(row, 8, best);
    for (; p != end; ++p) {
        const float dx = (*p)[0] - x, dy = (*p)[1] - y, across = dx * dx + dy * dy;
        for (int z = 0; z < 8; ++z) {
            const float dz = (*p)[2] - static_cast<float>(z), d = across + dz * dz;
            best[z] = d < best[z] ? d : best[z];
        }
    }
    std::copy_n(best, 8, row);
}

/// squared[512] = the least squared distance [voxels^2] from each voxel of a leaf to `points`, at
/// most that of `far`, in the rows along z whose bit 8 x + y is set.
void nearest_squared(const Crossings& points, float far, std::uint64_t rows, float* squared) {
    std::fill_n(squared, 512, far * far);
    if (points.empty())
        return;
    const int before = points.size() / 2 - 4, reach = static_cast<int>(std::ceil(far));
    for (; rows != 0; rows &= rows - 1) {
        const int row = std::countr_zero(rows), x = row / 8, y = row % 8;
        // A crossing lies less than a voxel beyond the first of its edge.
        const int x0 = std::max(before + x - reach, 0),
                  x1 = std::min(before + x + reach, points.size() - 1);
        for (int column = x0; column <= x1; ++column) {
            const auto [first, end] =
                points.columns(column, before + y - reach, before + y + reach);
            nearer_row(first, end, static_cast<float>(x), static_cast<float>(y), squared + 8 * row);
        }
    }
}

/// A leaf and its surroundings after the choice, as far as the band reaches.
class Neighbourhood {
public:
    Neighbourhood(const openvdb::FloatGrid::ConstAccessor& values, const MaskAccessor& mask,
                  const Coord& leaf, int reach)
        : reach_(reach), size_(8 + 2 * reach),
          flipped_(static_cast<std::size_t>(size_ * size_ * size_)), staying_(size_), going_(size_),
          cut_(size_) {
        const CoordBBox box(leaf.offsetBy(-reach), leaf.offsetBy(7 + reach));
        each_block(box, [&](const Coord& block, const CoordBBox& part) {
            copy_mask(mask, block, part, box.min());
        });
        if (!any_flipped_)
            return;
        old_.resize(flipped_.size());
        each_block(box, [&](const Coord& block, const CoordBBox& part) {
            copy_values(values, block, part, box.min());
        });
        find_crossings();
    }

    bool any_flipped() const { return any_flipped_; }
    float old(int x, int y, int z) const { return old_[index(x + reach_, y + reach_, z + reach_)]; }
    bool flipped(int x, int y, int z) const {
        return flipped_[index(x + reach_, y + reach_, z + reach_)] != 0;
    }
    /// Where the surface that stays, and the one that goes, cross the edges of the grid.
    const Crossings& staying() const { return staying_; }
    const Crossings& going() const { return going_; }
    /// New surface, where a cut goes through what was on one side.
    const Crossings& cut() const { return cut_; }

private:
    std::size_t index(int x, int y, int z) const {
        return static_cast<std::size_t>((x * size_ + y) * size_ + z);
    }
    /// fn(block, its part in the box), for blocks of 8^3.
    template <class Fn>
    static void each_block(const CoordBBox& box, Fn&& fn) {
        for (int x = box.min().x() & -8; x <= box.max().x(); x += 8)
            for (int y = box.min().y() & -8; y <= box.max().y(); y += 8)
                for (int z = box.min().z() & -8; z <= box.max().z(); z += 8) {
                    CoordBBox part = CoordBBox::createCube(Coord(x, y, z), 8);
                    part.intersect(box);
                    fn(Coord(x, y, z), part);
                }
    }
    /// fn(place of a row's first voxel here, number of the same in its block).
    template <class Fn>
    void each_row(const CoordBBox& part, const Coord& lo, Fn&& fn) const {
        for (int x = part.min().x(); x <= part.max().x(); ++x)
            for (int y = part.min().y(); y <= part.max().y(); ++y)
                fn(index(x - lo.x(), y - lo.y(), part.min().z() - lo.z()),
                   Leaf::coordToOffset(Coord(x, y, part.min().z())));
    }
    void copy_mask(const MaskAccessor& mask, const Coord& block, const CoordBBox& part,
                   const Coord& lo) {
        const auto* bits = mask.probeConstLeaf(block);
        const bool on = !bits && mask.isValueOn(block);
        if (!bits && !on)
            return;
        each_row(part, lo, [&](std::size_t to, openvdb::Index from) {
            for (int z = 0; z < part.dim().z(); ++z, ++to, ++from) {
                flipped_[to] = on || bits->isValueOn(from);
                any_flipped_ |= flipped_[to] != 0;
            }
        });
    }
    void copy_values(const openvdb::FloatGrid::ConstAccessor& values, const Coord& block,
                     const CoordBBox& part, const Coord& lo) {
        const Leaf* leaf = values.probeConstLeaf(block);
        const float value = leaf ? 0 : values.getValue(block);
        each_row(part, lo, [&](std::size_t to, openvdb::Index from) {
            float* row = old_.data() + to;
            if (leaf)
                std::copy_n(leaf->buffer().data() + from, part.dim().z(), row);
            else
                std::fill_n(row, part.dim().z(), value);
        });
    }
    void find_crossings() {
        // What a voxel is: two that are the same have nothing between them.
        std::vector<char> kind(old_.size());
        for (std::size_t p = 0; p < old_.size(); ++p)
            kind[p] = static_cast<char>(2 * (flipped_[p] != 0) + (old_[p] < 0));
        const std::size_t strides[3] = {index(1, 0, 0), index(0, 1, 0), 1};
        for (int x = 0; x < size_; ++x)
            for (int y = 0; y < size_; ++y) {
                for (Crossings* list : {&staying_, &going_, &cut_})
                    list->begin_column();
                const int last[3] = {x + 1, y + 1, 0};
                for (std::size_t axis = 0; axis < 3; ++axis)
                    if (last[axis] < size_)
                        cross_row(kind.data(), x, y, axis, strides[axis]);
            }
    }
    /// The edges along an axis from the voxels of a row, eight at a time.
    void cross_row(const char* kind, int x, int y, std::size_t axis, std::size_t stride) {
        const int n = axis == 2 ? size_ - 1 : size_;
        for (int z0 = 0; z0 < n; z0 += 8) {
            const std::size_t p0 = index(x, y, z0);
            if (p0 + stride + 8 <= old_.size() &&
                std::memcmp(kind + p0, kind + p0 + stride, 8) == 0)
                continue;
            for (int z = z0; z < std::min(z0 + 8, n); ++z) {
                const std::size_t p = index(x, y, z), q = p + stride;
                if (kind[p] == kind[q])
                    continue;
                const bool crossing = (old_[p] < 0) != (old_[q] < 0);
                Crossing point = {static_cast<float>(x - reach_), static_cast<float>(y - reach_),
                                  static_cast<float>(z - reach_)};
                point[axis] += crossing ? old_[p] / (old_[p] - old_[q]) : 0.5f;
                (!crossing ? cut_ : flipped_[p] || flipped_[q] ? going_ : staying_).add(point);
            }
        }
    }

    int reach_, size_;
    bool any_flipped_ = false;
    std::vector<float> old_;
    std::vector<char> flipped_;
    Crossings staying_, going_, cut_;
};

/// Rebuild the values of one leaf whose surroundings changed.
void rebuild_leaf(Leaf& leaf, const Neighbourhood& near, float half_width, float voxel) {
    const float background = half_width * voxel;
    // Looked for a voxel beyond the band: crossings of edges are a little farther than the
    // surface.
    const float far = half_width + 1;
    alignas(64) float staying[512], going[512], cut[512];
    constexpr std::uint64_t kAllRows = ~std::uint64_t{0};
    nearest_squared(near.going(), far, kAllRows, going);
    nearest_squared(near.cut(), far, kAllRows, cut);
    // Elsewhere nothing changes, wherever the surface is that stays.
    std::uint64_t rows = 0;
    for (int v = 0; v < 512; ++v)
        if (near.flipped(v / 64, v / 8 % 8, v % 8) || going[v] < far * far || cut[v] < far * far)
            rows |= std::uint64_t{1} << v / 8;
    nearest_squared(near.staying(), far, rows, staying);
    for (int v = 0; v < 512; ++v) {
        const int x = v / 64, y = v / 8 % 8, z = v % 8;
        const float old = near.old(x, y, z);
        const bool flipped = near.flipped(x, y, z);
        const bool by_cut = cut[v] < staying[v];
        if (!flipped && !by_cut && std::fabs(old) >= background)
            continue;
        // The nearest surface stays: its exact distance is better than the one rebuilt.
        if (!flipped && !by_cut && going[v] >= staying[v])
            continue;
        const float value = std::min(std::sqrt(std::min(staying[v], cut[v])) * voxel, background);
        const auto offset = static_cast<openvdb::Index>(v);
        leaf.setValueOnly(offset, (old < 0) != flipped ? -value : value);
        leaf.setActiveState(offset, value < background);
    }
}

/// The leaves and tiles of a node of 128^3 voxels, some of them flipped.
class Flipper {
public:
    Flipper(const openvdb::FloatGrid& grid, const openvdb::MaskTree& mask, const CoordBBox& region,
            Flipped what)
        : grid_(grid), mask_(mask), region_(region), what_(what), lattice_(lattice_of(grid)),
          reach_(flip_reach_blocks(lattice_.half_width_vox)) {}

    /// Null, and whether it lies inside, where the node comes out uniform.
    std::unique_ptr<Node> node(const Coord& origin, bool& inside) const {
        const auto values = grid_.getConstAccessor();
        const MaskAccessor mask(mask_);
        auto node = std::make_unique<Node>(origin, grid_.background(), false);
        openvdb::Index n_inside = 0, n_leaves = 0;
        for (openvdb::Index place = 0; place < Node::NUM_VALUES; ++place) {
            const Coord at = node->offsetToGlobalCoord(place);
            if (!region_.isInside(at))
                continue;
            std::unique_ptr<Leaf> leaf = this->leaf(values, mask, at);
            const bool is_inside =
                leaf ? leaf->getValue(0) < 0 : (values.getValue(at) < 0) != mask.isValueOn(at);
            if (leaf && !leaf->isEmpty()) {
                node->addChild(leaf.release());
                ++n_leaves;
            } else if (is_inside) {
                node->addTile(place, -grid_.background(), false);
                ++n_inside;
            }
        }
        inside = n_inside == Node::NUM_VALUES;
        return n_leaves == 0 && (n_inside == 0 || inside) ? nullptr : std::move(node);
    }

private:
    /// The leaf at `origin`, rebuilt where something changes near it; null without either.
    std::unique_ptr<Leaf> leaf(const openvdb::FloatGrid::ConstAccessor& values,
                               const MaskAccessor& mask, const Coord& origin) const {
        const Leaf* old = values.probeConstLeaf(origin);
        if ((!old && what_ == Flipped::parts) || !any_near(mask, origin))
            return old ? std::make_unique<Leaf>(*old) : nullptr;
        // A cut through uniform blocks leaves a surface in them.
        auto leaf = old ? std::make_unique<Leaf>(*old)
                        : std::make_unique<Leaf>(origin, values.getValue(origin), false);
        const Neighbourhood near(values, mask, origin, reach_vox(lattice_.half_width_vox));
        if (near.any_flipped())
            rebuild_leaf(*leaf, near, lattice_.half_width_vox,
                         static_cast<float>(lattice_.voxel_m));
        return leaf;
    }

    bool any_near(const MaskAccessor& mask, const Coord& origin) const {
        for (int x = -reach_; x <= reach_; ++x)
            for (int y = -reach_; y <= reach_; ++y)
                for (int z = -reach_; z <= reach_; ++z) {
                    const Coord block = origin.offsetBy(8 * x, 8 * y, 8 * z);
                    if (mask.probeConstLeaf(block) || mask.isValueOn(block))
                        return true;
                }
        return false;
    }

    const openvdb::FloatGrid& grid_;
    const openvdb::MaskTree& mask_;
    CoordBBox region_;
    Flipped what_;
    Lattice lattice_;
    int reach_;
};

/// The nodes of 128^3 voxels in which something may lie inside, in order.
std::vector<Coord> nodes_of(const openvdb::FloatTree& tree, const openvdb::MaskTree& mask) {
    std::set<Coord> origins;
    for (auto top = tree.root().cbeginChildOn(); top; ++top)
        for (openvdb::Index i = 0; i < TopNode::NUM_VALUES; ++i)
            if (top->isChildMaskOn(i) || top->getTable()[i].getValue() < 0)
                origins.insert(top->offsetToGlobalCoord(i));
    std::vector<const MaskNode*> masked;
    mask.getNodes(masked);
    for (const MaskNode* node : masked)
        origins.insert(node->origin());
    return {origins.begin(), origins.end()};
}

std::vector<std::uint32_t> roots(std::size_t n) {
    std::vector<std::uint32_t> parent(n);
    std::iota(parent.begin(), parent.end(), 0u);
    return parent;
}

std::uint32_t find(std::vector<std::uint32_t>& parent, std::uint32_t p) {
    while (parent[p] != p)
        p = parent[p] = parent[parent[p]];
    return p;
}

/// Solid parts, those that stay first.
std::vector<std::uint32_t> ranked(const std::vector<Components::Part>& parts,
                                  const std::vector<char>& kept) {
    std::vector<std::uint32_t> solids;
    for (std::uint32_t p = 0; p < parts.size(); ++p)
        if (parts[p].solid)
            solids.push_back(p);
    const auto is_kept = [&](std::uint32_t p) { return !kept.empty() && kept[p] != 0; };
    const auto before = [&](std::uint32_t a, std::uint32_t b) {
        if (is_kept(a) != is_kept(b))
            return is_kept(a);
        if (parts[a].n_voxels != parts[b].n_voxels)
            return parts[a].n_voxels > parts[b].n_voxels;
        const Coord first = parts[a].first >> 3, second = parts[b].first >> 3;
        return first != second ? first < second : parts[a].first < parts[b].first;
    };
    std::sort(solids.begin(), solids.end(), before);
    return solids;
}

} // namespace

CleanChoice choose_parts(const std::vector<Components::Part>& parts,
                         const std::vector<Components::Contact>& contacts,
                         const CleanSettings& settings, const std::vector<char>& kept) {
    const std::vector<std::uint32_t> solids = ranked(parts, kept);
    if (solids.empty())
        throw Error(Fault::bad_input,
                    "clean: nothing is left of the solid; use fewer or smaller holes");
    CleanChoice choice;
    choice.removed.assign(parts.size(), 0);
    choice.filled.assign(parts.size(), 0);
    choice.counts.n_pieces = solids.size();
    std::size_t n_stay = settings.n_pieces.value_or(solids.size());
    if (!kept.empty())
        n_stay = static_cast<std::size_t>(std::count(kept.begin(), kept.end(), 1));
    for (std::size_t i = n_stay; i < solids.size(); ++i) {
        choice.removed[solids[i]] = 1;
        ++choice.counts.n_pieces_removed;
    }
    // A removed piece is void: it joins the voids that it touches.
    std::vector<std::uint32_t> parent = roots(parts.size());
    for (const auto& [solid, empty] : contacts)
        if (choice.removed[solid]) {
            const std::uint32_t a = find(parent, solid), b = find(parent, empty);
            parent[std::max(a, b)] = std::min(a, b);
        }
    for (std::uint32_t p = 1; p < parts.size(); ++p) {
        if (parts[p].solid && !choice.removed[p])
            continue;
        const std::uint32_t root = find(parent, p);
        choice.counts.n_bubbles += root == p;
        choice.filled[p] = settings.fill_bubbles && root != Components::kOutside;
    }
    choice.counts.n_bubbles_filled = settings.fill_bubbles ? choice.counts.n_bubbles : 0;
    return choice;
}

int flip_reach_blocks(float half_width_vox) {
    return (reach_vox(half_width_vox) + 7) / 8;
}

openvdb::FloatGrid::Ptr flip(const openvdb::FloatGrid& grid, const openvdb::MaskTree& mask,
                             const openvdb::CoordBBox& region, Progress* progress, Flipped what) {
    const Flipper flipper(grid, mask, region, what);
    const std::vector<Coord> origins = nodes_of(grid.tree(), mask);
    std::vector<std::unique_ptr<Node>> nodes(origins.size());
    std::vector<char> inside(origins.size(), 0);
    tbb::parallel_for(std::size_t{0}, origins.size(), [&](std::size_t i) {
        check_cancelled(progress);
        if (!region.hasOverlap(CoordBBox::createCube(origins[i], static_cast<int>(Node::DIM))))
            return;
        bool uniform_inside = false;
        nodes[i] = flipper.node(origins[i], uniform_inside);
        inside[i] = uniform_inside;
    });
    auto result = openvdb::FloatGrid::create(grid.background());
    result->setTransform(grid.transform().copy());
    result->setGridClass(openvdb::GRID_LEVEL_SET);
    auto& root = result->tree().root();
    for (std::size_t i = 0; i < origins.size(); ++i) {
        if (!nodes[i] && !inside[i])
            continue;
        auto* top = root.probeNode<TopNode>(origins[i]);
        if (!top) {
            top = new TopNode(origins[i], grid.background(), false);
            root.addChild(top);
        }
        if (nodes[i])
            top->addChild(nodes[i].release());
        else
            top->addTile(TopNode::coordToOffset(origins[i]), -grid.background(), false);
    }
    return result;
}

} // namespace taihu
