#include "mesh_out/lod.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "mesh_out/extract.h"
#include "mesh_out/io/mesh_file.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "tests/support/level_sets.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using testing::HasSubstr;

constexpr double kVoxel = 0.05;
const std::vector<Sphere> kHoles = {
    {{0.7, 0, 0}, 0.5}, {{0, 0.6, 0}, 0.45}, {{-0.6, -0.3, 0}, 0.5}, {{0, 0.1, 0.1}, 0.4}};
const LodSettings kSettings{.levels = bounds_by_factor(4, 0.25 * kVoxel, 1.6)};

openvdb::FloatGrid::Ptr holed_rock() {
    return holed_ball_grid(1, kVoxel, kHoles);
}

const DifferenceField& holed_field() {
    static const DifferenceField field(
        std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 1}}),
        std::make_shared<BallsField>(kHoles));
    return field;
}

const LodChain& rock_chain() {
    static const LodChain chain = make_lods(*holed_rock(), &holed_field(), kSettings);
    return chain;
}

/// How far a point is from the surface of the rock: that of a ball without four others.
double off_rock(const Vec3& p) {
    double value = length(p) - 1;
    for (const Sphere& hole : kHoles)
        value = std::max(value, hole.radius_m - length(p - hole.center));
    return std::fabs(value);
}

TEST(Lod, EveryLevelKeepsItsBoundAsDecoded) {
    ASSERT_EQ(rock_chain().levels.size(), 4u) << rock_chain().note;
    for (std::size_t j = 0; j < 4; ++j) {
        const LodLevel& level = rock_chain().levels[j];
        EXPECT_DOUBLE_EQ(level.bound_m, kSettings.levels[j].bound_m);
        EXPECT_LE(level.error_m, level.bound_m);
        EXPECT_GT(level.rms_m, 0);
        EXPECT_LE(level.unresolved.size(), 20u); // fins where holes meet
        const TriMesh again = decode_draco(level.encoded.draco, "level");
        std::size_t n_apart = 0;
        for (const Triangle& t : again.triangles) { // the value is at most the distance
            const Vec3 middle =
                (again.positions[t[0]] + again.positions[t[1]] + again.positions[t[2]]) / 3;
            const bool is_apart = std::any_of(
                level.unresolved.begin(), level.unresolved.end(), [&](const UnresolvedPlace& u) {
                    return length(middle - u.center) <= u.radius_m + level.bound_m;
                });
            n_apart += is_apart;
            if (!is_apart) {
                ASSERT_LE(off_rock(middle), level.bound_m);
            }
        }
        EXPECT_LE(n_apart, again.triangles.size() / 3);
    }
}

TEST(Lod, HasNoSelfIntersections) {
    for (const LodLevel& level : rock_chain().levels)
        EXPECT_EQ(level.certificate.n_self_intersections, 0u);
}

TEST(Lod, VerticesLieOnSharpRims) {
    // The curve in which the first hole leaves the ball: x and the distance from the axis.
    const double x = (0.7 * 0.7 + 1 - 0.5 * 0.5) / (2 * 0.7), r = std::sqrt(1 - x * x);
    const SurfaceDistance to_mesh(rock_chain().levels[0].encoded.decoded);
    for (int i = 0; i < 64; ++i) {
        const double a = 2 * std::numbers::pi * i / 64;
        const Vec3 on_rim{x, r * std::cos(a), r * std::sin(a)};
        if (off_rock(on_rim) < 1e-9) {
            EXPECT_LE(to_mesh(on_rim), rock_chain().levels[0].bound_m);
        }
    }
}

TEST(Lod, ReachesNumbersOfTriangles) {
    const LodChain chain =
        make_lods(*holed_rock(), &holed_field(), {.levels = {{0, 3000}, {0, 1500}, {0, 1000}}});
    ASSERT_EQ(chain.levels.size(), 3u) << chain.note;
    const std::size_t wanted[] = {3000, 1500, 1000};
    for (std::size_t j = 0; j < 3; ++j) {
        const std::size_t n = chain.levels[j].certificate.n_triangles;
        EXPECT_LE(n, wanted[j]);
        EXPECT_GE(double(n), 0.98 * double(wanted[j]));
        EXPECT_LE(chain.levels[j].error_m, chain.levels[j].bound_m);
    }
}

TEST(Lod, SaysWhichNumberOfTrianglesIsTooSmall) {
    const LodChain chain =
        make_lods(*holed_rock(), &holed_field(), {.levels = {{0, 3000}, {0, 5}}});
    EXPECT_EQ(chain.levels.size(), 1u);
    EXPECT_THAT(chain.note, HasSubstr("1 of 2 levels: simplify: 5 triangles are too few"));
    EXPECT_THAT(chain.note, HasSubstr("the fewest found are"));
}

TEST(Lod, TakesALevelSetForItsOwnField) {
    const LodChain chain = make_lods(*holed_rock(), nullptr, kSettings);
    ASSERT_EQ(chain.levels.size(), 4u) << chain.note;
    for (const LodLevel& level : chain.levels)
        EXPECT_LE(level.error_m, level.bound_m);
}

TEST(Lod, EveryLevelIsCertifiedAndSmallerThanTheOneBefore) {
    std::size_t previous = rock_chain().n_reference_triangles;
    for (const LodLevel& level : rock_chain().levels) {
        EXPECT_TRUE(level.certificate.holds());
        EXPECT_EQ(level.certificate.genus, rock_chain().levels[0].certificate.genus);
        EXPECT_EQ(level.holes_closed, 0);
        EXPECT_LT(level.certificate.n_triangles, previous);
        previous = level.certificate.n_triangles;
    }
}

TEST(Lod, GridsNest) {
    const std::vector<LodLevel>& levels = rock_chain().levels;
    double coarsest_m = 0;
    for (const LodLevel& level : levels)
        coarsest_m = std::max(coarsest_m, level.grid.step_m);
    for (std::size_t j = 0; j < levels.size(); ++j) {
        EXPECT_EQ(std::fmod(coarsest_m, levels[j].grid.step_m), 0);
        for (int k = 0; k < 3; ++k)
            EXPECT_EQ(std::fmod(levels[j].grid.origin[k], coarsest_m), 0);
    }
}

TEST(Lod, NormalsAreTheFields) {
    for (const LodLevel& level : rock_chain().levels) {
        const TriMesh& mesh = level.encoded.decoded;
        ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
        std::size_t n_off = 0;
        for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
            const Vec3& p = mesh.positions[i];
            std::vector<Vec3> sides; // of the spheres that it is near to
            if (std::fabs(length(p) - 1) < 1.5 * level.bound_m)
                sides.push_back(normalized(p));
            for (const Sphere& hole : kHoles)
                if (std::fabs(length(p - hole.center) - hole.radius_m) < 1.5 * level.bound_m)
                    sides.push_back(normalized(hole.center - p));
            // 10 bits are at most about 0.3 degrees off, and rounding moves the point.
            if (sides.size() == 1) {
                n_off += !(dot(mesh.normals[i], sides[0]) > 0.999);
            }
        }
        // Some lie on the edge of a fin, and the other side is just too far to be counted.
        EXPECT_LE(n_off, mesh.normals.size() / 200);
    }
}

TEST(Lod, OpennessIsLeftOutWhenAskedTo) {
    LodSettings plain{.levels = {{0.5 * kVoxel, 0}}, .openness = false};
    const auto ball = ball_grid(0.5, kVoxel);
    EXPECT_TRUE(make_lods(*ball, nullptr, plain).levels[0].encoded.decoded.openness.empty());
    plain.openness = true;
    EXPECT_FALSE(make_lods(*ball, nullptr, plain).levels[0].encoded.decoded.openness.empty());
}

TEST(Lod, IsByteIdenticalOnOneThreadAndMany) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const LodChain one = make_lods(*holed_rock(), &holed_field(), kSettings);
    EXPECT_EQ(format_glb(one), format_glb(rock_chain()));
    EXPECT_EQ(format_report(one, "a.glb"), format_report(rock_chain(), "a.glb"));
}

TEST(Lod, ReportHoldsWhatWasMeasured) {
    const auto report = nlohmann::json::parse(format_report(rock_chain(), "a.glb"));
    EXPECT_EQ(report.at("n_reference_triangles"), rock_chain().n_reference_triangles);
    EXPECT_EQ(report.at("file"), "a.glb");
    EXPECT_EQ(report.at("note"), "");
    EXPECT_THAT(report.at("reference").get<std::string>(), HasSubstr("surface of the field"));
    ASSERT_EQ(report.at("levels").size(), 4u);
    double previous = 2;
    for (std::size_t j = 0; j < 4; ++j) {
        const auto& level = report.at("levels")[j];
        const LodLevel& truth = rock_chain().levels[j];
        EXPECT_EQ(level.at("triangles"), truth.certificate.n_triangles);
        EXPECT_EQ(level.at("bytes"), truth.encoded.draco.size());
        EXPECT_EQ(level.at("error_m"), truth.error_m);
        EXPECT_EQ(level.at("bound_m"), truth.bound_m);
        EXPECT_EQ(level.at("rms_m"), truth.rms_m);
        EXPECT_EQ(level.at("genus"), truth.certificate.genus);
        EXPECT_EQ(level.at("holes_closed"), 0);
        EXPECT_LT(level.at("screen_coverage").get<double>(), previous);
        previous = level.at("screen_coverage");
    }
    EXPECT_GT(previous, 0);
    EXPECT_LE(previous, 1e-4);
}

TEST(Lod, ScreenCoverageIsWhereTheNextLevelsErrorIsAPixel) {
    LodChain chain; // a box of 2 x 1 m, seen where 1 cm is a pixel: 200 x 100 pixels
    chain.levels.resize(2);
    chain.levels[0].certificate.box = {{0, 0, 0}, {2, 1, 0.5}};
    chain.levels[1].certificate.box = {{0, 0, 0}, {2, 1, 0.5}};
    chain.levels[1].error_m = 0.01;
    const auto report = nlohmann::json::parse(format_report(chain, "rock.glb"));
    EXPECT_NEAR(report["levels"][0]["screen_coverage"].get<double>(), 200.0 * 100 / (1920.0 * 1080),
                1e-12); // rounding
}

TEST(Lod, GlbHoldsAllLevels) {
    const MeshFile file = parse_mesh(format_glb(rock_chain()), MeshFormat::glb, "rock.glb");
    ASSERT_EQ(file.levels.size(), 4u);
    EXPECT_TRUE(file.draco);
    for (std::size_t j = 0; j < 4; ++j)
        EXPECT_EQ(file.levels[j].triangles.size(),
                  rock_chain().levels[j].encoded.decoded.triangles.size());
    ASSERT_EQ(file.coverages.size(), 4u);
}

TEST(Lod, StopsWhereNothingIsLeftToSimplifyAndSaysSo) {
    const LodChain chain =
        make_lods(*ball_grid(0.3, 0.1), nullptr, {.levels = bounds_by_factor(8, 0.02, 1.0001)});
    EXPECT_LT(chain.levels.size(), 8u);
    EXPECT_THAT(chain.note, HasSubstr("of 8 levels"));
}

TEST(Lod, SurvivesBoundsLargerThanTheRock) {
    const LodChain chain =
        make_lods(*holed_rock(), &holed_field(), {.levels = bounds_by_factor(3, 0.5, 100)});
    for (const LodLevel& level : chain.levels) {
        EXPECT_TRUE(level.certificate.holds());
        EXPECT_LE(level.error_m, level.bound_m);
    }
}

/// A ball with more small holes than matter between them.
struct Sponge {
    std::vector<Sphere> holes;
    DifferenceField field;
    openvdb::FloatGrid::Ptr grid;

    Sponge()
        : holes(made()), field(std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 0.8}}),
                               std::make_shared<BallsField>(holes)),
          grid(clean(*rasterize(field, {kVoxel, {}, 3})).solid) {}
    static std::vector<Sphere> made() {
        const Rng rng{.seed = 3, .stream = 1};
        std::vector<Sphere> holes;
        for (std::uint64_t i = 0; i < 130; ++i)
            holes.push_back({Vec3{rng.uniform(i, 0), rng.uniform(i, 1), rng.uniform(i, 2)} * 1.6 -
                                 Vec3{1, 1, 1} * 0.8,
                             (2 + 2.5 * rng.uniform(i, 3)) * kVoxel});
        return holes;
    }
};

const Sponge& sponge() {
    static const Sponge sponge;
    return sponge;
}

const LodChain& sponge_chain() {
    static const LodChain chain = make_lods(*sponge().grid, &sponge().field,
                                            {.levels = bounds_by_factor(4, 0.5 * kVoxel, 2)});
    return chain;
}

TEST(Lod, SpongesShrinkFromLevelToLevel) {
    ASSERT_EQ(sponge_chain().levels.size(), 4u) << sponge_chain().note;
    std::size_t previous = 0;
    for (const LodLevel& level : sponge_chain().levels) {
        EXPECT_TRUE(level.certificate.holds());
        EXPECT_EQ(level.certificate.n_self_intersections, 0u);
        EXPECT_LE(level.error_m, level.bound_m);
        EXPECT_GE(double(previous), 1.6 * double(previous > 0 ? level.certificate.n_triangles : 0));
        previous = level.certificate.n_triangles;
    }
}

TEST(Lod, HolesOfSpongesCloseAndAreNamed) {
    const LodLevel &first = sponge_chain().levels.front(), &last = sponge_chain().levels.back();
    EXPECT_TRUE(first.closed.empty());
    EXPECT_FALSE(last.closed.empty());
    EXPECT_LT(last.certificate.genus, first.certificate.genus);
    EXPECT_EQ(last.holes_closed, first.certificate.genus - last.certificate.genus);
    const auto report = nlohmann::json::parse(format_report(sponge_chain(), "a.glb"));
    const auto& closed = report.at("levels")[3].at("closed");
    EXPECT_EQ(closed.at("n"), last.closed.size());
    EXPECT_EQ(closed.at("genus_before"), first.certificate.genus);
    EXPECT_EQ(closed.at("components_before"), first.certificate.n_components);
    EXPECT_EQ(closed.at("largest").size(), std::min<std::size_t>(100, last.closed.size()));
    double before = closed.at("largest")[0].at("diameter_m");
    for (const auto& hole : closed.at("largest")) {
        EXPECT_LE(hole.at("diameter_m").get<double>(), before);
        before = hole.at("diameter_m");
        EXPECT_GT(before, 0);
    }
}

TEST(Lod, SpongesKeepTheirBoundsButForWhatIsNamed) {
    // Points of the sharp surface, and how far each level is from them.
    const LabelledMesh fine = extract(*sponge().grid, &sponge().field, {.bound_vox = 0.05});
    for (const LodLevel& level : sponge_chain().levels) {
        const SurfaceDistance to_level(level.encoded.decoded);
        std::size_t n_named = 0;
        for (const Vec3& p : fine.positions) {
            if (to_level(p) <= level.bound_m)
                continue;
            ++n_named;
            const auto near = [&](const Vec3& center, double radius_m) {
                return length(p - center) <= radius_m + level.bound_m;
            };
            bool is_named = false;
            for (const Sphere& s : level.closed)
                is_named = is_named || near(s.center, s.radius_m);
            for (const UnresolvedPlace& u : level.unresolved)
                is_named = is_named || near(u.center, u.radius_m);
            ASSERT_TRUE(is_named);
        }
        // Most of it is outside of holes that close.
        EXPECT_LE(n_named, fine.positions.size() / 4);
    }
}

void expect_refused(const LodSettings& settings, Fault fault, const char* text) {
    try {
        make_lods(*ball_grid(0.5, 0.1), nullptr, settings);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault);
        EXPECT_THAT(e.what(), HasSubstr(text));
    }
}

TEST(Lod, SaysWhichBubblesNoVoxelSees) {
    const Vec3 unseen{2.5 * kVoxel, 0.5 * kVoxel, 0.5 * kVoxel}; // between lattice points
    const DifferenceField field(
        std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 1}}),
        std::make_shared<BallsField>(std::vector<Sphere>{{unseen, 0.6 * kVoxel}}));
    const LodChain chain =
        make_lods(*rasterize(field, Lattice{kVoxel, {}, 3}), &field, {.levels = {{kVoxel / 4}}});
    ASSERT_EQ(chain.unseen.size(), 1u);
    EXPECT_NEAR(length(chain.unseen[0].center - unseen), 0.6 * kVoxel, 1e-3 * kVoxel);
    EXPECT_TRUE(chain.levels[0].unresolved.empty());
    EXPECT_EQ(nlohmann::json::parse(format_report(chain, "a.glb")).at("unseen").at("n"), 1);
}

TEST(Lod, NamesTheSettingOutOfRange) {
    expect_refused({}, Fault::bad_argument, "0 levels, must be 1..8");
    expect_refused({.levels = bounds_by_factor(9, 1, 2)}, Fault::bad_argument, "9 levels");
    expect_refused({.levels = {{-1, 0}}}, Fault::bad_argument, "bound_m is -1");
    expect_refused({.levels = {{1, 100}}}, Fault::bad_argument, "a bound or a number");
    expect_refused({.levels = {{0, 3}}}, Fault::bad_argument, "3 triangles");
    expect_refused({.levels = {{1, 0}, {1, 0}}}, Fault::bad_argument, "greater than");
    expect_refused({.levels = {{0, 100}, {0, 100}}}, Fault::bad_argument, "fewer than");
    expect_refused({.levels = {{1e-8, 0}}}, Fault::numeric, "finer than positions of 18 bits");
}

} // namespace
} // namespace taihu
