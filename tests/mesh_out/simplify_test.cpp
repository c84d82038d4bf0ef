#include "mesh_out/simplify.h"

#include <numbers>

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"
#include "tests/support/level_sets.h"

namespace taihu {
namespace {

using testing::HasSubstr;

constexpr double kVoxel = 0.05;

/// Three tunnels and a sealed bubble.
TriMesh holed_rock() {
    const std::vector<Sphere> holes = {{{0.7, 0, 0}, 0.5},
                                       {{0, 0.6, 0}, 0.45},
                                       {{-0.6, -0.3, 0}, 0.5},
                                       {{0, 0.1, 0.1}, 0.4},
                                       {{0, -0.2, -0.7}, 0.1}};
    return extract_uniform(*holed_ball_grid(1, kVoxel, holes));
}

TEST(Simplify, KeepsItsBoundBothWays) {
    const TriMesh rock = holed_rock();
    for (const double bound_vox : {0.25, 0.5, 2.0}) {
        const double bound_m = bound_vox * kVoxel;
        const TriMesh mesh = simplify(rock, rock, {.bound_m = bound_m});
        EXPECT_LT(mesh.triangles.size(), rock.triangles.size() / 4);
        // What sparse samples of a face may miss: 12 %.
        EXPECT_LE(two_sided_distance(mesh, rock, kVoxel / 3).max_m, 1.12 * bound_m);
    }
}

TEST(Simplify, KeepsTheCertificateAndTheTopology) {
    const TriMesh rock = holed_rock();
    const Certificate before = certify(rock, {.self_intersections = false});
    const Certificate after =
        certify(simplify(rock, rock, {.bound_m = 2 * kVoxel}), {.self_intersections = false});
    ASSERT_GT(before.genus, 0);
    ASSERT_GT(before.n_components, 1u);
    EXPECT_TRUE(after.holds()) << testing::PrintToString(faults(after));
    EXPECT_EQ(after.genus, before.genus);
    EXPECT_EQ(after.n_components, before.n_components);
}

TEST(Simplify, LeavesOnABallAboutAsManyTrianglesAsItsBoundAllows) {
    const double voxel = 0.04, bound_m = 0.02;
    const TriMesh ball = extract_uniform(*ball_grid(1, voxel));
    const TriMesh mesh = simplify(ball, ball, {.bound_m = bound_m});
    // An inscribed equilateral triangle with sagitta s has the circumradius sqrt(2 s r) and so the
    // area 3 sqrt(3) / 4 * 2 s r: 4 pi / that many cover the ball. Greedy vertices stay where they
    // are and get within a factor of 2.5 (measured 1.9).
    const double ideal = 4 * std::numbers::pi / (3 * std::sqrt(3.0) / 2 * bound_m);
    EXPECT_LT(static_cast<double>(mesh.triangles.size()), 2.5 * ideal);
}

TEST(Simplify, ChainedLevelsReferToTheFirstSurface) {
    const TriMesh rock = holed_rock();
    TriMesh mesh = rock;
    for (int j = 0; j < 4; ++j) {
        const double bound_m = 0.25 * kVoxel * (1 << j);
        mesh = simplify(mesh, rock, {.bound_m = bound_m});
        EXPECT_LE(two_sided_distance(mesh, rock, kVoxel / 2).max_m, 1.12 * bound_m);
    }
}

TEST(Simplify, StopsAtTheLeastNumberOfTriangles) {
    const TriMesh rock = holed_rock();
    const std::size_t wanted = rock.triangles.size() - 1000;
    const TriMesh mesh = simplify(rock, rock, {.bound_m = kVoxel, .min_triangles = wanted});
    EXPECT_EQ(mesh.triangles.size(), wanted);
}

TEST(Simplify, KeepsATetrahedron) {
    const TriMesh tetrahedron = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                 {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}},
                                 {}};
    const TriMesh mesh = simplify(tetrahedron, tetrahedron, {.bound_m = 10, .min_triangles = 0});
    EXPECT_EQ(mesh.triangles.size(), 4u);
}

TEST(Simplify, KeepsNormalsWithTheirVertices) {
    TriMesh ball = extract_uniform(*ball_grid(1, 0.1));
    for (const Vec3& p : ball.positions)
        ball.normals.push_back(normalized(p));
    const TriMesh mesh = simplify(ball, ball, {.bound_m = 0.05});
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        EXPECT_EQ(mesh.normals[i], normalized(mesh.positions[i]));
}

TEST(Simplify, IsBitIdenticalOnOneThreadAndMany) {
    const TriMesh rock = holed_rock();
    const TriMesh many = simplify(rock, rock, {.bound_m = kVoxel});
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const TriMesh one = simplify(rock, rock, {.bound_m = kVoxel});
    EXPECT_EQ(one.positions, many.positions);
    EXPECT_EQ(one.triangles, many.triangles);
}

TEST(Simplify, GivesTheSameMeshFarFromTheOrigin) {
    const TriMesh ball = extract_uniform(*ball_grid(1, 0.1));
    TriMesh far = ball;
    for (Vec3& p :
         far.positions) // a power of two much larger than the ball: differences lose 2^-43
        p += Vec3{512, 512, 512};
    const TriMesh here = simplify(ball, ball, {.bound_m = 0.05});
    const TriMesh there = simplify(far, far, {.bound_m = 0.05});
    // Ties of cost may fall the other way: the numbers agree, not each face.
    EXPECT_NEAR(static_cast<double>(there.triangles.size()),
                static_cast<double>(here.triangles.size()),
                0.05 * static_cast<double>(here.triangles.size()));
}

void expect_refused(const TriMesh& mesh, const SimplifySettings& settings, const char* text) {
    try {
        simplify(mesh, mesh, settings);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_argument);
        EXPECT_THAT(e.what(), HasSubstr(text));
    }
}

TEST(Simplify, NamesTheSettingOutOfRange) {
    const TriMesh ball = extract_uniform(*ball_grid(0.5, 0.1));
    expect_refused(ball, {}, "bound_m is 0");
    expect_refused(ball, {.bound_m = std::nan("")}, "bound_m is nan");
    expect_refused(ball, {.bound_m = 1, .max_normal_turn_deg = 91}, "max_normal_turn_deg is 91");
}

TEST(Simplify, RefusesMeshesThatAreNoClosedManifold) {
    const TriMesh ball = extract_uniform(*ball_grid(0.5, 0.1));
    TriMesh open = ball, turned = ball, pinched = ball, stray = ball;
    open.triangles.pop_back();
    std::swap(turned.triangles[7][0], turned.triangles[7][1]);
    stray.triangles[3][1] = 1'000'000;
    for (const Triangle& t : ball.triangles) { // a second ball that shares vertex 0 with the first
        Triangle copy = t;
        for (std::uint32_t& v : copy)
            v = v == 0 ? 0 : v + static_cast<std::uint32_t>(ball.positions.size());
        pinched.triangles.push_back(copy);
    }
    for (const Vec3& p : ball.positions)
        pinched.positions.push_back(p + Vec3{0.001, 0, 0});
    for (const TriMesh* bad : {&open, &turned, &pinched})
        expect_refused(*bad, {.bound_m = 0.1}, "not a closed 2-manifold");
    expect_refused(stray, {.bound_m = 0.1}, "not a closed 2-manifold");
    expect_refused({}, {.bound_m = 0.1}, "not a closed 2-manifold");
}

class Cancelled : public Progress {
public:
    void stage(std::string_view) override {}
    void fraction(double) override {}
    bool cancelled() const override { return true; }
};

TEST(Simplify, StopsWhenCancelled) {
    Cancelled progress;
    const TriMesh ball = extract_uniform(*ball_grid(0.5, 0.1));
    try {
        simplify(ball, ball, {.bound_m = 0.1}, &progress);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::cancelled);
    }
}

} // namespace
} // namespace taihu
