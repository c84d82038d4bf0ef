#pragma once
#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace taihu {

/// work(0) .. work(n - 1), each once, on all processors; `work` keeps its result under its number.
template <class Work>
void for_each_run(int n, Work&& work) {
    std::atomic<int> next{0};
    const auto serve = [&] {
        for (int run = next++; run < n; run = next++)
            work(run);
    };
    std::vector<std::jthread> others;
    for (unsigned i = 1; i < std::max(1U, std::thread::hardware_concurrency()); ++i)
        others.emplace_back(serve);
    serve();
}

} // namespace taihu
