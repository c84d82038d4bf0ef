#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace taihu {

/// The projected faces of one chart while it grows, in cells.
class ChartPlane {
public:
    struct Point {
        double x = 0, y = 0;
    };
    using Corners = std::array<Point, 3>;

    explicit ChartPlane(std::span<const Corners> faces) : faces_(faces) {
        hi_ = {-lo_.x, -lo_.y};
        for (const Corners& c : faces)
            for (const Point& p : c) {
                lo_ = {std::min(lo_.x, p.x), std::min(lo_.y, p.y)};
                hi_ = {std::max(hi_.x, p.x), std::max(hi_.y, p.y)};
            }
        const double width = hi_.x - lo_.x, height = hi_.y - lo_.y;
        // About a cell for each face, whatever the shape.
        cell_ = std::max(std::sqrt(width * height / double(faces.size())),
                         std::max(width, height) / double(faces.size() + 1));
        n_x_ = 1 + static_cast<std::size_t>(width / cell_);
        n_y_ = 1 + static_cast<std::size_t>(height / cell_);
        cells_.resize(n_x_ * n_y_);
    }

    /// False, and nothing changes, where the face overlaps one that is there.
    bool add(std::uint32_t face) {
        bool free = true;
        each_cell(face, [&](std::vector<std::uint32_t>& cell) {
            for (std::size_t i = 0; free && i < cell.size(); ++i)
                free = parts(faces_[face], faces_[cell[i]]) || parts(faces_[cell[i]], faces_[face]);
        });
        if (free)
            each_cell(face, [&](std::vector<std::uint32_t>& cell) { cell.push_back(face); });
        return free;
    }
    void remove(std::uint32_t face) {
        each_cell(face, [&](std::vector<std::uint32_t>& cell) { std::erase(cell, face); });
    }
    void clear(std::span<const std::uint32_t> added) {
        for (const std::uint32_t face : added)
            each_cell(face, [](std::vector<std::uint32_t>& cell) { cell.clear(); });
    }

private:
    /// Whether an edge of `a` has all of `b` on its outer side or on itself. Exact where
    /// coordinates are multiples of one step below 2^25 of it.
    static bool parts(const Corners& a, const Corners& b) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Point& p = a[k];
            const Point& q = a[(k + 1) % 3];
            if (std::all_of(b.begin(), b.end(), [&](const Point& r) {
                    return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x) <= 0;
                }))
                return true;
        }
        return false;
    }

    template <class Visit>
    void each_cell(std::uint32_t face, Visit&& visit) {
        const Corners& c = faces_[face];
        const auto [x_lo, x_hi] = std::minmax({c[0].x, c[1].x, c[2].x});
        const auto [y_lo, y_hi] = std::minmax({c[0].y, c[1].y, c[2].y});
        const auto index = [&](double at, double lo, std::size_t n) {
            return std::min(n - 1, static_cast<std::size_t>((at - lo) / cell_));
        };
        for (std::size_t y = index(y_lo, lo_.y, n_y_); y <= index(y_hi, lo_.y, n_y_); ++y)
            for (std::size_t x = index(x_lo, lo_.x, n_x_); x <= index(x_hi, lo_.x, n_x_); ++x)
                visit(cells_[y * n_x_ + x]);
    }

    std::span<const Corners> faces_;
    Point lo_{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()},
        hi_;
    double cell_ = 1;
    std::size_t n_x_ = 1, n_y_ = 1;
    std::vector<std::vector<std::uint32_t>> cells_;
};

} // namespace taihu
