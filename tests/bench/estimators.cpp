// The simulation table of the estimators: how far each is from a truth that is drawn, beside what
// it is held to. Deterministic; about a minute. Not a test: the tests run a small share of it.
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "stats/bootstrap.h"
#include "stats/core/error.h"
#include "stats/fit.h"
#include "stats/sampler.h"
#include "stats/section_draws.h"
#include "stats/unfold.h"

namespace taihu {
namespace {

constexpr double kArea = 50;

struct Truth {
    const char* name;
    Law law; // of mean 1
};

struct Estimate {
    double rate; ///< 1 / mean diameter
    Law law;
    std::optional<bool> covered; ///< the interval of N_V, and of the rate of an exponential law
    std::optional<bool> n_v_covered;
};

using Method = std::function<Estimate(const Sample&, double true_n_v)>;

// Errors are measured at a given number of profiles, as the goals are; the interval of N_V allows
// for a Poisson number of them, and its coverage is measured on one.
enum class Number { given, poisson };

struct Errors {
    double bias = 0, rmse = 0, f3 = 0;
    double covered = -1, n_v_covered = -1;
    int failed = 0;
};

// About n profiles, of which those above the limit are marked: N_V is n / kArea.
Sample draw(const Law& law, double limit, std::size_t n, std::uint64_t run,
            Number number = Number::given) {
    if (number == Number::poisson)
        n = poisson_count(static_cast<double>(n), {run, kCountStream});
    const SectionDraws draws(law, 0);
    Sample sample;
    for (std::size_t i = 0; i < n; ++i) {
        const double d = draws.diameter({run, 1}, i);
        if (d >= limit)
            sample.diameters.push_back(d);
    }
    sample.detection_limit = limit;
    sample.area = kArea;
    return sample;
}

Errors measure(const Truth& truth, double limit, std::size_t n, int runs, Number number,
               const Method& method) {
    Errors errors;
    int done = 0, covered = 0, n_covered = 0, n_v_covered = 0, n_n_v_covered = 0;
    for (int run = 0; run < runs; ++run) {
        const Sample sample = draw(truth.law, limit, n, static_cast<std::uint64_t>(run), number);
        try {
            const Estimate e = method(sample, static_cast<double>(n) / kArea);
            ++done;
            errors.bias += e.rate - 1;
            errors.rmse += (e.rate - 1) * (e.rate - 1);
            for (int decile = 1; decile < 10; ++decile) {
                const double u = 0.1 * decile;
                errors.f3 += std::abs(e.law.cdf(truth.law.quantile(u)) - u) / 9;
            }
            n_covered += e.covered.has_value();
            covered += e.covered.value_or(false);
            n_n_v_covered += number == Number::poisson && e.n_v_covered.has_value();
            n_v_covered += e.n_v_covered.value_or(false);
        } catch (const Error&) {
            ++errors.failed;
        }
    }
    errors.bias /= done;
    errors.rmse = std::sqrt(errors.rmse / done);
    errors.f3 /= done;
    if (n_covered > 0)
        errors.covered = 100.0 * covered / n_covered;
    if (n_n_v_covered > 0)
        errors.n_v_covered = 100.0 * n_v_covered / n_n_v_covered;
    return errors;
}

Estimate of_fit(const Fit& fit, double n_v) {
    Estimate e{1 / fit.law.mean(), fit.law, {}, fit.n_v->lo <= n_v && n_v <= fit.n_v->hi};
    if (fit.law.family() == Family::exponential)
        e.covered = fit.intervals[0].lo <= 1 && 1 <= fit.intervals[0].hi;
    if (fit.law.family() == Family::lognormal) // sd_log, true 0.5
        e.covered = fit.intervals[1].lo <= 0.5 && 0.5 <= fit.intervals[1].hi;
    return e;
}

Estimate of_law(const Law& law) {
    return {1 / law.mean(), law, {}, {}};
}

Method fitted(Family family) {
    return [family](const Sample& s, double n_v) { return of_fit(fit_law(s, family), n_v); };
}

Estimate chosen(const Sample& sample, double n_v) {
    return of_fit(fit_laws(sample).fits.front(), n_v);
}

// N_V, averaged over the families by their Akaike weights, in place of the rate.
Estimate averaged(const Sample& sample, double n_v) {
    const LawRanking ranking = fit_laws(sample);
    return {ranking.n_v->mean / n_v, ranking.fits.front().law, {}, {}};
}

struct Goal {
    double bias = -1, rmse = -1; // none when negative
    bool coverage = false;
};

std::string verdict(const Errors& e, const Goal& goal) {
    if (goal.bias < 0 && goal.rmse < 0 && !goal.coverage)
        return "";
    const auto inside = [](double percent) {
        return percent < 0 || (percent >= 92 && percent <= 98);
    };
    const bool met = (goal.bias < 0 || std::abs(e.bias) <= goal.bias) &&
                     (goal.rmse < 0 || e.rmse <= goal.rmse) &&
                     (!goal.coverage || (inside(e.covered) && inside(e.n_v_covered)));
    return met ? "met" : "not met";
}

void row(const char* method, const Truth& truth, double limit, std::size_t n, int runs,
         const Method& estimate, const Goal& goal = {}) {
    const Errors e =
        measure(truth, limit, n, runs, goal.coverage ? Number::poisson : Number::given, estimate);
    const auto percent = [](double p) {
        return p < 0 ? std::string("-") : fmt::format("{:.1f}", p);
    };
    fmt::print("{:<22} {:<10} {:>4} {:>5} {:>5} {:>+7.3f} {:>6.3f} {:>6.3f} {:>7} {:>7}  {}{}\n",
               method, truth.name, limit, n, runs, e.bias, e.rmse, e.f3, percent(e.covered),
               percent(e.n_v_covered), verdict(e, goal),
               e.failed > 0 ? fmt::format(" ({} without an answer)", e.failed) : "");
}

double seconds(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void table() {
    const Truth exponential{"exp", Law::exponential(1)};
    const Truth lognormal{"logn(.5)", Law(Family::lognormal, std::array{-0.125, 0.5})};
    fmt::print("{:<22} {:<10} {:>4} {:>5} {:>5} {:>7} {:>6} {:>6} {:>7} {:>7}\n", "method", "truth",
               "d0", "n", "runs", "bias", "rmse", "F3err", "cover%", "N_V%");
    constexpr int kRuns = 100;
    const Method exp_fit = fitted(Family::exponential), logn_fit = fitted(Family::lognormal);
    for (const auto& [limit, worse] : {std::pair{0.0, 1.0}, std::pair{0.3, 1.3}}) {
        const double bias = limit > 0 ? -1 : 0.02;
        row("likelihood", exponential, limit, 50, 10 * kRuns, exp_fit, {bias, worse * 0.135});
        row("likelihood", exponential, limit, 200, 6 * kRuns, exp_fit, {bias, worse * 0.065});
        row("likelihood", lognormal, limit, 200, 2 * kRuns, logn_fit, {-1, worse * 0.08});
        row("likelihood, by AICc", exponential, limit, 50, kRuns, chosen);
        row("likelihood, by AICc", exponential, limit, 200, kRuns, chosen);
        row("likelihood, by AICc", lognormal, limit, 50, kRuns, chosen);
        row("likelihood, by AICc", lognormal, limit, 200, 2 * kRuns, chosen, {-1, worse * 0.08});
        row("N_V by all weights", lognormal, limit, 200, 2 * kRuns, averaged);
        row("intervals", exponential, limit, 50, 10 * kRuns, exp_fit, {-1, -1, true});
        row("intervals", exponential, limit, 200, 6 * kRuns, exp_fit, {-1, -1, true});
        row("intervals", lognormal, limit, 50, 4 * kRuns, logn_fit, {-1, -1, true});
        row("intervals", lognormal, limit, 200, 2 * kRuns, logn_fit, {-1, -1, true});
    }
    const std::array<std::pair<const char*, Method>, 4> unfoldings = {{
        {"Schwartz-Saltykov",
         [](const Sample& s, double) { return of_law(schwartz_saltykov(s, {10}).law()); }},
        {"EM",
         [](const Sample& s, double) {
             return of_law(unfold_em(s, {10, 64, 0}).law());
         }},
        {"EMS .1",
         [](const Sample& s, double) {
             return of_law(unfold_em(s, {10, 64, 0.1}).law());
         }},
        {"isotonic", [](const Sample& s, double) { return of_law(unfold_isotonic(s)); }},
    }};
    for (const auto& [name, method] : unfoldings)
        for (const Truth& truth : {exponential, lognormal})
            for (const std::size_t n : {std::size_t{50}, std::size_t{200}})
                row(name, truth, 0, n, kRuns, method);

    const Sample three_hundred = draw(exponential.law, 0, 300, 0);
    const Sample fifty = draw(exponential.law, 0, 50, 0);
    const std::array at = {0.5, 1.0, 2.0};
    fmt::print("\n300 profiles, five laws with intervals: {:.3f} s (0.1)\n",
               seconds([&] { fit_laws(three_hundred); }));
    for (const Family family : {Family::exponential, Family::lognormal})
        fmt::print("50 profiles, band of 1000 resamples, {}: {:.2f} s (10)\n", family_name(family),
                   seconds([&] { f3_band(fifty, likeliest_law(fifty, family), at); }));
}

} // namespace
} // namespace taihu

int main() {
    try {
        taihu::table();
        return 0;
    } catch (const std::exception& e) {
        fmt::print(stderr, "estimators: {}\n", e.what());
        return 1;
    }
}
