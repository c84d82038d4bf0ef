#include "stats/core/polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace taihu {
namespace {

struct Point2 {
    double x = 0, y = 0;
    friend bool operator==(const Point2&, const Point2&) = default;
};

/// Twice the area of a triangle, positive when it is counter-clockwise.
double area2(const Point2& a, const Point2& b, const Point2& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

double squared(const Point2& a, const Point2& b) {
    return (b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y);
}

/// The polygon seen along its area vector, so that it runs counter-clockwise; all zero when it has
/// no area.
std::vector<Point2> flattened(std::span<const Vec3> positions,
                              std::span<const std::uint32_t> corners) {
    const Vec3 first = positions[corners[0]]; // coordinates about it lose the least
    Vec3 normal;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        normal += cross(positions[corners[i]] - first, positions[corners[i + 1]] - first);
    std::vector<Point2> flat(corners.size());
    if (!is_finite(normal) || !(length(normal) > 0))
        return flat;
    normal = normalized(normal);
    const Vec3 axis = std::abs(normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 u = normalized(cross(axis, normal)), v = cross(normal, u);
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3 p = positions[corners[i]] - first;
        flat[i] = {dot(p, u), dot(p, v)};
    }
    return flat;
}

/// Every turn to the left and every fan triangle with area: convex, and round once.
bool fan_fits(const std::vector<Point2>& p) {
    const std::size_t n = p.size();
    for (std::size_t i = 0; i < n; ++i)
        if (!(area2(p[i], p[(i + 1) % n], p[(i + 2) % n]) >= 0))
            return false;
    for (std::size_t i = 1; i + 1 < n; ++i)
        if (!(area2(p[0], p[i], p[i + 1]) > 0))
            return false;
    return true;
}

/// Cuts ears off a ring of corners until a triangle is left.
class EarClipper {
public:
    EarClipper(const std::vector<Point2>& points, std::span<const std::uint32_t> corners,
               std::vector<Triangle>& out)
        : points_(points), corners_(corners), out_(out), before_(points.size()),
          after_(points.size()), ear_(points.size()) {
        for (std::size_t i = 0; i < points.size(); ++i) {
            before_[i] = (i + points.size() - 1) % points.size();
            after_[i] = (i + 1) % points.size();
        }
    }

    void run() {
        int n_refreshes = 0;
        std::size_t left = points_.size();
        refresh();
        while (left > 3) {
            const std::size_t best = shortest_ear(left);
            if (best != kNone) {
                cut(best);
                --left;
            } else if (++n_refreshes <= kMaxRefreshes) {
                refresh(); // a corner cut elsewhere may have freed one that is no neighbour
                if (shortest_ear(left) == kNone)
                    break;
            } else {
                break;
            }
        }
        // A triangle, or what is left of a polygon that crosses itself, as a fan.
        for (std::size_t i = after_[head_]; after_[i] != head_; i = after_[i])
            emit(head_, i, after_[i]);
    }

private:
    static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
    static constexpr int kMaxRefreshes = 8; // each is quadratic; simple polygons hardly need one

    void emit(std::size_t a, std::size_t b, std::size_t c) {
        out_.push_back({corners_[a], corners_[b], corners_[c]});
    }

    bool is_ear(std::size_t i) const {
        const Point2 &a = points_[before_[i]], &b = points_[i], &c = points_[after_[i]];
        if (!(area2(a, b, c) > 0))
            return false;
        for (std::size_t j = after_[after_[i]]; j != before_[i]; j = after_[j]) {
            const Point2& p = points_[j];
            if (p == a || p == b || p == c) // a seam that runs there and back blocks nothing
                continue;
            if (area2(a, b, p) >= 0 && area2(b, c, p) >= 0 && area2(c, a, p) >= 0)
                return false;
        }
        return true;
    }

    void refresh() {
        std::size_t i = head_;
        do {
            ear_[i] = is_ear(i);
            i = after_[i];
        } while (i != head_);
    }

    std::size_t shortest_ear(std::size_t left) const {
        std::size_t best = kNone;
        double shortest = std::numeric_limits<double>::infinity();
        for (std::size_t i = head_, k = 0; k < left; ++k, i = after_[i]) {
            const double cut_length = squared(points_[before_[i]], points_[after_[i]]);
            if (ear_[i] && cut_length < shortest) {
                best = i;
                shortest = cut_length;
            }
        }
        return best;
    }

    void cut(std::size_t i) {
        const std::size_t a = before_[i], c = after_[i];
        emit(a, i, c);
        after_[a] = c;
        before_[c] = a;
        ear_[a] = is_ear(a);
        ear_[c] = is_ear(c);
        if (head_ == i)
            head_ = c;
    }

    const std::vector<Point2>& points_;
    std::span<const std::uint32_t> corners_;
    std::vector<Triangle>& out_;
    std::vector<std::size_t> before_, after_;
    std::vector<char> ear_;
    std::size_t head_ = 0;
};

void cut_quad(const std::vector<Point2>& p, std::span<const Vec3> positions,
              std::span<const std::uint32_t> c, std::vector<Triangle>& out) {
    const bool first_inside = area2(p[0], p[1], p[2]) > 0 && area2(p[0], p[2], p[3]) > 0;
    const bool second_inside = area2(p[1], p[2], p[3]) > 0 && area2(p[1], p[3], p[0]) > 0;
    const bool first = first_inside != second_inside
                           ? first_inside
                           : length_squared(positions[c[2]] - positions[c[0]]) <=
                                 length_squared(positions[c[3]] - positions[c[1]]);
    if (first) {
        out.push_back({c[0], c[1], c[2]});
        out.push_back({c[0], c[2], c[3]});
    } else {
        out.push_back({c[1], c[2], c[3]});
        out.push_back({c[1], c[3], c[0]});
    }
}

} // namespace

bool triangulate(std::span<const Vec3> positions, std::span<const std::uint32_t> corners,
                 std::vector<Triangle>& out) {
    if (corners.size() == 3) {
        out.push_back({corners[0], corners[1], corners[2]});
        return true;
    }
    const auto points = flattened(positions, corners);
    if (corners.size() == 4) {
        cut_quad(points, positions, corners, out);
        return true;
    }
    if (fan_fits(points)) {
        for (std::size_t i = 1; i + 1 < corners.size(); ++i)
            out.push_back({corners[0], corners[i], corners[i + 1]});
        return true;
    }
    if (corners.size() > kMaxConcaveCorners)
        return false;
    EarClipper(points, corners, out).run();
    return true;
}

} // namespace taihu
