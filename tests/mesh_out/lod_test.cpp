#include "mesh_out/lod.h"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "mesh_out/extract.h"
#include "mesh_out/io/mesh_file.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"
#include "tests/support/level_sets.h"

namespace taihu {
namespace {

using testing::HasSubstr;

constexpr double kVoxel = 0.05;
const LodSettings kSettings{.n_levels = 4, .bound_m = 0.25 * kVoxel};

openvdb::FloatGrid::Ptr holed_rock() {
    const std::vector<Sphere> holes = {
        {{0.7, 0, 0}, 0.5}, {{0, 0.6, 0}, 0.45}, {{-0.6, -0.3, 0}, 0.5}, {{0, 0.1, 0.1}, 0.4}};
    return holed_ball_grid(1, kVoxel, holes);
}

const LodChain& rock_chain() {
    static const LodChain chain = make_lods(*holed_rock(), kSettings);
    return chain;
}

TEST(Lod, EveryLevelKeepsItsBoundAsDecoded) {
    const TriMesh reference = extract_uniform(*holed_rock());
    ASSERT_EQ(rock_chain().levels.size(), 4u) << rock_chain().note;
    EXPECT_EQ(rock_chain().n_reference_triangles, reference.triangles.size());
    for (std::size_t j = 0; j < 4; ++j) {
        const LodLevel& level = rock_chain().levels[j];
        EXPECT_DOUBLE_EQ(level.bound_m, kSettings.bound_m * std::pow(2, j));
        EXPECT_LE(level.error_m, level.bound_m);
        EXPECT_GT(level.rms_m, 0);
        const TriMesh again = decode_draco(level.encoded.draco, "level");
        // Measured more densely than the chain does: samples miss a few per cent of the worst
        // point.
        EXPECT_LE(two_sided_distance(again, reference, kVoxel / 3).max_m, 1.05 * level.bound_m);
    }
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
    const double coarsest_m = levels.back().grid.step_m;
    for (std::size_t j = 0; j < levels.size(); ++j) {
        EXPECT_EQ(levels[j].grid.step_m, levels[0].grid.step_m * std::pow(2, j));
        for (int k = 0; k < 3; ++k)
            EXPECT_EQ(std::fmod(levels[j].grid.origin[k], coarsest_m), 0);
    }
}

TEST(Lod, NormalsAreTheFieldsOrLeftOut) {
    const auto rock = holed_rock();
    for (const LodLevel& level : rock_chain().levels) {
        const TriMesh& mesh = level.encoded.decoded;
        const std::vector<Vec3> expected = surface_normals(*rock, mesh.positions);
        ASSERT_EQ(mesh.normals.size(), expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) // 10 bits: at most about 0.3 degrees off
            EXPECT_GT(dot(mesh.normals[i], expected[i]), 0.9999);
    }
    LodSettings plain = kSettings;
    plain.normals = false;
    plain.n_levels = 1;
    EXPECT_TRUE(
        make_lods(*ball_grid(0.5, kVoxel), plain).levels[0].encoded.decoded.normals.empty());
}

TEST(Lod, IsByteIdenticalOnOneThreadAndMany) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const LodChain one = make_lods(*holed_rock(), kSettings);
    EXPECT_EQ(format_glb(one), format_glb(rock_chain()));
    EXPECT_EQ(format_report(one, "a.glb"), format_report(rock_chain(), "a.glb"));
}

TEST(Lod, ReportHoldsWhatWasMeasured) {
    const auto report = nlohmann::json::parse(format_report(rock_chain(), "a.glb"));
    EXPECT_EQ(report.at("n_reference_triangles"), rock_chain().n_reference_triangles);
    EXPECT_EQ(report.at("file"), "a.glb");
    EXPECT_EQ(report.at("note"), "");
    EXPECT_THAT(report.at("reference").get<std::string>(), HasSubstr("uniform surface"));
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
        make_lods(*ball_grid(0.3, 0.1), {.n_levels = 8, .bound_m = 0.02, .factor = 1.0001});
    EXPECT_LT(chain.levels.size(), 8u);
    EXPECT_THAT(chain.note, HasSubstr("of 8 levels"));
}

TEST(Lod, SurvivesBoundsLargerThanTheRock) {
    const LodChain chain = make_lods(*holed_rock(), {.n_levels = 3, .bound_m = 0.5, .factor = 100});
    for (const LodLevel& level : chain.levels) {
        EXPECT_TRUE(level.certificate.holds());
        EXPECT_LE(level.error_m, level.bound_m);
    }
}

void expect_refused(const LodSettings& settings, Fault fault, const char* text) {
    try {
        make_lods(*ball_grid(0.5, 0.1), settings);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault);
        EXPECT_THAT(e.what(), HasSubstr(text));
    }
}

TEST(Lod, NamesTheSettingOutOfRange) {
    expect_refused({.n_levels = 0, .bound_m = 1}, Fault::bad_argument, "n_levels is 0");
    expect_refused({.n_levels = 9, .bound_m = 1}, Fault::bad_argument, "n_levels is 9");
    expect_refused({.bound_m = -1}, Fault::bad_argument, "bound_m is -1");
    expect_refused({.bound_m = 1, .factor = 1}, Fault::bad_argument, "factor is 1");
    expect_refused({.bound_m = 1e-8}, Fault::numeric, "the finest step that fits");
}

} // namespace
} // namespace taihu
