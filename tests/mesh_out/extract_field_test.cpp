#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "stats/core/error.h"
#include "tests/support/cube_mesh.h"
#include "tests/support/fields.h"
#include "tests/support/level_sets.h"
#include "tests/support/random_recipe.h"
#include "tests/support/surface_error.h"
#include "vdb_ops/analytic_field.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/offset_field.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/superquadric_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using testing::HasSubstr;
constexpr double kVoxel = 0.05;
const Lattice kLattice{kVoxel, {0.0113, -0.0071, 0.0037}, 3};
const ExtractSettings kFull{0.1, 1};

std::shared_ptr<const Field> balls(std::vector<Sphere> all) {
    return std::make_shared<BallsField>(std::move(all));
}
std::shared_ptr<const Field> solid(const PrimitiveSolid& shape, const Similarity& at = {}) {
    return std::make_shared<SolidsField>(std::vector<AnalyticSolid>{{shape, at}});
}
TriMesh plain(const LabelledMesh& mesh) {
    return {mesh.positions, mesh.triangles, {}};
}

void expect_trustworthy(const LabelledMesh& mesh) {
    const Certificate c = certify(plain(mesh));
    EXPECT_TRUE(c.holds()) << testing::PrintToString(faults(c));
    EXPECT_EQ(c.n_self_intersections, 0u);
    EXPECT_EQ(c.n_merged_positions, 0u);
    EXPECT_EQ(mesh.labels.size(), mesh.positions.size());
}

/// How far off a mesh may be [voxels] and how far its triangles turned [degrees].
struct Near {
    double usual;     ///< for faces, and 99.8 % of the samples of the mesh
    double most;      ///< for all of them
    double most_rims; ///< from rims to the mesh
    double angle_deg; ///< for 99 % of the triangles
};
void expect_near(const Field& field, const LabelledMesh& mesh, const Near& near) {
    Box box;
    for (const Vec3& p : mesh.positions)
        box.include(p);
    // In voxels, as the measures want it.
    TriMesh scaled = plain(mesh);
    const auto probe = field.probe(box.dilated(6 * kVoxel), 5 * kVoxel);
    struct InVoxels final : FieldProbe {
        const FieldProbe& of_;
        explicit InVoxels(const FieldProbe& of) : of_(of) {}
        Nearest at(const Vec3& p) const override {
            Nearest n = of_.at(p * kVoxel);
            n.value_m /= kVoxel;
            return n;
        }
        Value of(Primitive i, const Vec3& p) const override {
            Value v = of_.of(i, p * kVoxel);
            v.value_m /= kVoxel;
            return v;
        }
        void near(const Vec3& p, double reach, std::vector<Primitive>& out) const override {
            of_.near(p * kVoxel, reach * kVoxel, out);
        }
        std::optional<Sphere> ball(Primitive) const override { return std::nullopt; }
    };
    const InVoxels in_voxels(*probe);
    for (Vec3& p : scaled.positions)
        p = p / kVoxel;
    const MeshErrors there = mesh_errors(in_voxels, scaled);
    EXPECT_LE(there.distance.at_share(0.998), near.usual);
    EXPECT_LE(there.distance.max(), near.most);
    EXPECT_LE(there.angle_deg.at_share(0.99), near.angle_deg);
    const ReferencePoints points = reference_points(in_voxels, scaled.positions);
    const SurfaceDistance distance(scaled);
    double worst_face = 0, worst_rim = 0;
    for (const Vec3& p : points.faces)
        worst_face = std::max(worst_face, distance(p));
    for (const Vec3& p : points.rims)
        worst_rim = std::max(worst_rim, distance(p));
    EXPECT_GT(points.rims.size(), 50u);
    EXPECT_LE(worst_face, near.usual);
    EXPECT_LE(worst_rim, near.most_rims);
}

struct Sharp {
    std::string name;
    std::shared_ptr<const Field> field;
};
std::vector<Sharp> sharp_solids() {
    const auto ball = balls({{{}, 1}});
    return {
        {"ball minus ball",
         std::make_shared<DifferenceField>(ball, balls({{{0.9, 0.2, 0.1}, 0.6}}))},
        {"cube minus ball",
         std::make_shared<DifferenceField>(
             solid(BoxSolid{{0.8, 0.8, 0.8}}, Similarity::rotation({1, 2, 0.5}, 0.5)),
             balls({{{0.8, 0.3, 0.1}, 0.55}}))},
        {"two holes that cross", std::make_shared<DifferenceField>(
                                     ball, balls({{{0.7, 0.1, 0}, 0.5}, {{0.5, 0.6, 0.1}, 0.45}}))},
    };
}

/// One piece: the tip of the cube that the ball leaves has a voxel that no other one touches.
openvdb::FloatGrid::Ptr grid_of(const Sharp& s) {
    return clean(*rasterize(*s.field, kLattice)).solid;
}

TEST(ExtractField, IsSharpAndExactAtFullExtraction) {
    for (const Sharp& s : sharp_solids()) {
        SCOPED_TRACE(s.name);
        const LabelledMesh mesh = extract(*grid_of(s), s.field.get(), kFull);
        expect_trustworthy(mesh);
        // Chords of the smallest ball are 0.03 off. Tips of fins reach out of the voxels: fewer
        // triangles, whose chords are up to 0.093 off.
        expect_near(*s.field, mesh, {0.05, 0.1, 0.02, 2.5});
    }
}

TEST(ExtractField, CutsNoRimOffAtTheTipsOfFins) {
    for (const Sharp& s : sharp_solids())
        for (const ExtractSettings& settings : {kFull, ExtractSettings{0.25, 4}}) {
            SCOPED_TRACE(s.name);
            const LabelledMesh mesh = extract(*grid_of(s), s.field.get(), settings);
            std::size_t n_over_rims = 0;
            for (const Triangle& t : mesh.triangles)
                n_over_rims +=
                    mesh.labels[t[0]].common(mesh.labels[t[1]]).common(mesh.labels[t[2]]).empty();
            EXPECT_EQ(n_over_rims, 0u); // all lie on one primitive
        }
}

TEST(ExtractField, StaysWithinItsBoundWhereCellsGrow) {
    for (const Sharp& s : sharp_solids()) {
        SCOPED_TRACE(s.name);
        const auto grid = grid_of(s);
        const LabelledMesh full = extract(*grid, s.field.get(), kFull);
        const LabelledMesh mesh = extract(*grid, s.field.get(), {0.25, 4});
        expect_trustworthy(mesh);
        EXPECT_LT(2 * double(mesh.triangles.size()), double(full.triangles.size()));
        // Rims are those of full extraction: cells beside them do not grow.
        expect_near(*s.field, mesh, {0.13, 0.16, 0.02, 5});
    }
}

TEST(ExtractField, LabelsFacesRimsAndCorners) {
    const auto cube = solid(BoxSolid{{0.8, 0.8, 0.8}}, Similarity::rotation({1, 2, 0.5}, 0.5));
    const LabelledMesh mesh = extract(*rasterize(*cube, kLattice), cube.get(), kFull);
    std::size_t n_corners = 0, n_rims = 0;
    const auto probe = cube->probe({{-2, -2, -2}, {2, 2, 2}}, 1);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        n_corners += mesh.labels[v].size() == 3;
        n_rims += mesh.labels[v].size() == 2;
        for (const Primitive p : mesh.labels[v].all())
            EXPECT_NEAR(probe->of(p, mesh.positions[v]).value_m, 0, 1e-3 * kVoxel);
    }
    EXPECT_EQ(n_corners, 8u);
    EXPECT_GT(n_rims, 12 * 1.6 / kVoxel / 1.8); // an edge passes a cell every 1.7 voxels at least
    expect_trustworthy(mesh);
}

TEST(ExtractField, IsSharpAlongTheEdgesOfAMesh) {
    TriMesh mesh = placed(cube({}, 1.6), Similarity::rotation({1, 2, 0.5}, 0.5));
    const DifferenceField field(std::make_shared<MeshField>(close_mesh(mesh, "cube")),
                                balls({{{0.8, 0.3, 0.1}, 0.55}}));
    const LabelledMesh sharp = extract(*rasterize(field, kLattice), &field, kFull);
    expect_trustworthy(sharp);
    std::size_t n_corners = 0;
    for (const PrimitiveSet& l : sharp.labels)
        n_corners += l.size() == 3;
    EXPECT_GE(n_corners, 8u);
    const auto probe = field.probe({{-2, -2, -2}, {2, 2, 2}}, 0.2);
    for (const Vec3& p : sharp.positions)
        EXPECT_NEAR(probe->at(p).value_m, 0, 0.2 * kVoxel);
}

TEST(ExtractField, KeepsSmoothSolidsSmooth) {
    const SuperquadricField field({{0.9, 0.7, 0.8}, 0.8, 1}, Similarity::rotation({1, 1, 0}, 0.3));
    const LabelledMesh mesh = extract(*rasterize(field, kLattice), &field, kFull);
    expect_trustworthy(mesh);
    const auto probe = field.probe({{-2, -2, -2}, {2, 2, 2}}, 0.1);
    const auto normals = surface_normals(mesh, *probe);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        EXPECT_EQ(mesh.labels[v].size(), 1u);
        EXPECT_NEAR(probe->at(mesh.positions[v]).value_m, 0, 1e-3 * kVoxel);
        EXPECT_NEAR(length(normals[v]), 1, 1e-12);
    }
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
        EXPECT_GT(dot(normalized(cross(b - a, c - a)), normals[t[0]]), 0.97); // 14 degrees
    }
}

TEST(ExtractField, LosesNoTopologyWhereCellsGrow) {
    std::vector<Sphere> holes;
    for (std::uint64_t i = 0; i < 60; ++i)
        holes.push_back({random_vec(i) * 1.1, kVoxel * (1 + 5 * random_number(i, 5))});
    const DifferenceField field(balls({{{}, 1}, {{1.3, 0, 0}, 1.2 * kVoxel}}), balls(holes));
    const auto grid = rasterize(field, kLattice);
    const Certificate full = certify(plain(extract(*grid, &field, kFull)));
    for (const double bound : {0.1, 0.3, 1.0}) {
        const LabelledMesh mesh = extract(*grid, &field, {bound, 4});
        expect_trustworthy(mesh);
        const Certificate c = certify(plain(mesh));
        EXPECT_EQ(c.n_components, full.n_components);
        EXPECT_EQ(c.genus, full.genus);
    }
}

TEST(ExtractField, IsTheSameOnOneThreadAndMany) {
    const auto field = sharp_solids()[2].field;
    const auto grid = rasterize(*field, kLattice);
    const LabelledMesh many = extract(*grid, field.get());
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const LabelledMesh one = extract(*grid, field.get());
    EXPECT_EQ(one.positions, many.positions);
    EXPECT_EQ(one.triangles, many.triangles);
    EXPECT_EQ(one.labels, many.labels);
}

TEST(ExtractField, LeavesRemovedPiecesAndFilledBubblesAway) {
    const DifferenceField field(balls({{{}, 0.6}, {{1.1, 0, 0}, 0.2}}), balls({{{}, 0.2}}));
    const auto grid = clean(*rasterize(field, kLattice)).solid;
    const LabelledMesh mesh = extract(*grid, &field);
    expect_trustworthy(mesh);
    EXPECT_EQ(certify(plain(mesh)).n_components, 1u);
    for (const Vec3& p : mesh.positions)
        EXPECT_NEAR(length(p), 0.6, 1e-3 * kVoxel);
}

TEST(ExtractField, TakesTheGridWhereTheFieldIsAnother) {
    const auto grid = ball_grid(1, kVoxel);
    const auto other = balls({{{0.6, 0, 0}, 1}});
    const LabelledMesh mesh = extract(*grid, other.get());
    expect_trustworthy(mesh);
    for (const Vec3& p : mesh.positions)
        EXPECT_NEAR(length(p), 1,
                    kVoxel); // a cell's middle crossing, or the other ball's in the cell
}

TEST(ExtractField, SharpensALevelSetByItsGradients) {
    const auto field = sharp_solids()[0].field;
    const auto grid = rasterize(*field, kLattice);
    const LabelledMesh mesh = extract(*grid, nullptr, kFull);
    expect_trustworthy(mesh);
    const auto probe = field->probe({{-2, -2, -2}, {2, 2, 2}}, 0.2);
    Errors off;
    for (const Vec3& p : mesh.positions)
        off.all.push_back(static_cast<float>(std::fabs(probe->at(p).value_m) / kVoxel));
    EXPECT_LT(off.at_share(0.9), 0.03); // trilinear, on faces of 10 voxels' radius and more
    EXPECT_LT(off.max(), 0.75);         // rims are cut where gradients of a cell mix both sides
}

TEST(ExtractField, IsTrustworthyForRecipesAtRandom) {
    for (std::uint64_t seed = 0; seed < 24; ++seed) {
        SCOPED_TRACE(seed);
        const RandomRecipe recipe = random_recipe(seed, kVoxel);
        openvdb::FloatGrid::Ptr grid;
        try {
            grid = make_recipe(recipe.text, "recipe", {}).solid;
        } catch (const Error&) { // its parts do not meet
            continue;
        }
        if (!(volume_m3(*grid) > 0))
            continue;
        const Box box = level_set_box(*grid);
        const AnalyticField field(box, recipe.distance_m);
        for (const Field* f :
             {static_cast<const Field*>(nullptr), static_cast<const Field*>(&field)})
            for (const int most : {1, 4})
                expect_trustworthy(extract(*grid, f, {0.2, most}));
    }
}

TEST(ExtractField, IsTrustworthyForSolidsThatMeetAtRandom) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE(seed);
        const auto at = [&](std::uint32_t draw) {
            return Similarity::translation(random_vec(seed, draw) * 0.5) *
                   Similarity::rotation(random_vec(seed, draw + 3), 2 * random_number(seed, draw));
        };
        std::vector<Sphere> holes;
        for (std::uint64_t i = 0; i < 30; ++i)
            holes.push_back({random_vec(100 * seed + i, 40), 0.3 * random_number(seed, 60)});
        const auto both = std::make_shared<CombineField>(
            seed % 2 ? Combine::unite : Combine::intersect,
            std::vector<std::shared_ptr<const Field>>{solid(BoxSolid{{0.7, 0.5, 0.6}}, at(0)),
                                                      solid(CylinderSolid{0.6, 0.5}, at(10))},
            seed % 3 == 0 ? 0.2 : 0);
        const DifferenceField field(std::make_shared<ShellField>(both, 0.15, 0), balls(holes));
        const auto grid = rasterize(field, kLattice);
        for (const int most : {1, 4})
            expect_trustworthy(extract(*grid, &field, {0.2, most}));
    }
}

void expect_refused(const openvdb::FloatGrid& grid, Fault fault, const std::string& text,
                    const ExtractSettings& settings = {}) {
    try {
        extract(grid, nullptr, settings);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault);
        EXPECT_THAT(e.what(), HasSubstr(text));
    }
}

TEST(ExtractField, KeepsWallsThinnerThanAVoxelApart) {
    // Of its cells some have to be made smaller again and again before no triangles cross.
    const RecipeSolid shell = make_recipe(R"({"taihu_recipe": 1, "voxel_m": 0.08333333333333333,
        "seed": 941, "solid": {"warp": {"of": {"shell": {"of": {"transform": {"of":
        {"rounded_box": {"size_m": [0.391, 0.47, 0.407], "round_m": 0.117}}, "scale": 1.14,
        "axis": [-0.439, -0.00817, 1], "angle_deg": -127, "move_m": [0.0775, -0.22, 0.479]}},
        "inwards_m": 0.0467, "outwards_m": 0.0243}},
        "amplitude_m": 0.0327, "largest_m": 0.544, "smallest_m": 0.136}}})",
                                          "r.json", {});
    const LabelledMesh mesh = extract(*shell.solid, nullptr);
    const Certificate c = certify({mesh.positions, mesh.triangles, {}});
    EXPECT_TRUE(c.holds());
    EXPECT_EQ(c.n_self_intersections, 0u);
}

TEST(ExtractField, SheetsThroughOppositeCornersOfACellDoNotCross) {
    // A slit far thinner than a voxel, with two vertices in one cell and no face of it ambiguous.
    const RecipeSolid rock = make_recipe(R"({"taihu_recipe": 1, "voxel_m": 0.08333333333333333,
        "seed": 6166, "solid": {"rough": {"of": {"union": {"of": [{"intersection": {"of": [
        {"shell": {"of": {"offset": {"of": {"transform": {"of": {"transform": {"of":
        {"transform": {"of": {"box": {"size_m": [0.93868, 0.91668, 0.33409]}}, "scale": 1.329,
        "axis": [-0.71717, -0.21561, 1], "angle_deg": 156.28, "move_m": [0.24561, -0.43704,
        -0.16788]}}, "scale": 1.4852, "axis": [0.96034, -0.13742, 1], "angle_deg": 169.96,
        "move_m": [-0.50031, -0.3341, -0.1448]}}, "scale": 1.4484, "axis": [0.35954, -0.19142, 1],
        "angle_deg": 22.372, "move_m": [0.060614, -0.45254, 0.29078]}}, "by_m": -0.035247}},
        "inwards_m": 0.055385, "outwards_m": 0.02015}}, {"box": {"size_m": [2, 2, 2]}}]}},
        {"sphere": {"size_m": [0.7, 0.7, 0.7]}}]}}, "relief": "beds", "amplitude_m": 0.067017,
        "largest_m": 0.2024}}})",
                                         "r.json", {});
    const LabelledMesh mesh = extract(*rock.solid, rock.field.get());
    EXPECT_EQ(certify({mesh.positions, mesh.triangles, {}}).n_self_intersections, 0u);
}

TEST(ExtractField, RefusesWhatHasNoSurface) {
    const std::vector<Sphere> all = {{{0, 0, 0}, 2}};
    expect_refused(*holed_ball_grid(0.5, 0.1, all), Fault::bad_argument, "nothing is left");
    const auto fog = ball_grid(0.5, 0.1);
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    expect_refused(*fog, Fault::bad_argument, "'fog volume', must be a level set");
    const auto clipped = ball_grid(0.5, 0.05);
    auto accessor = clipped->getAccessor();
    for (int x = 6; x <= 15; ++x)
        for (int y = -15; y <= 15; ++y)
            for (int z = -15; z <= 15; ++z)
                accessor.setValueOff({x, y, z}, clipped->background());
    expect_refused(*clipped, Fault::numeric, "leaves the narrow band");
}

TEST(ExtractField, RefusesSettingsOutOfRange) {
    const auto grid = ball_grid(0.5, 0.1);
    expect_refused(*grid, Fault::bad_argument, "most_spacing is 3, must be 1, 2 or 4", {0.1, 3});
    expect_refused(*grid, Fault::bad_argument, "bound_vox is 0, must be finite and > 0", {0, 4});
}

} // namespace
} // namespace taihu
