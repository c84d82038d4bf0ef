#include "mesh_out/bake.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "mesh_out/bump.h"
#include "mesh_out/chart_atlas.h"
#include "mesh_out/grain.h"
#include "mesh_out/io/exr_file.h"
#include "mesh_out/io/image_file.h"
#include "mesh_out/io/mesh_file.h"
#include "stats/core/file.h"
#include "tests/support/cube_mesh.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"
#include "vdb_ops/analytic_field.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/fractal_rock.h"
#include "vdb_ops/icosphere.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/region_relief.h"

namespace taihu {
namespace {

TriMesh ball(int level) {
    TriMesh mesh = icosphere(level);
    mesh.normals = mesh.positions;
    return mesh;
}

/// Each face with corners and normals of its own.
TriMesh flat_shaded(const TriMesh& mesh) {
    TriMesh out;
    for (const Triangle& t : mesh.triangles) {
        const auto first = static_cast<std::uint32_t>(out.positions.size());
        for (const std::uint32_t v : t)
            out.positions.push_back(mesh.positions[v]);
        const Vec3 n = normalized(cross(out.positions[first + 1] - out.positions[first],
                                        out.positions[first + 2] - out.positions[first]));
        out.normals.insert(out.normals.end(), 3, n);
        out.triangles.push_back({first, first + 1, first + 2});
    }
    return out;
}

TexturedMesh textured(const TriMesh& mesh, int side_px) {
    return chart_atlas(mesh, {.side_px = side_px}).textured;
}

constexpr double kBump_m = 0.02, kWaves = 9;

/// A ball of radius 1 with bumps; divided by more than its steepest slope, since a field never
/// tells too much.
double bumpy(const Vec3& p) {
    const double bumps =
        kBump_m * std::sin(kWaves * p.x) * std::sin(kWaves * p.y) * std::sin(kWaves * p.z);
    return (length(p) - 1 - bumps) / 1.25;
}

Vec3 bumpy_normal(const Vec3& p) {
    const double sx = std::sin(kWaves * p.x), sy = std::sin(kWaves * p.y),
                 sz = std::sin(kWaves * p.z), cx = std::cos(kWaves * p.x),
                 cy = std::cos(kWaves * p.y), cz = std::cos(kWaves * p.z);
    return normalized(normalized(p) -
                      Vec3{cx * sy * sz, sx * cy * sz, sx * sy * cz} * (kBump_m * kWaves));
}

const Box kBox{{-1.2, -1.2, -1.2}, {1.2, 1.2, 1.2}};

/// Where the middle of a texel lies on the mesh, or nothing.
std::optional<Vec3> place_of(const TexturedMesh& mesh, const std::vector<std::uint32_t>& faces,
                             int x, int y, int side) {
    const std::uint32_t f = faces[static_cast<std::size_t>(y * side + x)];
    if (f == kNoFace)
        return std::nullopt;
    const auto w = texture_weights(mesh, f, x + 0.5, y + 0.5, side);
    Vec3 p;
    for (std::size_t k = 0; k < 3; ++k)
        p += mesh.mesh.positions[mesh.mesh.triangles[f][k]] * w[k];
    return p;
}

Vec3 pixel(const Image& image, int x, int y) {
    const float* v = image.at(x, y);
    return {v[0], v[1], v[2]};
}

TEST(SeedRow, D10AFlatPairBakesToStraightNormalsAndNoDisplacement) {
    const TexturedMesh low = textured(flat_shaded(cube()), 128);
    const AnalyticField field(Box{{-1, -1, -1}, {1, 1, 1}}, [](const Vec3& p) {
        return box_distance(p, {0.5, 0.5, 0.5});
    });
    const BakeSource fine(field, flat_shaded(cube()),
                          {.voxel_m = 0.02, .reach_m = 0.1, .n_rays = 16});
    const BakedMaps maps = bake(low, fine, {.reach_m = 0.1, .side_px = 128});
    for (int y = 0; y < 128; ++y)
        for (int x = 0; x < 128; ++x) {
            const Vec3 n = pixel(maps.normal, x, y);
            ASSERT_NEAR(length(n - Vec3{0, 0, 1}), 0, 1e-5) << x << ' ' << y; // differences of 1e-9
            ASSERT_NEAR(*maps.displacement.at(x, y), 0, 1e-6);
            ASSERT_NEAR(*maps.occlusion.at(x, y), 1, 1e-6); // weights that sum to nearly 1
        }
    EXPECT_EQ(maps.n_nearest, 0u);
    const Scratch folder;
    write_file(folder / "normal.png", normal_png(maps));
    const Image back = read_png(folder / "normal.png", PngValues::data);
    EXPECT_EQ(std::lround(255 * back.at(64, 64)[0]), 128);
    EXPECT_EQ(std::lround(255 * back.at(64, 64)[1]), 128);
    EXPECT_EQ(std::lround(255 * back.at(64, 64)[2]), 255);
}

TEST(Bake, OfABumpedBallHasItsAnalyticNormalsAndLeadsOntoIt) {
    const int side = 256;
    const TexturedMesh low = textured(ball(4), side);
    const AnalyticField field(kBox, bumpy);
    const BakeSource fine(field, ball(5), {.voxel_m = 0.01, .reach_m = 0.06, .n_rays = 4});
    const BakedMaps maps = bake(low, fine, {.reach_m = 0.06, .side_px = side});
    const auto faces = texel_faces(low, side);
    double worst_deg = 0, worst_m = 0;
    std::size_t n = 0;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            if (const auto p = place_of(low, faces, x, y, side)) {
                // Normals of a face of the ball are those of its corners, mixed: along p but for
                // the square of a small angle.
                const Vec3 q = *p + normalized(*p) * double{*maps.displacement.at(x, y)};
                worst_m = std::max(worst_m, std::fabs(bumpy(q)));
                const Vec3 truth = bumpy_normal(q), got = pixel(maps.object_normal, x, y);
                worst_deg = std::max(worst_deg, std::acos(std::min(1.0, dot(truth, got))) * 180 /
                                                    std::numbers::pi);
                ++n;
            }
    EXPECT_EQ(n, maps.n_texels);
    EXPECT_GT(n, 20000u);
    EXPECT_EQ(maps.n_nearest, 0u);
    EXPECT_LT(worst_deg, 0.5); // floats near 1, and q aside of the true place by under 1e-3
    EXPECT_LT(worst_m, 1e-4);
    EXPECT_NEAR(maps.most_displacement_m, kBump_m, 0.3 * kBump_m);
}

TEST(Bake, NormalsOfTheTextureGiveThoseOfTheMeshBack) {
    const int side = 256;
    const TexturedMesh low = textured(ball(2), side);
    const AnalyticField field(kBox, bumpy);
    const BakeSource fine(field, ball(4), {.voxel_m = 0.01, .reach_m = 0.12, .n_rays = 4});
    const BakedMaps maps = bake(low, fine, {.reach_m = 0.12, .side_px = side});
    const auto faces = texel_faces(low, side);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const std::uint32_t f = faces[static_cast<std::size_t>(y * side + x)];
            if (f == kNoFace)
                continue;
            // As shaders do: corners' frames mixed, each axis then of length 1.
            const auto w = texture_weights(low, f, x + 0.5, y + 0.5, side);
            Vec3 n, t, b;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t i = low.mesh.triangles[f][k];
                n += low.mesh.normals[i] * w[k];
                t += low.tangents[i] * w[k];
                b += cross(low.mesh.normals[i], low.tangents[i]) * w[k];
            }
            const Vec3 m = pixel(maps.normal, x, y);
            const Vec3 lit =
                normalized(normalized(t) * m.x + normalized(b) * m.y + normalized(n) * m.z);
            ASSERT_GT(dot(lit, pixel(maps.object_normal, x, y)), 1 - 1e-6); // floats
        }
}

TEST(Bake, CurvatureAndOcclusionAreThoseOfTheSolid) {
    const std::vector<Sphere> holes = {{{0, 0, 1}, 0.6}};
    const DifferenceField field(std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 1}}),
                                std::make_shared<BallsField>(holes));
    // A coarse mesh of its own: the ball with those inside of the hole moved onto that.
    TriMesh mesh = ball(5);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        if (const Vec3 to = mesh.positions[i] - holes[0].center; length(to) < 0.6) {
            const double a = length(to) / 0.6 * std::numbers::pi / 2;
            const Vec3 flat = normalized({to.x, to.y, 0});
            const Vec3 d = flat * std::sin(a) - Vec3{0, 0, std::cos(a)};
            mesh.positions[i] = holes[0].center + d * 0.6;
            mesh.normals[i] = -d;
        }
    const int side = 256;
    const TexturedMesh low = textured(mesh, side);
    const BakeSource fine(field, mesh, {.voxel_m = 0.02, .reach_m = 0.05, .n_rays = 64});
    const BakedMaps maps = bake(low, fine, {.reach_m = 0.05, .side_px = side});
    const auto faces = texel_faces(low, side);
    std::size_t n_ball = 0, n_hole = 0;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            if (const auto p = place_of(low, faces, x, y, side)) {
                const double from_rim = std::fabs(length(*p - holes[0].center) - 0.6);
                const double h = *maps.curvature.at(x, y), o = *maps.occlusion.at(x, y);
                if (p->z < 0) {              // the far side of the ball
                    ASSERT_NEAR(h, 1, 0.02); // differences of 0.02: (h / r)^2, and floats
                    ASSERT_GT(o, 0.95);
                    ASSERT_EQ(*maps.part.at(x, y), 0);
                    ++n_ball;
                } else if (from_rim < 0.01 && length(*p) < 0.8) { // in the hole
                    ASSERT_NEAR(h, -1 / 0.6, 0.05);
                    ASSERT_LT(o, 0.8);
                    ASSERT_EQ(*maps.part.at(x, y), 1);
                    ++n_hole;
                }
            }
    EXPECT_GT(n_ball, 5000u);
    EXPECT_GT(n_hole, 500u);
}

TEST(SeedRow, D10ALowModelOfAFractalRockRelitByItsMapLooksLikeTheHighOne) {
    const FractalSettings settings{.damping = Damping::none};
    const FractalRefiner refiner(fractal_base(settings, 3), settings, 3);
    TriMesh low = refiner.iterate(refiner.start(fractal_base(settings, 3)), 2);
    const TriMesh high = refiner.iterate(low, 2);
    low.normals = averaged_normals(low);
    TriMesh surface = high;
    surface.normals = averaged_normals(high);
    const MeshField field(close_mesh(high, "high"));
    const int side = 512;
    const TexturedMesh coarse = textured(low, side);
    const BakeSource fine(
        field, surface,
        {.voxel_m = 0.01, .reach_m = 0.15, .n_rays = 1, .normals = NormalsOf::surface});
    const BakedMaps maps = bake(coarse, fine, {.reach_m = 0.15, .side_px = side, .masters = false});
    const RelitError error = relit_error(coarse, fine, maps, 0.15);
    EXPECT_GT(error.n_samples, 20000u);
    EXPECT_LT(error.mean_deg, 5); // the row's bound
    EXPECT_GT(error.plain_mean_deg, 2 * error.mean_deg);
    RecordProperty("mean_deg", std::to_string(error.mean_deg));
    RecordProperty("plain_mean_deg", std::to_string(error.plain_mean_deg));
}

TEST(SeedRow, T16BumpsLeaveTheSilhouetteOfABallAndDisplacementDoesNot) {
    const TriMesh plain = ball(5);
    for (const RegionLaw law : {RegionLaw::convex, RegionLaw::concave}) {
        const RegionPlane plane{
            .size_px = 256, .pixel_m = 1.0 / 256, .n_regions = 40, .tileable = true, .seed = 4};
        const Image heights = region_relief(plane, {.law = law}).heights;
        TriMesh bumped = plain, displaced = plain;
        bumped.normals =
            bumped_normals(plain, bump_offsets(heights, MapBorder::wrap), bounds(plain), 64, 2);
        const auto places = texture_coordinates(plain, TextureMap::spherical, bounds(plain));
        for (std::size_t f = 0; f < plain.triangles.size(); ++f)
            for (std::size_t k = 0; k < 3; ++k) {
                const auto [u, v] = places.corners[f][k];
                const int x = int(u * 512) % 256, y = int((1 - v) * 511) % 256;
                const std::uint32_t i = plain.triangles[f][k];
                displaced.positions[i] = plain.positions[i] * (1 + *heights.at(x, y));
            }
        const auto stored = [](const TriMesh& mesh) {
            return parse_mesh(format_mesh(mesh, MeshFormat::glb), MeshFormat::glb, "ball")
                .levels.front();
        };
        EXPECT_EQ(stored(bumped).positions, stored(plain).positions);
        EXPECT_NE(stored(displaced).positions, stored(plain).positions);
        // The outline as seen along Z: how far out it is, by angle.
        const auto outline = [](const TriMesh& mesh) {
            std::vector<double> far(36);
            for (const Vec3& p : mesh.positions) {
                const double turn = std::atan2(p.y, p.x) / (2 * std::numbers::pi) + 0.5;
                double& r = far[static_cast<std::size_t>(turn * 36) % 36];
                r = std::max(r, std::hypot(p.x, p.y));
            }
            const auto [lo, hi] = std::minmax_element(far.begin(), far.end());
            return *hi - *lo;
        };
        EXPECT_LT(outline(bumped), 0.01); // of an icosphere's own corners
        EXPECT_GT(outline(displaced), 0.02);
        double lean_deg = 0;
        for (std::size_t i = 0; i < plain.normals.size(); ++i)
            lean_deg += std::acos(std::min(1.0, dot(plain.normals[i], bumped.normals[i]))) * 180 /
                        std::numbers::pi / static_cast<double>(plain.normals.size());
        EXPECT_GT(lean_deg, 5); // and yet it shows
    }
}

TEST(SeedRow, D14GrainsAreABaseColourUnderTheNormalMap) {
    const int side = 128;
    const TexturedMesh low = textured(ball(3), side);
    const AnalyticField field(kBox, bumpy);
    const BakeSource fine(field, ball(4), {.voxel_m = 0.01, .reach_m = 0.06, .n_rays = 1});
    const BakedMaps maps =
        bake(low, fine, {.reach_m = 0.06, .side_px = side, .grain_m = 0.2, .grain_contrast = 0.5});
    const auto faces = texel_faces(low, side);
    std::size_t n_same = 0, n = 0;
    float least = 1, most = 0;
    for (int y = 0; y < side; ++y)
        for (int x = 1; x < side; ++x)
            if (faces[static_cast<std::size_t>(y * side + x)] != kNoFace &&
                faces[static_cast<std::size_t>(y * side + x - 1)] != kNoFace) {
                n_same += *maps.colour.at(x, y) == *maps.colour.at(x - 1, y);
                least = std::min(least, *maps.colour.at(x, y));
                most = std::max(most, *maps.colour.at(x, y));
                ++n;
            }
    EXPECT_GT(n_same, 0.6 * static_cast<double>(n)); // grains of some six texels
    EXPECT_LT(n_same, 0.95 * static_cast<double>(n));
    EXPECT_NEAR(least, 0.5, 0.02); // hundreds of grains, evenly between
    EXPECT_NEAR(most, 1, 0.02);
    const Scratch folder;
    write_file(folder / "colour.png", colour_png(maps));
    const Image back = read_png(folder / "colour.png");
    for (std::size_t i = 0; i < back.pixels.size(); ++i)
        ASSERT_NEAR(back.pixels[i], maps.colour.pixels[i], 0.005); // a step of sRGB at white
}

TEST(Grain, HasOneNumberAndNoSeamAcrossCubes) {
    const double size_m = 0.1;
    std::size_t n_changes = 0;
    double sum = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3 p{i * 1e-3 - 10, 0.3, -0.2};
        sum += grain(p, size_m) / 20000;
        n_changes += grain(p, size_m) != grain(p + Vec3{1e-3, 0, 0}, size_m);
    }
    EXPECT_NEAR(sum, 0.5, 0.1); // some 280 grains along the line: 5 standard errors
    // Cells of a Poisson process of one point a cube are passed 1.455 times a length of a cube;
    // points in cubes are more regular.
    EXPECT_NEAR(static_cast<double>(n_changes) / 200, 1.4, 0.15);
    EXPECT_NE(grain({1, 2, 3}, size_m, 1), grain({1, 2, 3}, size_m, 2));
}

TEST(Bake, GutterContinuesTheChart) {
    const int side = 128;
    const TexturedMesh low = textured(ball(3), side);
    const AnalyticField field(kBox, [](const Vec3& p) { return length(p) - 1; });
    const BakeSource fine(field, ball(4), {.voxel_m = 0.02, .reach_m = 0.05, .n_rays = 1});
    const auto texels_off = [&](int gutter_px) { // where the map is not what is beyond the gutter
        const BakedMaps maps =
            bake(low, fine, {.reach_m = 0.05, .side_px = side, .gutter_px = gutter_px});
        std::size_t n = 0;
        for (std::size_t i = 0; i < maps.displacement.pixels.size(); ++i)
            n += maps.displacement.pixels[i] != 0;
        return n;
    };
    const auto faces = texel_faces(low, side);
    const auto n_owned = static_cast<std::size_t>(
        std::count_if(faces.begin(), faces.end(), [](std::uint32_t f) { return f != kNoFace; }));
    std::size_t n_within = 0; // two texels of an owned one, along either axis or across
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            bool near = false;
            for (int j = std::max(0, y - 2); j <= std::min(side - 1, y + 2); ++j)
                for (int i = std::max(0, x - 2); i <= std::min(side - 1, x + 2); ++i)
                    near |= faces[static_cast<std::size_t>(j * side + i)] != kNoFace;
            n_within += near;
        }
    EXPECT_EQ(texels_off(0), n_owned);
    EXPECT_EQ(texels_off(2), n_within);
}

TEST(Bake, WhatIsBeyondTheCageIsTakenFromTheNearestPlace) {
    TriMesh off = ball(3);
    for (Vec3& p : off.positions)
        p *= 1.1;
    const TexturedMesh low = textured(off, 128);
    const AnalyticField field(kBox, [](const Vec3& p) { return length(p) - 1; });
    const BakeSource fine(field, ball(5), {.voxel_m = 0.02, .reach_m = 0.3, .n_rays = 1});
    const BakedMaps met = bake(low, fine, {.reach_m = 0.2, .side_px = 128});
    EXPECT_EQ(met.n_nearest, 0u);
    EXPECT_NEAR(met.rms_displacement_m, 0.1, 0.01); // faces of a coarse ball lie below it
    const BakedMaps missed = bake(low, fine, {.reach_m = 0.02, .side_px = 128});
    EXPECT_EQ(missed.n_nearest, missed.n_texels);
    EXPECT_NEAR(missed.rms_displacement_m, met.rms_displacement_m, 0.005);
}

TEST(Bake, IsTheSameOnAnyNumberOfThreads) {
    const TexturedMesh low = textured(ball(3), 128);
    const AnalyticField field(kBox, bumpy);
    const auto all = [&] {
        const BakeSource fine(field, ball(4), {.voxel_m = 0.01, .reach_m = 0.06, .n_rays = 8});
        const BakedMaps maps = bake(low, fine, {.reach_m = 0.06, .side_px = 128});
        return std::tuple(maps.normal.pixels, maps.displacement.pixels, maps.occlusion.pixels,
                          maps.curvature.pixels, maps.rms_displacement_m,
                          relit_error(low, fine, maps, 0.06).mean_deg);
    };
    const auto many = all();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(all(), many);
}

TEST(Bake, MapsComeBackFromTheirFiles) {
    const TexturedMesh low = textured(ball(3), 64);
    const AnalyticField field(kBox, bumpy);
    const BakeSource fine(field, ball(4), {.voxel_m = 0.01, .reach_m = 0.06, .n_rays = 8});
    const BakedMaps maps = bake(low, fine, {.reach_m = 0.06, .side_px = 64});
    const Scratch folder;
    write_maps(folder.path(), "level0", maps);
    const ExrImage displacement = read_exr(folder / "level0_displacement.exr");
    EXPECT_EQ(displacement.image.pixels, maps.displacement.pixels);
    EXPECT_THAT(displacement.attributes, testing::Contains(testing::Pair("unit", "m")));
    EXPECT_EQ(read_exr(folder / "level0_curvature.exr").image.pixels, maps.curvature.pixels);
    const std::vector<std::string> part = {"part"}, rgb = {"R", "G", "B"};
    EXPECT_EQ(read_exr(folder / "level0_part.exr", part).image.pixels, maps.part.pixels);
    for (const auto& [name, image] : {std::pair("level0_normal.exr", &maps.normal),
                                      std::pair("level0_object_normal.exr", &maps.object_normal)}) {
        const ExrImage back = read_exr(folder / name, rgb);
        for (std::size_t i = 0; i < image->pixels.size(); ++i)
            ASSERT_NEAR(back.image.pixels[i], image->pixels[i], 2.5e-4); // half of 2^-11
    }
    // PNG: half a step of 8 bits.
    write_file(folder / "normal.png", normal_png(maps));
    const Image png = read_png(folder / "normal.png", PngValues::data);
    for (std::size_t i = 0; i < png.pixels.size(); ++i)
        ASSERT_NEAR(png.pixels[i], (maps.normal.pixels[i] + 1) / 2, 0.5001 / 255);
    write_file(folder / "occlusion.png", occlusion_png(maps));
    const Image grey = read_png(folder / "occlusion.png", PngValues::data);
    EXPECT_EQ(grey.channels, 1);
    for (std::size_t i = 0; i < grey.pixels.size(); ++i)
        ASSERT_NEAR(grey.pixels[i], maps.occlusion.pixels[i], 0.5001 / 255);
}

TEST(Bake, NamesWhatItCannotUse) {
    const TexturedMesh low = textured(ball(1), 64);
    const AnalyticField field(kBox, bumpy);
    const BakeSource fine(field, ball(1), {.voxel_m = 0.01, .reach_m = 0.06, .n_rays = 1});
    const auto refuses = [&](const TexturedMesh& mesh, const BakeSettings& settings,
                             const char* part) {
        expect_error(Fault::bad_argument, part, [&] { bake(mesh, fine, settings); });
    };
    refuses(low, {.reach_m = 0}, "reach_m is 0.000000, must be > 0");
    refuses(low, {.reach_m = 0.07}, "at most that of the fine surface, 0.06");
    refuses(low, {.reach_m = 0.06, .side_px = 8193}, "side_px is 8193, must be 1..8192");
    refuses(low, {.reach_m = 0.06, .gutter_px = 17}, "gutter_px is 17, must be 0..16");
    TexturedMesh bare = low;
    bare.tangents.clear();
    refuses(bare, {.reach_m = 0.06}, "needs a normal and a tangent");
    TexturedMesh outside = low;
    outside.texture[3].u = 1.5;
    refuses(outside, {.reach_m = 0.06}, "texture[3] is 1.5");
    expect_error(Fault::bad_argument, "voxel_m is 0.000000",
                 [&] { const BakeSource none(field, ball(1), {.reach_m = 0.06}); });
    expect_error(Fault::bad_argument, "the fine surface has no normals", [&] {
        const BakeSource none(field, icosphere(1), {.voxel_m = 0.01, .reach_m = 0.06});
    });
    refuses(low, {.reach_m = 0.06, .grain_m = -1}, "grain_m is -1.000000, must be finite and >= 0");
    refuses(low, {.reach_m = 0.06, .grain_contrast = 2},
            "grain_contrast is 2.000000, must be 0..1");
    const BakedMaps maps = bake(low, fine, {.reach_m = 0.06, .side_px = 64, .masters = false});
    expect_error(Fault::bad_argument, "baked without masters",
                 [&] { write_maps("nowhere", "level0", maps); });
}

} // namespace
} // namespace taihu
