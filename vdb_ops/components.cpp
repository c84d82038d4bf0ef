#include "vdb_ops/components_detail.h"

#include <algorithm>
#include <numeric>

#include <tbb/parallel_for.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
constexpr std::uint32_t kUniform = 0x80000000u; // block_ entries above hold a label, below a leaf
constexpr std::uint16_t kUnlabelled = 0xffff;
constexpr int kSteps[3] = {64, 8, 1}; // from a voxel of a leaf to the next along each axis
constexpr std::size_t kChunk = 4096;  // blocks

} // namespace

Components::Components(const openvdb::FloatGrid& grid, const CoordBBox& region,
                       const CoordBBox& world)
    : region_(region), lo_(region.min() >> 3), n_((region.max() >> 3) - lo_ + Coord(1)) {
    const double n_blocks = double(n_.x()) * n_.y() * n_.z();
    if (n_blocks > double(kUniform))
        throw Error(Fault::bad_input, "clean: the box of the solid holds " +
                                          std::to_string(n_blocks) +
                                          " leaves, at most 2^31 are handled; use a larger voxel");
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        if (region.isInside(leaf->origin()))
            leaves_.push_back(&*leaf);
    labels_.resize(leaves_.size());
    n_labels_.resize(leaves_.size());
    tbb::parallel_for(std::size_t{0}, leaves_.size(), [this](std::size_t i) { label_leaf(i); });
    label_blocks(grid);
    parent_.resize(solid_.size());
    std::iota(parent_.begin(), parent_.end(), 0u);
    join_faces();
    join_outside(world);
    collect();
}

std::size_t Components::block_index(const Coord& voxel) const {
    return (static_cast<std::size_t>((voxel.x() >> 3) - lo_.x()) *
                static_cast<std::size_t>(n_.y()) +
            static_cast<std::size_t>((voxel.y() >> 3) - lo_.y())) *
               static_cast<std::size_t>(n_.z()) +
           static_cast<std::size_t>((voxel.z() >> 3) - lo_.z());
}

Coord Components::block_origin(std::size_t block) const {
    const auto ny = static_cast<std::size_t>(n_.y()), nz = static_cast<std::size_t>(n_.z());
    return (lo_ + Coord(static_cast<int>(block / (ny * nz)), static_cast<int>(block / nz % ny),
                        static_cast<int>(block % nz)))
           << 3;
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
            for (const int step : kSteps)
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

/// Labels of leaves, then one for each uniform block.
void Components::label_blocks(const openvdb::FloatGrid& grid) {
    constexpr std::uint32_t kNone = 0xffffffffu;
    std::uint32_t n = 1; // kOutside
    first_label_.resize(leaves_.size());
    block_.assign(static_cast<std::size_t>(n_.x()) * static_cast<std::size_t>(n_.y()) *
                      static_cast<std::size_t>(n_.z()),
                  kNone);
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
        first_label_[i] = n;
        n += n_labels_[i];
        block_[block_index(leaves_[i]->origin())] = static_cast<std::uint32_t>(i);
    }
    solid_.assign(n, 0);
    for (std::size_t i = 0; i < leaves_.size(); ++i)
        for (int v = 0; v < 512; ++v)
            solid_[first_label_[i] + labels_[i][static_cast<std::size_t>(v)]] =
                leaves_[i]->getValue(static_cast<openvdb::Index>(v)) < 0;
    const auto accessor = grid.getConstAccessor();
    for (std::size_t b = 0; b < block_.size(); ++b)
        if (block_[b] == kNone) {
            block_[b] = kUniform + n++;
            solid_.push_back(accessor.getValue(block_origin(b)) < 0);
        }
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
    for (std::size_t b = 0; b < block_.size(); ++b) {
        const Coord at = (block_origin(b) >> 3) - lo_;
        for (int axis = 0; axis < 3; ++axis) {
            if (at[axis] + 1 >= n_[axis])
                continue;
            const std::size_t next = b + strides[axis];
            const bool uniform = block_[b] >= kUniform && block_[next] >= kUniform;
            const int s1 = kSteps[(axis + 1) % 3], s2 = kSteps[(axis + 2) % 3];
            for (int i = 0; i < (uniform ? 1 : 64); ++i) {
                const int face = i / 8 * s1 + i % 8 * s2;
                const std::uint32_t p = label_at(b, face + 7 * kSteps[axis]),
                                    q = label_at(next, face);
                if (solid_[p] == solid_[q])
                    join(p, q);
            }
        }
    }
}

void Components::join_outside(const CoordBBox& world) {
    for (int axis = 0; axis < 3; ++axis)
        for (const bool upper : {false, true}) {
            const int at = upper ? region_.max()[axis] : region_.min()[axis];
            if (at != (upper ? world.max()[axis] : world.min()[axis]))
                continue;
            const int a = (axis + 1) % 3, b = (axis + 2) % 3;
            for (int i = region_.min()[a]; i <= region_.max()[a]; ++i)
                for (int j = region_.min()[b]; j <= region_.max()[b]; ++j) {
                    Coord voxel;
                    voxel[axis] = at, voxel[a] = i, voxel[b] = j;
                    const int in_leaf =
                        (voxel.x() & 7) * 64 + (voxel.y() & 7) * 8 + (voxel.z() & 7);
                    const std::uint32_t label = label_at(block_index(voxel), in_leaf);
                    if (!solid_[label])
                        join(kOutside, label);
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
            parts_.push_back({solid_[l] != 0, 0, Coord::max()});
        } else {
            part_of_[l] = part_of_[root]; // roots come first: they are the smallest label
        }
    }
    for (std::size_t b = 0; b < block_.size(); ++b) {
        const Coord origin = block_origin(b);
        const bool uniform = block_[b] >= kUniform;
        for (int v = 0; v < (uniform ? 1 : 512); ++v) {
            Part& p = parts_[part_of_[label_at(b, v)]];
            if (p.n_voxels == 0)
                p.first = origin.offsetBy(v / 64, v / 8 % 8, v % 8);
            p.n_voxels += uniform ? 512 : 1;
        }
    }
}

/// Those inside a block and over its upper faces.
void Components::contacts_of(std::size_t block, std::vector<Contact>& found) const {
    const auto touch = [&](std::uint32_t a, std::uint32_t b) {
        if (solid_[a] == solid_[b])
            return;
        const Contact contact{part_of_[solid_[a] ? a : b], part_of_[solid_[a] ? b : a]};
        if (found.empty() || found.back() != contact)
            found.push_back(contact);
    };
    const Coord origin = block_origin(block);
    const bool uniform = block_[block] >= kUniform;
    for (int axis = 0; axis < 3; ++axis) {
        Coord beyond = origin;
        beyond[axis] += 8;
        const bool last = beyond[axis] > region_.max()[axis];
        const std::size_t next = last ? block : block_index(beyond);
        if (uniform && (last || block_[next] >= kUniform)) {
            if (!last)
                touch(label_at(block, 0), label_at(next, 0));
            continue;
        }
        for (int v = 0; v < 512; ++v) {
            const bool edge = v / kSteps[axis] % 8 == 7;
            if (edge && last)
                continue;
            touch(label_at(block, v),
                  edge ? label_at(next, v - 7 * kSteps[axis]) : label_at(block, v + kSteps[axis]));
        }
    }
}

std::vector<Components::Contact> Components::contacts() const {
    std::vector<std::vector<Contact>> chunks((block_.size() + kChunk - 1) / kChunk);
    const auto unite = [](std::vector<Contact>& c) {
        std::sort(c.begin(), c.end());
        c.erase(std::unique(c.begin(), c.end()), c.end());
    };
    tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t chunk) {
        const std::size_t end = std::min(block_.size(), (chunk + 1) * kChunk);
        for (std::size_t b = chunk * kChunk; b < end; ++b)
            contacts_of(b, chunks[chunk]);
        unite(chunks[chunk]);
    });
    std::vector<Contact> all;
    for (const auto& chunk : chunks)
        all.insert(all.end(), chunk.begin(), chunk.end());
    unite(all);
    return all;
}

std::uint32_t Components::part(const Coord& voxel) const {
    const int in_leaf = (voxel.x() & 7) * 64 + (voxel.y() & 7) * 8 + (voxel.z() & 7);
    return part_of_[label_at(block_index(voxel), in_leaf)];
}

std::vector<std::uint32_t> Components::face(int axis, bool upper) const {
    const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    Coord voxel;
    voxel[axis] = upper ? region_.max()[axis] : region_.min()[axis];
    std::vector<std::uint32_t> parts;
    for (voxel[a] = region_.min()[a]; voxel[a] <= region_.max()[a]; ++voxel[a])
        for (voxel[b] = region_.min()[b]; voxel[b] <= region_.max()[b]; ++voxel[b])
            parts.push_back(part(voxel));
    return parts;
}

void Components::mark(const std::vector<char>& marked, openvdb::MaskTree& mask) const {
    for (std::size_t b = 0; b < block_.size(); ++b) {
        const std::uint32_t leaf = block_[b];
        if (leaf >= kUniform) {
            if (marked[part_of_[leaf - kUniform]])
                mask.addTile(1, block_origin(b), true, true);
            continue;
        }
        bool any = false;
        for (std::uint32_t l = 0; l < n_labels_[leaf]; ++l)
            any |= marked[part_of_[first_label_[leaf] + l]] != 0;
        if (!any)
            continue;
        auto* bits = mask.touchLeaf(block_origin(b));
        for (openvdb::Index v = 0; v < 512; ++v)
            if (marked[part_of_[first_label_[leaf] + labels_[leaf][v]]])
                bits->setValueOn(v);
    }
}

} // namespace taihu
