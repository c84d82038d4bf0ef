#pragma once
#include <array>
#include <span>
#include <string_view>
#include <vector>

namespace taihu {

/// The laws of sphere diameters that taihu knows.
enum class Family {
    exponential,      ///< `rate`
    gamma,            ///< `shape`, `scale`
    weibull,          ///< `shape`, `scale`
    lognormal,        ///< `mean_log`, `sd_log`
    truncated_normal, ///< `mean`, `sd` of the normal law before everything below 0 is cut away
    uniform,          ///< `lo`, `hi`
    constant,         ///< `diameter`
    empirical         ///< no parameters: a table of (diameter, CDF), straight lines between
};

/// `exponential`, `truncated_normal`, ...: the word used in files and messages.
std::string_view family_name(Family family);

/// The family of that name.
/// \throws Error bad_argument, with the nearest known name.
Family family_from_name(std::string_view name);

/// Names of the family's parameters in the order Law::parameters() has them.
std::span<const std::string_view> parameter_names(Family family);

/// A point of an empirical law: the share `cdf` of diameters is at most `diameter`.
struct CdfPoint {
    double diameter = 0;
    double cdf = 0;
    friend constexpr bool operator==(const CdfPoint&, const CdfPoint&) = default;
};

/// A probability law of diameters D >= 0, in some unit of length that the law does not know.
///
/// Immutable; every function may be called from many threads. Lengths must lie in 1e-12..1e12.
class Law {
public:
    /// \param parameters  in the order of parameter_names(family). Legal ranges: lengths and
    ///        1/rate 1e-12..1e12 (uniform: 0 <= lo < hi; truncated normal: mean -6..1000 sd), gamma
    ///        shape 0.01..1e4, Weibull shape 0.1..1e3, mean_log -27..27, sd_log 1e-3..4.
    /// \throws Error bad_argument: another number of parameters, or one out of range, by name;
    ///         also for Family::empirical, which has its own maker.
    Law(Family family, std::span<const double> parameters);
    static Law exponential(double rate);
    static Law constant(double diameter);

    /// \param points  at least two, diameters >= 0 and rising, CDF from 0 to 1 and never falling.
    /// \throws Error bad_argument, with the index of the point.
    static Law empirical(std::vector<CdfPoint> points);

    Family family() const { return family_; }
    std::span<const double> parameters() const;
    std::span<const CdfPoint> points() const { return points_; } ///< of an empirical law, else none

    /// Density f3(D); 0 for D < 0. For a constant law, which has none, 0 everywhere.
    double pdf(double diameter) const;
    /// F3(D), the share of diameters <= D.
    double cdf(double diameter) const;
    /// Smallest D with F3(D) >= u. The same bits on every machine for the exponential, uniform,
    /// constant and empirical laws; to about 1e-14 for the others.
    /// \param u  0..1; 1 gives infinity where the law has no upper end.
    /// \throws Error bad_argument for another u.
    double quantile(double u) const;
    double mean() const { return moment(1); }
    /// E[D^k], k >= 0. Relative error about 1e-13 (truncated normal: 1e-10 up to k = 4).
    double moment(int k) const;

    friend bool operator==(const Law&, const Law&) = default;

private:
    Law() = default;
    Family family_ = Family::constant;
    std::array<double, 2> parameters_{};
    double log_normaliser_ = 0; ///< of the density, where it costs a special function
    std::vector<CdfPoint> points_;
};

/// The law of factor * D: the same diameters in a unit that is `factor` times smaller.
/// \throws Error bad_argument: factor not finite and > 0, or a parameter that leaves its range.
Law scaled(const Law& law, double factor);

} // namespace taihu
