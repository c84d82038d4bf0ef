#include "vdb_ops/combine_field.h"

#include <atomic>
#include <numbers>

#include <tbb/global_control.h>

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/grids.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/offset_field.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using Fields = std::vector<std::shared_ptr<const Field>>;

std::shared_ptr<const Field> solid(const PrimitiveSolid& shape, const Vec3& at) {
    return std::make_shared<SolidsField>(
        std::vector<AnalyticSolid>{{shape, Similarity::translation(at)}});
}

struct Operands {
    std::vector<AnalyticSolid> solids;
    Fields fields;
    Operands(std::uint64_t n, double r) {
        for (std::uint64_t i = 0; i < n; ++i) {
            const Similarity at = Similarity::translation(random_vec(i) * 0.7) *
                                  Similarity::rotation(random_vec(i, 3), 6 * random_number(i, 6));
            const PrimitiveSolid shapes[] = {BallSolid{r}, BoxSolid{{r, 0.6 * r, 0.8 * r}},
                                             CapsuleSolid{0.5 * r, 0.7 * r}};
            solids.push_back({shapes[i % 3], at});
            fields.push_back(std::make_shared<SolidsField>(std::vector{solids.back()}));
        }
    }
    double expected(Combine how, double k, const Vec3& p) const {
        std::vector<double> d;
        for (const AnalyticSolid& s : solids)
            d.push_back(
                (how == Combine::intersect || (how == Combine::subtract && d.empty()) ? -1 : 1) *
                distance_m(s, p));
        return (how == Combine::unite ? 1 : -1) * smooth_min(d, k);
    }
};

constexpr Combine kAll[] = {Combine::unite, Combine::intersect, Combine::subtract};
const Lattice kLattice{0.06, {0.01, -0.02, 0.003}, 3};
const CoordBBox kBox(Coord(-23), Coord(23));

TEST(SmoothMin, OfTwoIsTheQuadraticOne) {
    for (std::uint64_t i = 0; i < 200; ++i) {
        const Vec3 v = random_vec(i);
        const double k = 0.1 + random_number(i, 5), h = std::max(k - std::fabs(v.x - v.y), 0.0);
        EXPECT_NEAR(smooth_min({v.x, v.y}, k), std::min(v.x, v.y) - h * h / (4 * k), 1e-15);
    }
}

TEST(SmoothMin, IsTheLeastOverAllWeights) {
    for (std::uint64_t i = 0; i < 50; ++i) {
        const Vec3 v = random_vec(i);
        const double k = 0.2 + 2 * random_number(i, 5);
        double least = 1e9;
        constexpr int kN = 200;
        for (int a = 0; a <= kN; ++a)
            for (int b = 0; a + b <= kN; ++b) {
                const Vec3 w{double(a) / kN, double(b) / kN, double(kN - a - b) / kN};
                least = std::min(least, dot(w, v) - k / 2 * (1 - dot(w, w)));
            }
        const double got = smooth_min({v.x, v.y, v.z}, k);
        EXPECT_LE(got, least + 1e-14);
        EXPECT_GE(got, least - k / kN / kN); // a parabola, weights 1 / 200 apart
    }
}

TEST(SmoothMin, IsSymmetricLipschitzAndSharpWhereOthersAreFar) {
    for (std::uint64_t i = 0; i < 300; ++i) {
        std::vector<double> v;
        for (std::uint32_t j = 0; j < 6; ++j)
            v.push_back(random_number(i, j));
        const double k = 0.05 + random_number(i, 7);
        const double s = smooth_min(v, k);
        std::vector<double> shuffled(v.rbegin(), v.rend());
        std::swap(shuffled[1], shuffled[4]);
        EXPECT_EQ(smooth_min(shuffled, k), s);
        const double least = *std::min_element(v.begin(), v.end());
        EXPECT_LE(s, least);
        EXPECT_GE(s, least - k / 2 * (1 - 1.0 / 6) - 1e-15);
        std::vector<double> moved = v;
        double most = 0;
        for (std::uint32_t j = 0; j < 6; ++j) {
            const double by = 0.01 * random_number(i, 10 + j) - 0.005;
            moved[j] += by;
            most = std::max(most, std::fabs(by));
        }
        EXPECT_LE(std::fabs(smooth_min(moved, k) - s), most + 1e-15);
        for (double& d : moved)
            d += k;
        moved[0] = least - 0.01;
        EXPECT_EQ(smooth_min(moved, k), moved[0]); // all others are k above
    }
    EXPECT_EQ(smooth_min({3, 1, 2}, 0), 1);
    EXPECT_EQ(smooth_min({5}, 1), 5);
}

TEST(SmoothMin, HasItsWeightsAsDerivatives) {
    for (std::uint64_t i = 0; i < 100; ++i) {
        std::vector<double> v;
        for (std::uint32_t j = 0; j < 4; ++j)
            v.push_back(random_number(i, j));
        std::sort(v.begin(), v.end());
        const double k = 0.05 + random_number(i, 7), step = 1e-6;
        std::vector<double> weights(v.size());
        smooth_min_weights(v, k, weights);
        double sum = 0;
        for (std::size_t j = 0; j < v.size(); ++j) {
            std::vector<double> more = v, less = v;
            more[j] += step;
            less[j] -= step;
            const double slope = (smooth_min(more, k) - smooth_min(less, k)) / (2 * step);
            EXPECT_NEAR(weights[j], slope, 2 * step / k); // weights are 1 / k steep
            sum += weights[j];
        }
        EXPECT_NEAR(sum, 1, 1e-14);
    }
}

TEST(CombineField, IsTheClampedValueAtEveryVoxel) {
    for (const Combine how : kAll)
        for (const double k : {0.0, 0.05, 0.5}) { // below a voxel, and wider than the band
            const Operands of(how == Combine::intersect ? 3 : 4, 0.6);
            SCOPED_TRACE(k);
            expect_distances(
                CombineField(how, of.fields, k), kLattice, kBox,
                [&](const Vec3& p) { return of.expected(how, k, p); },
                4e-6); // floats below the wide band of 11 voxels
        }
}

TEST(CombineField, IsOneLipschitz) {
    for (const Combine how : kAll)
        for (const double k : {0.0, 0.3}) {
            const Operands of(5, 0.6);
            EXPECT_LE(steepest(sample(CombineField(how, of.fields, k), kLattice, kBox)), 1 + 4e-6);
        }
}

TEST(CombineField, BlocksAloneEqualTheWhole) {
    for (const Combine how : kAll) {
        const Operands of(3, 1.2);
        expect_blocks_equal_the_whole(CombineField(how, of.fields, 0.1), {0.015, {}, 3});
    }
}

TEST(CombineField, OrderAndThreadsChangeNoBit) {
    for (const Combine how : kAll)
        for (const double k : {0.0, 0.2}) {
            Operands of(6, 0.9);
            const auto hash = [&] {
                return grid_hash(*rasterize(CombineField(how, of.fields, k), {0.03, {}, 3}));
            };
            const std::string forward = hash();
            const auto first = of.fields.begin() + (how == Combine::subtract ? 1 : 0);
            std::reverse(first, of.fields.end());
            EXPECT_EQ(hash(), forward);
            std::rotate(first, first + 2, of.fields.end());
            const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
            EXPECT_EQ(hash(), forward);
        }
}

TEST(CombineField, BlendsEqualSharpOnesFarFromSeams) {
    const Operands of(2, 0.7);
    const double k = 0.2;
    for (const Combine how : kAll) {
        const DenseField sharp = sample(CombineField(how, of.fields), kLattice, kBox);
        const DenseField blended = sample(CombineField(how, of.fields, k), kLattice, kBox);
        const double side = how == Combine::unite ? 1 : -1;
        std::size_t n_equal = 0, n_other = 0;
        each_voxel(kBox, kLattice, [&](const Coord& c, const Vec3& p) {
            const double a = distance_m(of.solids[0], p),
                         b = (how == Combine::subtract ? -1 : 1) * distance_m(of.solids[1], p);
            if (std::fabs(a - b) >= k + 1e-6) {
                ASSERT_EQ(blended.at(c), sharp.at(c)) << c;
                ++n_equal;
            } else {
                ASSERT_LE(side * double(blended.at(c)), side * double(sharp.at(c))) << c;
                ++n_other;
            }
        });
        EXPECT_GT(n_equal, 1000u);
        EXPECT_GT(n_other, 1000u);
    }
}

TEST(CombineField, VolumesAddUp) {
    const auto a = solid(BallSolid{0.5}, {}), b = solid(BoxSolid{{0.4, 0.3, 0.5}}, {0.3, 0.2, 0.1});
    const auto volume = [](const Field& f) { return volume_m3(*rasterize(f, {1.0 / 64, {}, 3})); };
    const double va = volume(*a), vb = volume(*b);
    const double both = volume(CombineField(Combine::intersect, {a, b}));
    // The three share their seam to a fraction of a voxel squared along it.
    EXPECT_NEAR(volume(CombineField(Combine::unite, {a, b})), va + vb - both, 1e-3);
    EXPECT_NEAR(volume(CombineField(Combine::subtract, {a, b})), va - both, 1e-3);
}

TEST(CombineField, ComposesToAnyDepth) {
    // (A - B) + (C - D), then within E: against the same by hand.
    const auto a = solid(BoxSolid{{0.6, 0.5, 0.5}}, {}), b = solid(BallSolid{0.4}, {0.5, 0, 0}),
               c = solid(BallSolid{0.5}, {-0.6, 0.3, 0}),
               d = solid(CapsuleSolid{0.2, 1}, {-0.6, 0, 0}), e = solid(BallSolid{0.8}, {});
    const auto less = [](const auto& x, const auto& y) {
        return std::make_shared<CombineField>(Combine::subtract, Fields{x, y});
    };
    const CombineField tree(
        Combine::intersect,
        {std::make_shared<CombineField>(Combine::unite, Fields{less(a, b), less(c, d)}), e});
    const auto at = [](const PrimitiveSolid& s, const Vec3& m, const Vec3& p) {
        return distance_m({s, Similarity::translation(m)}, p);
    };
    expect_distances(
        tree, kLattice, kBox,
        [&](const Vec3& p) {
            const double ab = std::max(at(BoxSolid{{0.6, 0.5, 0.5}}, {}, p),
                                       -at(BallSolid{0.4}, {0.5, 0, 0}, p)),
                         cd = std::max(at(BallSolid{0.5}, {-0.6, 0.3, 0}, p),
                                       -at(CapsuleSolid{0.2, 1}, {-0.6, 0, 0}, p));
            return std::max(std::min(ab, cd), at(BallSolid{0.8}, {}, p));
        },
        1e-6);
    expect_blocks_equal_the_whole(tree, {0.02, {}, 3});
}

TEST(CombineField, TakesEmptyTangentAndCoincidentOperands) {
    const auto ball = solid(BallSolid{0.5}, {}), touching = solid(BallSolid{0.3}, {0.8, 0, 0}),
               far = solid(BallSolid{0.1}, {5, 5, 5});
    const auto none = std::make_shared<SolidsField>(std::vector<AnalyticSolid>{});
    const auto hash = [](const Field& f) { return grid_hash(*rasterize(f, {0.05, {}, 3})); };
    for (const double k : {0.0, 0.1}) {
        EXPECT_EQ(hash(CombineField(Combine::unite, {ball, none}, k)), hash(*ball));
        EXPECT_EQ(hash(CombineField(Combine::subtract, {ball, none, far}, k)), hash(*ball));
        EXPECT_EQ(hash(CombineField(Combine::unite, {ball}, k)), hash(*ball));
        for (const auto& empty : {CombineField(Combine::intersect, {ball, none}, k),
                                  CombineField(Combine::intersect, {ball, far}, k),
                                  CombineField(Combine::subtract, {none, ball}, k)})
            EXPECT_EQ(rasterize(empty, kLattice)->activeVoxelCount(), 0u);
    }
    EXPECT_EQ(hash(CombineField(Combine::unite, {ball, ball})), hash(*ball));
    EXPECT_EQ(hash(CombineField(Combine::intersect, {ball, ball, ball})), hash(*ball));
    // Two equal distances blend to k / 4 less; what is left of a solid without itself is a sheet.
    const auto at = [&](const Field& f, const Coord& c) { return sample(f, kLattice, kBox).at(c); };
    const double d = at(*ball, {8, 0, 0});
    EXPECT_NEAR(at(CombineField(Combine::unite, {ball, ball}, 0.08), {8, 0, 0}),
                d - 0.08 / 4 / 0.06, 1e-5);
    EXPECT_GE(at(CombineField(Combine::subtract, {ball, ball}), {8, 0, 0}), 0);
    expect_distances(
        CombineField(Combine::unite, {ball, touching}), kLattice, kBox,
        [&](const Vec3& p) {
            return std::min(length(p) - 0.5, length(p - Vec3{0.8, 0, 0}) - 0.3);
        },
        1e-6);
}

/// Counts the leaves that are evaluated.
class CountingField final : public Field {
public:
    explicit CountingField(std::shared_ptr<const Field> of) : of_(std::move(of)) {}
    mutable std::atomic<std::size_t> n_opened{0}, n_leaves{0};

    std::unique_ptr<LatticeField> on(const Lattice& l, const CoordBBox& region) const override {
        return std::make_unique<Prepared>(*this, of_->on(l, region));
    }
    Primitive n_primitives() const override { return of_->n_primitives(); }
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override {
        return of_->probe(region_m, reach_m);
    }

private:
    struct Block final : BlockSampler {
        const CountingField& count;
        std::unique_ptr<BlockSampler> of;
        Block(const CountingField& c, std::unique_ptr<BlockSampler> o)
            : count(c), of(std::move(o)) {}
        Cover cover(const Coord& leaf) const override { return of->cover(leaf); }
        void values(const Coord& leaf, float* out) override {
            ++count.n_leaves;
            of->values(leaf, out);
        }
    };
    struct Prepared final : LatticeField {
        const CountingField& count;
        std::unique_ptr<LatticeField> of;
        Prepared(const CountingField& c, std::unique_ptr<LatticeField> o)
            : count(c), of(std::move(o)) {}
        CoordBBox bounds() const override { return of->bounds(); }
        std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
            ++count.n_opened;
            auto sampler = of->open(block, cover);
            return sampler ? std::make_unique<Block>(count, std::move(sampler)) : nullptr;
        }
    };
    std::shared_ptr<const Field> of_;
};

TEST(CombineField, EvaluatesNothingThatAnotherOperandDecides) {
    const auto big = solid(BallSolid{2}, {});
    const Lattice lattice{0.02, {}, 3};
    for (const double k : {0.0, 0.1}) {
        // Deep inside the ball it matters neither to its union nor to what the ball is taken from.
        const auto inner = std::make_shared<CountingField>(solid(BallSolid{0.8}, {}));
        rasterize(CombineField(Combine::unite, {big, inner}, k), lattice);
        rasterize(CombineField(Combine::subtract, {inner, big}, k), lattice);
        EXPECT_EQ(inner->n_leaves, 0u);
        // Nor where it is outside of what it is cut with; blocks beyond its bounds are not opened.
        const auto outer = std::make_shared<CountingField>(solid(BallSolid{0.5}, {4, 0, 0}));
        rasterize(CombineField(Combine::intersect, {big, outer}, k), lattice);
        rasterize(CombineField(Combine::subtract, {big, outer}, k), lattice);
        EXPECT_EQ(outer->n_leaves, 0u);
        EXPECT_EQ(outer->n_opened, 0u);
    }
}

TEST(CombineField, CutsUnboundedOperandsToBounds) {
    const auto half =
        std::make_shared<SolidsField>(std::vector<AnalyticSolid>{{HalfSpaceSolid{}, {}}});
    const auto ball = solid(BallSolid{0.5}, {});
    const double whole = 4.0 / 3 * std::numbers::pi * 0.125;
    for (const Fields& of : {Fields{ball, half}, Fields{half, ball}})
        EXPECT_NEAR(volume_m3(*rasterize(CombineField(Combine::intersect, of), {1.0 / 64, {}, 3})),
                    whole / 2, 1e-3 * whole);
    const auto not_half = std::make_shared<ComplementField>(half);
    EXPECT_NEAR(volume_m3(*rasterize(CombineField(Combine::intersect, {ball, not_half}),
                                     {1.0 / 64, {}, 3})),
                whole / 2, 1e-3 * whole);
    expect_error(Fault::bad_argument, "beyond voxel 2^30", [&] {
        rasterize(CombineField(Combine::unite, {ball, half}), {1.0 / 64, {}, 3});
    });
}

TEST(CombineField, BlendsMeshesToo) {
    // A wide band of a mesh agrees with the narrow one where only one operand is near.
    const std::shared_ptr<const Field> rock = shape_field({.subdivisions = 3});
    const auto ball = solid(BallSolid{0.2}, {0.5, 0, 0});
    const CombineField blended(Combine::unite, {rock, ball}, 0.15);
    const Lattice lattice{0.02, {}, 3};
    EXPECT_LE(steepest(sample(blended, lattice, CoordBBox(Coord(-40), Coord(40)))), 1 + 1e-4);
    expect_blocks_equal_the_whole(blended, lattice);
    EXPECT_GT(volume_m3(*rasterize(blended, lattice)),
              volume_m3(*rasterize(CombineField(Combine::unite, {rock, ball}), lattice)));
}

TEST(CombineField, RefusesNothingNullAndWidthsOutOfRange) {
    const auto ball = solid(BallSolid{1}, {});
    expect_error(Fault::bad_argument, "no solids", [] { CombineField(Combine::unite, {}); });
    expect_error(Fault::bad_argument, "of[1] is null", [&] {
        CombineField(Combine::unite, {ball, nullptr});
    });
    expect_error(Fault::bad_argument, "blend_m is -1",
                 [&] { CombineField(Combine::unite, {ball}, -1); });
    const CombineField wide(Combine::unite, {ball, ball}, 20);
    expect_error(Fault::bad_argument, "2000 voxels, must be at most 1000", [&] {
        rasterize(wide, {0.01, {}, 3});
    });
}

} // namespace
} // namespace taihu
