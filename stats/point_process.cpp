#include "stats/point_process.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/portable_math.h"
#include "stats/number_detail.h"
#include "stats/sampler.h"

namespace taihu {
namespace {

constexpr std::uint32_t kCenterStream = 0x63656e74, kParentStream = 0x70617265,
                        kParentCountStream = 0x70636e74, kJointStream = 0x6a6f696e,
                        kThinStream = 0x7468696e;
constexpr std::uint64_t kTries = 100'000;
constexpr double kMost = 1e8;
// Standard deviations beyond which a normal cluster adds nothing: 2e-9 of its centres.
constexpr double kNormalReach = 6;

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "centres: " + what);
}

void check_box(const Box& box) {
    if (box.empty() || !is_finite(box.lo) || !is_finite(box.hi) || !(box.volume() > 0))
        refuse("the box has no volume or is not finite; give its two corners in metres");
}

void check_length(const char* name, double value) {
    if (!(value > 0 && std::isfinite(value)))
        refuse(std::string(name) + " is " + shortest(value) + "; must be finite and > 0");
}

/// Further candidates for the place of item i.
std::uint64_t attempt(std::uint64_t i, std::uint64_t n) {
    return i + (n << 40);
}

/// The numbers of one item, one after the other.
struct Draws {
    const Rng& rng;
    std::uint64_t item;
    std::uint32_t draw = 0;

    double next() { return rng.uniform(item, draw++); }
    double signed_next() { return 2 * next() - 1; }

    Vec3 in_box(const Box& box) {
        const Vec3 size = box.size();
        const double x = next(), y = next(), z = next();
        return {box.lo.x + x * size.x, box.lo.y + y * size.y, box.lo.z + z * size.z};
    }

    /// Uniform in the unit ball.
    Vec3 in_ball() {
        while (true) {
            const double x = signed_next(), y = signed_next(), z = signed_next();
            if (const Vec3 p{x, y, z}; length_squared(p) < 1)
                return p;
        }
    }

    /// Two normal numbers, by Marsaglia's polar method: no sine, so the same on every machine.
    std::pair<double, double> normal() {
        while (true) {
            const double a = signed_next(), b = signed_next(), square = a * a + b * b;
            if (!(square > 0 && square < 1))
                continue;
            const double factor = std::sqrt(-2 * portable_log(square) / square);
            return {a * factor, b * factor};
        }
    }
};

Vec3 direction(Draws& draws) {
    while (true)
        if (const Vec3 p = draws.in_ball(); length_squared(p) > 1e-6)
            return normalized(p);
}

/// Balls by the cells that they and half the gap round them reach.
class BallGrid {
public:
    BallGrid(const Box& box, double edge) : lo_(box.lo) {
        edge_ = std::max(edge, box.longest() / 128);
        for (int axis = 0; axis < 3; ++axis)
            n_[axis] = static_cast<int>(box.size()[axis] / edge_) + 1;
        head_.assign(static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1]) *
                         static_cast<std::size_t>(n_[2]),
                     kNone);
    }

    void add(const Sphere& ball) {
        const auto index = static_cast<std::uint32_t>(balls_.size());
        balls_.push_back(ball);
        any_cell(ball, [&](std::uint32_t& head) {
            entries_.push_back({index, head});
            head = static_cast<std::uint32_t>(entries_.size() - 1);
            return false;
        });
    }

    bool touches(const Sphere& ball) {
        return any_cell(ball, [&](std::uint32_t head) {
            for (; head != kNone; head = entries_[head].next) {
                const Sphere& other = balls_[entries_[head].ball];
                const double reach = ball.radius_m + other.radius_m;
                if (length_squared(ball.center - other.center) < reach * reach)
                    return true;
            }
            return false;
        });
    }

private:
    static constexpr std::uint32_t kNone = 0xffffffff;
    struct Entry {
        std::uint32_t ball, next;
    };

    // What lies outside of the box belongs to the cells at its faces: clamping keeps the order, so
    // balls that overlap still share a cell.
    int cell(double x, int axis) const {
        return static_cast<int>(std::clamp((x - lo_[axis]) / edge_, 0.0, n_[axis] - 1.0));
    }

    template <class Visit>
    bool any_cell(const Sphere& ball, const Visit& visit) {
        const double r = ball.radius_m;
        int lo[3], hi[3];
        for (int axis = 0; axis < 3; ++axis) {
            lo[axis] = cell(ball.center[axis] - r, axis);
            hi[axis] = cell(ball.center[axis] + r, axis);
        }
        for (int x = lo[0]; x <= hi[0]; ++x)
            for (int y = lo[1]; y <= hi[1]; ++y)
                for (int z = lo[2]; z <= hi[2]; ++z)
                    if (visit(head_[(static_cast<std::size_t>(x) * static_cast<std::size_t>(n_[1]) +
                                     static_cast<std::size_t>(y)) *
                                        static_cast<std::size_t>(n_[2]) +
                                    static_cast<std::size_t>(z)]))
                        return true;
        return false;
    }

    Vec3 lo_;
    double edge_ = 0;
    int n_[3] = {};
    std::vector<std::uint32_t> head_;
    std::vector<Entry> entries_;
    std::vector<Sphere> balls_;
};

} // namespace

CenterStream::CenterStream(const Box& box, std::uint64_t seed) : box_(box), seed_(seed) {
    check_box(box);
}

double CenterStream::mean_count(double density_m3) const {
    return density_m3 * box_.volume();
}

Vec3 UniformCenters::center(std::uint64_t i) const {
    const Rng rng{seed(), kHoleStream};
    return Draws{rng, i}.in_box(box());
}

ClusterCenters::ClusterCenters(const Box& box, const ClusterSettings& settings, std::uint64_t seed)
    : CenterStream(box, seed), settings_(settings) {
    check_length("spread_m", settings.spread_m);
    check_length("parents_m3", settings.parents_m3);
    const bool thomas = settings.shape == ClusterSettings::Shape::thomas;
    parents_box_ = box.dilated((thomas ? kNormalReach : 1) * settings.spread_m);
    const double mean = settings.parents_m3 * parents_box_.volume();
    if (!(mean <= kMost))
        refuse(shortest(mean) +
               " clusters; at most 1e8 are drawn, use fewer per m^3 or a smaller spread");
    n_parents_ = poisson_count(mean, {seed, kParentCountStream});
}

double ClusterCenters::mean_count(double density_m3) const {
    return static_cast<double>(n_parents_) * density_m3 / settings_.parents_m3;
}

Vec3 ClusterCenters::center(std::uint64_t i) const {
    if (n_parents_ == 0)
        throw Error(Fault::numeric, "centres: no cluster fell into the box; use more per "
                                    "m^3, or another seed");
    const Rng rng{seed(), kCenterStream}, parents{seed(), kParentStream};
    Draws draws{rng, i};
    const auto pick = static_cast<std::uint64_t>(draws.next() * static_cast<double>(n_parents_));
    const std::uint64_t parent = std::min(pick, n_parents_ - 1);
    const Vec3 middle = Draws{parents, parent}.in_box(parents_box_);
    if (settings_.shape == ClusterSettings::Shape::matern)
        return middle + draws.in_ball() * settings_.spread_m;
    const auto [x, y] = draws.normal();
    const double z = draws.normal().first;
    return middle + Vec3{x, y, z} * settings_.spread_m;
}

std::vector<JointPlane> random_joints(const Box& box, std::size_t n, std::uint64_t seed) {
    check_box(box);
    const Rng rng{seed, kJointStream};
    std::vector<JointPlane> planes;
    for (std::size_t i = 0; i < n; ++i) {
        Draws draws{rng, i};
        const Vec3 point = draws.in_box(box);
        planes.push_back({point, direction(draws)});
    }
    return planes;
}

JointCenters::JointCenters(const Box& box, std::vector<JointPlane> planes, double sd_m,
                           std::uint64_t seed)
    : CenterStream(box, seed), reach_m_(0.5 * length(box.size())), sd_m_(sd_m) {
    check_length("sd_m", sd_m);
    if (planes.empty())
        refuse("no planes of weakness; give at least one");
    const Vec3 half = box.size() * 0.5;
    for (std::size_t i = 0; i < planes.size(); ++i) {
        const JointPlane& plane = planes[i];
        const std::string name = "planes[" + std::to_string(i) + "]";
        if (!is_finite(plane.point) || !is_finite(plane.normal) || !(length(plane.normal) > 0))
            refuse(name + " is not finite or has no direction; give a point and a normal");
        const Vec3 n = normalized(plane.normal);
        const double distance = dot(plane.point - box.center(), n);
        const double support =
            half.x * std::abs(n.x) + half.y * std::abs(n.y) + half.z * std::abs(n.z);
        if (!(std::abs(distance) < support))
            refuse(name + " does not pass through the box; move it or drop it");
        // The axis farthest from the normal makes the first direction in the plane.
        const Vec3 a{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
        const Vec3 axis = a.x <= a.y && a.x <= a.z ? Vec3{1, 0, 0}
                          : a.y <= a.z             ? Vec3{0, 1, 0}
                                                   : Vec3{0, 0, 1};
        const Vec3 u = normalized(cross(axis, n));
        frames_.push_back({box.center() + n * distance, u, cross(n, u), n});
    }
}

Vec3 JointCenters::center(std::uint64_t i) const {
    const Rng rng{seed(), kCenterStream};
    Draws draws{rng, i};
    for (std::uint64_t n = 0; n < kTries; ++n) {
        const double pick = draws.next() * static_cast<double>(frames_.size());
        const Frame& f = frames_[std::min(static_cast<std::size_t>(pick), frames_.size() - 1)];
        const double u = draws.signed_next() * reach_m_, v = draws.signed_next() * reach_m_;
        const double off = draws.normal().first * sd_m_;
        if (const Vec3 p = f.foot + f.u * u + f.v * v + f.normal * off; box().contains(p))
            return p;
    }
    throw Error(Fault::numeric, "centres: the planes of weakness cut off corners of the box only, "
                                "too small to hit; move them inwards");
}

bool center_stays(std::uint64_t i, double share, std::uint64_t seed) {
    if (!(share >= 0 && share <= 1))
        refuse("the share that stays is " + shortest(share) + "; must be in 0..1");
    return share == 1 || Rng{seed, kThinStream}.uniform(i) < share;
}

std::vector<Vec3> lattice_centers(const Box& box, double spacing_m) {
    check_length("spacing_m", spacing_m);
    check_box(box);
    const Vec3 size = box.size();
    double n[3], all = 1;
    Vec3 first;
    for (int axis = 0; axis < 3; ++axis) {
        // 0.3 m hold three steps of 0.1 m, whatever the last bit says.
        n[axis] = std::max(1.0, std::floor(size[axis] / spacing_m * (1 + 1e-12)));
        all *= n[axis];
        first[axis] = box.center()[axis] - 0.5 * spacing_m * (n[axis] - 1);
    }
    if (!(all <= kMost))
        refuse(shortest(all) +
               " nodes of the lattice; at most 1e8 are placed, use a larger spacing");
    std::vector<Vec3> centers;
    centers.reserve(static_cast<std::size_t>(all));
    for (int x = 0; x < n[0]; ++x)
        for (int y = 0; y < n[1]; ++y)
            for (int z = 0; z < n[2]; ++z)
                centers.push_back(first + Vec3{double(x), double(y), double(z)} * spacing_m);
    return centers;
}

std::vector<Vec3> hard_core_centers(const CenterStream& candidates, std::span<const double> radii_m,
                                    double gap_m, Progress* progress) {
    if (!(gap_m >= 0 && std::isfinite(gap_m)))
        refuse("gap_m is " + shortest(gap_m) + "; must be finite and >= 0");
    double sum = 0;
    for (std::size_t i = 0; i < radii_m.size(); ++i) {
        check_length(("radii_m[" + std::to_string(i) + "]").c_str(), radii_m[i]);
        sum += 2 * radii_m[i] + gap_m;
    }
    if (radii_m.empty())
        return {};
    report_stage(progress, "placing holes apart");
    BallGrid grid(candidates.box(), sum / static_cast<double>(radii_m.size()));
    std::vector<Vec3> centers;
    std::uint64_t n_tries = 0;
    for (std::size_t i = 0; i < radii_m.size(); ++i) {
        for (std::uint64_t n = 0;; ++n) {
            if (n_tries++ % 1000 == 0)
                check_cancelled(progress);
            if (n == kTries)
                throw Error(Fault::numeric,
                            "centres: ball " + std::to_string(i + 1) + " of " +
                                std::to_string(radii_m.size()) +
                                " finds no room; use fewer or smaller holes, or a smaller gap");
            const Sphere ball{candidates.center(attempt(i, n)), radii_m[i] + 0.5 * gap_m};
            if (grid.touches(ball))
                continue;
            grid.add(ball);
            centers.push_back(ball.center);
            break;
        }
    }
    return centers;
}

std::vector<double> hole_radii(const Law& law, double scale_m, std::uint64_t seed, std::size_t n) {
    const HoleStream stream(law, Box{{0, 0, 0}, {1, 1, 1}}, scale_m, seed);
    std::vector<double> radii(n);
    for (std::size_t i = 0; i < n; ++i)
        radii[i] = stream.radius_m(i);
    return radii;
}

} // namespace taihu
