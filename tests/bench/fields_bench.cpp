// Many analytic solids, combinations and grid operations. Processor seconds, medians of three.
#include <cmath>
#include <fmt/format.h>

#include <functional>

#include "stats/core/rng.h"
#include "tests/bench/ratio.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/offset_field.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/redistance.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/solids_field.h"

using namespace taihu;

namespace {

void time(const std::string& what, const std::function<void()>& job) {
    std::vector<double> seconds;
    for (int i = 0; i < 3; ++i) {
        const double from = processor_s();
        job();
        seconds.push_back(processor_s() - from);
    }
    fmt::print("{:<44} {:>9.3f}\n", what, median(seconds));
}

/// In a cube of edge 1, a third of it filled.
std::vector<AnalyticSolid> scattered(std::uint64_t n,
                                     const std::function<PrimitiveSolid(double)>& of) {
    const double r = std::cbrt(0.36 / static_cast<double>(n) * 3 / (4 * M_PI));
    std::vector<AnalyticSolid> solids;
    for (std::uint64_t i = 0; i < n; ++i) {
        const auto u = [i](std::uint32_t draw) { return Rng{1, 1}.uniform(i, draw) - 0.5; };
        solids.push_back({of(r), Similarity::translation({u(0), u(1), u(2)}) *
                                     Similarity::rotation(Quaternion{u(3), u(4), u(5), u(6)})});
    }
    return solids;
}

} // namespace

int main() {
    openvdb::initialize();
    constexpr std::uint64_t kMany = 100'000;
    const std::pair<const char*, std::function<PrimitiveSolid(double)>> kinds[] = {
        {"balls", [](double r) { return BallSolid{r}; }},
        {"capsules",
         [](double r) {
             return CapsuleSolid{0.6 * r, 1.5 * r};
         }},
        {"ellipsoids",
         [](double r) {
             return EllipsoidSolid{{2 * r, r, 0.5 * r}};
         }},
        {"boxes",
         [](double r) {
             return BoxSolid{{0.8 * r, 0.8 * r, 0.8 * r}};
         }},
        {"cylinders", [](double r) {
             return CylinderSolid{0.8 * r, r};
         }}};
    for (const int dim : {256, 512}) {
        const Lattice lattice{1.0 / dim, {}, 3};
        fmt::print("lattice of {} voxels across{:>26}\n", dim, "processor seconds");
        for (const auto& [name, of] : kinds) {
            const SolidsField field(scattered(kMany, of));
            time(fmt::format("{} {}", kMany, name), [&] { rasterize(field, lattice); });
        }
        std::vector<Sphere> balls;
        for (const AnalyticSolid& s : scattered(kMany, kinds[0].second))
            balls.push_back({s.at.shift_m(), std::get<BallSolid>(s.shape).radius_m});
        const BallsField field(balls);
        time("the same balls as a BallsField", [&] { rasterize(field, lattice); });

        const std::shared_ptr<const Field> rock = shape_field({}),
                                           knob =
                                               shape_field({.kind = ShapeKind::ellipsoid,
                                                            .size_m = {0.6, 0.8, 0.6}},
                                                           Similarity::translation({0.4, 0.3, 0}));
        time("boulder", [&] { rasterize(*rock, lattice); });
        for (const double k : {0.0, 0.02, 0.1})
            time(fmt::format("boulder + ellipsoid, blend {}", k), [&] {
                rasterize(CombineField(Combine::unite, {rock, knob}, k), lattice);
            });
        for (const double by : {0.01, 0.05})
            time(fmt::format("boulder grown by {}", by),
                 [&] { rasterize(OffsetField(rock, by), lattice); });
        const auto grid = rasterize(*rock, lattice);
        const PlacedLevelSetField turned(grid, Similarity::rotation({1, 2, 3}, 0.7));
        time("boulder's level set turned", [&] { rasterize(turned, lattice); });
        time("redistance", [&] { redistance(*grid); });
        time("widen_band to 5", [&] { widen_band(*grid, 5); });
        time("widen_band to 20", [&] { widen_band(*grid, 20); });
    }
}
