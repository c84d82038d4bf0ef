// Rough recipes at random: is their surface closed, 2-manifold, outward, without crossings?
// `random_rough N` runs N of them and prints what it saw; the test runs a fixed few.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "stats/core/rng.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {
namespace {

using Json = nlohmann::json;

class Maker {
public:
    explicit Maker(std::uint64_t seed) : rng_{seed, 0x726f7567} {}

    Json make() {
        Json solid = shape();
        for (int n = 1 + pick(3); n > 0; --n)
            solid = operation(std::move(solid));
        solid = {{"clean", {{"of", std::move(solid)}}}};
        return {{"taihu_recipe", 1}, {"seed", rng_.seed}, {"dim", 56}, {"solid", solid}};
    }

private:
    double uniform(double lo, double hi) { return lo + (hi - lo) * rng_.uniform(0, n_draws_++); }
    int pick(int n) { return std::min(n - 1, static_cast<int>(uniform(0, n))); }

    Json shape() {
        const Json size = {uniform(0.6, 1.2), uniform(0.6, 1.2), uniform(0.6, 1.2)};
        const Json base = {
            {std::array{"ellipsoid", "box", "boulder"}[static_cast<std::size_t>(pick(3))],
             {{"size_m", size}}}};
        if (pick(2) == 0)
            return base;
        const Json law = {{"family", "exponential"}, {"parameters", {{"rate", 6}}}};
        return {
            {"difference", {{"of", {base, {{"holes", {{"law", law}, {"count", 1 + pick(12)}}}}}}}}};
    }
    Json noise(Json solid) {
        const double largest = uniform(0.1, 0.5);
        return {{"of", std::move(solid)},     {"amplitude_m", uniform(0.005, 0.05)},
                {"largest_m", largest},       {"smallest_m", largest / (1 << pick(5))},
                {"hurst", uniform(0.3, 1.2)}, {"stretch", pick(2) == 0 ? 1 : uniform(1, 4)}};
    }
    Json operation(Json solid) {
        switch (pick(7)) {
        case 0: {
            Json body = noise(std::move(solid));
            body["facing"] = {uniform(0, 2), 1, uniform(0, 1)};
            body["inside"] = {{"mouth_m", uniform(0.05, 0.2)}, {"share", uniform(0, 1)}};
            return {{"rough", body}};
        }
        case 1: {
            Json body = noise(std::move(solid));
            body["relief"] = "furrows";
            return {{"rough", body}};
        }
        case 2:
            return {{"rough",
                     {{"of", std::move(solid)},
                      {"relief", pick(2) == 0 ? "facets" : "beds"},
                      {"amplitude_m", uniform(0.02, 0.1)},
                      {"largest_m", uniform(0.1, 0.3)}}}};
        case 3:
            return {{"warp", noise(std::move(solid))}};
        case 4:
            return {{"weather",
                     {{"of", std::move(solid)},
                      {"sigma_m", uniform(0.01, 0.05)},
                      {"steps", 1 + pick(4)},
                      {"rounding", uniform(0, 1)},
                      {"hollowing", uniform(-1, 1)},
                      {"durability", {{"contrast", uniform(0, 1)}, {"largest_m", 0.3}}}}}};
        case 5: {
            const double least = uniform(0.03, 0.1);
            return {{"bites",
                     {{"of", std::move(solid)},
                      {"count", 5 + pick(60)},
                      {"mean_m", 2 * least},
                      {"least_m", least},
                      {"most_m", 4 * least},
                      {"aspect", uniform(0.7, 2.5)},
                      {"rim", uniform(0, 0.4)},
                      {"chain", 1 + pick(3)},
                      {"begin", pick(2) == 0 ? "surface" : "inside"}}}};
        }
        default: {
            const bool fractal = pick(2) == 0;
            Json tile = {
                {"taihu_relief", 1},
                {"law", fractal ? "fractal" : "convex"},
                {"size_px", 65},
                {fractal ? "hurst" : "n_regions", fractal ? uniform(0.3, 1) : 1 + pick(30)}};
            return {{"relief",
                     {{"of", std::move(solid)},
                      {"tile", std::move(tile)},
                      {"amplitude_m", uniform(0.02, 0.1)},
                      {"side_m", uniform(0.2, 1)},
                      {"sharpness", uniform(1, 8)}}}};
        }
        }
    }

    Rng rng_;
    std::uint32_t n_draws_ = 0;
};

struct Counts {
    int n = 0, n_failed = 0, n_crossed = 0;
    std::size_t n_crossings = 0, n_triangles = 0;
};

/// Both surfaces of a level set: with cells as large as they may be, and of one size.
void judge(const openvdb::FloatGrid& solid, std::uint64_t seed, Counts& counts) {
    for (const bool uniform : {false, true}) {
        TriMesh mesh;
        if (uniform) {
            mesh = extract_uniform(solid);
        } else {
            LabelledMesh labelled = extract(solid, nullptr);
            mesh.positions = std::move(labelled.positions);
            mesh.triangles = std::move(labelled.triangles);
        }
        const Certificate c = certify(mesh);
        ++counts.n;
        counts.n_triangles += c.n_triangles;
        counts.n_crossings += c.n_self_intersections;
        counts.n_crossed += c.n_self_intersections > 0;
        if (!c.holds() || c.n_components - c.n_cavities != 1 || c.n_self_intersections > 0) {
            ++counts.n_failed;
            std::printf("recipe %d%s: %s, %zu crossings, %zu components\n", static_cast<int>(seed),
                        uniform ? " uniform" : "",
                        faults(c).empty() ? "holds" : faults(c).front().c_str(),
                        c.n_self_intersections, c.n_components);
        }
    }
}

Counts run_recipes(std::uint64_t n) {
    Counts counts;
    for (std::uint64_t seed = 0; seed < n; ++seed) {
        const std::string text = Maker(seed).make().dump();
        judge(*make_recipe(text, "recipe " + std::to_string(seed), {}).solid, seed, counts);
    }
    return counts;
}

TEST(RandomRough, SurfacesKeepTheirCertificate) {
    const Counts counts = run_recipes(8);
    EXPECT_EQ(counts.n, 16);
    EXPECT_EQ(counts.n_failed, 0);
    EXPECT_GT(counts.n_triangles, 50'000u);
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    openvdb::initialize();
    if (argc == 2 && argv[1][0] != '-') {
        const auto c = taihu::run_recipes(std::strtoull(argv[1], nullptr, 10));
        std::printf("%d surfaces of %zu triangles: %d without certificate or with crossings, %zu "
                    "crossings in %d\n",
                    c.n, c.n_triangles, c.n_failed, c.n_crossings, c.n_crossed);
        return c.n_failed > 0;
    }
    testing::InitGoogleTest(&argc, argv);
    return RUN_ALL_TESTS();
}
