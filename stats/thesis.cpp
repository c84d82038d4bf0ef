#include "stats/thesis.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <numeric>

#include "stats/chi_squared.h"
#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr int kParameters = 2;

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_input, "thesis method: " + what);
}

// The bins that are tested and what the formulas of all four laws need.
struct Row {
    std::vector<double> centers, observed;
    double n, width, mean;
    std::size_t first_bin;
    double greatest; // upper edge of the last bin
};

Row tested_row(const ThesisInversion& inversion) {
    const auto first = static_cast<std::ptrdiff_t>(inversion.first_bin);
    Row row{{inversion.centers.begin() + first, inversion.centers.end()},
            {inversion.density.begin() + first, inversion.density.end()},
            inversion.n,
            inversion.bin_width,
            0,
            inversion.first_bin,
            inversion.bin_width * static_cast<double>(inversion.centers.size())};
    // Divided by the number of profiles although the row sums to more: so does the thesis.
    row.mean =
        std::inner_product(row.centers.begin(), row.centers.end(), row.observed.begin(), 0.0) /
        row.n;
    return row;
}

std::vector<double> expect_uniform(const Row& row) {
    return std::vector<double>(row.centers.size(), row.n * row.width / row.greatest);
}

std::vector<double> expect_normal(const Row& row) {
    double variance = 0;
    for (std::size_t i = 0; i < row.centers.size(); ++i)
        variance +=
            row.observed[i] * (row.centers[i] - row.mean) * (row.centers[i] - row.mean) / row.n;
    if (!(variance > 0))
        refuse("the inverted density lies in one bin; use the fit");
    std::vector<double> expected;
    for (const double c : row.centers)
        expected.push_back(row.n * row.width *
                           std::exp(-(c - row.mean) * (c - row.mean) / (2 * variance)) /
                           std::sqrt(2 * std::numbers::pi * variance));
    return expected;
}

// A Poisson law of the bin's number, counted from 0, with a whole mean.
std::vector<double> expect_poisson(const Row& row) {
    const double mean = std::max(1.0, std::floor(row.mean / row.width - 0.5));
    std::vector<double> expected;
    for (std::size_t i = 0; i < row.centers.size(); ++i) {
        const auto k = static_cast<double>(row.first_bin + i);
        expected.push_back(row.n * std::exp(k * std::log(mean) - mean - std::lgamma(k + 1)));
    }
    return expected;
}

// The density at the bin centres, scaled so that the tested bins hold all holes.
std::vector<double> expect_exponential(const Row& row) {
    const double rate = 1 / (row.mean - row.width * static_cast<double>(row.first_bin));
    std::vector<double> expected;
    for (const double c : row.centers)
        expected.push_back(std::exp(-rate * (c - row.centers.front())));
    const double sum = std::accumulate(expected.begin(), expected.end(), 0.0);
    for (double& e : expected)
        e *= row.n / sum;
    return expected;
}

std::string fixed(double value, int digits) {
    std::array<char, 400> text{}; // the longest double has 309 digits before the point
    const auto written = std::to_chars(text.data(), text.data() + text.size(), value,
                                       std::chars_format::fixed, digits);
    return {text.data(), written.ptr};
}

// As the thesis prints: two digits, no zeros behind a whole number.
std::string table_number(double value) {
    const std::string text = fixed(value, 2);
    return text.ends_with(".00") ? text.substr(0, text.size() - 3) : text;
}

std::string significant(double value) {
    std::array<char, 32> text{};
    const auto written =
        std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 4);
    return {text.data(), written.ptr};
}

std::string left(std::string text, std::size_t width) {
    text.resize(std::max(width, text.size()), ' ');
    return text;
}

std::string right(const std::string& text, std::size_t width) {
    return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

template <class Print>
std::string table_row(const char* name, std::span<const double> values, Print print) {
    std::string line = left(name, 11);
    for (const double v : values)
        line += right(print(v), 7);
    return line + "\n";
}

} // namespace

ThesisInversion thesis_inversion(std::span<const Bin> bins) {
    Sample sample;
    sample.bins.assign(bins.begin(), bins.end());
    check_sample(sample);
    if (bins.size() < 3)
        refuse(std::to_string(bins.size()) + " bins; at least 3 are needed");
    ThesisInversion result;
    result.bin_width = bins.back().hi / static_cast<double>(bins.size());
    for (std::size_t i = 0; i < bins.size(); ++i) {
        const double lo = result.bin_width * static_cast<double>(i);
        if (std::abs(bins[i].lo - lo) > 1e-9 * bins.back().hi)
            refuse("bin " + std::to_string(i + 1) + " begins at " + shortest(bins[i].lo) +
                   ", not " + shortest(lo) + "; bins must begin at 0 and have one width");
        result.centers.push_back(0.5 * (bins[i].lo + bins[i].hi));
        result.counts.push_back(static_cast<double>(bins[i].count));
    }
    if (bins.back().count == 0)
        refuse("the last bin is empty; leave out the bins past the greatest diameter");
    const auto filled = [](double count) { return count > 0; };
    result.first_bin = static_cast<std::size_t>(
        std::find_if(result.counts.begin(), result.counts.end(), filled) - result.counts.begin());
    result.n = std::accumulate(result.counts.begin(), result.counts.end(), 0.0);

    double denominator = 0, below = 0, previous = 0;
    for (std::size_t i = 0; i < bins.size(); ++i)
        denominator += result.counts[i] / result.centers[i];
    for (std::size_t k = 0; k < bins.size(); ++k) {
        const double d = result.centers[k];
        double numerator = 0;
        for (std::size_t i = k + 1; i < bins.size(); ++i)
            numerator +=
                result.counts[i] / std::sqrt(result.centers[i] * result.centers[i] - d * d);
        below += result.counts[k];
        const double f3 = std::max(0.0, 1 - numerator / denominator);
        result.f2.push_back(below / result.n);
        result.f3.push_back(f3);
        result.density.push_back(std::max(0.0, f3 - previous) * result.n);
        previous = f3;
    }
    return result;
}

std::vector<ThesisTest> thesis_tests(const ThesisInversion& inversion) {
    const Row row = tested_row(inversion);
    const int df = static_cast<int>(row.centers.size()) - 1 - kParameters;
    if (df < 1)
        refuse(std::to_string(row.centers.size()) +
               " bins from the first filled one on; at least 4 are needed");
    const auto test = [&](std::string_view law, const std::vector<double>& expected) {
        ThesisTest result{.law = law, .df = df, .critical = chi_squared_critical(df, 0.05)};
        for (std::size_t i = 0; i < expected.size(); ++i)
            result.chi_squared +=
                (row.observed[i] - expected[i]) * (row.observed[i] - expected[i]) / expected[i];
        result.rejected = result.chi_squared >= result.critical;
        result.least_expected = *std::min_element(expected.begin(), expected.end());
        return result;
    };
    return {test("uniform", expect_uniform(row)), test("normal", expect_normal(row)),
            test("Poisson", expect_poisson(row)), test("exponential", expect_exponential(row))};
}

Law empirical_law(const ThesisInversion& inversion) {
    std::vector<CdfPoint> points = {{0, 0}};
    for (std::size_t i = 0; i < inversion.centers.size(); ++i)
        points.push_back(
            {inversion.centers[i], std::clamp(inversion.f3[i], points.back().cdf, 1.0)});
    points.back().cdf = 1;
    return Law::empirical(std::move(points));
}

std::string format_thesis_tables(const ThesisInversion& inversion,
                                 std::span<const ThesisTest> tests) {
    std::vector<double> numbers(inversion.centers.size());
    std::iota(numbers.begin(), numbers.end(), 1.0);
    std::string text =
        "Distribution and density of the diameters (N = " + table_number(inversion.n) + ")\n";
    text += table_row("Bin", numbers, table_number);
    text += table_row("D", inversion.centers, significant);
    text += table_row("F2", inversion.f2, table_number);
    text += table_row("F2' N dD", inversion.counts, table_number);
    text += table_row("F3", inversion.f3, table_number);
    text += table_row("F3' N dD", inversion.density, table_number);
    text += "\nChi-squared of F3' N dD\n";
    for (const ThesisTest& test : tests)
        text += left(std::string(test.law), 12) + right(fixed(test.chi_squared, 3), 9) + "  df " +
                std::to_string(test.df) + "  critical " + fixed(test.critical, 3) +
                (test.rejected ? "  rejected\n" : "  not rejected\n");
    const auto least =
        std::min_element(tests.begin(), tests.end(), [](const auto& a, const auto& b) {
            return a.least_expected < b.least_expected;
        });
    text +=
        "\nThe method is kept for comparison with the thesis; a fit is what to trust. The tested "
        "numbers are differences of an inverted curve, not counts, and two parameters are taken "
        "off for every law.\n";
    if (least != tests.end() && least->least_expected < 5)
        text += "Some bins expect fewer than 5 holes (" + significant(least->least_expected) +
                " at the least, " + std::string(least->law) +
                "), where chi-squared values mean little.\n";
    text +=
        "Rock 1 of the thesis: its table leaves out the tenth bin, and its 115.276 for the normal "
        "law follows from no mean and deviation of the data; the verdict is the same.\n";
    return text;
}

} // namespace taihu
