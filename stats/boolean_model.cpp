#include "stats/boolean_model.h"

#include <cmath>
#include <numbers>

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

} // namespace

BooleanModel boolean_model(const Law& law, double n_v) {
    if (!(n_v >= 0 && std::isfinite(n_v)))
        throw Error(Fault::bad_argument,
                    "boolean model: n_v is " + shortest(n_v) + "; must be finite and >= 0");
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
