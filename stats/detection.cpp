#include "stats/detection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr int kSteps = 64; // of the table of g
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The smallest diameter that no longer fits into the window.
double greatest_fit(const Window& window) {
    double lo = 0, hi = std::max(window.width(), window.height());
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (lo + hi);
        (window.eroded_area(middle) > 0 ? lo : hi) = middle;
    }
    return hi;
}

struct WeightedFrame {
    double weight, limit;
    const Window* window; // null: no edge
};

std::vector<WeightedFrame> weighted_frames(const Sample& sample, double limit) {
    if (sample.frames.empty())
        return {{1, limit, nullptr}};
    const double area = *searched_area(sample);
    const bool edge = sample.counting == Counting::whole;
    std::vector<WeightedFrame> frames;
    for (const Frame& f : sample.frames)
        frames.push_back({f.area / area, detection_limit(sample, f), edge ? &*f.window : nullptr});
    return frames;
}

// g at d, with the frames whose limit is at or below `from`.
double share_of(const std::vector<WeightedFrame>& frames, double d, double from) {
    double sum = 0;
    for (const WeightedFrame& f : frames)
        if (f.limit <= from)
            sum += f.weight * (f.window ? f.window->eroded_area(d) / f.window->area() : 1);
    return std::min(1.0, sum);
}

void check_fits(const Sample& sample, const Detection& detection) {
    const auto refuse = [](const std::string& name, double d) {
        throw Error(Fault::bad_input,
                    "detection: " + name + " is " + shortest(d) +
                        " but no whole profile of that size fits into a window that was searched "
                        "for it; count profiles by their centre or correct the window");
    };
    for (std::size_t i = 0; i < sample.diameters.size(); ++i)
        if (!(detection.share(sample.diameters[i]) > 0))
            refuse("diameters[" + std::to_string(i) + "]", sample.diameters[i]);
    for (std::size_t i = 0; i < sample.bins.size(); ++i)
        if (sample.bins[i].count > 0 && !(detection.share(sample.bins[i].lo) > 0) &&
            !(detection.share(sample.bins[i].hi) > 0))
            refuse("bins[" + std::to_string(i) + "]", sample.bins[i].lo);
}

} // namespace

Detection::Detection(const Sample& sample) : area_(searched_area(sample)) {
    const double least = detection_limit(sample);
    const std::vector<WeightedFrame> frames = weighted_frames(sample, least);
    std::vector<double> knots;
    double end = 0;
    for (const WeightedFrame& f : frames) {
        knots.push_back(f.limit);
        if (f.window)
            end = std::max(end, greatest_fit(*f.window));
    }
    for (int i = 1; i <= kSteps && end > least; ++i)
        knots.push_back(least + (end - least) * i / kSteps);
    std::sort(knots.begin(), knots.end());
    knots.erase(std::unique(knots.begin(), knots.end()), knots.end());
    for (std::size_t i = 0; i + 1 < knots.size(); ++i)
        pieces_.push_back({knots[i], knots[i + 1], share_of(frames, knots[i], knots[i]),
                           share_of(frames, knots[i + 1], knots[i])});
    const double rest = share_of(frames, knots.back(), knots.back());
    pieces_.push_back({knots.back(), kInfinity, rest, rest});
    check_fits(sample, *this);
}

const Detection::Piece* Detection::piece_at(double d) const {
    if (!(d >= limit()))
        return nullptr;
    const auto above = std::upper_bound(pieces_.begin(), pieces_.end(), d,
                                        [](double v, const Piece& p) { return v < p.lo; });
    return &*(above - 1);
}

double Detection::share(double d) const {
    const Piece* p = piece_at(d);
    if (!p)
        return 0;
    return p->g_lo == p->g_hi ? p->g_lo
                              : std::lerp(p->g_lo, p->g_hi, (d - p->lo) / (p->hi - p->lo));
}

bool Detection::is_flat(double lo, double hi) const {
    const Piece* p = piece_at(lo);
    return p && hi <= p->hi && p->g_lo == p->g_hi;
}

double Detection::seen(const std::function<double(double)>& survival, double lo, double hi) const {
    double sum = 0;
    for (const Piece& p : pieces_) {
        const double a = std::max(lo, p.lo), b = std::min(hi, p.hi);
        if (!(a < b))
            continue;
        const double at_a = survival(a), at_b = std::isinf(b) ? 0 : survival(b);
        if (p.g_lo == p.g_hi) {
            sum += p.g_lo * (at_a - at_b);
            continue;
        }
        // By parts, with Simpson's rule for the integral of 1 - F2 over the short piece.
        const double slope = (p.g_hi - p.g_lo) / (p.hi - p.lo);
        const double below = (at_a + 4 * survival(0.5 * (a + b)) + at_b) * (b - a) / 6;
        sum += share(a) * at_a - (p.g_lo + slope * (b - p.lo)) * at_b + slope * below;
    }
    return sum;
}

} // namespace taihu
