#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace taihu {

/// A partition whose classes are named by their smallest member.
class Partition {
public:
    explicit Partition(std::size_t n) : parent_(n) { reset(n); }

    void reset(std::size_t n) {
        parent_.resize(n);
        std::iota(parent_.begin(), parent_.end(), 0u);
    }
    std::uint32_t find(std::uint32_t i) {
        while (parent_[i] != i)
            i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::uint32_t a, std::uint32_t b) {
        a = find(a);
        b = find(b);
        if (a != b)
            parent_[std::max(a, b)] = std::min(a, b);
    }
    std::size_t n_classes() const {
        std::size_t n = 0;
        for (std::uint32_t i = 0; i < parent_.size(); ++i)
            n += parent_[i] == i;
        return n;
    }

private:
    std::vector<std::uint32_t> parent_;
};

} // namespace taihu
