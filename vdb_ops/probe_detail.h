#pragma once
#include <algorithm>
#include <cmath>

#include "vdb_ops/field_probe.h"

namespace taihu {

/// Central differences of value(p).
template <class ValueFn>
Vec3 gradient_of(ValueFn&& value, const Vec3& p, double step_m) {
    Vec3 g;
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 step;
        step[axis] = step_m;
        g[axis] = (value(p + step) - value(p - step)) / (2 * step_m);
    }
    return g;
}

/// How far apart gradient_of() looks, for a probe of this reach.
inline double gradient_step(double reach_m) {
    return 1e-3 * reach_m;
}

/// A cube of 2^depth cells along each edge that holds a box; cells at least as large as asked for.
class CellCube {
public:
    CellCube(const Box& box, double least_cell_m, int most_depth) : origin_(box.lo) {
        const double longest = std::max(box.longest(), least_cell_m);
        while (depth_ < most_depth && longest / (2 << depth_) >= least_cell_m)
            ++depth_;
        cell_m_ = longest / (1 << depth_);
    }
    int depth() const { return depth_; }
    double cell_m() const { return cell_m_; }
    const Vec3& origin() const { return origin_; }
    std::size_t size() const { return std::size_t{1} << (3 * depth_); }
    std::size_t index(int i, int j, int k) const {
        return (static_cast<std::size_t>(i) << (2 * depth_)) |
               (static_cast<std::size_t>(j) << depth_) | static_cast<std::size_t>(k);
    }
    /// The cell of a point of the box.
    std::size_t cell(const Vec3& p) const {
        const auto along = [this](double x) {
            const double most = (1 << depth_) - 1;
            return static_cast<int>(std::clamp(x / cell_m_, 0.0, most));
        };
        return index(along(p.x - origin_.x), along(p.y - origin_.y), along(p.z - origin_.z));
    }

private:
    Vec3 origin_;
    double cell_m_;
    int depth_ = 0;
};

} // namespace taihu
