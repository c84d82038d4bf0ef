#pragma once
#include <algorithm>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "vdb_ops/dense_detail.h"

namespace taihu {

enum class LineWrite { replace, keep_less };

/// Applies an operation to every line of samples along `axis`: make() gives one for a thread,
/// called as op(line, n), which changes the n numbers in place. `in` and `out` may be the same
/// array.
template <class Make>
void along_lines(const DenseLattice& lattice, int axis, const float* in, float* out,
                 LineWrite write, const Progress* progress, const Make& make) {
    // Across memory, lines go together by 16: each cache line that is fetched serves them all.
    const int bundle = axis == 2 ? 1 : 16;
    const int n = lattice.n[axis], across = axis == 2 ? lattice.n[1] : lattice.n[2];
    const int outer = axis == 0 ? lattice.n[1] : lattice.n[0];
    const int n_bundles = (across + bundle - 1) / bundle;
    const std::size_t stride = lattice.stride(axis),
                      stride_outer = lattice.stride(axis == 0 ? 1 : 0),
                      stride_across = lattice.stride(axis == 2 ? 1 : 2);
    tbb::parallel_for(tbb::blocked_range<int>(0, outer, 2), [&](const auto& range) {
        check_cancelled(progress);
        auto op = make();
        const auto length = static_cast<std::size_t>(n);
        std::vector<float> lines(static_cast<std::size_t>(bundle) * length);
        for (int o = range.begin(); o < range.end(); ++o)
            for (int b = 0; b < n_bundles; ++b) {
                const std::size_t first = static_cast<std::size_t>(o) * stride_outer +
                                          static_cast<std::size_t>(b * bundle) * stride_across;
                const auto count = static_cast<std::size_t>(std::min(bundle, across - b * bundle));
                for (std::size_t i = 0; i < length; ++i)
                    for (std::size_t k = 0; k < count; ++k)
                        lines[k * length + i] = in[first + i * stride + k * stride_across];
                for (std::size_t k = 0; k < count; ++k)
                    op(lines.data() + k * length, n);
                for (std::size_t i = 0; i < length; ++i)
                    for (std::size_t k = 0; k < count; ++k) {
                        float& to = out[first + i * stride + k * stride_across];
                        const float value = lines[k * length + i];
                        to = write == LineWrite::replace ? value : std::min(to, value);
                    }
            }
    });
}

} // namespace taihu
