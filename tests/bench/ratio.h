#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <sys/resource.h>

namespace taihu {

/// Processor time of this process so far, user and system, all threads [s].
inline double processor_s() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

inline double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// Ours and the peer's in turn, `n` times each; one line with the medians and their ratio against a
/// bar.
template <class Ours, class Peer>
double compare(const std::string& what, double bar, int n, Ours&& ours, Peer&& peer) {
    std::vector<double> a, b;
    for (int i = 0; i < n; ++i) {
        const double t0 = processor_s();
        ours();
        const double t1 = processor_s();
        peer();
        a.push_back(t1 - t0);
        b.push_back(processor_s() - t1);
    }
    const double ratio = median(b) / median(a);
    fmt::print("{:<34} {:>9.4f} {:>9.4f} {:>7.1f}x  bar {:.0f}x {}\n", what, median(a), median(b),
               ratio, bar, ratio >= bar ? "met" : "not met");
    return ratio;
}

} // namespace taihu
