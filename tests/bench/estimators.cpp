// The simulation table of the estimators: how far each is from a truth that is drawn, beside what
// it is held to. Deterministic; about two minutes on two processors. Not a test:
// the tests run a small share of it.
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stats/core/error.h"
#include "stats/fit.h"
#include "stats/sampler.h"
#include "stats/section_draws.h"
#include "stats/unfold.h"
#include "tests/bench/bars.h"
#include "tests/bench/parallel.h"

namespace taihu {
namespace {

constexpr double kArea = 50;

struct Truth {
    const char* name;
    Law law; // of mean 1
};

struct Estimate {
    double ratio = 0; ///< 1 / mean diameter, or N_V, over its truth
    std::optional<Law> law;
    std::optional<bool> covered;     ///< by the interval of the rate, or of sd_log
    std::optional<bool> n_v_covered; ///< by that of N_V
};

/// A Poisson number of profiles, of which those above the limit are marked.
struct Draw {
    Sample sample;
    double n_v = 0;       ///< of the process: what intervals have to hold
    double drawn_n_v = 0; ///< of the number drawn: what estimates are measured by, as the goals
                          ///< are for a given number of profiles
};

/// One or more estimates from one sample.
using Method = std::function<std::vector<Estimate>(const Draw&)>;

struct Errors {
    double bias = 0, rmse = 0, f3 = 0;
    double covered = 0, n_v_covered = 0; ///< percent of the runs that have an interval
    int n_failed = 0;
};

Draw draw(const Law& law, double limit, std::size_t n, std::uint64_t run) {
    const std::uint64_t drawn = poisson_count(static_cast<double>(n), {run, kCountStream});
    const SectionDraws draws(law, 0);
    Draw result{{}, static_cast<double>(n) / kArea, static_cast<double>(drawn) / kArea};
    for (std::uint64_t i = 0; i < drawn; ++i) {
        const double d = draws.diameter({run, 1}, i);
        if (d >= limit)
            result.sample.diameters.push_back(d);
    }
    result.sample.detection_limit = limit;
    result.sample.area = kArea;
    return result;
}

Errors errors_of(const Truth& truth, std::span<const std::vector<Estimate>> runs,
                 std::size_t which) {
    Errors errors;
    int n_done = 0, n_covered = 0, n_n_v_covered = 0;
    for (const std::vector<Estimate>& run : runs) {
        if (run.empty()) {
            ++errors.n_failed;
            continue;
        }
        const Estimate& e = run[which];
        ++n_done;
        errors.bias += e.ratio - 1;
        errors.rmse += (e.ratio - 1) * (e.ratio - 1);
        for (int decile = 1; e.law && decile < 10; ++decile) {
            const double u = 0.1 * decile;
            errors.f3 += std::abs(e.law->cdf(truth.law.quantile(u)) - u) / 9;
        }
        n_covered += e.covered.value_or(false);
        n_n_v_covered += e.n_v_covered.value_or(false);
    }
    errors.bias /= n_done;
    errors.rmse = std::sqrt(errors.rmse / n_done);
    errors.f3 /= n_done;
    errors.covered = 100.0 * n_covered / n_done;
    errors.n_v_covered = 100.0 * n_n_v_covered / n_done;
    return errors;
}

/// Errors of the estimates that the method makes of each sample.
std::vector<Errors> measure(const Truth& truth, double limit, std::size_t n, int n_runs,
                            const Method& method) {
    std::vector<std::vector<Estimate>> runs(static_cast<std::size_t>(n_runs));
    for_each_run(n_runs, [&](int run) {
        const Draw drawn = draw(truth.law, limit, n, static_cast<std::uint64_t>(run));
        try {
            runs[static_cast<std::size_t>(run)] = method(drawn);
        } catch (const Error&) { // counted by errors_of
        }
    });
    std::size_t n_estimates = 0;
    for (const auto& run : runs)
        n_estimates = std::max(n_estimates, run.size());
    std::vector<Errors> errors;
    for (std::size_t i = 0; i < n_estimates; ++i)
        errors.push_back(errors_of(truth, runs, i));
    return errors;
}

std::string failures(const Errors& e) {
    return e.n_failed > 0 ? fmt::format("  {} without an answer", e.n_failed) : "";
}

Estimate of_law(const Law& law) {
    return {1 / law.mean(), law, {}, {}};
}

bool holds(const Interval& interval, double value) {
    return interval.lo <= value && value <= interval.hi;
}

Method of_family(Family family) {
    return [family](const Draw& drawn) -> std::vector<Estimate> {
        const Fit fit = fit_law(drawn.sample, family);
        Estimate e = of_law(fit.law);
        // The rate of an exponential law is 1, sd_log of the lognormal one 0.5.
        e.covered = family == Family::exponential ? holds(fit.intervals[0], 1)
                                                  : holds(fit.intervals[1], 0.5);
        e.n_v_covered = holds({fit.n_v->lo, fit.n_v->hi}, drawn.n_v);
        return {e};
    };
}

// N_V of the first fit, and by all laws.
std::vector<Estimate> numbers(const Draw& drawn) {
    const LawRanking ranking = fit_laws(drawn.sample);
    const auto& first = ranking.fits.front().n_v;
    const auto& all = ranking.n_v;
    return {{first->estimate / drawn.drawn_n_v, {}, {}, holds({first->lo, first->hi}, drawn.n_v)},
            {all->mean / drawn.drawn_n_v, {}, {}, holds({all->lo, all->hi}, drawn.n_v)}};
}

const Truth kExponential{"exponential", Law::exponential(1)};
const Truth kLognormal{"lognormal(.5)", Law(Family::lognormal, std::array{-0.125, 0.5})};

// Laws of one family, known to be the right one; with a limit of 0.3 mean diameters errors may be
// 30 % greater. Of the lognormal law the mean stands for N_V.
void known_family(Bars& bars) {
    fmt::print("Likelihood, family known: 1 / mean diameter; intervals of 95 %: of rate or sd_log, "
               "and of N_V\n{:<14} {:>4} {:>4} {:>5}  {:<22} {:<28} {:>5}  {:<24} {}\n",
               "truth", "d0", "n", "runs", "RMSE", "bias", "F3err", "parameter [%]", "N_V [%]");
    const auto row = [&](const Truth& truth, Family family, double limit, std::size_t n, int runs,
                         std::optional<double> most, std::optional<double> most_bias) {
        const Errors e = measure(truth, limit, n, runs, of_family(family)).front();
        fmt::print("{:<14} {:>4} {:>4} {:>5}  {:<22} {:<28} {:>5.3f}  {:<24} {}{}\n", truth.name,
                   limit, n, runs,
                   most ? bars.at_most(e.rmse, *most) : fmt::format("{:.3f}", e.rmse),
                   most_bias ? bars.within(e.bias, -*most_bias, *most_bias)
                             : fmt::format("{:.3f}", e.bias),
                   e.f3, bars.within(e.covered, 92, 98, 1), bars.within(e.n_v_covered, 92, 98, 1),
                   failures(e));
    };
    for (const auto& [limit, worse] : {std::pair{0.0, 1.0}, std::pair{0.3, 1.3}}) {
        row(kExponential, Family::exponential, limit, 50, 2000, worse * 0.135, worse * 0.02);
        row(kExponential, Family::exponential, limit, 200, 2000, worse * 0.065, worse * 0.02);
        row(kLognormal, Family::lognormal, limit, 50, 1000, {}, {});
        row(kLognormal, Family::lognormal, limit, 200, 1000, worse * 0.08, {});
    }
}

// N_V when five families are fitted. Only the lognormal truth is held to something: the others show
// what the estimator does to laws it was not asked about.
void unknown_family(Bars& bars) {
    const std::array<Truth, 6> truths = {
        {kLognormal,
         kExponential,
         {"gamma(2)", Law(Family::gamma, std::array{2.0, 0.5})},
         {"weibull(1.5)", Law(Family::weibull, std::array{1.5, 1 / std::tgamma(1 + 1 / 1.5)})},
         {"lognormal(.8)", Law(Family::lognormal, std::array{-0.32, 0.8})},
         {"gamma(.7)", Law(Family::gamma, std::array{0.7, 1 / 0.7})}}};
    fmt::print(
        "\nN_V, family not known: of the first fit by AICc, and by all laws with its interval "
        "of 95 %\n{:<14} {:>4} {:>4} {:>5}  {:>10} {:>6}  {:>8} {:>6} {:>6}\n",
        "truth", "d0", "n", "runs", "first bias", "RMSE", "all bias", "%", "RMSE");
    const auto row = [&](const Truth& truth, double limit, std::size_t n, int runs,
                         std::optional<double> most) {
        const auto e = measure(truth, limit, n, runs, numbers);
        fmt::print("{:<14} {:>4} {:>4} {:>5}  {:>+10.2f} {:>6.3f}  {:>+8.2f} {:>6.1f}  {}{}\n",
                   truth.name, limit, n, runs, e[0].bias, e[0].rmse, e[1].bias, e[1].n_v_covered,
                   most ? bars.at_most(e[1].rmse, *most) : fmt::format("{:.3f}", e[1].rmse),
                   failures(e[1]));
    };
    for (const double limit : {0.0, 0.3})
        for (const std::size_t n : {std::size_t{50}, std::size_t{200}})
            for (const Truth& truth : truths) {
                const bool held = &truth == truths.data() && n == 200;
                row(truth, limit, n, held ? 600 : 100,
                    held ? std::optional(limit > 0 ? 0.104 : 0.08) : std::nullopt);
            }
    for (const Truth& truth : truths) // half of the mean diameter: more than can be made good
        row(truth, 0.5, 200, 100, {});
}

void unfoldings() {
    const std::array<std::pair<const char*, std::function<Law(const Sample&)>>, 4> methods = {{
        {"Schwartz-Saltykov", [](const Sample& s) { return schwartz_saltykov(s, {10}).law(); }},
        {"EM",
         [](const Sample& s) {
             return unfold_em(s, {10, 64, 0}).law();
         }},
        {"EMS .1",
         [](const Sample& s) {
             return unfold_em(s, {10, 64, 0.1}).law();
         }},
        {"isotonic", [](const Sample& s) { return unfold_isotonic(s); }},
    }};
    fmt::print("\nNo family: 1 / mean diameter of what the profiles unfold to, no limit\n"
               "{:<18} {:<14} {:>4} {:>5} {:>7} {:>6} {:>6}\n",
               "method", "truth", "n", "runs", "bias", "RMSE", "F3err");
    for (const auto& [name, method] : methods)
        for (const Truth& truth : {kExponential, kLognormal})
            for (const std::size_t n : {std::size_t{50}, std::size_t{200}}) {
                constexpr int kRuns = 100;
                const auto unfold = [&](const Draw& drawn) {
                    return std::vector{of_law(method(drawn.sample))};
                };
                const Errors e = measure(truth, 0, n, kRuns, unfold).front();
                fmt::print("{:<18} {:<14} {:>4} {:>5} {:>+7.3f} {:>6.3f} {:>6.3f}{}\n", name,
                           truth.name, n, kRuns, e.bias, e.rmse, e.f3, failures(e));
            }
}

} // namespace
} // namespace taihu

int main() {
    try {
        taihu::Bars bars;
        taihu::known_family(bars);
        taihu::unknown_family(bars);
        taihu::unfoldings();
        bars.print_sum();
        return 0;
    } catch (const std::exception& e) {
        fmt::print(stderr, "estimators: {}\n", e.what());
        return 1;
    }
}
