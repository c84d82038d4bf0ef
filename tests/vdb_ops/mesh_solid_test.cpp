#include "vdb_ops/mesh_solid.h"

#include <numbers>

#include <tbb/global_control.h>

#include "stats/core/rng.h"
#include "tests/support/cube_mesh.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "tests/support/mesh_oracle.h"
#include "vdb_ops/mesh_repair.h"
#include "vdb_ops/volume.h"
#include "vdb_ops/voxelize.h"
#include "vdb_ops/winding_survey_detail.h"

namespace taihu {
namespace {

using testing::Contains;
using testing::HasSubstr;

const CloseSettings kWinding{CloseRule::winding, ShellRule::unite};
const CloseSettings kPlane{CloseRule::plane, ShellRule::unite};

TriMesh ball(int subdivisions = 3) {
    return shape_mesh({.kind = ShapeKind::icosphere, .subdivisions = subdivisions});
}

/// The faces whose middle is so.
template <class Keep>
TriMesh faces_where(const TriMesh& mesh, Keep keep) {
    TriMesh out = mesh;
    out.triangles.clear();
    for (const Triangle& t : mesh.triangles)
        if (keep((mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3))
            out.triangles.push_back(t);
    return out;
}

openvdb::FloatGrid::Ptr solid(const TriMesh& mesh, const CloseSettings& close,
                              double voxel_m = 1.0 / 40) {
    return voxelize(mesh, "mesh", {.voxel_m = voxel_m, .close = close}).solid;
}

/// Signs against the sum over all faces, wherever that is not too close to 1/2 to tell; and values
/// that are a distance: 1-Lipschitz, at most that to the faces unless some are `walls` inside.
void expect_winding_solid(const TriMesh& mesh, double voxel_m, bool walls = false) {
    const auto grid = solid(mesh, kWinding, voxel_m);
    auto values = grid->getConstAccessor();
    int n = 0, n_changes = 0;
    for (auto it = grid->cbeginValueOn(); it; ++it) {
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = it.getCoord();
            ++next[axis];
            const float other = values.getValue(next);
            ASSERT_LE(std::fabs(double(other) - double(*it)), 1.001 * voxel_m);
            n_changes += (other < 0) != (*it < 0);
        }
        if (++n % 11 != 0)
            continue;
        const openvdb::Coord c = it.getCoord();
        const Vec3 p = Vec3{double(c.x()), double(c.y()), double(c.z())} * voxel_m;
        const double w = std::fabs(mesh_winding(mesh.positions, mesh.triangles, p));
        // Places between samples are right to 0.02; walls end within a quarter of a voxel.
        if (std::fabs(w - 0.5) > 0.03 && (!walls || std::fabs(*it) > 0.25 * voxel_m)) {
            ASSERT_EQ(*it<0, w> 0.5) << c << ": " << w;
        }
        if (!walls) {
            ASSERT_LE(std::fabs(double(*it)),
                      mesh_distance(mesh.positions, mesh.triangles, p) + 1e-4 * voxel_m);
        }
    }
    EXPECT_GT(n_changes, 1000);
}

TEST(MeshSolid, WindingFillsABallWithoutItsTop) {
    const TriMesh open = faces_where(ball(), [](const Vec3& p) { return p.y < 0.35; });
    expect_winding_solid(open, 1.0 / 40);
    const double cut_m3 = std::numbers::pi / 3 * 0.15 * 0.15 * (1.5 - 0.15); // if it were flat
    EXPECT_NEAR(volume_m3(*solid(open, kWinding)), signed_volume_m3(ball()) - cut_m3, 0.01);
}

TEST(MeshSolid, WindingBridgesAGapBetweenTwoHalvesThatLoopsCapEach) {
    // A band round the waist is missing: caps make two halves, the winding number one ball.
    const TriMesh halves =
        faces_where(ball(4), [](const Vec3& p) { return std::fabs(p.y) > 0.06; });
    expect_winding_solid(halves, 1.0 / 40);
    const auto bridged = solid(halves, kWinding), capped = solid(halves, {});
    EXPECT_LT(bridged->tree().getValue(openvdb::Coord(0)), 0);
    EXPECT_GT(capped->tree().getValue(openvdb::Coord(0)), 0);
    EXPECT_NEAR(volume_m3(*bridged), signed_volume_m3(ball(4)), 0.01);
    EXPECT_LT(volume_m3(*capped), signed_volume_m3(ball(4)) - 0.05);
}

TEST(MeshSolid, WindingTakesCapsOnVoxelPlanesAndWallsInside) {
    TriMesh open = cube();
    open.triangles.resize(10); // without x = 1/2, which is a plane of voxels at 1/16
    append(open, cube({-0.3, 0.1, 0.05}, 0.6));
    expect_winding_solid(open, 1.0 / 16, true);
    // The wall x = -1/2 of the first runs through the second, where nothing is a surface.
    EXPECT_FLOAT_EQ(solid(open, kWinding, 1.0 / 32)->tree().getValue(openvdb::Coord(-16, 3, 1)),
                    -3.f / 32);
}

TEST(MeshSolid, WindingOfAClosedMeshIsThatOfLoops) {
    EXPECT_EQ(grid_hash(*solid(ball(), kWinding)), grid_hash(*solid(ball(), {})));
}

TEST(MeshSolid, WindingIsTheSameOnOneThreadAndMany) {
    const TriMesh open = faces_where(ball(), [](const Vec3& p) { return p.y < 0.3; });
    const std::string many = grid_hash(*solid(open, kWinding));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(grid_hash(*solid(open, kWinding)), many);
}

TEST(MeshSolid, WindingRefusesSheetsByName) {
    const TriMesh sheet{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
    expect_error(Fault::bad_input, "sheet: no inside",
                 [&] { voxelize(sheet, "sheet", {.voxel_m = 0.05, .close = kWinding}); });
    expect_error(Fault::bad_input, "--close plane", [&] {
        voxelize(faces_where(ball(), [](const Vec3& p) { return p.y > 0.47; }), "cap",
                 {.voxel_m = 0.01, .close = kWinding});
    });
}

/// Triangles at random places of the unit box, corners up to `size` from there.
TriMesh loose_triangles(std::uint32_t n, double size) {
    const Rng rng{11, 2};
    TriMesh mesh;
    for (std::uint32_t i = 0; i < n; ++i) {
        const Vec3 c{rng.uniform(i, 0), rng.uniform(i, 1), rng.uniform(i, 2)};
        for (std::uint32_t k = 3; k < 12; k += 3)
            mesh.positions.push_back(c + Vec3{rng.uniform(i, k) - 0.5, rng.uniform(i, k + 1) - 0.5,
                                              rng.uniform(i, k + 2) - 0.5} *
                                             (2 * size));
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return mesh;
}

TEST(MeshSolid, WindingRefusesLooseTrianglesAndTakesScansWithFacesMissing) {
    const auto parting = [](const TriMesh& mesh) {
        return survey_winding(repair_mesh(mesh, std::nullopt, CloseRule::winding)).parting;
    };
    for (const double size : {0.1, 0.3, 1.0})
        EXPECT_LT(parting(loose_triangles(300, size)), 0.5) << size;
    // So many large ones that most places are in or out by whole numbers.
    expect_error(Fault::bad_input, "of the area of its faces parts in from out", [] {
        mesh_solid(loose_triangles(1000, 1), "soup", kWinding, {1.0 / 40, {}, 3});
    });
    // Two open balls, one of them turned inwards: each has its side.
    TriMesh balls = faces_where(ball(), [](const Vec3&p) { return p.y < 0.35; }), second = balls;
    flip(second);
    for (Vec3& p : second.positions)
        p.x += 2;
    append(balls, second);
    EXPECT_GT(parting(balls), 0.95);
    for (const double missing : {0.1, 0.2, 0.3}) {
        std::uint64_t face = 0;
        const TriMesh scan = faces_where(ball(), [&](const Vec3&) {
            return Rng{12, 2}.uniform(face++, 0) >= missing;
        });
        EXPECT_GT(parting(scan), 0.95) << missing;
        EXPECT_NO_THROW(mesh_solid(scan, "scan", kWinding, {1.0 / 10, {}, 3})) << missing;
    }
}

TEST(MeshSolid, PlaneMakesARaggedBottomFlatAndCutsNothingAway) {
    // A ball whose rim runs up and down between -0.3 and -0.2.
    const TriMesh open = faces_where(ball(4), [](const Vec3& p) {
        return p.y > -0.25 + 0.05 * std::sin(9 * std::atan2(p.z, p.x));
    });
    const VoxelizeResult made = voxelize(open, "mesh", {.voxel_m = 1.0 / 64, .close = kPlane});
    EXPECT_THAT(made.diagnosis.lines(), Contains(HasSubstr("closed with flat bases")));
    double lowest = 1;
    for (const Triangle& t : open.triangles)
        for (const std::uint32_t v : t)
            lowest = std::min(lowest, open.positions[v].y);
    auto values = made.solid->getConstAccessor();
    for (int i = -15; i <= 15; i += 5) // the base is flat, within the tilt of its best plane
        for (int k = -15; k <= 15; k += 5) {
            const int j = static_cast<int>(std::floor(lowest * 64));
            EXPECT_LT(values.getValue(openvdb::Coord(i, j + 2, k)), 0) << i << ' ' << k;
            EXPECT_GT(values.getValue(openvdb::Coord(i, j - 2, k)), 0) << i << ' ' << k;
        }
}

TEST(MeshSolid, PlanePutsABaseUnderTerrain) {
    TriMesh terrain;
    constexpr std::uint32_t n = 20;
    for (std::uint32_t i = 0; i <= n; ++i)
        for (std::uint32_t k = 0; k <= n; ++k)
            terrain.positions.push_back(
                {double(i) / n, 0.1 * std::sin(0.5 * i) * std::cos(0.4 * k), double(k) / n});
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t k = 0; k < n; ++k) {
            const std::uint32_t a = i * (n + 1) + k, b = a + n + 1;
            terrain.triangles.push_back({a, a + 1, b});
            terrain.triangles.push_back({b, a + 1, b + 1});
        }
    expect_error(Fault::bad_input, "no inside: 1 open sheet (caps would be",
                 [&] { solid(terrain, {}); });
    expect_error(Fault::bad_input, "try --close plane", [&] { solid(terrain, {}); });
    const auto grid = solid(terrain, kPlane, 1.0 / 50);
    // The base lies a twentieth of the diagonal (1.43) under the lowest place, -0.1.
    const double base = -0.1 - 0.05 * 1.43;
    for (const auto& [x, z] : {std::pair(10, 10), std::pair(25, 40), std::pair(40, 20)}) {
        EXPECT_LT(grid->tree().getValue(openvdb::Coord(x, int(base * 50) + 2, z)), 0);
        EXPECT_GT(grid->tree().getValue(openvdb::Coord(x, int(base * 50) - 2, z)), 0);
        EXPECT_GT(grid->tree().getValue(openvdb::Coord(x, 7, z)), 0);
    }
}

TEST(MeshSolid, PlaneOfAFlatLoopIsItsCap) {
    TriMesh open = cube();
    open.triangles.resize(10);
    EXPECT_EQ(grid_hash(*solid(open, kPlane)), grid_hash(*solid(open, {})));
}

TEST(MeshSolid, ParityMakesEveryShellInsideAnotherHollow) {
    TriMesh nested = cube({}, 2);
    append(nested, cube({}, 1));
    append(nested, cube({}, 0.5));
    const CloseSettings parity{CloseRule::loops, ShellRule::parity};
    const VoxelizeResult made = voxelize(nested, "mesh", {.voxel_m = 1.0 / 24, .close = parity});
    EXPECT_NEAR(volume_m3(*made.solid), 8 - 1 + 0.125, 0.01);
    EXPECT_NEAR(volume_m3(*solid(nested, {})), 8, 0.01);
    EXPECT_EQ(made.diagnosis.n_cavities, 1u);
}

TEST(MeshSolid, ParityOfShellsThatCrossIsWhatOneOfThemHolds) {
    TriMesh two = cube();
    append(two, cube({0.5, 0.03, 0.02}));
    const CloseSettings parity{CloseRule::loops, ShellRule::parity};
    const double both = 0.5 * 0.97 * 0.98;
    EXPECT_NEAR(volume_m3(*solid(two, parity)), 2 - 2 * both, 0.01);
}

} // namespace
} // namespace taihu
