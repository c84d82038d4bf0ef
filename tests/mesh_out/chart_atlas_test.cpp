#include "mesh_out/chart_atlas.h"

#include <cmath>
#include <numbers>
#include <set>

#include <gmock/gmock.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "stats/core/rng.h"
#include "tests/support/cube_mesh.h"
#include "tests/support/errors.h"
#include "tests/support/level_sets.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/fractal_rock.h"
#include "vdb_ops/icosphere.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

const std::vector<Sphere> kHoles = {
    {{0.7, 0, 0}, 0.5}, {{0, 0.6, 0}, 0.45}, {{-0.6, -0.3, 0}, 0.5}, {{0, 0.1, 0.1}, 0.4}};

TriMesh with_normals(TriMesh mesh) {
    mesh.normals = averaged_normals(mesh);
    return mesh;
}

/// Holes that meet: tunnels, rims and chambers.
TriMesh holed_ball() {
    const DifferenceField field(std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 1}}),
                                std::make_shared<BallsField>(kHoles));
    const LabelledMesh mesh = extract(*holed_ball_grid(1, 0.08, kHoles), &field);
    return with_normals({mesh.positions, mesh.triangles, {}});
}

TriMesh fractal() {
    return with_normals(fractal_rock({.iterations = 2, .damping = Damping::none}, 5));
}

TriMesh torus() {
    return with_normals(shape_mesh({.kind = ShapeKind::torus, .subdivisions = 4}));
}

/// A ramp that winds up `turns` times about Y: all of it faces up, and one turn lies over another.
TriMesh ramp(double turns) {
    TriMesh mesh;
    const int n = static_cast<int>(24 * turns);
    for (int i = 0; i <= n; ++i) {
        const double a = 2 * std::numbers::pi * i / 24;
        for (const double r : {1.0, 2.0})
            mesh.positions.push_back({r * std::cos(a), 0.2 * a, r * std::sin(a)});
    }
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
        mesh.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
        mesh.triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
    }
    return with_normals(mesh);
}

struct Point {
    double x, y;
};

/// How far `p` is inside of a triangle of either turn, at its nearest side [texels].
double depth(const std::array<Point, 3>& t, const Point& p) {
    double least = 1e300, turn = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const Point &a = t[k], &b = t[(k + 1) % 3], &c = t[(k + 2) % 3];
        const double side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
        turn = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        least = std::min(least, (turn > 0 ? side : -side) / std::hypot(b.x - a.x, b.y - a.y));
    }
    return turn == 0 ? -1 : least;
}

std::array<Point, 3> image_of(const ChartAtlas& atlas, std::size_t face, int side_px) {
    std::array<Point, 3> out{};
    for (std::size_t k = 0; k < 3; ++k) {
        const TexturePoint& t = atlas.textured.texture[atlas.textured.mesh.triangles[face][k]];
        out[k] = {t.u * side_px, (1 - t.v) * side_px};
    }
    return out;
}

/// Every texel whose middle is well inside of a face is so of no other, and not within a gutter of
/// another chart; looked at one by one, without texel_faces().
void expect_texels_of_one_chart(const ChartAtlas& atlas, const AtlasSettings& settings) {
    const int side = settings.side_px;
    std::vector<std::uint32_t> chart(
        static_cast<std::size_t>(side) * static_cast<std::size_t>(side), kNoFace);
    std::size_t n_owned = 0, n_twice = 0, n_near = 0;
    for (std::size_t f = 0; f < atlas.chart_of.size(); ++f) {
        const auto t = image_of(atlas, f, side);
        const auto [x_lo, x_hi] = std::minmax({t[0].x, t[1].x, t[2].x});
        const auto [y_lo, y_hi] = std::minmax({t[0].y, t[1].y, t[2].y});
        for (int y = int(y_lo); y <= int(y_hi); ++y)
            for (int x = int(x_lo); x <= int(x_hi); ++x)
                // Texture points are rounded by up to 1/32 texel, either face's.
                if (depth(t, {x + 0.5, y + 0.5}) > 0.1) {
                    auto& owner = chart[static_cast<std::size_t>(y * side + x)];
                    n_twice += owner != kNoFace;
                    owner = atlas.chart_of[f];
                    ++n_owned;
                }
    }
    const int g = settings.gutter_px;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            if (const auto own = chart[static_cast<std::size_t>(y * side + x)]; own != kNoFace)
                for (int j = std::max(0, y - g); j <= std::min(side - 1, y + g); ++j)
                    for (int i = std::max(0, x - g); i <= std::min(side - 1, x + g); ++i) {
                        const auto other = chart[static_cast<std::size_t>(j * side + i)];
                        n_near += other != kNoFace && other != own;
                    }
    EXPECT_EQ(n_twice, 0u);
    EXPECT_EQ(n_near, 0u);
    EXPECT_GT(n_owned, static_cast<std::size_t>(side * side / 8));
}

void expect_invariants(const TriMesh& mesh, const AtlasSettings& settings) {
    const ChartAtlas atlas = chart_atlas(mesh, settings);
    const TriMesh& cut = atlas.textured.mesh;
    ASSERT_EQ(atlas.chart_of.size(), mesh.triangles.size());
    ASSERT_EQ(cut.triangles.size(), mesh.triangles.size());
    std::vector<std::size_t> n_faces(atlas.charts.size());
    double most_stretch = 0;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
        ASSERT_LT(atlas.chart_of[f], atlas.charts.size());
        ++n_faces[atlas.chart_of[f]];
        for (std::size_t k = 0; k < 3; ++k) {
            ASSERT_EQ(cut.positions[cut.triangles[f][k]], mesh.positions[mesh.triangles[f][k]]);
        }
        // The area of the face over that of its image, from texture points alone.
        const auto t = image_of(atlas, f, settings.side_px);
        const double image_px =
            ((t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[1].y - t[0].y) * (t[2].x - t[0].x)) / 2;
        EXPECT_LE(image_px, 0.1); // all turn one way: y runs downwards, and nothing is mirrored
        const Vec3 &a = cut.positions[cut.triangles[f][0]], &b = cut.positions[cut.triangles[f][1]],
                   &c = cut.positions[cut.triangles[f][2]];
        const double face_px = length(cross(b - a, c - a)) / 2 / (atlas.texel_m * atlas.texel_m);
        if (face_px > 200) // a texel rounded by 1/32 is then 1 % of it
            most_stretch = std::max(most_stretch, face_px / -image_px);
    }
    for (std::size_t c = 0; c < n_faces.size(); ++c) {
        EXPECT_EQ(n_faces[c], atlas.charts[c].n_triangles);
        EXPECT_GT(n_faces[c], 0u);
    }
    EXPECT_LE(most_stretch, settings.merge_stretch * 1.05);
    EXPECT_LE(atlas.most_stretch, settings.merge_stretch * (1 + 1e-9));
    expect_texels_of_one_chart(atlas, settings);
}

AtlasSettings strict(int side_px) {
    return {.side_px = side_px, .merge_stretch = std::numbers::sqrt3};
}

TEST(ChartAtlas, OfABallKeepsItsInvariants) {
    expect_invariants(with_normals(icosphere(4)), strict(512));
}

TEST(ChartAtlas, OfATorusKeepsItsInvariants) {
    expect_invariants(torus(), strict(512));
}

TEST(ChartAtlas, OfAFractalRockKeepsItsInvariants) {
    expect_invariants(fractal(), strict(512));
    expect_invariants(fractal(), {.side_px = 512});
}

TEST(ChartAtlas, OfASolidFullOfHolesKeepsItsInvariants) {
    expect_invariants(holed_ball(), strict(1024));
    expect_invariants(holed_ball(), {.side_px = 1024, .gutter_px = 2});
}

TEST(ChartAtlas, IsClosedOnceEqualPositionsAreWelded) {
    for (const TriMesh& mesh : {holed_ball(), torus(), fractal()}) {
        const Certificate before = certify(mesh, {.self_intersections = false});
        const ChartAtlas atlas = chart_atlas(mesh);
        const Certificate after = certify(atlas.textured.mesh, {.self_intersections = false});
        EXPECT_GT(atlas.textured.mesh.positions.size(), mesh.positions.size());
        EXPECT_TRUE(after.holds());
        EXPECT_EQ(after.genus, before.genus);
        EXPECT_EQ(after.n_vertices, before.n_vertices);
    }
}

TEST(ChartAtlas, OfACubeIsSixSquares) {
    const ChartAtlas atlas = chart_atlas(with_normals(cube()), {.side_px = 256});
    ASSERT_EQ(atlas.charts.size(), 6u);
    std::set<std::array<double, 3>> directions;
    for (const Chart& chart : atlas.charts) {
        directions.insert({chart.direction.x, chart.direction.y, chart.direction.z});
        EXPECT_EQ(chart.width_px, chart.height_px);
    }
    EXPECT_EQ(directions.size(), 6u);
    EXPECT_NEAR(atlas.most_stretch, 1, 1e-12);
    // Nine squares of 256 / 3 texels less their gutters are the most that shelves can hold.
    EXPECT_NEAR(1 / atlas.texel_m, 256 / 3 - 2 * 3 - 0.125, 1);
}

TEST(ChartAtlas, SplitsARampWhereItLiesOverItself) {
    EXPECT_EQ(chart_atlas(ramp(0.9), {.side_px = 256}).charts.size(), 1u);
    const AtlasSettings settings{.side_px = 256};
    for (const double turns : {1.5, 3.0}) {
        const ChartAtlas atlas = chart_atlas(ramp(turns), settings);
        EXPECT_GE(atlas.charts.size(), static_cast<std::size_t>(std::ceil(turns)));
        EXPECT_LE(atlas.charts.size(), static_cast<std::size_t>(2 * turns));
        expect_texels_of_one_chart(atlas, settings);
    }
}

TEST(ChartAtlas, TinyChartsJoinTheirNeighbours) {
    const TriMesh mesh = fractal();
    const ChartAtlas apart = chart_atlas(mesh, {.side_px = 1024, .tiny_area_rel = 0});
    const ChartAtlas joined = chart_atlas(mesh, {.side_px = 1024, .tiny_area_rel = 0.005});
    EXPECT_LE(apart.most_stretch, std::numbers::sqrt3 * (1 + 1e-9));
    EXPECT_EQ(apart.stretched_area_rel, 0);
    EXPECT_LT(joined.charts.size(), 0.7 * static_cast<double>(apart.charts.size()));
    EXPECT_LE(joined.most_stretch, 3);
    EXPECT_LT(joined.stretched_area_rel, 0.1);
}

TEST(ChartAtlas, TangentsRunAlongGrowingU) {
    // Each face with corners and normals of its own, so that tangents are those of the face.
    const TriMesh rock = fractal();
    TriMesh flat;
    for (const Triangle& t : rock.triangles) {
        const auto first = static_cast<std::uint32_t>(flat.positions.size());
        for (const std::uint32_t v : t)
            flat.positions.push_back(rock.positions[v]);
        const Vec3 n = normalized(cross(flat.positions[first + 1] - flat.positions[first],
                                        flat.positions[first + 2] - flat.positions[first]));
        flat.normals.insert(flat.normals.end(), 3, n);
        flat.triangles.push_back({first, first + 1, first + 2});
    }
    flat.triangles.resize(200); // each a chart
    flat.positions.resize(600);
    flat.normals.resize(600);
    const ChartAtlas atlas = chart_atlas(flat, {.side_px = 1024, .tiny_area_rel = 0});
    const TexturedMesh& out = atlas.textured;
    for (std::size_t f = 0; f < 200; ++f) {
        const auto& [a, b, c] = out.mesh.triangles[f];
        // P(u, v) is linear over a face; the step of 1/16 texel is 2 % of edges of 3 texels or
        // more.
        const double u1 = out.texture[b].u - out.texture[a].u,
                     v1 = out.texture[b].v - out.texture[a].v,
                     u2 = out.texture[c].u - out.texture[a].u,
                     v2 = out.texture[c].v - out.texture[a].v;
        const Vec3 e1 = out.mesh.positions[b] - out.mesh.positions[a],
                   e2 = out.mesh.positions[c] - out.mesh.positions[a];
        const double det = u1 * v2 - u2 * v1;
        ASSERT_GT(det, 0); // v upwards: not mirrored
        const Vec3 along_u = normalized((e1 * v2 - e2 * v1) / det),
                   along_v = normalized((e2 * u1 - e1 * u2) / det);
        EXPECT_NEAR(length(out.tangents[a]), 1, 1e-12);
        EXPECT_NEAR(dot(out.tangents[a], out.mesh.normals[a]), 0, 1e-12);
        EXPECT_GT(dot(out.tangents[a], along_u), 0.995);
        EXPECT_GT(dot(cross(out.mesh.normals[a], out.tangents[a]), along_v), 0.5);
    }
}

TEST(ChartAtlas, FillsItsTexture) {
    EXPECT_GT(chart_atlas(with_normals(icosphere(4)), {.side_px = 1024}).used_rel, 0.4);
    EXPECT_GT(chart_atlas(holed_ball(), {.side_px = 1024}).used_rel, 0.35);
}

TEST(ChartAtlas, OfAFoamHasLargeChartsOfDirectionsOfTheirOwn) {
    std::vector<Sphere> bubbles;
    const Rng rng{3, 1};
    for (std::uint64_t i = 0; i < 260; ++i)
        bubbles.push_back(
            {{2 * rng.uniform(i, 0) - 1, 2 * rng.uniform(i, 1) - 1, 2 * rng.uniform(i, 2) - 1},
             0.13 + 0.12 * rng.uniform(i, 3)});
    const DifferenceField field(std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 1}}),
                                std::make_shared<BallsField>(bubbles));
    const LabelledMesh foam = extract(*holed_ball_grid(1, 0.05, bubbles), &field);
    const TriMesh mesh = with_normals({foam.positions, foam.triangles, {}});
    const AtlasSettings settings{.side_px = 2048};
    expect_invariants(mesh, settings);
    const ChartAtlas atlas = chart_atlas(mesh, settings);
    std::size_t n_slanted = 0;
    for (const Chart& chart : atlas.charts)
        n_slanted += std::max({std::fabs(chart.direction.x), std::fabs(chart.direction.y),
                               std::fabs(chart.direction.z)}) < 0.999;
    EXPECT_GT(2 * n_slanted, atlas.charts.size());
    EXPECT_GT(atlas.used_rel, 0.3);
}

TEST(ChartAtlas, NamesWhatItCannotUse) {
    const TriMesh ball = with_normals(icosphere(1));
    const auto refuses = [](const TriMesh& mesh, const AtlasSettings& settings, const char* part) {
        expect_error(Fault::bad_argument, part, [&] { chart_atlas(mesh, settings); });
    };
    refuses(icosphere(1), {}, "has no normals");
    refuses(ball, {.side_px = 63}, "side_px is 63, must be 64..8192");
    refuses(ball, {.gutter_px = 0}, "gutter_px is 0, must be 1..16");
    refuses(ball, {.tiny_area_rel = 0.5}, "tiny_area_rel is 0.5");
    refuses(ball, {.merge_stretch = 1}, "must be sqrt(3)..10");
    TriMesh thin = ball;
    thin.positions[thin.triangles[7][0]] = thin.positions[thin.triangles[7][1]];
    refuses(thin, {}, "has no area; mend the mesh first");
    TriMesh many = ball;
    for (int i = 1; i < 20; ++i)
        append(many, icosphere(1));
    many = with_normals(many);
    expect_error(Fault::numeric, "charts do not fit a texture of 64 x 64 texels; use a larger one",
                 [&] { chart_atlas(many, {.side_px = 64}); });
}

} // namespace
} // namespace taihu
