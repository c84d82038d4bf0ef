#include "vdb_ops/noise.h"

#include <algorithm>
#include <cmath>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kFrameStream = 0x6e6f6973; // turn, shift and key of each octave
/// The root mean square of gradient noise: each of 8 corners adds 1/3 of its squared distance under
/// quintic weights w, so 8 * 1/3 * 3 * b * a^2 with the integrals a of w^2 and b of w^2 t^2.
const double kGradientRms = [] {
    double a = 0, b = 0; // the midpoint rule: good to 1e-8, the same everywhere
    constexpr int kSteps = 4096;
    for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) / kSteps, w = 1 - t * t * t * (t * (t * 6 - 15) + 10);
        a += w * w / kSteps;
        b += w * w * t * t / kSteps;
    }
    return std::sqrt(8 * b * a * a);
}();

/// Source: the 32-bit finalizer of Wellons 2018, Prospecting for hash functions, from memory.
std::uint32_t mixed(std::uint32_t h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ h >> 16;
}

/// Of a corner of the lattice; the same again after 2^32 of them.
std::uint32_t hashed(std::int64_t x, std::int64_t y, std::int64_t z, std::uint32_t key) {
    const auto part = [](std::int64_t v) { return static_cast<std::uint32_t>(v); };
    return mixed(part(x) * 0x8da6b343u ^ part(y) * 0xd8163841u ^ part(z) * 0xcb1ab31fu ^ key);
}

constexpr double kTenBits = 2.0 / 1023;

/// Three numbers in -1..1.
Vec3 cube_vector(std::uint32_t h) {
    return {(h & 1023) * kTenBits - 1, (h >> 10 & 1023) * kTenBits - 1,
            (h >> 20 & 1023) * kTenBits - 1};
}

struct Frame {
    std::array<Vec3, 3> row;
    Vec3 shift;
    std::uint32_t key;
};

/// A frame at random whose unit is `unit_m`, and `stretch` times that along `along`.
Frame random_frame(const NoiseSettings& s, std::uint64_t item, double unit_m) {
    const Rng rng{s.seed, kFrameStream};
    double q[4], n2 = 2;
    std::uint32_t draw = 0;
    while (n2 > 1 || n2 < 0.01) { // a quaternion, uniform on the sphere
        n2 = 0;
        for (double& v : q) {
            v = 2 * rng.uniform(item, draw++) - 1;
            n2 += v * v;
        }
    }
    const double w = q[0], x = q[1], y = q[2], z = q[3], k = 2 / n2;
    const std::array<Vec3, 3> turn = {
        {{1 - k * (y * y + z * z), k * (x * y - w * z), k * (x * z + w * y)},
         {k * (x * y + w * z), 1 - k * (x * x + z * z), k * (y * z - w * x)},
         {k * (x * z - w * y), k * (y * z + w * x), 1 - k * (x * x + y * y)}}};
    Frame frame;
    const Vec3 along = normalized(s.along);
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3 row = turn[i] - along * (dot(turn[i], along) * (1 - 1 / s.stretch));
        frame.row[i] = row / unit_m;
        frame.shift[static_cast<int>(i)] = 1000 * rng.uniform(item, draw++);
    }
    frame.key = rng.words(item, draw)[0];
    return frame;
}

Vec3 placed_in(const std::array<Vec3, 3>& row, const Vec3& shift, const Vec3& p) {
    return {dot(row[0], p) + shift.x, dot(row[1], p) + shift.y, dot(row[2], p) + shift.z};
}

double fade(double t) {
    return t * t * t * (t * (t * 6 - 15) + 10);
}

double mix(double a, double b, double t) {
    return a + (b - a) * t;
}

} // namespace

void check_noise(const NoiseSettings& s, const std::string& where) {
    const auto within = [&](const char* name, double v, double lo, double hi) {
        if (!(v >= lo && v <= hi))
            throw Error(Fault::bad_argument, where + ": " + name + " is " + shortest(v) +
                                                 ", must be " + shortest(lo) + ".." + shortest(hi));
    };
    within("largest_m", s.largest_m, 1e-9, 1e6);
    within("smallest_m", s.smallest_m, s.largest_m * 0x1p-16, s.largest_m);
    within("hurst", s.hurst, 0.05, 2);
    within("stretch", s.stretch, 0.01, 100);
    if (const double n = length(s.along); !(n > 1e-9 && n < 1e9))
        throw Error(Fault::bad_argument, where + ": along has no length; give a direction");
}

FractalNoise::FractalNoise(const NoiseSettings& s, double least_m) : hurst_(s.hurst) {
    check_noise(s, "noise");
    double wavelength = s.largest_m;
    for (std::uint64_t i = 0; wavelength >= s.smallest_m * 0.999; ++i) {
        const Frame f = random_frame(s, i, wavelength);
        octaves_.push_back({f.row, f.shift, f.key, wavelength >= least_m});
        wavelength /= 2;
    }
}

double FractalNoise::Octave::value(const Vec3& p) const {
    const Vec3 q = placed_in(row, shift, p);
    const double fx = std::floor(q.x), fy = std::floor(q.y), fz = std::floor(q.z);
    const double x = q.x - fx, y = q.y - fy, z = q.z - fz;
    const auto i = static_cast<std::int64_t>(fx), j = static_cast<std::int64_t>(fy),
               k = static_cast<std::int64_t>(fz);
    const auto corner = [&](int a, int b, int c) {
        const Vec3 g = cube_vector(hashed(i + a, j + b, k + c, key));
        return g.x * (x - a) + g.y * (y - b) + g.z * (z - c);
    };
    const double u = fade(x), v = fade(y), w = fade(z);
    const double near =
        mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v);
    const double far =
        mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v);
    return mix(near, far, w);
}

double FractalNoise::at(const Vec3& p, double hurst) const {
    const double falling = std::exp2(-hurst);
    double sum = 0, squares = 0, weight = 1;
    for (const Octave& octave : octaves_) {
        sum += octave.shown ? weight * octave.value(p) : 0;
        squares += weight * weight;
        weight *= falling;
    }
    return std::clamp(sum / (kGradientRms * std::sqrt(squares)), -kMost, kMost);
}

double FractalNoise::ridged(const Vec3& p) const {
    constexpr double kFoot = 1.7; // times the rms: where a ridge has come down to 0
    const double falling = std::exp2(-hurst_);
    double sum = 0, total = 0, weight = 1;
    for (const Octave& octave : octaves_) {
        const double up =
            octave.shown ? 1 - std::min(1.0, std::fabs(octave.value(p)) / (kFoot * kGradientRms))
                         : 0;
        sum += weight * up * up;
        total += weight;
        weight *= falling;
    }
    return sum / total;
}

CellNoise::CellNoise(const NoiseSettings& s) {
    check_noise(s, "noise");
    const Frame f = random_frame(s, 0, s.largest_m);
    row_ = f.row;
    shift_ = f.shift;
    key_ = f.key;
}

CellNoise::Cell CellNoise::at(const Vec3& p) const {
    const Vec3 q = placed_in(row_, shift_, p);
    const Vec3 base{std::floor(q.x), std::floor(q.y), std::floor(q.z)}, in = q - base;
    const auto i = static_cast<std::int64_t>(base.x), j = static_cast<std::int64_t>(base.y),
               k = static_cast<std::int64_t>(base.z);
    Cell cell{9, 9, 0};
    double nearest2 = 81, second2 = 81;
    Vec3 to;
    std::uint32_t owner = 0;
    // A point lies within sqrt(3), so two rings of cubes hold the nearest; those that are farther
    // than the second are left out.
    const auto beyond = [](int step, double at) {
        const double d = step > 0 ? step - at : step < 0 ? at - step - 1 : 0;
        return d * d;
    };
    for (int a = -2; a <= 2; ++a)
        for (int b = -2; b <= 2; ++b)
            for (int c = -2; c <= 2; ++c) {
                if (beyond(a, in.x) + beyond(b, in.y) + beyond(c, in.z) > second2)
                    continue;
                const std::uint32_t h = hashed(i + a, j + b, k + c, key_);
                const Vec3 from =
                    in - Vec3{1. * a, 1. * b, 1. * c} - (cube_vector(h) + Vec3{1, 1, 1}) * 0.5;
                const double d2 = length_squared(from);
                if (d2 < nearest2) {
                    second2 = nearest2;
                    nearest2 = d2;
                    to = from;
                    owner = h;
                } else {
                    second2 = std::min(second2, d2);
                }
            }
    cell.nearest = std::sqrt(nearest2);
    cell.second = std::sqrt(second2);
    const Vec3 slope = cube_vector(mixed(owner ^ 0x5bd1e995u));
    const double level = (mixed(owner + 0x9e3779b9u) >> 8) * 0x1p-24 - 0.5;
    cell.facet = std::clamp(dot(to, slope) + level, -2.0, 2.0);
    return cell;
}

BedNoise::BedNoise(const NoiseSettings& s)
    : sway_({s.largest_m * 8, s.largest_m * 2, 0.8, {0, 1, 0}, 1, s.seed}),
      along_(normalized(s.along)), thickness_m_(s.largest_m),
      key_(Rng{s.seed, kFrameStream}.words(1000)[0]) {
    check_noise(s, "noise");
}

double BedNoise::at(const Vec3& p) const {
    constexpr double kSway = 0.2, kStep = 0.75, kJoint = 0.87, kJointWidth = 0.06;
    const double t = dot(p, along_) / thickness_m_ + kSway * sway_.at(p);
    const double bed = std::floor(t), in = t - bed;
    const auto level = [&](double number) {
        return (hashed(static_cast<std::int64_t>(number), 0, 0, key_) >> 8) * 0x1p-24 - 0.5;
    };
    double u = std::clamp((in - kStep) / (1 - kStep), 0.0, 1.0);
    u = u * u * (3 - 2 * u);
    const double joint = std::max(0.0, 1 - std::fabs(in - kJoint) / (2 * kJointWidth));
    return mix(level(bed), level(bed + 1), u) - 0.35 * joint * joint;
}

} // namespace taihu
