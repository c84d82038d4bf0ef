#include "stats/expect.h"

#include "stats/sampler.h"
#include "stats/section_draws.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

// Profiles of holes of this law, a Poisson number of them about `mean`, on an area of 100.
Sample cut(const Law& law, double mean, std::uint64_t seed) {
    const SectionDraws draws(law, 0.1);
    Sample sample;
    const std::uint64_t n = poisson_count(mean, {seed, kCountStream});
    for (std::uint64_t i = 0; i < n; ++i)
        sample.diameters.push_back(draws.diameter({seed, 1}, i));
    sample.detection_limit = 0.1;
    sample.area = 100;
    return sample;
}

// d0 = .1 and rate 1: the share seen is 0.1 K1(0.1) = 0.98538, times N_A = N_V = 2 and 100.
constexpr double kNumber = 197.08;

TEST(Expect, ATrueLawObeysInNineteenOfTwenty) {
    int n_obey = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed)
        n_obey += expect_law(cut(Law::exponential(1), kNumber, seed), Law::exponential(1), 2.0, {},
                             {99, seed})
                      .obeys;
    EXPECT_GE(n_obey, 89); // 95 expected, sd 2.2: 2.7 of them
    EXPECT_LE(n_obey, 99);
}

TEST(Expect, TheExpectedNumberIsThatOfTheSections) {
    const Expectation e =
        expect_law(cut(Law::exponential(1), kNumber, 1), Law::exponential(1), 2.0, {}, {99});
    EXPECT_NEAR(e.number->expected, kNumber, 0.01);
    EXPECT_GT(e.number->p_value, 0.025);
}

TEST(Expect, NamesWhatIsWrong) {
    const Law law = Law::exponential(1);
    const Expectation larger =
        expect_law(cut(Law::exponential(0.7), kNumber, 2), law, 2.0, {}, {199});
    EXPECT_FALSE(larger.obeys);
    EXPECT_LE(larger.sizes.anderson_darling.p_value, 0.01);
    const Expectation more = expect_law(cut(law, 1.4 * kNumber, 3), law, 2.0, {}, {199});
    EXPECT_FALSE(more.obeys);
    EXPECT_LE(more.number->p_value, 0.001); // 40 % more: 5.6 sd
    EXPECT_GT(more.sizes.anderson_darling.p_value, 0.025);
}

TEST(Expect, PlanesThroughOneRockSpreadMore) {
    // 10 planes through a rock of 60 holes: the variance is 197 + .9 197^2 2 / 60 = 1362, so 40 %
    // more is 2.1 sd and no proof; on one plane it was one.
    const Law law = Law::exponential(1);
    const Sample more = cut(law, 1.4 * kNumber, 3);
    const Expectation e = expect_law(more, law, 2.0, SharedHoles{10, 30}, {99});
    EXPECT_GT(e.number->p_value, 0.02);
    EXPECT_LT(e.number->p_value, 0.2);
    EXPECT_NEAR(e.number->shared, 0.9 * 2 / 60 * kNumber, 0.01);
    EXPECT_LE(expect_law(more, law, 2.0, SharedHoles{1, 30}, {99}).number->p_value, 0.001);
}

TEST(Expect, JudgesSizesAloneWithoutADensity) {
    Sample sample = cut(Law::exponential(1), 300, 4);
    EXPECT_FALSE(expect_law(sample, Law::exponential(1), std::nullopt, {}, {99}).number);
    sample.area.reset();
    const Expectation e = expect_law(sample, Law::exponential(1), 2.0, {}, {99});
    EXPECT_FALSE(e.number);
    EXPECT_TRUE(e.obeys);
    expect_error(Fault::bad_argument, "n_v is 0",
                 [&] { expect_law(sample, Law::exponential(1), 0.0); });
}

} // namespace
} // namespace taihu
