#include "vdb_ops/fractal_rock.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>

#include "stats/core/rng.h"
#include "stats/core/sha256.h"
#include "tests/support/cube_mesh.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/icosphere.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;
using Damp = Damping;

/// Deix' own: nothing of ours added.
FractalSettings plain(Damping damping = Damping::interpolating) {
    return {.base = 0, .damping = damping, .corners = 0, .roundness = 0};
}

/// Every edge of two faces that run through it in opposite directions.
void expect_closed(const TriMesh& mesh) {
    std::map<Edge, int> halves;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            ++halves[{t[k], t[(k + 1) % 3]}];
    for (const auto& [edge, n] : halves) {
        ASSERT_EQ(n, 1);
        ASSERT_EQ(halves.count({edge.second, edge.first}), 1u);
    }
    EXPECT_GT(signed_volume_m3(mesh), 0);
}

std::int64_t euler(const TriMesh& mesh) {
    std::set<std::uint32_t> used;
    for (const Triangle& t : mesh.triangles)
        used.insert(t.begin(), t.end());
    const auto f = static_cast<std::int64_t>(mesh.triangles.size());
    return static_cast<std::int64_t>(used.size()) - f / 2;
}

TriMesh torus() {
    return shape_mesh({.kind = ShapeKind::torus, .tube_m = 0.3, .subdivisions = 3});
}

std::string bytes_of(const TriMesh& mesh) {
    return {reinterpret_cast<const char*>(mesh.positions.data()),
            mesh.positions.size() * sizeof(Vec3)};
}

std::set<std::tuple<double, double, double>> places(const TriMesh& mesh) {
    std::set<std::tuple<double, double, double>> out;
    for (const Vec3& p : mesh.positions)
        out.insert({p.x, p.y, p.z});
    return out;
}

/// Mean of 1 - cos of the angle between neighbouring faces, of edges whose middle is in `part`
/// (seen from the origin, up 1 to down -1).
double roughness(const TriMesh& mesh, double lo = -1, double hi = 1) {
    std::map<Edge, std::size_t> face_of;
    std::vector<Vec3> normals;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& [a, b, c] = mesh.triangles[i];
        const Vec3 &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
        normals.push_back(normalized(cross(q - p, r - p)));
        for (const Edge& e : {Edge{a, b}, Edge{b, c}, Edge{c, a}})
            face_of[e] = i;
    }
    double sum = 0;
    int n = 0;
    for (const auto& [edge, face] : face_of) {
        const Vec3 middle = normalized(mesh.positions[edge.first] + mesh.positions[edge.second]);
        if (edge.first > edge.second || middle.y < lo || middle.y > hi)
            continue;
        sum += 1 - dot(normals[face], normals[face_of.at({edge.second, edge.first})]);
        ++n;
    }
    return sum / n;
}

TEST(SeedRow, D01MidpointDisplacementKeepsClosedMeshesClosed) {
    for (const TriMesh& base : {icosphere(0), cube(), torus()}) {
        const FractalRefiner refiner(base, plain(), 3);
        TriMesh mesh = base;
        for (int level = 0; level < 3; ++level) {
            const MidpointMesh displaced = refiner.displace(mesh);
            EXPECT_EQ(displaced.mesh.triangles.size(), 4 * mesh.triangles.size());
            expect_closed(displaced.mesh);
            EXPECT_EQ(euler(displaced.mesh), euler(base));
            mesh = displaced.mesh;
        }
    }
}

TEST(SeedRow, D02BothTrianglesOfAnEdgeGetTheSameValue) {
    const TriMesh mesh = icosphere(2);
    const DisplacementTable table(5);
    std::set<double> values;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 &a = mesh.positions[t[k]], &b = mesh.positions[t[(k + 1) % 3]];
            EXPECT_EQ(table.at(a, b), table.at(b, a));
            EXPECT_GT(table.at(a, b), -1);
            EXPECT_LT(table.at(a, b), 1);
            values.insert(table.at(a, b));
        }
    // 480 edges in 4096 slots: 453 different on average, standard deviation 5.
    EXPECT_GT(values.size(), 430u);
    EXPECT_EQ(table.at({0, 1, 2}, {3, 0, 4}), table.at({3, -0.0, 4}, {-0.0, 1, 2}));
}

TEST(SeedRow, D02TheOrderOfTrianglesAndCornersChangesNoBit) {
    const TriMesh base = fractal_base({}, 9);
    TriMesh shuffled = base;
    std::reverse(shuffled.triangles.begin(), shuffled.triangles.end());
    for (std::size_t i = 0; i < shuffled.triangles.size(); ++i)
        std::rotate(shuffled.triangles[i].begin(),
                    shuffled.triangles[i].begin() + static_cast<std::ptrdiff_t>(i % 3),
                    shuffled.triangles[i].end());
    for (const Damping damping : {Damp::none, Damp::interpolating, Damp::approximating}) {
        const FractalSettings settings{.damping = damping};
        const TriMesh a = FractalRefiner(base, settings, 1).iterate(base, 2),
                      b = FractalRefiner(shuffled, settings, 1).iterate(shuffled, 2);
        EXPECT_EQ(places(a), places(b)) << damping_name(damping);
        EXPECT_EQ(places(a).size(), a.positions.size()); // no two in one place: no cracks either
        expect_closed(a);
    }
}

TEST(SeedRow, D03TheSeedIsTheRock) {
    const FractalSettings settings{.iterations = 2};
    const TriMesh rock = fractal_rock(settings, 1);
    EXPECT_EQ(rock.positions, fractal_rock(settings, 1).positions);
    EXPECT_NE(rock.positions, fractal_rock(settings, 2).positions);
    // On the same base, which is turned by the seed, all new positions differ.
    const TriMesh base = icosphere(0);
    const auto a = FractalRefiner(base, plain(), 1).displace(base).mesh.positions,
               b = FractalRefiner(base, plain(), 2).displace(base).mesh.positions;
    for (std::size_t i = 12; i < a.size(); ++i)
        EXPECT_NE(a[i], b[i]);
}

TEST(SeedRow, D03TheBytesAreTheSameOnEveryPlatform) {
    EXPECT_EQ(sha256_hex(bytes_of(fractal_rock({.iterations = 2}, 7))).substr(0, 16),
              "aa1a81793183adaf");
}

TEST(SeedRow, D04InterpolatingDampingPassesThroughMidpoints) {
    const TriMesh base = icosphere(1);
    const FractalRefiner refiner(base, {}, 4);
    const MidpointMesh displaced = refiner.displace(base);
    const TriMesh damped = refiner.damp(displaced);
    for (std::size_t i = 0; i < displaced.mesh.positions.size(); ++i)
        EXPECT_EQ(damped.positions[i], displaced.mesh.positions[i]);
    // The spline of an edge is a parabola: A, B, the midpoint M and the quarter next to A satisfy
    // 8 S = 3 A + 6 M - B. The first of 16 faces has A, S, and the quarter of its other edge.
    for (std::size_t f = 0; f < base.triangles.size(); ++f) {
        const Vec3 &a = damped.positions[base.triangles[f][0]],
                   &b = damped.positions[base.triangles[f][1]],
                   &m = displaced.mesh.positions[displaced.mesh.triangles[4 * f][1]],
                   &s = damped.positions[damped.triangles[16 * f][1]];
        EXPECT_LT(length(8 * s - 3 * a - 6 * m + b), 1e-14);
    }
}

TEST(SeedRow, D04ApproximatingDampingStaysInTheHull) {
    const TriMesh base = icosphere(1);
    const FractalRefiner refiner(base, {.damping = Damping::approximating, .amplitude = 1}, 4);
    const MidpointMesh displaced = refiner.displace(base);
    const TriMesh damped = refiner.damp(displaced);
    for (std::size_t f = 0; f < base.triangles.size(); ++f)
        for (std::uint64_t i = 0; i < 50; ++i) {
            const Vec3 way{Rng{1, 1}.uniform(i, 0) - 0.5, Rng{1, 1}.uniform(i, 1) - 0.5,
                           Rng{1, 1}.uniform(i, 2) - 0.5};
            double hull = -1e9, reached = -1e9;
            for (std::size_t k = 4 * f; k < 4 * f + 4; ++k)
                for (const std::uint32_t v : displaced.mesh.triangles[k])
                    hull = std::max(hull, dot(way, displaced.mesh.positions[v]));
            for (std::size_t k = 16 * f; k < 16 * f + 16; ++k)
                for (const std::uint32_t v : damped.triangles[k])
                    reached = std::max(reached, dot(way, damped.positions[v]));
            ASSERT_LE(reached, hull + 1e-15); // rounding
        }
}

TEST(SeedRow, D05TheBaseIsAnIcosahedronOrAnyClosedMesh) {
    EXPECT_EQ(icosphere(0).triangles.size(), 20u);
    for (int level = 0; level <= 3; ++level) {
        const TriMesh base = fractal_base({.base = level}, 3);
        EXPECT_EQ(base.triangles.size(), 20u << (2 * level));
        for (const Vec3& p : base.positions)
            EXPECT_NEAR(length(p), 1, 1e-15);
        // An inscribed triangle of edge e lacks 3 e^2 / 8 of its volume; edges differ by a fifth.
        const double edge = 1.107 / (1 << level);
        EXPECT_NEAR(signed_volume_m3(base) / (4 * std::numbers::pi / 3), 1, 0.5 * edge * edge);
    }
    for (const TriMesh& base : {cube(), torus()})
        for (const DisplaceAlong along : {DisplaceAlong::radius, DisplaceAlong::normal}) {
            const FractalSettings settings{.along = along, .amplitude = 0.05, .roundness = 0};
            const FractalRefiner refiner(base, settings, 2);
            const TriMesh rough = refiner.iterate(refiner.start(base), 2);
            expect_closed(rough);
            EXPECT_EQ(euler(rough), euler(base));
        }
}

TEST(SeedRow, D06RoughnessFallsAsHRises) {
    double before = 2;
    for (const double h : {0.1, 0.3, 0.5, 0.7, 0.9}) {
        double mean = 0;
        for (std::uint64_t seed = 0; seed < 8; ++seed) {
            FractalSettings settings = plain();
            settings.iterations = 2;
            settings.amplitude = 0.15;
            settings.hurst_up = settings.hurst_down = h;
            mean += roughness(fractal_rock(settings, seed)) / 8;
        }
        EXPECT_LT(mean, 0.8 * before) << h;
        before = mean;
    }
}

TEST(SeedRow, D07WhatFacesUpIsRougher) {
    const auto difference = [](double up, double down, std::uint64_t seed) {
        const TriMesh rock =
            fractal_rock({.base = 0, .iterations = 2, .hurst_up = up, .hurst_down = down}, seed);
        const double a = roughness(rock, 0.4, 1), b = roughness(rock, -1, -0.4);
        return (a - b) / (a + b);
    };
    constexpr int kRocks = 24;
    double sum = 0, squares = 0, least = 1;
    for (std::uint64_t seed = 0; seed < kRocks; ++seed) {
        const double same = difference(0.9, 0.9, seed);
        sum += same;
        squares += same * same;
        least = std::min(least, difference(0.5, 1.3, seed));
    }
    EXPECT_GT(least, 0.1);                                               // of every rock
    EXPECT_LT(std::fabs(sum / kRocks), 4 * std::sqrt(squares) / kRocks); // standard errors
}

TEST(SeedRow, D08SixteenTrianglesOfAFace) {
    const TriMesh base = icosphere(0);
    const FractalRefiner refiner(base, plain(), 1);
    const MidpointMesh displaced = refiner.displace(base);
    const TriMesh damped = refiner.damp(displaced);
    // 12 ends, 30 midpoints, two more points an edge, three in a face.
    ASSERT_EQ(displaced.n_corners, 12u);
    ASSERT_EQ(damped.positions.size(), 12u + 30 + 60 + 60);
    const auto kind = [](std::uint32_t v) {
        return v < 12 ? 'e' : v < 42 ? 'm' : v < 102 ? 's' : 'i'; // end, mid, subdivision, inner
    };
    for (std::size_t f = 0; f < base.triangles.size(); ++f) {
        std::map<std::string, int> of_kind;
        for (std::size_t i = 16 * f; i < 16 * f + 16; ++i) {
            std::string kinds;
            for (const std::uint32_t v : damped.triangles[i])
                kinds += kind(v);
            std::sort(kinds.begin(), kinds.end());
            ++of_kind[kinds];
        }
        const std::map<std::string, int> expected{
            {"ess", 3}, {"iss", 3}, {"ims", 6}, {"iim", 3}, {"iii", 1}};
        EXPECT_EQ(of_kind, expected);
    }
    TriMesh mesh = base;
    for (const std::size_t n : {320u, 5120u, 81920u}) {
        mesh = refiner.iterate(std::move(mesh), 1);
        EXPECT_EQ(mesh.triangles.size(), n);
    }
    expect_closed(mesh);
}

TEST(SeedRow, D09LowVerticesAreASubsetOfHighOnes) {
    for (const Damping damping : {Damp::none, Damp::interpolating}) {
        const auto rock = [&](int n) {
            return fractal_rock({.base = 0, .iterations = n, .damping = damping}, 6);
        };
        const TriMesh low = rock(2), high = rock(3);
        ASSERT_LT(low.positions.size(), high.positions.size());
        for (std::size_t i = 0; i < low.positions.size(); ++i)
            ASSERT_EQ(low.positions[i], high.positions[i]);
    }
    // Approximating moves the midpoints, so its ends alone stay.
    const auto rock = [&](int n) {
        return fractal_rock({.base = 0, .iterations = n, .damping = Damping::approximating}, 6);
    };
    const TriMesh low = rock(1), high = rock(2);
    for (std::size_t i = 0; i < low.positions.size(); ++i)
        ASSERT_EQ(low.positions[i], high.positions[i]);
}

TEST(SeedRow, D18RescalingFillsTheBox) {
    for (const Vec3& size : {Vec3{1, 1, 1}, Vec3{2, 0.7, 1.3}, Vec3{0.01, 5, 0.3}}) {
        const TriMesh mesh = shape_mesh({.kind = ShapeKind::fractal_rock,
                                         .size_m = size,
                                         .fractal = {.iterations = 2},
                                         .seed = 4});
        const Box box = bounds(mesh);
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(box.size()[axis], size[axis], 1e-14 * size[axis]);
            EXPECT_NEAR(box.center()[axis], 0, 1e-14 * size[axis]);
        }
        expect_closed(mesh);
    }
}

TEST(FractalRock, NormalsAreAveragedOverFaces) {
    const TriMesh ball = icosphere(3);
    const std::vector<Vec3> normals = averaged_normals(ball);
    for (std::size_t i = 0; i < normals.size(); ++i)
        // Faces around a vertex of an icosphere are not alike: 8 degrees an edge, a tenth off.
        EXPECT_GT(dot(normals[i], ball.positions[i]), 0.9995);
}

TEST(FractalRock, NoDisplacementAndFullRoundnessGiveASphere) {
    const TriMesh ball = fractal_rock(
        {.base = 0, .iterations = 5, .damping = Damping::none, .amplitude = 0, .roundness = 1}, 0);
    for (const Vec3& p : ball.positions)
        EXPECT_NEAR(length(p), 1, 1e-14);
}

TEST(FractalRock, IsANodeOfRecipes) {
    const ShapeSettings settings{.kind = ShapeKind::fractal_rock,
                                 .size_m = {1, 0.8, 0.9},
                                 .fractal = {.base = 0,
                                             .iterations = 2,
                                             .damping = Damping::approximating,
                                             .along = DisplaceAlong::normal,
                                             .amplitude = 0.2,
                                             .hurst_up = 0.6,
                                             .hurst_down = 1.1,
                                             .corners = 0.3,
                                             .roundness = 0.7},
                                 .seed = 11};
    const auto made = make_recipe(format_recipe(shape_node(settings), 0.04, 0), "r.json", {});
    EXPECT_EQ(grid_hash(*made.solid), grid_hash(*rasterize(*shape_field(settings), {0.04, {}, 3})));
    const auto refused = [](const std::string& body) {
        return [body] {
            make_recipe(R"({"taihu_recipe":1,"solid":{"fractal_rock":{"size_m":[1,1,1],)" + body +
                            "}}}",
                        "r.json", {});
        };
    };
    expect_error(Fault::bad_input, "'damping' is 'soft'; must be one of none, interpolating",
                 refused(R"("damping":"soft")"));
    expect_error(Fault::bad_input, "'hurst' is [3,1]", refused(R"("hurst":[3,1])"));
    expect_error(Fault::bad_input, "'iterations'", refused(R"("iterations":9)"));
    expect_error(Fault::bad_input, "did you mean 'amplitude'?", refused(R"("amplitud":1)"));
}

TEST(FractalRock, RefusesSettingsAndMeshesByName) {
    const auto rock = [](const FractalSettings& settings) {
        return [settings] { fractal_rock(settings, 0); };
    };
    expect_error(Fault::bad_argument, "amplitude is 1.5, must be 0..1", rock({.amplitude = 1.5}));
    expect_error(Fault::bad_argument, "hurst_up is 0", rock({.hurst_up = 0}));
    expect_error(Fault::bad_argument, "hurst_down", rock({.hurst_down = 3}));
    expect_error(Fault::bad_argument, "roundness", rock({.roundness = -1}));
    expect_error(Fault::bad_argument, "corners", rock({.corners = std::nan("")}));
    expect_error(Fault::unsupported, "at most 16777216", rock({.base = 3, .iterations = 4}));
    expect_error(Fault::bad_argument, "must be one of none, interpolating, approximating",
                 [] { damping_from_name("smooth"); });
    expect_error(Fault::bad_argument, "must be one of radius, normal",
                 [] { along_from_name("up"); });
    TriMesh open = cube();
    open.triangles.pop_back();
    expect_error(Fault::bad_input, "give a closed mesh", [&] { FractalRefiner(open, plain(), 0); });
    TriMesh wild = cube();
    wild.triangles[0][0] = 99;
    expect_error(Fault::bad_input, "give a closed mesh", [&] { FractalRefiner(wild, plain(), 0); });
    expect_error(Fault::bad_input, "extent", [] { FractalRefiner(TriMesh{}, plain(), 0); });
}

} // namespace
} // namespace taihu
