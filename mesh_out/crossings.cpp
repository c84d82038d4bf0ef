#include "mesh_out/crossings_detail.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <boost/multiprecision/cpp_int.hpp>
#include <tbb/blocked_range.h>
#include <tbb/combinable.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include "mesh_out/face_tree_detail.h"

namespace taihu {
namespace {

using boost::multiprecision::cpp_int;
__extension__ typedef __int128 Int128;

// Half a unit in the last place, and the errors of the two determinants over their permanents:
// Shewchuk 1997, "Adaptive precision floating-point arithmetic", bounds A (from memory, unchecked;
// the tests compare with rational arithmetic).
constexpr double kHalfUlp = 0x1p-53;
constexpr double kBound3d = (7 + 56 * kHalfUlp) * kHalfUlp;
constexpr double kBound2d = (3 + 16 * kHalfUlp) * kHalfUlp;
// The bounds hold without underflow. Below this size of a difference the absolute slack covers it.
constexpr double kMaxDifference = 1e90;
constexpr double kUnderflowSlack = 1e-200;

template <class Number>
int sign(const Number& x) {
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

/// value == mantissa * 2^exponent, the mantissa odd (or zero).
struct Binary {
    std::int64_t mantissa = 0;
    int exponent = 0;
};

Binary split(double value) {
    if (value == 0)
        return {};
    int exponent = 0;
    const auto whole = static_cast<std::int64_t>(std::ldexp(std::frexp(value, &exponent), 53));
    const int zeros = std::countr_zero(static_cast<std::uint64_t>(whole));
    return {whole / (std::int64_t{1} << zeros), exponent - 53 + zeros};
}

/// The values as integers in one common unit, a power of two; nothing when one would pass
/// `max_bits`.
template <class Int, std::size_t N>
std::optional<std::array<Int, N>> integers(const std::array<double, N>& values, int max_bits) {
    std::array<Binary, N> parts;
    int unit = 2000; // above every exponent of a double
    for (std::size_t i = 0; i < N; ++i) {
        parts[i] = split(values[i]);
        if (parts[i].mantissa != 0)
            unit = std::min(unit, parts[i].exponent);
    }
    std::array<Int, N> out;
    for (std::size_t i = 0; i < N; ++i) {
        const auto [mantissa, exponent] = parts[i];
        if (mantissa == 0) {
            out[i] = 0;
            continue;
        }
        const int shift = exponent - unit;
        const auto size = static_cast<std::uint64_t>(mantissa < 0 ? -mantissa : mantissa);
        if (static_cast<int>(std::bit_width(size)) + shift > max_bits)
            return std::nullopt;
        out[i] = mantissa;
        out[i] <<= static_cast<unsigned>(shift);
    }
    return out;
}

constexpr int kAnyBits = 1 << 20;
constexpr int kProductBits = 40; // three factors and the sum of six products fit 127 bits

bool is_exact_difference(double a, double b) {
    const double d = a - b, b_used = a - d, a_used = d + b_used;
    return (a - a_used) + (b_used - b) == 0; // the tail of Knuth's two-sum
}

template <class Int>
int sign_of_det3(const std::array<Int, 9>& m) {
    const Int x = m[4] * m[8] - m[5] * m[7], y = m[5] * m[6] - m[3] * m[8],
              z = m[3] * m[7] - m[4] * m[6];
    return sign(Int(m[0] * x + m[1] * y + m[2] * z));
}

int exact_orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    std::array<double, 9> difference;
    bool exact = true;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
            const double p = (i == 0 ? b : i == 1 ? c : d)[k];
            difference[static_cast<std::size_t>(3 * i + k)] = p - a[k];
            exact = exact && is_exact_difference(p, a[k]);
        }
    // Nearly every doubtful case: points of one flat patch on a grid or in single precision.
    if (exact)
        if (const auto small = integers<Int128>(difference, kProductBits))
            return sign_of_det3(*small);
    const std::array<double, 12> all = {a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, d.x, d.y, d.z};
    const auto whole = *integers<cpp_int>(all, kAnyBits);
    std::array<cpp_int, 9> m;
    for (std::size_t i = 0; i < 9; ++i)
        m[i] = whole[i + 3] - whole[i % 3];
    return sign_of_det3(m);
}

struct Point2 {
    double u = 0, v = 0;
};

/// Sign of det(b - a, c - a), exact: +1 when a, b, c turn counter-clockwise.
int orient2d(const Point2& a, const Point2& b, const Point2& c) {
    const double bu = b.u - a.u, bv = b.v - a.v, cu = c.u - a.u, cv = c.v - a.v;
    const double left = bu * cv, right = bv * cu, det = left - right;
    const double bound = kBound2d * (std::abs(left) + std::abs(right)) + kUnderflowSlack;
    if (std::abs(det) > bound &&
        std::max({std::abs(bu), std::abs(bv), std::abs(cu), std::abs(cv)}) < kMaxDifference)
        return sign(det);
    if (is_exact_difference(b.u, a.u) && is_exact_difference(b.v, a.v) &&
        is_exact_difference(c.u, a.u) && is_exact_difference(c.v, a.v))
        if (const auto m = integers<Int128>(std::array{bu, bv, cu, cv}, kProductBits))
            return sign(Int128((*m)[0] * (*m)[3] - (*m)[1] * (*m)[2]));
    const auto w = *integers<cpp_int>(std::array{a.u, a.v, b.u, b.v, c.u, c.v}, kAnyBits);
    return sign(cpp_int((w[2] - w[0]) * (w[5] - w[1]) - (w[3] - w[1]) * (w[4] - w[0])));
}

/// `p` without its coordinate `axis`.
Point2 dropped(const Vec3& p, int axis) {
    return {p[(axis + 1) % 3], p[(axis + 2) % 3]};
}

/// An axis along which abc may be projected without losing its area, or 3 if there is none.
int projection_axis(const Vec3& a, const Vec3& b, const Vec3& c) {
    for (int axis = 0; axis < 3; ++axis)
        if (orient2d(dropped(a, axis), dropped(b, axis), dropped(c, axis)) != 0)
            return axis;
    return 3;
}

bool in_box(const Point2& p, const Point2& a, const Point2& b) {
    return p.u >= std::min(a.u, b.u) && p.u <= std::max(a.u, b.u) && p.v >= std::min(a.v, b.v) &&
           p.v <= std::max(a.v, b.v);
}

bool segments_meet(const Point2& a, const Point2& b, const Point2& c, const Point2& d) {
    const int abc = orient2d(a, b, c), abd = orient2d(a, b, d), cda = orient2d(c, d, a),
              cdb = orient2d(c, d, b);
    if (abc != abd && cda != cdb)
        return true;
    return (abc == 0 && in_box(c, a, b)) || (abd == 0 && in_box(d, a, b)) ||
           (cda == 0 && in_box(a, c, d)) || (cdb == 0 && in_box(b, c, d));
}

using Corners = std::array<Vec3, 3>;

bool all_of_one_sign(int x, int y, int z) {
    return (x >= 0 && y >= 0 && z >= 0) || (x <= 0 && y <= 0 && z <= 0);
}

/// segment_meets() for a segment in the plane of the triangle.
bool meets_in_plane(const Vec3& p, const Vec3& q, const Corners& t) {
    const int axis = projection_axis(t[0], t[1], t[2]);
    const Point2 s = dropped(p, axis), e = dropped(q, axis);
    const std::array<Point2, 3> c = {dropped(t[0], axis), dropped(t[1], axis), dropped(t[2], axis)};
    if (all_of_one_sign(orient2d(c[0], c[1], s), orient2d(c[1], c[2], s), orient2d(c[2], c[0], s)))
        return true;
    return segments_meet(s, e, c[0], c[1]) || segments_meet(s, e, c[1], c[2]) ||
           segments_meet(s, e, c[2], c[0]);
}

/// Whether the closed segment pq meets the closed triangle t; `side_p` and `side_q` are the sides
/// of its plane on which p and q lie.
bool segment_meets(const Vec3& p, const Vec3& q, int side_p, int side_q, const Corners& t) {
    if (side_p * side_q > 0)
        return false;
    if (side_p == 0 && side_q == 0)
        return meets_in_plane(p, q, t);
    return all_of_one_sign(orient3d(p, q, t[0], t[1]), orient3d(p, q, t[1], t[2]),
                           orient3d(p, q, t[2], t[0]));
}

/// Whether abc and abd, with ab in common, lie in one plane on the same side of ab.
bool folded(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    if (orient3d(a, b, c, d) != 0)
        return false;
    const int axis = projection_axis(a, b, c);
    const Point2 a2 = dropped(a, axis), b2 = dropped(b, axis);
    return orient2d(a2, b2, dropped(c, axis)) == orient2d(a2, b2, dropped(d, axis));
}

/// Permutes both triples so that what they share comes first, in the same order; how many that is.
std::size_t move_shared_first(Triangle& f, Triangle& g) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = n; k < 3; ++k)
            if (f[i] == g[k]) {
                std::swap(g[k], g[n]);
                std::swap(f[i], f[n]);
                ++n;
                break;
            }
    return n;
}

/// Which parts of space some faces reach into: a quick no for most others.
class Occupied {
public:
    Occupied(std::span<const Vec3> positions, std::span<const Triangle> faces, const Box& all)
        : bits_(kSide * kSide * kSide / 64), all_(all) {
        const Vec3 size = all_.size();
        for (int axis = 0; axis < 3; ++axis)
            // Zero where the whole is flat, or so large that it overflows: then all is in one part.
            per_m_[axis] = size[axis] > 0 && size[axis] < 1e300 ? (kSide - 0.5) / size[axis] : 0;
        for (const Triangle& f : faces)
            each_part(box_of(positions, f), [&](std::size_t i) {
                bits_[i / 64] |= std::uint64_t{1} << (i % 64);
                return false;
            });
    }
    bool meets(const Box& box) const {
        return overlap(box, all_) &&
               each_part(box, [&](std::size_t i) { return (bits_[i / 64] >> (i % 64) & 1) != 0; });
    }

private:
    static constexpr std::size_t kSide = 128;

    static bool overlap(const Box& a, const Box& b) {
        return a.lo.x <= b.hi.x && b.lo.x <= a.hi.x && a.lo.y <= b.hi.y && b.lo.y <= a.hi.y &&
               a.lo.z <= b.hi.z && b.lo.z <= a.hi.z;
    }

    /// Whether fn(part) is true for one of them.
    template <class Fn>
    bool each_part(const Box& box, const Fn& fn) const {
        std::array<std::size_t, 3> lo, hi;
        for (int axis = 0; axis < 3; ++axis) {
            const auto part = [&](double x) {
                return static_cast<std::size_t>(
                    std::clamp((x - all_.lo[axis]) * per_m_[axis], 0.0, kSide - 1.0));
            };
            lo[static_cast<std::size_t>(axis)] = part(box.lo[axis]);
            hi[static_cast<std::size_t>(axis)] = part(box.hi[axis]);
        }
        for (std::size_t x = lo[0]; x <= hi[0]; ++x)
            for (std::size_t y = lo[1]; y <= hi[1]; ++y)
                for (std::size_t z = lo[2]; z <= hi[2]; ++z)
                    if (fn((x * kSide + y) * kSide + z))
                        return true;
        return false;
    }

    std::vector<std::uint64_t> bits_;
    Box all_;
    Vec3 per_m_;
};

/// Whether a plane between two triangles, with their first corner in common or none, surely parts
/// them: told by rounded numbers with a margin.
bool surely_apart(const Corners& a, const Corners& b, bool is_shared) {
    const Vec3& o = a[0];
    const std::size_t first = is_shared ? 1 : 0;
    Vec3 n;
    double largest = 0, a_least = std::numeric_limits<double>::infinity(), b_most = -a_least;
    for (std::size_t k = first; k < 3; ++k) {
        const Vec3 p = a[k] - o, q = b[k] - o;
        n += p - q;
        largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z), std::abs(q.x),
                            std::abs(q.y), std::abs(q.z)});
    }
    for (std::size_t k = first; k < 3; ++k) {
        a_least = std::min(a_least, dot(a[k] - o, n));
        b_most = std::max(b_most, dot(b[k] - o, n));
    }
    const double margin =
        0x1p-48 * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z)) * largest + kUnderflowSlack;
    return is_shared ? a_least > margin && b_most < -margin : a_least - b_most > margin;
}

} // namespace

int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const Vec3 p = b - a, q = c - a, r = d - a;
    const double pyqz = p.y * q.z, pzqy = p.z * q.y, pzqx = p.z * q.x, pxqz = p.x * q.z,
                 pxqy = p.x * q.y, pyqx = p.y * q.x;
    const double det = (pyqz - pzqy) * r.x + (pzqx - pxqz) * r.y + (pxqy - pyqx) * r.z;
    const double permanent = (std::abs(pyqz) + std::abs(pzqy)) * std::abs(r.x) +
                             (std::abs(pzqx) + std::abs(pxqz)) * std::abs(r.y) +
                             (std::abs(pxqy) + std::abs(pyqx)) * std::abs(r.z);
    const double largest =
        std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z), std::abs(q.x), std::abs(q.y),
                  std::abs(q.z), std::abs(r.x), std::abs(r.y), std::abs(r.z)});
    if (std::abs(det) > kBound3d * permanent + kUnderflowSlack && largest < kMaxDifference)
        return sign(det);
    return exact_orient3d(a, b, c, d);
}

bool is_flat(const Vec3& a, const Vec3& b, const Vec3& c) {
    return projection_axis(a, b, c) == 3;
}

bool faces_cross(std::span<const Vec3> positions, Triangle f, Triangle g) {
    const std::size_t n_shared = move_shared_first(f, g);
    const Corners a = {positions[f[0]], positions[f[1]], positions[f[2]]};
    const Corners b = {positions[g[0]], positions[g[1]], positions[g[2]]};
    if (n_shared == 3)
        return true;
    if (n_shared == 2)
        return folded(a[0], a[1], a[2], b[2]);
    if (surely_apart(a, b, n_shared == 1))
        return false;
    // When the free vertices of one face lie strictly on one side of the other's plane, the two
    // meet at most in the vertex they share.
    const auto sides = [n_shared](const Corners& plane, const Corners& points) {
        std::array<int, 3> side{};
        for (std::size_t k = n_shared; k < 3; ++k)
            side[k] = orient3d(plane[0], plane[1], plane[2], points[k]);
        return side;
    };
    const auto apart = [n_shared](const std::array<int, 3>& side) {
        return side[1] * side[2] > 0 && (n_shared == 1 || side[0] * side[1] > 0);
    };
    const std::array<int, 3> side_b = sides(a, b);
    if (apart(side_b))
        return false;
    const std::array<int, 3> side_a = sides(b, a);
    if (apart(side_a))
        return false;
    // Where two convex faces meet in more than a shared vertex, an edge opposite to it (any edge,
    // if none is shared) of one of them reaches the other.
    for (std::size_t k = n_shared; k < (n_shared == 1 ? 2u : 3u); ++k) {
        const std::size_t next = (k + 1) % 3;
        if (segment_meets(a[k], a[next], side_a[k], side_a[next], b) ||
            segment_meets(b[k], b[next], side_b[k], side_b[next], a))
            return true;
    }
    return false;
}

std::size_t count_crossings(std::span<const Vec3> positions, std::span<const Triangle> faces) {
    if (faces.empty())
        return 0;
    const FaceTree tree(positions, faces);
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, tree.n_groups(), 64), std::size_t{0},
        [&](const tbb::blocked_range<std::size_t>& range, std::size_t n) {
            for (std::size_t g = range.begin(); g < range.end(); ++g)
                tree.visit_pairs(g, [&](const FaceTree::Face& f, const FaceTree::Face& other) {
                    n += faces_cross(positions, f.vertices, other.vertices);
                });
            return n;
        },
        [](std::size_t a, std::size_t b) { return a + b; });
}

std::vector<std::pair<std::uint32_t, std::uint32_t>>
crossing_pairs(std::span<const Vec3> positions, std::span<const Triangle> faces,
               std::span<const std::uint8_t> picked) {
    using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
    const auto is_picked = [&](std::size_t i) { return picked.empty() || picked[i] != 0; };
    std::vector<Triangle> some;
    std::vector<std::uint32_t> number;
    const auto has_area = [&](std::size_t i) {
        return !is_flat(positions[faces[i][0]], positions[faces[i][1]], positions[faces[i][2]]);
    };
    for (std::size_t i = 0; i < faces.size(); ++i)
        if (is_picked(i) && has_area(i)) {
            some.push_back(faces[i]);
            number.push_back(static_cast<std::uint32_t>(i));
        }
    Pairs pairs;
    if (some.empty())
        return pairs;
    const FaceTree tree(positions, some);
    tbb::combinable<Pairs> found;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tree.n_groups(), 64), [&](const auto& r) {
        Pairs& own = found.local();
        for (std::size_t g = r.begin(); g < r.end(); ++g)
            tree.visit_pairs(g, [&](const FaceTree::Face& f, const FaceTree::Face& other) {
                if (faces_cross(positions, f.vertices, other.vertices))
                    own.push_back(std::minmax(number[f.index], number[other.index]));
            });
    });
    if (!picked.empty()) {
        const Occupied occupied(positions, some, tree.bounds());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, faces.size(), 1024),
                          [&](const auto& r) {
                              Pairs& own = found.local();
                              for (std::size_t i = r.begin(); i < r.end(); ++i) {
                                  const Box box = box_of(positions, faces[i]);
                                  if (is_picked(i) || !occupied.meets(box) || !has_area(i))
                                      continue;
                                  tree.visit(tree.box(box), [&](const FaceTree::Face& other) {
                                      if (faces_cross(positions, faces[i], other.vertices))
                                          own.push_back(std::minmax(static_cast<std::uint32_t>(i),
                                                                    number[other.index]));
                                  });
                              }
                          });
    }
    found.combine_each(
        [&](const Pairs& part) { pairs.insert(pairs.end(), part.begin(), part.end()); });
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

} // namespace taihu
