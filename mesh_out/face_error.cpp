#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <tbb/parallel_for.h>

#include "mesh_out/closest_point_detail.h"
#include "mesh_out/face_error_detail.h"

namespace taihu {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTouch = 0.02; ///< of a spacing: deeper is in, for primitives that only pass by
constexpr std::size_t kMostSteps = 12; ///< along an edge, of samples
constexpr int kMostHalvings = 2;
constexpr double kSmallest = 0.2; ///< of a spacing: parts of faces are not divided further
constexpr double kStep = 1.6;     ///< spacings from sample to sample
constexpr double kFineStep = 0.5; ///< where a primitive turns out to have creases
constexpr double kFlat = 1e-6;    ///< slope of a value that is held to a band
constexpr double kSteep = 0.95;   ///< gradients of distances have length 1
constexpr double kPlanarMargin = 1.1; ///< rims of other surfaces are bent; planes are not

Vec3 middle(const FaceErrors::Corners& f) {
    return (f[0] + f[1] + f[2]) * (1. / 3);
}

double radius_about(const Vec3& m, const FaceErrors::Corners& f) {
    return std::sqrt(
        std::max({length_squared(f[0] - m), length_squared(f[1] - m), length_squared(f[2] - m)}));
}

double longest_edge(const FaceErrors::Corners& f) {
    return std::sqrt(std::max(
        {length_squared(f[0] - f[1]), length_squared(f[1] - f[2]), length_squared(f[2] - f[0])}));
}

std::size_t steps(const FaceErrors::Corners& f, double step) {
    return std::clamp(static_cast<std::size_t>(std::ceil(longest_edge(f) / step)), std::size_t{2},
                      kMostSteps);
}

std::array<FaceErrors::Corners, 4> quarters(const FaceErrors::Corners& f) {
    const Vec3 ab = (f[0] + f[1]) * .5, bc = (f[1] + f[2]) * .5, ca = (f[2] + f[0]) * .5;
    return {{{f[0], ab, ca}, {ab, f[1], bc}, {ca, bc, f[2]}, {ab, bc, ca}}};
}

/// How far from the edge of a wedge a point is whose distances past its two planes are at most `d`
/// and `e`, where neither plane is nearest; `cosine` that of the angle between their normals.
double past_wedge(double d, double e, double cosine) {
    const double sine2 = 1 - cosine * cosine;
    const bool in_cone = d >= e * cosine && e >= d * cosine;
    const double faces = std::max({d, e, 0.});
    if (!in_cone)
        return faces;
    if (sine2 < 1e-4)
        return kInfinity;
    return std::max(faces, std::sqrt(std::max(0., d * d + e * e - 2 * d * e * cosine) / sine2));
}

} // namespace

double FaceErrors::bound(const Corners& face, const Labels& labels, const Rules& rules) const {
    Range range;
    const std::uint32_t shape =
        own(face, labels, rules.exact_corners, range, (rules.centred ? 2 : 1) * rules.face_m);
    return shape == kNone ? kInfinity : bound_beside(shape, range, face, labels, rules);
}

double FaceErrors::bound_beside(std::uint32_t shape, const Range& range, const Corners& face,
                                const Labels& labels, const Rules& rules) const {
    double most = rules.centred ? (range.hi - range.lo) / 2 : range.most();
    if (most > rules.face_m)
        return kInfinity;
    const Vec3 m = middle(face);
    if (rules.turn_cosine > -1) {
        const Vec3 n = cross(face[1] - face[0], face[2] - face[0]),
                   g = shapes_[shape].is_ball ? of(shape, m).gradient : range.gradient;
        if (dot(n, g) < rules.turn_cosine * length(n) * length(g))
            return kInfinity;
    }
    // Whose surface comes near the face, or near where it projects to.
    const double radius = radius_about(m, face), reach = radius + most + kTouch * spacing_;
    const auto is_near = [&](const Shape& s) {
        if (!s.is_ball)
            return rules.clear_m <= 2 * radius + reach &&
                   std::abs(field_.value_of(s.primitive, m)) <= reach;
        const double d2 = length_squared(m - s.center), far = s.radius + reach,
                     deep = s.radius - reach;
        return d2 <= far * far && (deep <= 0 || d2 >= deep * deep);
    };
    std::uint32_t active = kNone; // has a rim with it near the face
    std::array<int, 3> lo{}, hi{}, c{};
    for (int a = 0; a < 3; ++a) {
        lo[a] = coordinate(std::min({face[0][a], face[1][a], face[2][a]}), a);
        hi[a] = coordinate(std::max({face[0][a], face[1][a], face[2][a]}), a);
    }
    for (c[0] = lo[0]; c[0] <= hi[0]; ++c[0])
        for (c[1] = lo[1]; c[1] <= hi[1]; ++c[1])
            for (c[2] = lo[2]; c[2] <= hi[2]; ++c[2])
                for (const std::uint32_t other : near(c)) {
                    if (other == shape || !is_near(shapes_[other]))
                        continue;
                    const double past = against(shape, range, other, face, labels, rules);
                    most = std::max(most, past);
                    // A third primitive may cut off the rim of two.
                    const bool cut =
                        rules.may_pierce && past > 0 && active != kNone && active != other;
                    if (most == kInfinity || cut)
                        return kInfinity;
                    if (past > 0)
                        active = other;
                }
    return most;
}

FaceErrors::Clearance FaceErrors::clearance(const Vec3& p, std::uint32_t label) const {
    const std::array<int, 3> at = {coordinate(p.x, 0), coordinate(p.y, 1), coordinate(p.z, 2)};
    const auto list = near(at);
    const double off_center = length(p - center_of(at));
    const double known = list_reach() - off_center; // the lists know no more
    Clearance least{known, known};
    for (const std::uint32_t& shape : list) {
        const Shape& s = shapes_[shape];
        if (sets_[label].has(shape))
            continue;
        if (s.is_ball) {
            least.any = std::min(least.any, std::abs(length(p - s.center) - s.radius));
            continue;
        }
        const double value = center_values_[static_cast<std::size_t>(&shape - near_.data())];
        const double at_least = std::abs(value) - off_center;
        least.sampled = std::min(least.sampled, at_least > 2 * spacing_
                                                    ? at_least
                                                    : std::abs(field_.value_of(s.primitive, p)));
    }
    least.any = std::min(least.any, least.sampled);
    return least;
}

bool FaceErrors::fits_ball(std::uint32_t shape, const Vec3& corner, const Vec3& normal,
                           const Rules& rules) const {
    // No point of the face is nearer to the centre than its plane, and none farther than a corner.
    const Shape& s = shapes_[shape];
    const double area = length(normal), h = s.sign * dot(normal, corner - s.center),
                 r = s.radius * area;
    return r - h <= (rules.centred ? 2 : 1) * rules.face_m * area && h >= rules.turn_cosine * r;
}

double FaceErrors::reach_m(const Rules& rules) const {
    return rules.face_m + kTouch * spacing_;
}

PrimitiveSet FaceErrors::shared(const Labels& labels) const {
    if (labels[0] == labels[1] && labels[1] == labels[2])
        return sets_[labels[0]];
    return sets_[labels[0]].common(sets_[labels[1]]).common(sets_[labels[2]]);
}

std::uint32_t FaceErrors::own(const Corners& face, const Labels& labels, bool exact_corners,
                              Range& out, double give_up_m) const {
    std::uint32_t best = kNone;
    double least = kInfinity;
    const PrimitiveSet candidates = shared(labels);
    for (const std::uint32_t s : candidates.all()) {
        constexpr CornerValues kOnIt{};
        const Range r = range(s, face, exact_corners ? &kOnIt : nullptr, give_up_m);
        if (r.most() < least) {
            least = r.most();
            best = s;
            out = r;
        }
    }
    return best;
}

FieldProbe::Value FaceErrors::of(std::uint32_t shape, const Vec3& p) const {
    const Shape& s = shapes_[shape];
    if (!s.is_ball)
        return field_.of(s.primitive, p);
    const Vec3 d = p - s.center;
    const double l = length(d);
    return {s.sign * (l - s.radius), d * (s.sign / std::max(l, 1e-300))};
}

FaceErrors::Range FaceErrors::range(std::uint32_t shape, const Corners& f,
                                    const CornerValues* known, double give_up_m) const {
    const Shape& s = shapes_[shape];
    if (!s.is_ball)
        return sampled_range(s, f, known, give_up_m, kStep * spacing_);
    const double nearest =
        length(closest_point_on_triangle(s.center, f[0], f[1], f[2]) - s.center) - s.radius;
    const double farthest = radius_about(s.center, f) - s.radius;
    return s.sign > 0 ? Range{nearest, farthest, {}} : Range{-farthest, -nearest, {}};
}

/// Where a primitive has creases of its own, or a blend, its values under-read and are not steep:
/// then the way to where it is 0 counts.
double FaceErrors::sample(Primitive primitive, const Vec3& p, Range& range) const {
    const FieldProbe::Value at = field_.of(primitive, p);
    const double slope = length(at.gradient);
    if (slope < kFlat) // beyond what the field tells: at least so far
        return at.value_m;
    range.gradient += at.gradient;
    range.least_slope = std::min(range.least_slope, slope);
    if (slope > kSteep)
        return at.value_m;
    if (const auto y = onto(field_, PrimitiveSet(primitive), p, 2 * pad_))
        return std::copysign(std::max(length(*y - p), std::abs(at.value_m)), at.value_m);
    return slope > 0.1 ? at.value_m / slope : at.value_m;
}

FaceErrors::Range FaceErrors::sampled_range(const Shape& shape, const Corners& f,
                                            const CornerValues* known, double give_up_m,
                                            double step) const {
    const std::size_t n = steps(f, step);
    std::array<double, (kMostSteps + 1) * (kMostSteps + 1)> values;
    const auto at = [&](std::size_t u, std::size_t v) -> double& {
        return values[u * (kMostSteps + 1) + v];
    };
    Range r{kInfinity, -kInfinity, {}};
    for (std::size_t u = 0; u <= n; ++u)
        for (std::size_t v = 0; u + v <= n; ++v) {
            const bool corner = u == n || v == n || u + v == 0;
            const double x = static_cast<double>(u) / static_cast<double>(n),
                         y = static_cast<double>(v) / static_cast<double>(n);
            const double d = corner && known ? (*known)[u == n   ? 1
                                                        : v == n ? 2
                                                                 : 0]
                                             : sample(shape.primitive,
                                                      f[1] * x + f[2] * y + f[0] * (1 - x - y), r);
            at(u, v) = d;
            r.lo = std::min(r.lo, d);
            r.hi = std::max(r.hi, d);
            if (r.most() > give_up_m)
                return r;
        }
    const double fine = kFineStep * spacing_;
    if (r.least_slope < kSteep && step > fine)
        return sampled_range(shape, f, known, give_up_m, fine);
    // Between three samples on a line a parabola passes the highest by at most 1/8 of the second
    // difference.
    double bend = 0;
    for (std::size_t u = 0; u <= n; ++u)
        for (std::size_t v = 0; u + v <= n; ++v) {
            if (u > 0 && u + v < n)
                bend = std::max(bend, std::abs(at(u - 1, v) - 2 * at(u, v) + at(u + 1, v)));
            if (v > 0 && u + v < n)
                bend = std::max(bend, std::abs(at(u, v - 1) - 2 * at(u, v) + at(u, v + 1)));
            if (u > 0 && v > 0)
                bend = std::max(bend, std::abs(at(u - 1, v + 1) - 2 * at(u, v) + at(u + 1, v - 1)));
        }
    r.lo -= r.lo < 0 ? bend / 8 : 0;
    r.hi += r.hi > 0 ? bend / 8 : 0;
    return r;
}

std::size_t FaceErrors::n_steps(const Corners& f) const {
    return steps(f, kStep * spacing_);
}

void FaceErrors::samples(std::uint32_t shape, const Corners& f, std::size_t n, float* out) const {
    Range ignored;
    for (std::size_t u = 0; u <= n; ++u)
        for (std::size_t v = 0; u + v <= n; ++v) {
            const double x = static_cast<double>(u) / static_cast<double>(n),
                         y = static_cast<double>(v) / static_cast<double>(n);
            *out++ = static_cast<float>(sample(shapes_[shape].primitive,
                                               f[1] * x + f[2] * y + f[0] * (1 - x - y), ignored));
        }
}

/// Of a primitive that has corners of the face on it, or comes near.
FaceErrors::Range FaceErrors::range_beside(std::uint32_t shape, const Corners& face,
                                           const CornerValues& corners,
                                           const std::array<Vec3, 3>& gradients,
                                           const Rules& rules) const {
    if (rules.slopes && !shapes_[shape].is_ball) {
        const FaceParabolas p = parabolas(face, corners, gradients);
        if (p.is_smooth) // it is not where a gradient is not known: a sum with a 0
            return {p.range.lo - p.skew, p.range.hi + p.skew, p.range.gradient};
    }
    return range(shape, face, &corners);
}

double FaceErrors::against(std::uint32_t own, const Range& own_range, std::uint32_t other,
                           const Corners& face, const Labels& labels, const Rules& rules) const {
    CornerValues corners{};
    std::array<Vec3, 3> gradients;
    bool is_labelled = false;
    for (std::size_t k = 0; k < 3; ++k) {
        const bool has = labels[k] != kNone && sets_[labels[k]].has(other);
        is_labelled = is_labelled || has;
        if (rules.exact_corners && has) {
            if (rules.slopes && (*rules.slopes)[k].shape == other)
                gradients[k] = (*rules.slopes)[k].at();
            continue;
        }
        const FieldProbe::Value at = of(other, face[k]);
        corners[k] = at.value_m;
        gradients[k] = at.gradient;
    }
    const double lo = std::min({corners[0], corners[1], corners[2]}),
                 hi = std::max({corners[0], corners[1], corners[2]});
    const double tolerance = kTouch * spacing_;
    const bool pierces_nothing = !is_labelled && !rules.may_pierce;
    if (pierces_nothing && lo < -tolerance && hi > tolerance) {
        // Through a part of it that bounds nothing, unless the field says otherwise.
        const FieldProbe::Nearest n = field_.at(middle(face));
        return std::abs(n.value_m) > tolerance && n.primitive != shapes_[own].primitive ? kInfinity
                                                                                        : 0;
    }
    const Range range_there = range_beside(other, face, corners, gradients, rules);
    Meeting pair{own, other, -lo >= hi ? 1. : -1., rules};
    if (pierces_nothing && (pair.turn > 0 ? range_there.hi : -range_there.lo) > tolerance)
        return kInfinity;
    double most = meeting(pair, face, own_range, range_there, 0);
    // The corners alone do not say on which side of it the solid is.
    if (rules.may_pierce && !is_sure_of_side(own, corners, face)) {
        pair.turn = -pair.turn;
        most = std::max(most, meeting(pair, face, own_range, range_there, 0));
    }
    return most;
}

/// Whether the field goes by `own` at the corner farthest from another primitive, which so has the
/// solid on that side.
bool FaceErrors::is_sure_of_side(std::uint32_t own, const CornerValues& other,
                                 const Corners& face) const {
    const auto far = static_cast<std::size_t>(
        std::max_element(other.begin(), other.end(),
                         [](double a, double b) { return std::abs(a) < std::abs(b); }) -
        other.begin());
    const FieldProbe::Nearest n = field_.at(face[far]);
    return n.primitive == shapes_[own].primitive && std::abs(other[far]) > std::abs(n.value_m);
}

/// Of the part of a face that lies past the rim of two primitives, an upper bound of the distance
/// to that rim; 0 when there is no such part.
double FaceErrors::meeting(const Meeting& pair, const Corners& face, const Range& a, const Range& b,
                           int depth) const {
    double own = pair.turn > 0 ? a.hi : -a.lo;
    const double other = pair.turn > 0 ? b.hi : -b.lo;
    if (pair.rules.centred)
        own = std::min(own, std::max(own / 2, (a.hi - a.lo) / 2));
    own = std::max(own, 0.);
    if (other <= -own)
        return 0;
    const double d = past_rim(pair, face, own, other);
    if (d <= pair.rules.rim_m)
        return d;
    if (depth == kMostHalvings || !pair.rules.may_halve)
        return kInfinity;
    double most = 0;
    for (const Corners& part : quarters(face)) {
        most = std::max(
            most, meeting(pair, part, range(pair.own, part), range(pair.other, part), depth + 1));
        if (most == kInfinity)
            return most;
    }
    return most;
}

double FaceErrors::past_rim(const Meeting& pair, const Corners& face, double own,
                            double other) const {
    const Shape &s = shapes_[pair.own], &t = shapes_[pair.other];
    if (!s.is_ball || !t.is_ball) {
        const Vec3 m = middle(face);
        const Vec3 g = normalized(of(pair.own, m).gradient),
                   h = normalized(of(pair.other, m).gradient);
        const double cosine = dot(g, h);
        if (other <= 0 && other <= own * cosine)
            return 0; // not past it: straight above its own surface
        return kPlanarMargin * past_wedge(own, other, cosine);
    }
    // In the half plane through the axis of both balls the rim is the point where two circles meet;
    // the farthest point past it is where the circles of the two depths meet.
    const double apart = length(t.center - s.center);
    const auto meet = [&](double r, double q, double& z, double& height2) {
        z = (apart * apart + r * r - q * q) / (2 * apart);
        height2 = r * r - z * z;
        return height2 >= 0;
    };
    double z = 0, height2 = 0, z_deep = 0, height2_deep = 0;
    if (!(apart > 0) || !meet(s.radius, t.radius, z, height2))
        return std::max(own, other);
    const double cosine = s.sign * t.sign *
                          (s.radius * s.radius + t.radius * t.radius - apart * apart) /
                          (2 * s.radius * t.radius);
    if (other <= 0 && other <= own * cosine)
        return 0;
    if (own < other * cosine || other < own * cosine)
        return std::max(own, other);
    if (!meet(s.radius + pair.turn * s.sign * own, t.radius + pair.turn * t.sign * other, z_deep,
              height2_deep))
        return kInfinity;
    return std::hypot(z - z_deep, std::sqrt(height2) - std::sqrt(height2_deep));
}

double FaceErrors::searched(const Corners& face, double enough_m, double give_up_m) const {
    const Vec3 m = middle(face);
    const double radius = radius_about(m, face);
    const FieldProbe::Nearest n = field_.at(m);
    const double least = std::abs(n.value_m); // distances are never below it
    if (least > give_up_m)
        return least;
    const bool is_small = longest_edge(face) < kSmallest * enough_m;
    if (std::hypot(least, radius) <= enough_m || is_small) {
        double far = kInfinity;
        // Where the way from the middle leads nowhere, those from the corners may.
        for (const Vec3& from : {m, face[0], face[1], face[2]}) {
            if (const auto y = surface_point_near(field_, from, 4 * pad_))
                far = std::min(far, radius_about(*y, face));
            if (far < kInfinity)
                break;
        }
        if (far <= enough_m || is_small)
            return far;
    }
    // Its parts are looked at here, so not there, too.
    const Rules rules{
        .face_m = enough_m, .rim_m = enough_m, .may_pierce = true, .may_halve = false};
    if (const std::uint32_t shape = shape_of(n.primitive); shape != kNone && least <= enough_m) {
        const Range r = range(shape, face, nullptr, enough_m);
        // No corner is told to lie on anything.
        if (const double known = bound_beside(shape, r, face, {kNone, kNone, kNone}, rules);
            known <= enough_m)
            return known;
    }
    double most = 0;
    for (const Corners& part : quarters(face)) {
        most = std::max(most, searched(part, std::max(enough_m, most), give_up_m));
        if (most > give_up_m)
            return most;
    }
    return most;
}

std::optional<Vec3> surface_point_near(const FieldProbe& field, const Vec3& p, double farthest_m) {
    FieldProbe::Nearest n = field.at(p);
    PrimitiveSet set(n.primitive);
    for (std::size_t i = 0; i < PrimitiveSet::kMost; ++i) {
        const auto y = onto(field, set, p, farthest_m);
        if (!y)
            return std::nullopt;
        n = field.at(*y);
        if (std::abs(n.value_m) <= 1e-5 * farthest_m)
            return y;
        if (!set.add(n.primitive))
            return std::nullopt;
    }
    return std::nullopt;
}

} // namespace taihu
