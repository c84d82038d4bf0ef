#include "stats/section_draws.h"

#include <algorithm>
#include <cmath>

#include "stats/wicksell.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

Law two(Family family, double a, double b) {
    const double parameters[] = {a, b};
    return Law(family, parameters);
}

// Greatest distance of drawn profiles from the law of sections above the limit.
double distance(const Law& law, double limit, std::size_t n) {
    const SectionDraws draws(law, limit);
    const SectionLaw section(law);
    std::vector<double> d(n);
    for (std::size_t i = 0; i < n; ++i)
        d[i] = draws.diameter({3, 5}, i);
    std::sort(d.begin(), d.end());
    EXPECT_GE(d.front(), limit);
    double greatest = 0;
    const auto count = static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
        const double u = 1 - section.survival(d[i]) / section.survival(limit);
        greatest = std::max(
            {greatest, u - static_cast<double>(i) / count, static_cast<double>(i + 1) / count - u});
    }
    return greatest;
}

TEST(SectionDraws, ObeyTheLawOfSections) {
    constexpr std::size_t kMany = 2000;
    const Law laws[] = {Law::exponential(2),
                        two(Family::gamma, 0.7, 1),
                        two(Family::gamma, 5, 0.2),
                        two(Family::weibull, 1.6, 1),
                        two(Family::lognormal, -0.2, 0.6),
                        two(Family::truncated_normal, 0.5, 0.6),
                        two(Family::truncated_normal, 4, 0.5),
                        two(Family::uniform, 0.2, 1.5),
                        Law::constant(1),
                        Law::empirical({{0, 0}, {0.3, 0.5}, {0.5, 0.5}, {2, 1}})};
    for (const Law& law : laws)
        for (const double limit : {0.0, 0.4, 0.9})
            // Kolmogorov's critical value at 0.1 %, for thirty comparisons; the seed is fixed.
            EXPECT_LT(distance(law, limit, kMany), 1.95 / std::sqrt(kMany))
                << family_name(law.family()) << " above " << limit;
}

TEST(SectionDraws, KeepTheirPaceFarInTheTail) {
    // One profile in 10^17 of this law passes the limit.
    EXPECT_LT(distance(Law::exponential(1), 40, 1000), 1.95 / std::sqrt(1000));
}

// Recorded once: these bits must come out on every machine and of every later version.
TEST(SectionDraws, HaveGoldenFirstProfiles) {
    const SectionDraws exponential(Law::exponential(2), 0.25);
    const SectionDraws uniform(two(Family::uniform, 0, 1), 0.25);
    EXPECT_EQ(exponential.diameter({0, 1}, 0), 0x1.d9736f9d7871cp-2);
    EXPECT_EQ(exponential.diameter({0, 1}, 1), 0x1.2f6a9c84566c4p-2);
    EXPECT_EQ(uniform.diameter({0, 1}, 0), 0x1.726a3735d5199p-1);
}

TEST(SectionDraws, RefuseLimitsThatHideEverything) {
    expect_error(Fault::bad_argument, "the detection limit is -1",
                 [] { SectionDraws(Law::exponential(1), -1); });
    expect_error(Fault::numeric, "no sphere above the detection limit, 2",
                 [] { SectionDraws(Law::constant(1), 2); });
    expect_error(Fault::numeric, "no sphere above the detection limit, 2",
                 [] { SectionDraws(two(Family::uniform, 0, 1), 2); });
    expect_error(Fault::numeric, "no sphere above the detection limit, 1e+06",
                 [] { SectionDraws(two(Family::gamma, 2, 1), 1e6); });
}

} // namespace
} // namespace taihu
