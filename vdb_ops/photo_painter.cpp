#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/rng.h"
#include "vdb_ops/photo_painter_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kGrainStream = 0x67726169;
constexpr Vec3 kStone{0.47, 0.445, 0.40}, kBackground{0.80, 0.81, 0.82}; // linear light
constexpr double kTone = 0.04; // of the grain: steps hardly to be seen, which keep files small
constexpr double kKey = 0.4, kSky = 0.6; // of the light that a cut face gets
constexpr double kInside = 0.5;          // weathered walls are darker than a cut,
constexpr double kFade = 12;             // and half as bright this deep [pixels]: a soft rim
constexpr int kSide = 2;                 // samples along a pixel where it is not all stone
constexpr int kRays = 6;                 // to the sky from each of them

/// The grain of the stone in its plane, coordinates in pixels: a factor about 1.
class Grain {
public:
    double at(double x, double y) const {
        const double sum = 0.12 * smooth(x / 43, y / 43, 0) + 0.07 * smooth(x / 12, y / 12, 1) +
                           0.04 * smooth(x / 5, y / 5, 2) + crystal(x / 9, y / 9);
        return 1 + std::round(sum / kTone) * kTone;
    }

private:
    static std::uint64_t cell(double x, double y) {
        const auto i = static_cast<std::uint32_t>(static_cast<std::int32_t>(x));
        const auto j = static_cast<std::uint32_t>(static_cast<std::int32_t>(y));
        return std::uint64_t{j} << 32 | i;
    }
    /// -1..1, smooth between whole numbers.
    double smooth(double x, double y, std::uint32_t octave) const {
        const double x0 = std::floor(x), y0 = std::floor(y);
        const auto weight = [](double t) { return t * t * (3 - 2 * t); };
        const auto value = [&](double i, double j) {
            return 2 * rng_.uniform(cell(x0 + i, y0 + j), octave) - 1;
        };
        const double u = weight(x - x0), v = weight(y - y0);
        return std::lerp(std::lerp(value(0, 0), value(1, 0), u),
                         std::lerp(value(0, 1), value(1, 1), u), v);
    }
    /// In some cells a dark or a bright spot.
    double crystal(double x, double y) const {
        const double x0 = std::floor(x), y0 = std::floor(y);
        const auto number = [&](std::uint32_t k) { return rng_.uniform(cell(x0, y0), 3 + k); };
        if (number(0) > 0.3)
            return 0;
        const double radius = 0.06 + 0.12 * number(1);
        const double dx = x - x0 - 0.2 - 0.6 * number(2), dy = y - y0 - 0.2 - 0.6 * number(3);
        const double cover = std::clamp((radius - std::hypot(dx, dy)) * 9 + 0.5, 0.0, 1.0);
        return cover * (number(4) < 0.7 ? -0.27 : 0.18);
    }
    Rng rng_{0, kGrainStream};
};

/// One thread's brush.
class Painter {
public:
    Painter(const PhotoScene& scene, const PhotoFrame& frame)
        : scene_(scene), frame_(frame), rock_(scene.rock) {
        for (int k = 0; k < kSide * kSide; ++k) { // a lamp of some width: soft shadows
            const double a = 0.22 * (k % kSide - 0.5), b = 0.22 * (k / kSide - 0.5);
            keys_.push_back(normalized(scene.plane.normal * 0.9 + scene.plane.u * (a - 0.5) +
                                       scene.plane.v * (b + 0.5)));
        }
    }

    /// One look where all around is stone, or all background; several on edges and in holes.
    Vec3 pixel(int x, int y) const {
        const int i = frame_.x0 + x, j = frame_.y0 + y;
        const std::uint8_t kind = scene_.image.kind_at(i, j);
        bool near_hole = kind == PlaneImage::hole, plain = !near_hole;
        for (const auto& [a, b] : {std::pair{i - 1, j}, {i + 1, j}, {i, j - 1}, {i, j + 1}}) {
            const std::uint8_t other = scene_.image.kind_at(a, b);
            near_hole = near_hole || other == PlaneImage::hole;
            plain = plain && other == kind;
        }
        if (plain)
            return kind == PlaneImage::air ? kBackground : face(i, j);
        Vec3 sum;
        for (int k = 0; k < kSide * kSide; ++k)
            sum += sample(i + (k % kSide + 0.5) / kSide - 0.5, j + (k / kSide + 0.5) / kSide - 0.5,
                          kind, near_hole, k);
        return sum / (kSide * kSide);
    }

private:
    Vec3 face(double i, double j) const {
        return kStone * grain_.at(i, j * std::abs(scene_.image.step_v / scene_.image.step_u));
    }

    /// One of the samples of a pixel of this kind.
    Vec3 sample(double i, double j, std::uint8_t kind, bool near_hole, int k) const {
        const Vec3 p = scene_.image.point(scene_.plane, i, j);
        if (kind != PlaneImage::air && rock_.solid(p))
            return face(i, j);
        return near_hole && kind != PlaneImage::air ? inside(p, k) : kBackground;
    }

    /// What is seen through a void at a point of the cut.
    Vec3 inside(const Vec3& p, int k) const {
        const auto hit = march(p, scene_.view);
        if (!hit)
            return kBackground;
        const Vec3 normal = normal_at(*hit);
        const Vec3 start = *hit + normal * (0.6 * rock_.voxel_m());
        const Vec3 key = keys_[static_cast<std::size_t>(k)];
        const double facing =
            std::clamp(dot(normal, key) / dot(scene_.plane.normal, key), 0.0, 1.0);
        const double lit = facing > 0 && !march(start, key) ? facing : 0;
        const double depth = length(*hit - p) / scene_.image.step_u;
        const double light = kKey * lit + kSky * sky(start, normal, k);
        return kStone * (kInside * light / (1 + depth / kFade));
    }

    /// The share of the sky that a point inside of a hole gets; a face gets all.
    double sky(const Vec3& p, const Vec3& normal, int k) const {
        double sum = 0;
        for (int ray = 0; ray < kRays; ++ray) {
            const Vec3& d = directions_[static_cast<std::size_t>(ray * kSide * kSide + k)];
            const Vec3 to = scene_.plane.u * d.x + scene_.plane.v * d.y + scene_.plane.normal * d.z;
            const double cosine = dot(normal, to);
            if (cosine > 0 && !march(p, to))
                sum += cosine / d.z / kRays;
        }
        return std::min(1.0, sum);
    }

    /// Where a ray that starts in the void meets the rock; not, where it leaves by the cut.
    std::optional<Vec3> march(Vec3 p, const Vec3& direction) const {
        constexpr int kMostSteps = 400; // along a wall; it is then as good as met
        const double voxel = rock_.voxel_m();
        double way = 0;
        for (int step = 0; step < kMostSteps; ++step) {
            const double d = rock_.distance_m(p);
            if (d < 0.02 * voxel)
                return p;
            const double stride = std::max(d, 0.1 * voxel);
            p += direction * stride;
            way += stride;
            if (way > scene_.reach_m || dot(p - scene_.plane.origin, scene_.plane.normal) > 0)
                return {};
        }
        return p;
    }

    Vec3 normal_at(const Vec3& p) const {
        const double h = rock_.voxel_m();
        Vec3 g;
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 step;
            step[axis] = h;
            g[axis] = rock_.distance_m(p + step) - rock_.distance_m(p - step);
        }
        return normalized(g);
    }

    /// Spread over the half sphere with a density that grows with the cosine.
    static std::array<Vec3, kRays * kSide * kSide> make_directions() {
        std::array<Vec3, kRays * kSide * kSide> all;
        const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
        for (std::size_t i = 0; i < all.size(); ++i) {
            const double r2 = (static_cast<double>(i) + 0.5) / static_cast<double>(all.size());
            const double a = golden * static_cast<double>(i);
            all[i] = {std::sqrt(r2) * std::cos(a), std::sqrt(r2) * std::sin(a), std::sqrt(1 - r2)};
        }
        return all;
    }

    const PhotoScene& scene_;
    const PhotoFrame& frame_;
    SolidSampler rock_;
    std::vector<Vec3> keys_; ///< directions to the lamp, one a sample
    Grain grain_;
    std::array<Vec3, kRays* kSide* kSide> directions_ = make_directions();
};

} // namespace

Image paint_cut(const PhotoScene& scene, const PhotoFrame& frame, const Progress* progress) {
    Image picture(frame.width, frame.height, 3);
    tbb::parallel_for(tbb::blocked_range<int>(0, frame.height, 8), [&](const auto& rows) {
        const Painter painter(scene, frame);
        for (int y = rows.begin(); y < rows.end(); ++y) {
            check_cancelled(progress);
            for (int x = 0; x < frame.width; ++x) {
                const Vec3 colour = painter.pixel(x, y);
                for (int c = 0; c < 3; ++c)
                    picture.at(x, y)[c] = static_cast<float>(colour[c]);
            }
        }
    });
    return picture;
}

void paint_bar(Image& picture, int x, int y, double length, int height) {
    constexpr double kDark = 0.02, kBright = 0.9;
    for (int j = y; j < y + height; ++j)
        for (int i = x; i < x + length; ++i) {
            const bool edge = j == y || j == y + height - 1 || i == x || i + 1 >= x + length;
            const int quarter = static_cast<int>(4 * (i + 0.5 - x) / length);
            const double value = edge || quarter % 2 == 0 ? kDark : kBright;
            const double cover = std::min(1.0, x + length - i); // of the last pixel
            for (int c = 0; c < 3; ++c) {
                float& here = picture.at(i, j)[c];
                here = static_cast<float>(std::lerp(double{here}, value, cover));
            }
        }
}

} // namespace taihu
