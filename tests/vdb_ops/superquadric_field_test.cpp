#include "vdb_ops/superquadric_field.h"

#include <numbers>

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

const CoordBBox kBox(Coord(-40), Coord(40));

TEST(SuperquadricField, WithExponentsOfOneIsAnEllipsoid) {
    const Vec3 a{0.5, 0.3, 0.7};
    const Similarity at =
        Similarity::translation({0.05, 0, 0}) * Similarity::rotation({1, 2, 3}, 1);
    expect_distances(
        SuperquadricField({a, 1, 1}, at), {0.025, {}, 3}, kBox,
        [&](const Vec3& p) {
            return distance_m({EllipsoidSolid{a}, at}, p);
        },
        0.025); // 0.02 voxel as stated, measured at middles of edges and faces
}

TEST(SuperquadricField, WithExponentsOfTwoIsAnOctahedron) {
    // Its exact distance outside of a face is that of the face's plane.
    const Vec3 n = normalized(Vec3{1, 1, 1});
    const DenseField dense =
        sample(SuperquadricField({{0.8, 0.8, 0.8}, 2, 2}), {0.025, {}, 3}, kBox);
    for (const Coord& c : {Coord(11), Coord(10, 12, 11), Coord(12, 10, 10), Coord(9, 10, 11)}) {
        const Vec3 p = Vec3{double(c.x()), double(c.y()), double(c.z())} * 0.025;
        EXPECT_NEAR(dense.at(c), (dot(n, p) - 0.8 / std::sqrt(3.0)) / 0.025, 1e-4);
    }
}

TEST(SuperquadricField, LiesOnItsSurface) {
    for (const auto& [vertical, around] :
         {std::pair{0.1, 0.1}, {0.3, 1.0}, {1.0, 0.4}, {1.7, 0.2}}) {
        const Superquadric s{{0.8, 0.6, 0.5}, vertical, around};
        const double e1 = vertical, e2 = around;
        const DenseField dense = sample(SuperquadricField(s), {0.025, {}, 3}, kBox);
        std::size_t n_wrong = 0, n_near = 0;
        each_voxel(kBox, {0.025, {}, 3}, [&](const Coord& c, const Vec3& p) {
            const double level = std::pow(std::pow(std::fabs(p.x / 0.8), 2 / e2) +
                                              std::pow(std::fabs(p.z / 0.5), 2 / e2),
                                          e2 / e1) +
                                 std::pow(std::fabs(p.y / 0.6), 2 / e1);
            const double d = dense.at(c);
            n_near += std::fabs(d) < 1;
            n_wrong += std::fabs(d) > 0.02 && (level < 1) != (d < 0);
        });
        EXPECT_EQ(n_wrong, 0u) << vertical << ' ' << around;
        EXPECT_GT(n_near, 5000u);
        EXPECT_LE(steepest(dense), 1 + 1e-4); // floats of the mesh
    }
}

TEST(SuperquadricField, ItsMeshIsInscribedAndItsVolumeConverges) {
    // Volume: 2 a b c e1 e2 B(e1 / 2 + 1, e1) B(e2 / 2, e2 / 2) (Jaklic et al., from memory), here
    // for e1 = e2 = 0.5.
    const auto beta = [](double x, double y) {
        return std::tgamma(x) * std::tgamma(y) / std::tgamma(x + y);
    };
    const double exact = 2 * 0.5 * 0.4 * 0.3 * 0.25 * beta(1.25, 0.5) * beta(0.25, 0.25);
    double last = 0;
    for (const int n : {4, 8, 16, 32}) {
        const double v = signed_volume_m3(superquadric_mesh({{0.5, 0.4, 0.3}, 0.5, 0.5}, n));
        EXPECT_GT(v, last);
        EXPECT_LT(v, exact);
        last = v;
    }
    EXPECT_NEAR(last, exact, 2e-3 * exact); // second order: a quarter of the error each time
}

TEST(SuperquadricField, BlocksAloneEqualTheWhole) {
    expect_blocks_equal_the_whole(SuperquadricField({{0.8, 0.6, 0.5}, 0.4, 0.4}), {0.04, {}, 3});
}

TEST(SuperquadricField, RefusesExponentsOutOfRange) {
    expect_error(Fault::bad_argument, "superquadric.vertical is 0.05, must be 0.1..2", [] {
        SuperquadricField({{1, 1, 1}, 0.05, 1});
    });
    expect_error(Fault::bad_argument, "superquadric.around is 3", [] {
        SuperquadricField({{1, 1, 1}, 1, 3});
    });
    expect_error(Fault::bad_argument, "superquadric.semi_axes_m is 0", [] {
        SuperquadricField({{1, 0, 1}, 1, 1});
    });
}

} // namespace
} // namespace taihu
