#include "mesh_out/openness.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "mesh_out/extract.h"
#include "tests/support/errors.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/solids_field.h"

namespace taihu {
namespace {

AnalyticSolid ball(const Vec3& at, double radius) {
    return {BallSolid{radius}, Similarity::translation(at)};
}

TriMesh surface(const Field& field, double voxel_m = 0.03) {
    const auto grid = rasterize(field, {voxel_m, {}, 3});
    TriMesh mesh = extract_uniform(*grid);
    mesh.normals = surface_normals(*grid, mesh.positions);
    return mesh;
}

/// A ball with a round hole of radius 0.4 whose centre lies on its surface at the top.
TriMesh holed() {
    return surface(
        DifferenceField(std::make_shared<SolidsField>(std::vector{ball({}, 1)}),
                        std::make_shared<SolidsField>(std::vector{ball({0, 1, 0}, 0.4)})));
}

TEST(Openness, OfAConvexSolidIsOne) {
    const TriMesh mesh = surface(SolidsField({ball({0.3, 2, 5}, 1)}));
    const std::vector<float> open = openness(mesh);
    ASSERT_EQ(open.size(), mesh.positions.size());
    // Its faces are flat and a little inside of its vertices: a ray in 64 may meet one.
    for (const float o : open)
        EXPECT_GE(o, 1 - 2 / 64.f);
}

TEST(Openness, InAHoleIsTheCosineWeightedShareOfItsMouth) {
    const TriMesh mesh = holed();
    const std::vector<float> open = openness(mesh, {.n_rays = 1024});
    std::size_t n_seen = 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        if (length(mesh.positions[i] - Vec3{0, 0.6, 0}) > 0.02)
            continue;
        // From the bottom (0, 0.6, 0) the rim is a circle about the axis: where |p| = 1 and
        // |p - (0, 1, 0)| = 0.4, that is y = 1 - 0.08, r^2 = 1 - y^2. Share = sin^2 of its angle.
        const double y = 0.92, r2 = 1 - y * y, h = y - 0.6;
        EXPECT_NEAR(double(open[i]), r2 / (r2 + h * h), 0.05); // the rim is a voxel soft
        ++n_seen;
    }
    EXPECT_GT(n_seen, 0u);
}

TEST(Openness, WhatIsBeyondReachHidesNothing) {
    const TriMesh mesh = holed();
    for (const float o : openness(mesh, {.reach_m = 0.01}))
        EXPECT_GE(o, 0.5f); // but for the nearest faces at the rim
    double all = 0, near = 0;
    for (const float o : openness(mesh))
        all += double(o);
    for (const float o : openness(mesh, {.reach_m = 0.2}))
        near += double(o);
    EXPECT_LT(all, near);
}

TEST(Openness, IsTheSameOnAnyNumberOfThreads) {
    const TriMesh mesh = holed();
    const std::vector<float> many = openness(mesh);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(openness(mesh), many);
}

TEST(Openness, RefusesWhatItCannotUse) {
    TriMesh mesh = holed();
    expect_error(Fault::bad_argument, "n_rays is 0", [&] { openness(mesh, {.n_rays = 0}); });
    expect_error(Fault::bad_argument, "reach_m is -1", [&] { openness(mesh, {.reach_m = -1}); });
    mesh.normals.clear();
    expect_error(Fault::bad_argument, "no normals", [&] { openness(mesh); });
    expect_error(Fault::bad_argument, "no triangle", [] { openness({}); });
}

} // namespace
} // namespace taihu
