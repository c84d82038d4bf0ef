#pragma once
#include <algorithm>
#include <vector>

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

/// Medians of processor time [s].
struct Pair {
    double ours = 0, peer = 0;
    double ratio() const { return peer / ours; }
};

/// Ours and the peer's in turn, `n` times each, so that both meet the same machine.
template <class Ours, class Peer>
Pair compare(int n, Ours&& ours, Peer&& peer) {
    std::vector<double> a, b;
    for (int i = 0; i < n; ++i) {
        const double t0 = processor_s();
        ours();
        const double t1 = processor_s();
        peer();
        a.push_back(t1 - t0);
        b.push_back(processor_s() - t1);
    }
    return {median(a), median(b)};
}

} // namespace taihu
