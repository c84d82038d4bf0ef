#pragma once
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "stats/core/rng.h"
#include "vdb_ops/rasterize.h"

namespace taihu {

/// Every voxel of a box, in voxels, as blocks opened one by one say.
struct DenseField {
    openvdb::CoordBBox box;
    std::vector<float> values;
    std::vector<char> evaluated; ///< by values(), not by cover() alone

    std::size_t index(const openvdb::Coord& c) const {
        const openvdb::Coord d = box.dim(), at = c - box.min();
        return (static_cast<std::size_t>(at.x()) * static_cast<std::size_t>(d.y()) +
                static_cast<std::size_t>(at.y())) *
                   static_cast<std::size_t>(d.z()) +
               static_cast<std::size_t>(at.z());
    }
    float at(const openvdb::Coord& c) const { return values[index(c)]; }
};

inline DenseField sample(const Field& field, const Lattice& lattice,
                         const openvdb::CoordBBox& box) {
    using openvdb::Coord;
    DenseField dense{box, std::vector<float>(box.volume()), std::vector<char>(box.volume())};
    const auto prepared = field.on(lattice, box);
    const float w = lattice.half_width_vox;
    constexpr int kBlock = BlockSampler::kBlock, kLeaf = BlockSampler::kLeaf;
    std::array<float, 512> values;
    for (int bx = box.min().x() & ~(kBlock - 1); bx <= box.max().x(); bx += kBlock)
        for (int by = box.min().y() & ~(kBlock - 1); by <= box.max().y(); by += kBlock)
            for (int bz = box.min().z() & ~(kBlock - 1); bz <= box.max().z(); bz += kBlock) {
                Cover whole = Cover::surface;
                const auto block = prepared->open({bx, by, bz}, whole);
                EXPECT_EQ(block == nullptr, whole != Cover::surface);
                for (int l = 0; l < 512; ++l) {
                    const Coord leaf(bx + l / 64 * kLeaf, by + l / 8 % 8 * kLeaf,
                                     bz + l % 8 * kLeaf);
                    const Cover cover = block ? block->cover(leaf) : whole;
                    if (cover == Cover::surface)
                        block->values(leaf, values.data());
                    else
                        values.fill(cover == Cover::inside ? -w : w);
                    for (int v = 0; v < 512; ++v) {
                        const Coord c = leaf.offsetBy(v / 64, v / 8 % 8, v % 8);
                        if (!box.isInside(c))
                            continue;
                        dense.values[dense.index(c)] = values[static_cast<std::size_t>(v)];
                        dense.evaluated[dense.index(c)] = cover == Cover::surface;
                    }
                }
            }
    return dense;
}

/// All voxels of a box: fn(coordinates, world position).
template <class Fn>
void each_voxel(const openvdb::CoordBBox& box, const Lattice& lattice, Fn&& fn) {
    for (auto it = box.begin(); it; ++it) {
        const openvdb::Coord c = *it;
        fn(c, lattice.origin + Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice.voxel_m);
    }
}

/// Every voxel is the clamped distance, `exact` [m]; what was not evaluated is therefore far; and
/// nothing inside lies outside of the bounds.
inline void expect_distances(const Field& field, const Lattice& lattice,
                             const openvdb::CoordBBox& box,
                             const std::function<double(const Vec3&)>& exact,
                             double tolerance_vox) {
    const DenseField dense = sample(field, lattice, box);
    const openvdb::CoordBBox bounds = field.on(lattice, box)->bounds();
    const double w = lattice.half_width_vox;
    std::size_t n_wrong = 0, n_outside = 0;
    each_voxel(box, lattice, [&](const openvdb::Coord& c, const Vec3& p) {
        const double d = std::clamp(exact(p) / lattice.voxel_m, -w, w);
        const double got = dense.at(c);
        if (!(std::fabs(got - d) <= tolerance_vox) && ++n_wrong < 5)
            ADD_FAILURE() << "voxel " << c << ": " << got << ", expected " << d;
        n_outside += !bounds.isInside(c) && d < w - tolerance_vox;
    });
    EXPECT_EQ(n_wrong, 0u);
    EXPECT_EQ(n_outside, 0u) << "voxels of the band beyond bounds() " << bounds;
}

/// The largest difference between neighbours along an axis, in voxels.
inline double steepest(const DenseField& dense) {
    double most = 0;
    for (auto it = dense.box.begin(); it; ++it)
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = *it;
            if (++next[axis] <= dense.box.max()[axis])
                most = std::max(most, std::fabs(double(dense.at(next)) - double(dense.at(*it))));
        }
    return most;
}

/// Each block prepared and opened alone holds the bits of the whole.
inline void expect_blocks_equal_the_whole(const Field& field, const Lattice& lattice) {
    struct Alone {
        std::unique_ptr<LatticeField> prepared;
        std::unique_ptr<BlockSampler> sampler;
    };
    std::map<openvdb::Coord, Alone> blocks;
    const auto whole = rasterize(field, lattice);
    const auto voxel = static_cast<float>(lattice.voxel_m);
    std::size_t n_different = 0;
    for (auto leaf = whole->tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord o = leaf->origin();
        const openvdb::Coord block(o.x() & ~63, o.y() & ~63, o.z() & ~63);
        Alone& alone = blocks[block];
        if (!alone.prepared) {
            alone.prepared = field.on(lattice, openvdb::CoordBBox::createCube(block, 64));
            Cover cover = Cover::outside;
            alone.sampler = alone.prepared->open(block, cover);
        }
        ASSERT_TRUE(alone.sampler);
        ASSERT_EQ(alone.sampler->cover(o), Cover::surface);
        std::array<float, 512> values;
        alone.sampler->values(o, values.data());
        for (openvdb::Index i = 0; i < 512; ++i) {
            const float far = std::copysign(whole->background(), values[i]);
            const bool band = std::fabs(values[i]) < lattice.half_width_vox;
            n_different += (band ? values[i] * voxel : far) != leaf->getValue(i);
        }
    }
    EXPECT_EQ(n_different, 0u);
    EXPECT_GT(blocks.size(), 1u);
}

/// Numbers in (0, 1), and points, by index.
inline double random_number(std::uint64_t item, std::uint32_t draw) {
    return Rng{17, 23}.uniform(item, draw);
}
inline Vec3 random_vec(std::uint64_t item, std::uint32_t draw = 0) { ///< in [-1, 1]^3
    return {2 * random_number(item, draw) - 1, 2 * random_number(item, draw + 1) - 1,
            2 * random_number(item, draw + 2) - 1};
}

} // namespace taihu
