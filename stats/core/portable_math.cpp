#include "stats/core/portable_math.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace taihu {
namespace {

// ln 2 in two parts: 32 bits, so that a product with an exponent is exact, and the rest.
constexpr double kLn2High = 0x1.62e42feep-1;
constexpr double kLn2Low = 0x1.a39ef35793c76p-33;
constexpr double kSqrt2 = 0x1.6a09e667f3bcdp+0;

// 2 s^2 / 3 + 2 s^4 / 5 + ..., by Horner. With s^2 <= 0.0295 the first term left out is below
// 2^-66.
double atanh_tail(double s2) {
    constexpr int kTerms = 12;
    double sum = 0;
    for (int k = kTerms; k >= 1; --k)
        sum = (sum + 2.0 / (2 * k + 1)) * s2;
    return sum;
}

} // namespace

double portable_log(double x) {
    if (!(x > 0))
        return x == 0 ? -std::numeric_limits<double>::infinity()
                      : std::numeric_limits<double>::quiet_NaN();
    if (x > std::numeric_limits<double>::max())
        return x;
    int exponent = 0;
    if (x < std::numeric_limits<double>::min()) {
        x *= 0x1p54;
        exponent = -54;
    }
    const auto bits = std::bit_cast<std::uint64_t>(x);
    exponent += static_cast<int>(bits >> 52) - 1023;
    double m = std::bit_cast<double>((bits & 0xfffffffffffffull) | 0x3ff0000000000000ull);
    if (m > kSqrt2) {
        m *= 0.5;
        ++exponent;
    }
    // ln(1 + f) = 2 atanh(s) with s = f / (2 + f), written as f - f^2 / 2 + a small rest: f is
    // exact, and the rounding of the rest is below the last bit of the result.
    const double f = m - 1;
    const double s = f / (2 + f);
    const double half_square = 0.5 * f * f;
    const double rest = s * (half_square + atanh_tail(s * s));
    if (exponent == 0)
        return f - (half_square - rest);
    return exponent * kLn2High - ((half_square - (rest + exponent * kLn2Low)) - f);
}

double portable_exp(double x) {
    if (!(x < 710)) // a NaN too
        return x != x ? x : std::numeric_limits<double>::infinity();
    if (x < -746)
        return 0;
    const double k = std::floor(x / kLn2High + 0.5);
    // |r| <= 0.35, so that the first term left out is below 2^-57.
    const double r = (x - k * kLn2High) - k * kLn2Low;
    constexpr int kTerms = 13;
    double sum = 1;
    for (int n = kTerms; n >= 1; --n)
        sum = 1 + sum * r / n;
    return std::ldexp(sum, static_cast<int>(k));
}

} // namespace taihu
