// Small recipes at random with operators of every kind, and the files that are made of them; CGAL
// judges. `random_solids N [FIRST [JOBS]]` makes N of them and prints what it saw.
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "mesh_out/surface_file.h"
#include "tests/support/campaign.h"
#include "tests/support/cgal_oracle.h"
#include "tests/support/random_solid.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {
namespace {

constexpr double kVoxel = 2.0 / 24; // 24 voxels across
constexpr unsigned kLongest_s = 30; // of processor time

void judge_file(const TriMesh& mesh, Recorder& out) {
    const CgalVerdict cgal = cgal_verdict(mesh);
    if (!cgal.manifold)
        out.failed("not 2-manifold", "CGAL");
    else if (!cgal.closed)
        out.failed("not closed", "CGAL");
    if (cgal.n_degenerate > 0)
        out.failed("degenerate faces", std::to_string(cgal.n_degenerate));
    if (cgal.n_self_intersections > 0)
        out.failed("self-intersections", std::to_string(cgal.n_self_intersections));
    else if (cgal.closed && !cgal.bounds_volume)
        out.failed("not turned outwards", "CGAL");
}

void judge(std::uint64_t seed, Recorder& out) {
    const RandomSolid recipe = random_solid(seed, kVoxel);
    for (const std::string& kind : recipe.kinds)
        out.add("with " + kind, 1);
    out.add("awkward", recipe.awkward);
    const RecipeSolid solid = make_recipe(recipe.text, "recipe", {});
    const LabelledMesh full = extract(*solid.solid, solid.field.get());
    const Certificate before = certify({full.positions, full.triangles, {}});
    out.add("surfaces that cross themselves before simplification",
            before.n_self_intersections > 0);
    const SurfaceFile file = format_surface(*solid.solid, solid.field.get(), MeshFormat::ply,
                                            {.max_error_m = 0.5 * kVoxel}, recipe.text);
    if (!(file.error_m <= file.bound_m))
        out.failed("an error above the bound", std::to_string(file.error_m / file.bound_m));
    judge_file(parse_mesh(file.bytes, MeshFormat::ply, "ply").levels.at(0), out);
    out.add("files", 1);
    out.add("files that hold", out.counts().failed.empty());
    out.add("triangles", file.certificate.n_triangles);
}

TEST(RandomSolids, KeepTheirCertificate) {
    const Counts counts = run_campaign(judge, 0, 30, 2, kLongest_s);
    counts.print();
    EXPECT_TRUE(counts.failed.empty());
    EXPECT_EQ(counts.sums.at("files that hold"), 30u);
}

TEST(RandomSolids, HaveEveryOperatorInOneOfTwenty) {
    Counts counts;
    for (std::uint64_t seed = 0; seed < 1000; ++seed)
        for (const std::string& kind : random_solid(seed, kVoxel).kinds)
            ++counts.sums[kind];
    for (const char* kind :
         {"sphere", "ellipsoid",    "box",          "rounded_box", "cylinder",     "capsule",
          "torus",  "boulder",      "fractal_rock", "icosphere",   "superquadric", "plane",
          "union",  "intersection", "difference",   "blend",       "transform",    "offset",
          "shell",  "embed",        "holes",        "rough",       "warp",         "weather",
          "bites",  "relief",       "clean"})
        EXPECT_GE(counts.sums[kind], 50u) << kind;
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    openvdb::initialize();
    return taihu::campaign_main(argc, argv, taihu::judge, taihu::kLongest_s);
}
