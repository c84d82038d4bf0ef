#include "vdb_ops/kernels_detail.h"

// The plain version of the kernels under other names, beside the dispatched one.
#undef TAIHU_CLONES
#define TAIHU_CLONES
#define solid_distance plain_solid_distance
#define solid_row plain_solid_row
#define min_solid plain_min_solid
#include "vdb_ops/solid_kernels.cpp" // NOLINT(bugprone-suspicious-include)
#undef solid_distance
#undef solid_row
#undef min_solid

#include "tests/support/fields.h"

namespace taihu {

double solid_distance(const VoxelSolid& solid, const double* point);
void solid_row(const VoxelSolid& solid, const double* first, double step, double* out);
void min_solid(const VoxelSolid& solid, const int* leaf, double half_width, float* values);

namespace {

std::vector<PrimitiveSolid> one_of_each() {
    return {BallSolid{4},          EllipsoidSolid{{6, 2, 3}}, BoxSolid{{3, 4, 2}, 0.5},
            CylinderSolid{3, 2},   ConeSolid{4, 1, 3},        CapsuleSolid{2, 5},
            TorusSolid{5, 1.5},    HalfSpaceSolid{},          EllipsoidSolid{{0.4, 9, 9}},
            CylinderSolid{3, 2, 1}};
}

TEST(SolidKernels, EveryInstructionSetGivesTheSameBits) {
    for (std::uint64_t i = 0; i < 300; ++i) {
        const Similarity at = Similarity::translation(random_vec(i) * 8.0 + Vec3{4, 4, 4}) *
                              Similarity::rotation(random_vec(i, 3), 6 * random_number(i, 6));
        const PrimitiveSolid shape = one_of_each()[i % one_of_each().size()];
        const VoxelSolid solid({shape, at}, {1, {}, 3});
        const int leaf[3] = {0, 0, 0};
        std::vector<float> a(512, 3.f), b(512, 3.f);
        plain_min_solid(solid, leaf, 3, a.data());
        min_solid(solid, leaf, 3, b.data());
        ASSERT_EQ(a, b);
        const double first[3] = {1, 2, -20};
        std::vector<double> c(8), d(8);
        plain_solid_row(solid, first, 5, c.data());
        solid_row(solid, first, 5, d.data());
        ASSERT_EQ(c, d);
        solid_row(solid, first, 0, d.data());
        ASSERT_EQ(solid_distance(solid, first), d[0]);
    }
}

TEST(SolidKernels, LeavesOutOnlyRowsBeyondTheBand) {
    for (std::uint64_t i = 0; i < 300; ++i) {
        const Similarity at = Similarity::translation(random_vec(i) * 10.0 + Vec3{4, 4, 4}) *
                              Similarity::rotation(random_vec(i, 3), 6 * random_number(i, 6));
        const AnalyticSolid solid{one_of_each()[i % one_of_each().size()], at};
        const int leaf[3] = {0, 0, 0};
        const float w = i % 2 ? 3.f : 9.f;
        std::vector<float> got(512, w);
        min_solid(VoxelSolid(solid, {1, {}, w}), leaf, w, got.data());
        for (int v = 0; v < 512; ++v) {
            const double d = distance_m(solid, {double(v / 64), double(v / 8 % 8), double(v % 8)});
            ASSERT_NEAR(got[static_cast<std::size_t>(v)], std::min(d, double(w)), 1e-6) << i;
        }
    }
}

} // namespace
} // namespace taihu
