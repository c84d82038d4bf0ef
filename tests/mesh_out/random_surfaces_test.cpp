// Recipes at random as chains of levels, each level judged by CGAL and by the recipe's own formula.
// `random_surfaces N [FIRST [JOBS]]` makes N of them, so many at a time, and prints what it saw,
// with the seeds of all that failed; the test makes a fixed few. Each is made in a process of its
// own, which may crash or take too long without harm to the others.
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "mesh_out/lod.h"
#include "tests/bench/ratio.h"
#include "tests/support/bound_check.h"
#include "tests/support/campaign.h"
#include "tests/support/cgal_oracle.h"
#include "tests/support/random_recipe.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {
namespace {

constexpr double kVoxel = 2.0 / 64; // 64 voxels across
constexpr int kLevels = 3;
constexpr unsigned kLongest_s = 100; // of processor time; most take one

void judge_topology(const LodLevel& level, const TriMesh& mesh, const std::string& where,
                    Recorder& out) {
    const CgalVerdict cgal = cgal_verdict(mesh);
    if (!cgal.manifold)
        out.failed("not 2-manifold", where);
    else if (!cgal.closed)
        out.failed("not closed", where);
    if (cgal.n_degenerate > 0)
        out.failed("degenerate faces", where + ": " + std::to_string(cgal.n_degenerate));
    if (cgal.n_self_intersections > 0)
        out.failed("self-intersections", where + ": " + std::to_string(cgal.n_self_intersections));
    else if (cgal.closed && !cgal.bounds_volume)
        out.failed("not outward", where);
    const Certificate& c = level.certificate;
    if (!c.holds() || (c.n_self_intersections > 0) != (cgal.n_self_intersections > 0))
        out.failed("certificate against CGAL", where);
}

std::string shown(const OffBound& off) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "%zu samples (%zu where it is thinner than a voxel), %.2f "
                  "times the bound at (%.5f, %.5f, %.5f)",
                  off.n, off.n_thin, off.worst_rel, off.worst.x, off.worst.y, off.worst.z);
    return text;
}

void judge_bound(const LodLevel& level, const std::vector<Sphere>& unseen, const TriMesh& mesh,
                 const BoundCheck& check, const std::string& where, Recorder& out) {
    std::vector<Sphere> named;
    for (const UnresolvedPlace& place : level.unresolved)
        named.push_back({place.center, place.radius_m + level.bound_m});
    for (const Sphere& closed : level.closed)
        named.push_back({closed.center, closed.radius_m + level.bound_m});
    for (const Sphere& place : unseen)
        named.push_back({place.center, place.radius_m + level.bound_m});
    const BoundVerdict verdict = check.judge(mesh, level.bound_m, named);
    out.add("samples", verdict.n_samples);
    out.add("samples named", verdict.n_named);
    out.add("samples undecided", verdict.n_unclear);
    out.add("places", named.size());
    const auto tell = [&](const OffBound& off, const std::string& what) {
        if (off.n > 0)
            out.failed(what + (off.n == off.n_thin ? ", all of it thin" : ""),
                       where + ": " + shown(off));
    };
    tell(verdict.mesh, "mesh beyond its bound");
    tell(verdict.surface, "surface beyond the bound");
    if (level.error_m > level.bound_m)
        out.failed("stated error above the bound", where);
}

std::size_t milliseconds(double s) {
    return static_cast<std::size_t>(1000 * s);
}

void judge(std::uint64_t seed, Recorder& out) {
    const double start_s = processor_s();
    const RandomRecipe recipe = random_recipe(seed, kVoxel);
    const std::string where = "recipe";
    const RecipeSolid solid = make_recipe(recipe.text, where, {});
    const LodChain chain =
        make_lods(*solid.solid, solid.field.get(),
                  {.levels = bounds_by_factor(kLevels, 0.25 * kVoxel, 2), .openness = false});
    const double made_s = processor_s();
    out.add("ms of making", milliseconds(made_s - start_s));
    const BoundCheck check(recipe.distance_m, bounds(chain.levels[0].encoded.decoded), kVoxel);
    out.add("short chains", !chain.note.empty());
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        const LodLevel& level = chain.levels[j];
        const TriMesh mesh = decode_draco(level.encoded.draco, where);
        const std::string which = "level " + std::to_string(j);
        judge_topology(level, mesh, which, out);
        judge_bound(level, chain.unseen, mesh, check, which, out);
        out.add("levels", 1);
        out.add("triangles", mesh.triangles.size());
    }
    out.add("ms of judging", milliseconds(processor_s() - made_s));
    out.add("chains", 1);
    out.add("chains that hold", out.counts().failed.empty());
}

TEST(RandomSurfaces, AreClosedManifoldUncrossedAndNowhereBeyondTheirBounds) {
    const Counts counts = run_campaign(judge, 0, 5, 2, kLongest_s);
    counts.print();
    EXPECT_EQ(counts.sums.at("chains"), 5u);
    EXPECT_TRUE(counts.failed.empty());
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    openvdb::initialize();
    return taihu::campaign_main(argc, argv, taihu::judge, taihu::kLongest_s);
}
