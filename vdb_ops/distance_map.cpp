#include "vdb_ops/distance_map_detail.h"

#include <limits>

#include "vdb_ops/dense_lines_detail.h"

namespace taihu {
namespace {

constexpr float kFar = 1e20f; // a squared distance that stands for none

/// Squared distances along a line to the nearest change of sign on it.
class Crossings {
public:
    void operator()(float* line, int n) {
        from_left_.resize(static_cast<std::size_t>(n));
        float last = -std::numeric_limits<float>::infinity();
        for (int i = 0; i < n; ++i) {
            if (i > 0 && (line[i - 1] < 0) != (line[i] < 0))
                last = static_cast<float>(i - 1) + line[i - 1] / (line[i - 1] - line[i]);
            from_left_[static_cast<std::size_t>(i)] = static_cast<float>(i) - last;
        }
        float next = std::numeric_limits<float>::infinity(), right = 0;
        for (int i = n - 1; i >= 0; --i) {
            const float here = line[i];
            if (i + 1 < n && (here < 0) != (right < 0))
                next = static_cast<float>(i) + here / (here - right);
            right = here;
            const float d =
                std::min(from_left_[static_cast<std::size_t>(i)], next - static_cast<float>(i));
            line[i] = std::min(d * d, kFar);
        }
    }

private:
    std::vector<float> from_left_;
};

/// line[i] = min over j of line[j] + (i - j)^2.
class Envelope {
public:
    void operator()(float* line, int n) {
        at_.resize(static_cast<std::size_t>(n));
        begin_.resize(static_cast<std::size_t>(n));
        low_.resize(static_cast<std::size_t>(n));
        std::size_t m = 0; // parabolas in the envelope
        for (int j = 0; j < n; ++j) {
            if (line[j] >= kFar)
                continue;
            const double f = line[j] + static_cast<double>(j) * j;
            double begin = -std::numeric_limits<double>::infinity();
            for (; m > 0; --m) {
                const double g = low_[m - 1] + static_cast<double>(at_[m - 1]) * at_[m - 1];
                begin = (f - g) / (2.0 * (j - at_[m - 1]));
                if (begin > begin_[m - 1])
                    break;
                begin = -std::numeric_limits<double>::infinity();
            }
            at_[m] = j;
            low_[m] = line[j];
            begin_[m++] = begin;
        }
        if (m == 0)
            return;
        std::size_t k = 0;
        for (int i = 0; i < n; ++i) {
            while (k + 1 < m && begin_[k + 1] < i)
                ++k;
            const auto d = static_cast<float>(i - at_[k]);
            line[i] = d * d + low_[k];
        }
    }

private:
    std::vector<int> at_;
    std::vector<double> begin_; // where a parabola takes over from the one before
    std::vector<float> low_;    // its lowest value
};

/// Squared distances to the places where lines along the axes cross the surface. Envelopes commute
/// with each other and with minima, so the crossings of all axes share the last ones.
std::vector<float> squared_distances(const DenseLattice& lattice, std::span<const float> values,
                                     const Progress* progress) {
    const auto crossings = [&](int axis, std::vector<float>& to) {
        along_lines(lattice, axis, values.data(), to.data(), LineWrite::replace, progress,
                    [] { return Crossings(); });
    };
    const auto envelope = [&](int axis, const std::vector<float>& from, std::vector<float>& to,
                              LineWrite write) {
        along_lines(lattice, axis, from.data(), to.data(), write, progress,
                    [] { return Envelope(); });
    };
    std::vector<float> nearest(lattice.size()), other(lattice.size());
    crossings(2, nearest);
    envelope(0, nearest, nearest, LineWrite::replace);
    crossings(0, other);
    envelope(2, other, nearest, LineWrite::keep_less);
    envelope(1, nearest, nearest, LineWrite::replace);
    crossings(1, other);
    envelope(0, other, other, LineWrite::replace);
    envelope(2, other, nearest, LineWrite::keep_less);
    return nearest;
}

} // namespace

std::vector<float> signed_distances(const DenseLattice& lattice, std::span<const float> values,
                                    float trusted, const Progress* progress) {
    std::vector<float> d = squared_distances(lattice, values, progress);
    // How far, at most, the nearest crossing lies beside the nearest point of a plane, squared.
    constexpr float kBeside = 0.75f;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, d.size(), 65536), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const float own = std::abs(values[i]), d2 = d[i];
            const bool agree = own < trusted && own * own <= d2 && own * own >= d2 - kBeside;
            const float distance = agree        ? own
                                   : d2 >= kFar ? std::numeric_limits<float>::infinity()
                                                : std::sqrt(d2);
            // Rounding may put a crossing on the sample itself, which must keep its side.
            d[i] = values[i] < 0 ? -std::max(distance, 1e-6f) : distance;
        }
    });
    return d;
}

} // namespace taihu
