#include "stats/boolean_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/special_functions/lambert_w.hpp>

#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

/// Means over the balls of a law: volume, surface, integral of mean curvature.
struct MeanBall {
    explicit MeanBall(const Law& law)
        : v(kPi / 6 * law.moment(3)), s(kPi * law.moment(2)), m(2 * kPi * law.moment(1)) {}
    double v, s, m;

    // chi_V = n exp(-n v) (1 - b n + a n^2).
    double b() const { return m * s / (4 * kPi); }
    double a() const { return kPi / 384 * s * s * s; }
};

void check_n_v(double n_v) {
    if (!(n_v >= 0 && std::isfinite(n_v)))
        throw Error(Fault::bad_argument,
                    "boolean model: n_v is " + shortest(n_v) + "; must be finite and >= 0");
}

/// Where the CDF has a step or a bend.
std::vector<double> knots(const Law& law) {
    if (law.family() == Family::constant || law.family() == Family::uniform)
        return {law.parameters().begin(), law.parameters().end()};
    std::vector<double> at;
    for (const CdfPoint& point : law.points())
        at.push_back(point.diameter);
    return at;
}

/// Mean volume that a ball shares with itself moved by r: pi/12 E[2 D^3 - 3 D^2 r + r^3; D > r].
/// Moments less the part below r, that by parts, so that laws without a density are served too.
double mean_lens(const Law& law, double r) {
    const double m3 = law.moment(3);
    if (r * r * r > 1e9 * m3) // rounding would be all that is left of the difference
        return 0;
    std::vector<double> ends = {0, r};
    for (const double knot : knots(law))
        if (knot > 0 && knot < r)
            ends.push_back(knot);
    std::sort(ends.begin(), ends.end());
    const auto below = [&](double d) { return d * (r - d) * law.cdf(d); };
    double sum = 0;
    for (std::size_t i = 1; i < ends.size(); ++i)
        if (ends[i] > ends[i - 1])
            sum += boost::math::quadrature::gauss_kronrod<double, 31>::integrate(
                below, ends[i - 1], ends[i], 12, 1e-13);
    const double mean = 2 * m3 - 3 * r * law.moment(2) + r * r * r - 6 * sum;
    return kPi / 12 * std::clamp(mean, 0.0, 2 * m3);
}

} // namespace

BooleanModel boolean_model(const Law& law, double n_v) {
    check_n_v(n_v);
    const MeanBall ball(law);
    const double q = std::exp(-n_v * ball.v);
    BooleanModel model;
    model.porosity = -std::expm1(-n_v * ball.v);
    model.s_v = q * n_v * ball.s;
    model.m_v = q * (n_v * ball.m - kPi * kPi / 32 * n_v * n_v * ball.s * ball.s);
    model.chi_v = q * n_v * (1 - ball.b() * n_v + ball.a() * n_v * n_v);
    model.a_a = model.porosity;
    model.l_a = kPi / 4 * model.s_v;
    model.chi_a = model.m_v / (2 * kPi);
    model.n_a = n_v * law.mean();
    model.n_a_seen = q * model.n_a;
    return model;
}

double boolean_covariance(const Law& law, double n_v, double r) {
    check_n_v(n_v);
    if (!(r >= 0 && std::isfinite(r)))
        throw Error(Fault::bad_argument,
                    "boolean model: the distance is " + shortest(r) + "; must be finite and >= 0");
    const double v = MeanBall(law).v, porosity = -std::expm1(-n_v * v);
    return 2 * porosity + std::expm1(-n_v * (2 * v - mean_lens(law, r)));
}

double overlap_corrected_n_a(double n_a_seen, double a_a) {
    if (!(n_a_seen >= 0 && std::isfinite(n_a_seen) && a_a >= 0 && a_a < 1))
        throw Error(Fault::bad_argument, "overlap correction: " + shortest(n_a_seen) +
                                             " profiles per area with a share " + shortest(a_a) +
                                             " of holes; must be >= 0 and in 0..1, below 1");
    return n_a_seen / (1 - a_a);
}

std::optional<double> overlap_corrected_n_v(const Law& law, double n_v_seen) {
    if (!(n_v_seen >= 0 && std::isfinite(n_v_seen)))
        throw Error(Fault::bad_argument, "overlap correction: n_v is " + shortest(n_v_seen) +
                                             "; must be finite and >= 0");
    const double v = MeanBall(law).v, seen = n_v_seen * v;
    if (seen * std::numbers::e >= 1)
        return std::nullopt;
    return -boost::math::lambert_w0(-seen) / v;
}

std::optional<double> sponge_porosity(const Law& law) {
    const MeanBall ball(law);
    const double a = ball.a(), b = ball.b(), discriminant = b * b - 4 * a;
    if (discriminant < 0)
        return std::nullopt;
    const double n_v = 2 / (b + std::sqrt(discriminant)); // the smaller root, without cancellation
    return -std::expm1(-n_v * ball.v);
}

} // namespace taihu
