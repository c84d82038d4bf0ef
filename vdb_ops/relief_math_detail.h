#pragma once
#include <array>
#include <cmath>

namespace taihu {

// What relief needs of the mathematical library, from + - * / and sqrt alone: the same bits on
// every machine.

/// (1/2)^h for h in 0..4, within 4 units in the last place: Taylor's series of exp(-h ln 2 / 4),
/// whose argument is below ln 2, taken to the fourth power.
inline double half_to_the(double h) {
    const double x = -0.25 * h * 0x1.62e42fefa39efp-1;
    double sum = 1;
    for (int k = 20; k >= 1; --k)
        sum = 1 + x / k * sum;
    return (sum * sum) * (sum * sum);
}

/// {cosine, sine} of an angle in full turns, |turns| below 2^40, within 1e-15: the nearest quarter
/// turn is split off exactly, and Taylor's series take the rest of at most an eighth.
inline std::array<double, 2> cos_sin_turns(double turns) {
    const double whole = turns - std::floor(turns);
    const double quarter = std::floor(4 * whole + 0.5);
    const double x = (whole - 0.25 * quarter) * 0x1.921fb54442d18p+2, x2 = x * x;
    double cosine = 1, sine = 1;
    for (int k = 9; k >= 1; --k) {
        cosine = 1 - x2 / ((2 * k - 1) * (2 * k)) * cosine;
        sine = 1 - x2 / ((2 * k) * (2 * k + 1)) * sine;
    }
    sine *= x;
    switch (static_cast<int>(quarter) % 4) {
    case 0:
        return {cosine, sine};
    case 1:
        return {-sine, cosine};
    case 2:
        return {-cosine, -sine};
    default:
        return {sine, -cosine};
    }
}

} // namespace taihu
