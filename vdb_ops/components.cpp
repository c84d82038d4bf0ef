#include "vdb_ops/components_detail.h"

#include <algorithm>
#include <numeric>

#include <tbb/parallel_for.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

using openvdb::Coord;
constexpr std::uint32_t kUniform = 0x80000000u; // block_ entries above hold a label, below a leaf
constexpr std::uint32_t kOutside = 0;           // label of the unbounded void
constexpr std::uint16_t kUnlabelled = 0xffff;
constexpr int kMargin = 3; // blocks; covers the widest half band and one voxel

} // namespace

Components::Components(const openvdb::FloatGrid& grid) {
    grid.tree().getNodes(leaves_);
    openvdb::CoordBBox box;
    grid.tree().evalLeafBoundingBox(box);
    // A margin on each side: the outside is one piece there, and neighbours may look that far.
    const Coord margin(kMargin);
    lo_ = Coord(box.min().x() >> 3, box.min().y() >> 3, box.min().z() >> 3) - margin;
    n_ =
        Coord(box.max().x() >> 3, box.max().y() >> 3, box.max().z() >> 3) + margin - lo_ + Coord(1);
    const double n_blocks = double(n_.x()) * n_.y() * n_.z();
    if (n_blocks > double(kUniform))
        throw Error(Fault::bad_input, "clean: the box of the solid holds " +
                                          std::to_string(n_blocks) +
                                          " leaves, at most 2^31 are handled; use a larger voxel");
    labels_.resize(leaves_.size());
    n_labels_.resize(leaves_.size());
    tbb::parallel_for(std::size_t{0}, leaves_.size(), [this](std::size_t i) { label_leaf(i); });

    std::uint32_t n = 1; // kOutside
    first_label_.resize(leaves_.size());
    block_.assign(static_cast<std::size_t>(n_blocks), kUniform + kOutside);
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
        first_label_[i] = n;
        n += n_labels_[i];
        block_[block_index(leaves_[i]->origin())] = static_cast<std::uint32_t>(i);
    }
    // Uniform blocks: inside ones each start a label; outside ones take the unbounded void's, or a
    // label of their own when they may be a large bubble. Both join their neighbours below.
    auto accessor = grid.getConstAccessor();
    solid_.assign(n, 0);
    for (std::size_t i = 0; i < leaves_.size(); ++i)
        for (int v = 0; v < 512; ++v)
            solid_[first_label_[i] + labels_[i][static_cast<std::size_t>(v)]] =
                leaves_[i]->getValue(static_cast<openvdb::Index>(v)) < 0;
    for (int x = 0; x < n_.x(); ++x)
        for (int y = 0; y < n_.y(); ++y)
            for (int z = 0; z < n_.z(); ++z) {
                const Coord voxel((lo_.x() + x) * 8, (lo_.y() + y) * 8, (lo_.z() + z) * 8);
                std::uint32_t& block = block_[block_index(voxel)];
                const bool border = x == 0 || y == 0 || z == 0 || x == n_.x() - 1 ||
                                    y == n_.y() - 1 || z == n_.z() - 1;
                if (block != kUniform + kOutside || border)
                    continue;
                block = kUniform + n++;
                solid_.push_back(accessor.getValue(voxel) < 0);
            }
    parent_.resize(n);
    std::iota(parent_.begin(), parent_.end(), 0u);
    join_faces();
    collect();
}

std::size_t Components::block_index(const Coord& voxel) const {
    return (static_cast<std::size_t>((voxel.x() >> 3) - lo_.x()) *
                static_cast<std::size_t>(n_.y()) +
            static_cast<std::size_t>((voxel.y() >> 3) - lo_.y())) *
               static_cast<std::size_t>(n_.z()) +
           static_cast<std::size_t>((voxel.z() >> 3) - lo_.z());
}

void Components::label_leaf(std::size_t leaf) {
    auto& label = labels_[leaf];
    label.fill(kUnlabelled);
    const float* value = leaves_[leaf]->buffer().data();
    std::uint16_t n = 0;
    std::vector<int> stack;
    for (int start = 0; start < 512; ++start) {
        if (label[static_cast<std::size_t>(start)] != kUnlabelled)
            continue;
        stack.push_back(start);
        label[static_cast<std::size_t>(start)] = n;
        while (!stack.empty()) {
            const int v = stack.back();
            stack.pop_back();
            for (const int step : {64, 8, 1})
                for (const int side : {-1, 1}) {
                    const int along = v / step % 8 + side;
                    if (along < 0 || along > 7)
                        continue;
                    const int next = v + side * step;
                    auto& l = label[static_cast<std::size_t>(next)];
                    if (l == kUnlabelled && (value[next] < 0) == (value[v] < 0)) {
                        l = n;
                        stack.push_back(next);
                    }
                }
        }
        ++n;
    }
    n_labels_[leaf] = n;
}

std::uint32_t Components::label_at(std::size_t block, int voxel) const {
    const std::uint32_t b = block_[block];
    return b >= kUniform ? b - kUniform
                         : first_label_[b] + labels_[b][static_cast<std::size_t>(voxel)];
}

void Components::join_faces() {
    const std::size_t strides[3] = {static_cast<std::size_t>(n_.y()) *
                                        static_cast<std::size_t>(n_.z()),
                                    static_cast<std::size_t>(n_.z()), 1};
    const int steps[3] = {64, 8, 1};
    for (std::size_t b = 0; b < block_.size(); ++b) {
        const std::size_t at[3] = {b / strides[0],
                                   b / strides[1] % static_cast<std::size_t>(n_.y()),
                                   b % static_cast<std::size_t>(n_.z())};
        for (int axis = 0; axis < 3; ++axis) {
            if (at[axis] + 1 >= static_cast<std::size_t>(n_[axis]))
                continue;
            const std::size_t next = b + strides[axis];
            const bool uniform = block_[b] >= kUniform && block_[next] >= kUniform;
            const int s1 = steps[(axis + 1) % 3], s2 = steps[(axis + 2) % 3];
            for (int i = 0; i < (uniform ? 1 : 64); ++i) {
                const int face = i / 8 * s1 + i % 8 * s2;
                const std::uint32_t p = label_at(b, face + 7 * steps[axis]),
                                    q = label_at(next, face);
                if (solid_[p] == solid_[q])
                    join(p, q);
            }
        }
    }
}

std::uint32_t Components::find(std::uint32_t label) {
    while (parent_[label] != label)
        label = parent_[label] = parent_[parent_[label]];
    return label;
}

void Components::join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    if (a != b)
        parent_[std::max(a, b)] = std::min(a, b);
}

void Components::collect() {
    part_of_.resize(parent_.size());
    for (std::uint32_t l = 0; l < parent_.size(); ++l) {
        const std::uint32_t root = find(l);
        if (root == l) {
            part_of_[l] = static_cast<std::uint32_t>(parts_.size());
            parts_.push_back({solid_[l] != 0, l == kOutside, 0, l});
        } else {
            part_of_[l] = part_of_[root]; // roots come first: they are the smallest label
        }
    }
    for (std::size_t i = 0; i < leaves_.size(); ++i)
        for (int v = 0; v < 512; ++v)
            ++parts_[part(i, v)].n_voxels;
    for (const std::uint32_t b : block_)
        if (b >= kUniform)
            parts_[part_of_[b - kUniform]].n_voxels += 512;
}

std::vector<char> Components::blocks_with(const std::vector<char>& marked) const {
    std::vector<char> blocks(block_.size(), 0);
    tbb::parallel_for(std::size_t{0}, block_.size(), [&](std::size_t b) {
        if (block_[b] >= kUniform) {
            blocks[b] = marked[part_of_[block_[b] - kUniform]];
            return;
        }
        const std::uint32_t leaf = block_[b];
        for (std::uint32_t l = 0; l < n_labels_[leaf] && !blocks[b]; ++l)
            blocks[b] = marked[part_of_[first_label_[leaf] + l]];
    });
    return blocks;
}

bool Components::near_any(const Coord& origin, const std::vector<char>& blocks) const {
    const Coord at((origin.x() >> 3) - lo_.x(), (origin.y() >> 3) - lo_.y(),
                   (origin.z() >> 3) - lo_.z());
    for (int x = std::max(0, at.x() - kMargin); x <= std::min(n_.x() - 1, at.x() + kMargin); ++x)
        for (int y = std::max(0, at.y() - kMargin); y <= std::min(n_.y() - 1, at.y() + kMargin);
             ++y)
            for (int z = std::max(0, at.z() - kMargin); z <= std::min(n_.z() - 1, at.z() + kMargin);
                 ++z)
                if (blocks[(static_cast<std::size_t>(x) * static_cast<std::size_t>(n_.y()) +
                            static_cast<std::size_t>(y)) *
                               static_cast<std::size_t>(n_.z()) +
                           static_cast<std::size_t>(z)])
                    return true;
    return false;
}

std::uint32_t Components::part(const Coord& voxel) const {
    const int in_leaf = (voxel.x() & 7) * 64 + (voxel.y() & 7) * 8 + (voxel.z() & 7);
    return part_of_[label_at(block_index(voxel), in_leaf)];
}

} // namespace taihu
