#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include "vdb_ops/kernels_detail.h"

namespace taihu {

// Sparse sets of leaves, 8^3 voxels each, as sorted keys: for level sets that are not fields.

inline constexpr int kFarthestLeaf = 1 << 20; ///< voxels: three coordinates make one key
using LeafKey = std::uint64_t;

/// Leaves by their first voxel, within +-kFarthestLeaf.
LeafKey leaf_key(const openvdb::Coord& leaf);
openvdb::Coord leaf_of_key(LeafKey key);

inline openvdb::Coord leaf_of(const openvdb::Coord& voxel) {
    return {voxel.x() & ~7, voxel.y() & ~7, voxel.z() & ~7};
}
inline std::size_t index_in_leaf(const openvdb::Coord& voxel) {
    return static_cast<std::size_t>((voxel.x() & 7) * 64 + (voxel.y() & 7) * 8 + (voxel.z() & 7));
}

using LeafArray = std::array<float, 512>; ///< z fastest

/// 512 values each for a growing set of leaves.
class LeafValues {
public:
    /// The number of a leaf in keys(), or how many there are.
    std::size_t number(const openvdb::Coord& leaf) const {
        const LeafKey key = leaf_key(leaf);
        const auto at = std::lower_bound(keys_.begin(), keys_.end(), key);
        return at != keys_.end() && *at == key ? static_cast<std::size_t>(at - keys_.begin())
                                               : keys_.size();
    }
    const LeafArray* find(const openvdb::Coord& leaf) const {
        const std::size_t i = number(leaf);
        return i < keys_.size() ? values_[i].get() : nullptr;
    }
    const LeafArray& operator[](std::size_t number) const { return *values_[number]; }
    const std::vector<LeafKey>& keys() const { return keys_; }

    /// Adds leaves that are not there yet; `keys` sorted, without repeats. fn(leaf, values) fills.
    template <class Fn>
    void add(const std::vector<LeafKey>& keys, Fn&& fn) {
        std::vector<std::unique_ptr<LeafArray>> added(keys.size());
        tbb::parallel_for(std::size_t{0}, keys.size(), [&](std::size_t i) {
            added[i] = std::make_unique<LeafArray>();
            fn(leaf_of_key(keys[i]), *added[i]);
        });
        const std::size_t n = keys_.size() + keys.size();
        std::vector<LeafKey> all;
        std::vector<std::unique_ptr<LeafArray>> values;
        all.reserve(n), values.reserve(n);
        for (std::size_t i = 0, j = 0; i < keys_.size() || j < keys.size();) {
            const bool old = j == keys.size() || (i < keys_.size() && keys_[i] < keys[j]);
            all.push_back(old ? keys_[i] : keys[j]);
            values.push_back(std::move(old ? values_[i] : added[j]));
            ++(old ? i : j);
        }
        keys_ = std::move(all);
        values_ = std::move(values);
    }

private:
    std::vector<LeafKey> keys_;
    std::vector<std::unique_ptr<LeafArray>> values_;
};

/// Triangles by the leaves that they come near.
class LeafLists {
public:
    /// Serial but for the search; memory O(pairs of a triangle and a leaf).
    LeafLists(const std::vector<LeafTriangle>& triangles, float half_width);

    const std::vector<LeafKey>& keys() const { return keys_; }
    /// squared = min(squared, squared distances) for a leaf; `triangles` as they were given.
    void nearer(const std::vector<LeafTriangle>& triangles, const openvdb::Coord& leaf,
                float half_width, float* squared) const;

private:
    std::vector<LeafKey> keys_;
    std::vector<std::size_t> first_;       ///< of leaf i: triangles_[first_[i] .. first_[i + 1])
    std::vector<std::uint32_t> triangles_; ///< ascending in each leaf
};

/// What is in one of two sorted lists.
std::vector<LeafKey> both(const std::vector<LeafKey>& a, const std::vector<LeafKey>& b);

} // namespace taihu
