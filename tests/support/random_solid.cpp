#include "tests/support/random_solid.h"

#include <algorithm>
#include <array>
#include <utility>

#include <nlohmann/json.hpp>

#include "stats/core/rng.h"
#include "tests/support/random_recipe.h"

namespace taihu {
namespace {

using Json = nlohmann::ordered_json;

class Maker {
public:
    Maker(std::uint64_t seed, double voxel_m) : rng_{seed, 0x736f6c69}, voxel_m_(voxel_m) {}

    RandomSolid make() {
        RandomRecipe exact = random_recipe(rng_.seed, voxel_m_);
        kinds_ = std::move(exact.kinds);
        Json recipe = Json::parse(exact.text);
        Json solid =
            named("union", {{"of", {recipe["solid"], named("sphere", sized(0.7)), rock()}}});
        if (pick(2) == 0)
            solid = rough(std::move(solid));
        if (pick(4) == 0)
            solid = rough(std::move(solid));
        if (pick(4) == 0)
            solid = named("clean", {{"of", std::move(solid)},
                                    {"pieces", pick(2) == 0 ? Json(1) : Json("all")},
                                    {"bubbles", pick(2) == 0 ? "fill" : "keep"}});
        recipe["solid"] = std::move(solid);
        recipe["seed"] = rng_.seed;
        return {recipe.dump(), kinds_, exact.awkward};
    }

private:
    double uniform(double lo, double hi) { return lo + (hi - lo) * rng_.uniform(0, n_draws_++); }
    int pick(int n) { return std::min(n - 1, static_cast<int>(uniform(0, n))); }
    static Json sized(double size_m) { return {{"size_m", {size_m, size_m, size_m}}}; }
    Json named(const char* kind, Json body) {
        kinds_.insert(kind);
        Json node;
        node[kind] = std::move(body);
        return node;
    }

    /// Shapes that random_recipe() does not have.
    Json rock() {
        const Json size = {uniform(0.4, 0.9), uniform(0.4, 0.9), uniform(0.4, 0.9)};
        switch (pick(4)) {
        case 0:
            return named("boulder", {{"size_m", size}, {"subdivisions", 2}});
        case 1:
            return named("fractal_rock", {{"size_m", size}, {"iterations", 1 + pick(2)}});
        case 2:
            return named("icosphere", {{"size_m", size}, {"subdivisions", pick(3)}});
        default:
            return named("superquadric",
                         {{"size_m", size}, {"exponents", {uniform(0.2, 1.8), uniform(0.2, 1.8)}}});
        }
    }
    Json noise(Json of) {
        const double largest = uniform(0.2, 0.6);
        return {{"of", std::move(of)},
                {"amplitude_m", uniform(0.01, 0.06)},
                {"largest_m", largest},
                {"smallest_m", std::max(largest / 4, voxel_m_)}};
    }
    Json rough(Json of) {
        const int which = pick(8);
        switch (which) {
        case 0:
            return named("rough", noise(std::move(of)));
        case 1:
        case 2:
        case 3: {
            const auto kind = std::array{"furrows", "facets", "beds"}[std::size_t(which - 1)];
            kinds_.insert(kind);
            return named("rough", {{"of", std::move(of)},
                                   {"relief", kind},
                                   {"amplitude_m", uniform(0.02, 0.1)},
                                   {"largest_m", uniform(0.2, 0.4)}});
        }
        case 4:
            return named("warp", noise(std::move(of)));
        case 5:
            return named("weather", {{"of", std::move(of)},
                                     {"sigma_m", uniform(0.02, 0.08)},
                                     {"steps", 1 + pick(3)},
                                     {"rounding", uniform(0, 1)},
                                     {"hollowing", uniform(-1, 1)}});
        case 6: {
            const double least = uniform(0.05, 0.1);
            return named("bites", {{"of", std::move(of)},
                                   {"count", 1 + pick(20)},
                                   {"mean_m", 2 * least},
                                   {"least_m", least},
                                   {"most_m", 3 * least}});
        }
        default:
            return named("relief", {{"of", std::move(of)},
                                    {"tile",
                                     {{"taihu_relief", 1},
                                      {"law", "fractal"},
                                      {"size_px", 33},
                                      {"hurst", uniform(0.3, 1)}}},
                                    {"amplitude_m", uniform(0.02, 0.1)},
                                    {"side_m", uniform(0.4, 1)}});
        }
    }

    Rng rng_;
    std::uint32_t n_draws_ = 0;
    double voxel_m_;
    std::set<std::string> kinds_;
};

} // namespace

RandomSolid random_solid(std::uint64_t seed, double voxel_m) {
    return Maker(seed, voxel_m).make();
}

} // namespace taihu
