#include "mesh_out/render.h"

#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <tbb/parallel_for.h>

#include "mesh_out/ray_scene_detail.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"

namespace taihu {
namespace {

// Lengths below are in units of the mesh's largest extent, its box about the origin.
constexpr double kEyeDistance = 3.2, kMargin = 1.06;
constexpr double kKeyLeftDeg = 55, kKeyUpDeg = 42, kKeySoftness = 0.06;
constexpr double kKey = 1.9, kSky = 0.9, kExposure = 0.62;
constexpr Vec3 kKeyTint{1.05, 1.0, 0.92}, kSkyTint{0.94, 0.98, 1.05};
constexpr double kGroundBounce = 0.3;
constexpr double kOcclusionReach = 1.2; // a wall farther than this counts as sky
constexpr double kRayOffset = 2e-5;     // positions are exact to a few 1e-7
constexpr double kGroundFadeFrom = 0.7, kGroundFadeOver = 1.6;
constexpr Vec3 kBackgroundTop{0.76, 0.77, 0.78}, kBackgroundBottom{0.60, 0.61, 0.62};
constexpr double kEdgeHalfWidthPx = 0.55, kEdgeGrey = 0.04;
constexpr double kInsetShare = 0.4, kInsetEdgePx = 12;
constexpr std::size_t kMaxLevels = 64;
constexpr std::uint32_t kPanelStream = 0x70696374, kInsetStream = 0x696e7365; // "pict", "inse"
constexpr int kTile = 16;

Vec3 tinted(const Vec3& a, const Vec3& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}
double radians(double degrees) {
    return degrees * std::numbers::pi / 180;
}

/// A pinhole camera and the window in front of it, in tangents of angles.
struct View {
    Vec3 eye, right, up, forward;
    double u_mid = 0, v_mid = 0, half_u = 0, half_v = 0;
    int width = 0, height = 0;

    Vec3 direction(double x_px, double y_px) const {
        const double u = u_mid + half_u * (2 * x_px / width - 1);
        const double v = v_mid + half_v * (1 - 2 * y_px / height);
        return normalized(forward + right * u + up * v);
    }
    /// Pixel coordinates of a point in front of the eye; z is not used.
    Vec3 pixel(const Vec3& p) const {
        const Vec3 d = p - eye;
        const double depth = dot(d, forward);
        return {width * 0.5 * (1 + (dot(d, right) / depth - u_mid) / half_u),
                height * 0.5 * (1 - (dot(d, up) / depth - v_mid) / half_v), 0};
    }
};

void require(bool ok, const std::string& name, double value, const char* range) {
    if (!ok)
        throw Error(Fault::bad_argument, "render: " + name + " is " + std::to_string(value) +
                                             ", must be " + range + "; choose one in that range");
}

void check(const RenderSettings& s) {
    require(s.width >= 16 && s.width <= 8192, "width", s.width, "16..8192");
    require(s.height >= 16 && s.height <= 8192, "height", s.height, "16..8192");
    require(std::isfinite(s.turntable_deg), "turntable_deg", s.turntable_deg, "finite");
    require(s.elevation_deg >= -89 && s.elevation_deg <= 89, "elevation_deg", s.elevation_deg,
            "-89..89");
    require(s.samples >= 1 && s.samples <= 4096, "samples", s.samples, "1..4096");
    require(s.ao_rays >= 1 && s.ao_rays <= 256, "ao_rays", s.ao_rays, "1..256");
    require(s.albedo >= 0 && s.albedo <= 1, "albedo", s.albedo, "0..1");
    for (int k = 0; k < 3; ++k)
        require(s.tint[k] >= 0 && s.tint[k] <= 1, "tint", s.tint[k], "0..1");
}

Box checked_bounds(std::span<const TriMesh> levels) {
    Box box;
    for (const TriMesh& mesh : levels) {
        if (mesh.triangles.empty())
            throw Error(Fault::bad_argument, "render: the mesh has no triangles; nothing to see");
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
            for (const std::uint32_t v : mesh.triangles[i]) {
                if (v >= mesh.positions.size() || !is_finite(mesh.positions[v]))
                    throw Error(Fault::bad_argument, "render: triangles[" + std::to_string(i) +
                                                         "] has no finite position " +
                                                         std::to_string(v) +
                                                         "; mend the mesh first");
                box.include(mesh.positions[v]);
            }
    }
    if (!(box.longest() > 0) || !std::isfinite(1 / box.longest()) || !is_finite(box.size()))
        throw Error(Fault::bad_argument, "render: the mesh has an extent of " +
                                             std::to_string(box.longest()) +
                                             " m; scale it to a size that can be seen");
    return box;
}

ScenePlacement placement(const Box& box, double turntable_deg) {
    ScenePlacement out;
    out.center = box.lo * 0.5 + box.hi * 0.5;
    out.scale = 1 / box.longest();
    const double turn = radians(std::remainder(turntable_deg, 360));
    out.cos_turn = std::cos(turn);
    out.sin_turn = std::sin(turn);
    out.ground = -0.5 * box.size().y * out.scale;
    return out;
}

/// The window that holds every circle which a vertex runs through on the turntable. Seen from the
/// eye, the point of such a circle at angle a from the eye's meridian has the depth A - B cos a and
/// the offsets R sin a and C - E cos a: the extremes of their ratios are known in closed form.
View framed(std::span<const TriMesh> levels, const ScenePlacement& place, const RenderSettings& s) {
    const double elevation = radians(s.elevation_deg);
    const double sine = std::sin(elevation), cosine = std::cos(elevation);
    View view{.eye = Vec3{0, sine, cosine} * kEyeDistance,
              .right = {1, 0, 0},
              .up = {0, cosine, -sine},
              .forward = {0, -sine, -cosine},
              .width = s.width,
              .height = s.height};
    for (const TriMesh& mesh : levels)
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t vertex : t) {
                const Vec3 p = (mesh.positions[vertex] - place.center) * place.scale;
                const double r = std::hypot(p.x, p.z);
                const double a = kEyeDistance - p.y * sine, b = r * cosine;
                view.half_u = std::max(view.half_u, r / std::sqrt(a * a - b * b));
                for (const double side : {-1.0, 1.0})
                    view.half_v = std::max(
                        view.half_v, std::abs((p.y * cosine - side * r * sine) / (a - side * b)));
            }
    const double aspect = static_cast<double>(s.width) / s.height;
    view.half_v = kMargin * std::max(view.half_v, view.half_u / aspect);
    view.half_u = view.half_v * aspect;
    return view;
}

/// Points of the R2 sequence (Roberts 2018, "The unreasonable effectiveness of quasirandom
/// sequences", from memory: powers of the plastic number), moved by a random vector.
struct Sequence {
    std::uint32_t u = 0, v = 0;

    std::array<double, 2> at(std::uint32_t i) const {
        return {(u + i * 0xC13FA9A9u + 0.5) * 0x1p-32, (v + i * 0x91E10DA6u + 0.5) * 0x1p-32};
    }
};

/// Two unit vectors that make a right-handed frame with `n` (Duff et al. 2017, from memory).
std::array<Vec3, 2> tangents(const Vec3& n) {
    const double s = std::copysign(1.0, n.z), a = -1 / (s + n.z), b = n.x * n.y * a;
    return {Vec3{1 + s * n.x * n.x * a, s * b, -s * n.x}, Vec3{b, s + n.y * n.y * a, -n.y}};
}

/// Draws one window of one scene.
class Painter {
public:
    Painter(const RayScene& scene, const ScenePlacement& place, const View& view,
            const RenderSettings& settings, std::uint32_t stream)
        : scene_(scene), view_(view), settings_(settings), rng_{settings.seed, stream},
          place_(place), ground_(place.ground) {
        const double left = radians(kKeyLeftDeg), up = radians(kKeyUpDeg);
        key_ = {-std::sin(left) * std::cos(up), std::sin(up), std::cos(left) * std::cos(up)};
        key_frame_ = tangents(key_);
    }

    Vec3 pixel(int x, int y) const {
        const auto item = static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(view_.width) +
                          static_cast<std::uint64_t>(x);
        const auto a = rng_.words(item, 0), b = rng_.words(item, 1);
        const Sequence in_pixel{a[0], a[1]}, in_key{a[2], a[3]}, in_sky{b[0], b[1]};
        const Vec3 backdrop = background(y);
        Vec3 sum;
        for (int s = 0; s < settings_.samples; ++s) {
            const auto i = static_cast<std::uint32_t>(s);
            const auto [dx, dy] = in_pixel.at(i);
            const Vec3 to = view_.direction(x + dx, y + dy);
            sum += sample(x + dx, y + dy, to, {in_key.at(i), in_sky, i}, backdrop);
        }
        return sum / settings_.samples;
    }

private:
    struct Draws {
        std::array<double, 2> key;
        Sequence sky;
        std::uint32_t sample;
    };

    Vec3 background(int y) const {
        const double t = (y + 0.5) / view_.height;
        return kBackgroundTop * (1 - t) + kBackgroundBottom * t;
    }

    Vec3 sample(double x_px, double y_px, const Vec3& to, const Draws& draws,
                const Vec3& backdrop) const {
        Hit hit;
        if (scene_.nearest(view_.eye, to, hit)) {
            const auto corners = scene_.corners(hit.face);
            return settings_.wireframe ? wire(corners, x_px, y_px, to)
                                       : stone(hit, corners, to, draws);
        }
        if (settings_.ground && !settings_.plain && to.y < 0 && view_.eye.y > ground_)
            return tinted(backdrop, plain(to, draws));
        return backdrop;
    }

    /// Faces in a plain light from the key's side, so that edges stay visible everywhere.
    Vec3 wire(const std::array<Vec3, 3>& corners, double x_px, double y_px, const Vec3& to) const {
        const Vec3 normal = facing(corners, to);
        const double light = 0.75 + 0.5 * dot(normal, key_);
        const Vec3 face = Vec3{1, 1, 1} * (1.2 * settings_.albedo * light);
        const Vec3 at{x_px, y_px, 0};
        std::array<Vec3, 3> p;
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = view_.pixel(corners[k]);
        const double twice_area = std::abs(cross(p[1] - p[0], p[2] - p[0]).z);
        double nearest = std::numeric_limits<double>::infinity(), longest = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 edge = p[(k + 1) % 3] - p[k];
            longest = std::max(longest, length(edge));
            nearest = std::min(nearest, std::abs(cross(edge, at - p[k]).z) / length(edge));
        }
        // Where triangles are as small as the lines are wide, the lines would hide them all.
        const double strength = std::min(1.0, twice_area / longest / (8 * kEdgeHalfWidthPx));
        const double ink = strength * std::clamp(kEdgeHalfWidthPx + 0.5 - nearest, 0.0, 1.0);
        return face * (1 - ink) + Vec3{1, 1, 1} * (kEdgeGrey * ink);
    }

    Vec3 stone(const Hit& hit, const std::array<Vec3, 3>& corners, const Vec3& to,
               const Draws& draws) const {
        const Vec3 flat = facing(corners, to);
        Vec3 normal = settings_.smooth ? scene_.smooth_normal(hit) : Vec3{};
        const double side = dot(normal, flat);
        normal = side > 0 ? normal : side < 0 ? -normal : flat;
        const Vec3 at = corners[0] * (1 - hit.u - hit.v) + corners[1] * hit.u + corners[2] * hit.v +
                        flat * kRayOffset;
        double albedo = settings_.plain ? 1 : settings_.albedo;
        Vec3 tint = settings_.plain ? settings_.plain->color : settings_.tint;
        if (settings_.normal_at || settings_.albedo_at || settings_.tint_at) {
            const Vec3 on_mesh = place_.mesh_point(at), own = place_.turned_back(normal);
            if (settings_.albedo_at)
                albedo = settings_.albedo_at(on_mesh, own);
            if (settings_.tint_at)
                tint = settings_.tint_at(on_mesh, own);
            if (settings_.normal_at)
                normal = place_.turned(settings_.normal_at(on_mesh, own));
        }
        if (settings_.plain)
            return tint * (albedo * plain_light(normal, to));
        return tinted(tint, sky_light(at, normal, draws) + key_light(at, normal, draws)) * albedo;
    }

    double plain_light(const Vec3& normal, const Vec3& to) const {
        const PlainLight& plain = *settings_.plain;
        const Vec3 seen = plain.light.direction(); // in the axes of the picture
        const Vec3 light = view_.right * seen.x + view_.up * seen.y - view_.forward * seen.z;
        return intensity(plain.reflection, normal, light, -to);
    }

    /// What the backdrop is multiplied by where the ray meets the ground: its light as a share of
    /// what it gets in the open, fading to 1 with the distance, so that no horizon shows.
    Vec3 plain(const Vec3& to, const Draws& draws) const {
        const Vec3 at = view_.eye + to * ((ground_ - view_.eye.y) / to.y);
        const double far = (std::hypot(at.x, at.z) - kGroundFadeFrom) / kGroundFadeOver;
        if (far >= 1)
            return {1, 1, 1};
        const Vec3 up{0, 1, 0}, above = at + up * kRayOffset;
        const Vec3 lit = sky_light(above, up, draws) + key_light(above, up, draws);
        const Vec3 open = kSkyTint * (kExposure * kSky * (0.65 + 0.5 * 2 / 3)) +
                          kKeyTint * (kExposure * kKey * key_.y);
        const double shadow = 1 - std::max(0.0, far);
        return Vec3{1, 1, 1} * (1 - shadow) +
               Vec3{lit.x / open.x, lit.y / open.y, lit.z / open.z} * shadow;
    }

    /// From above the sky, a little brighter overhead; from below what the ground sends back; from
    /// near walls some of the light that they must have got.
    Vec3 sky_light(const Vec3& at, const Vec3& normal, const Draws& draws) const {
        const auto [t, b] = tangents(normal);
        Vec3 sum;
        const auto n = static_cast<std::uint32_t>(settings_.ao_rays);
        for (std::uint32_t k = 0; k < n; ++k) {
            const auto [share, turn] = draws.sky.at(draws.sample * n + k);
            const double r = std::sqrt(share), angle = 2 * std::numbers::pi * turn;
            const Vec3 to = t * (r * std::cos(angle)) + b * (r * std::sin(angle)) +
                            normal * std::sqrt(1 - share);
            if (scene_.blocked(at, to, kOcclusionReach))
                sum += kKeyTint * (0.1 * settings_.albedo);
            else if (settings_.ground && to.y < 0)
                sum += kKeyTint * kGroundBounce;
            else
                sum += kSkyTint * (0.65 + 0.5 * to.y);
        }
        return sum * (kExposure * kSky / n);
    }

    Vec3 key_light(const Vec3& at, const Vec3& normal, const Draws& draws) const {
        const double r = kKeySoftness * std::sqrt(draws.key[0]);
        const double angle = 2 * std::numbers::pi * draws.key[1];
        const Vec3 to = normalized(key_ + key_frame_[0] * (r * std::cos(angle)) +
                                   key_frame_[1] * (r * std::sin(angle)));
        const double cosine = dot(normal, to);
        if (cosine <= 0 || scene_.blocked(at, to, std::numeric_limits<double>::infinity()))
            return {};
        return kKeyTint * (kExposure * kKey * cosine);
    }

    static Vec3 facing(const std::array<Vec3, 3>& c, const Vec3& to) {
        const Vec3 n = normalized(cross(c[1] - c[0], c[2] - c[0]));
        return dot(n, to) > 0 ? -n : n;
    }

    const RayScene& scene_;
    const View& view_;
    const RenderSettings& settings_;
    Rng rng_;
    ScenePlacement place_;
    double ground_;
    Vec3 key_;
    std::array<Vec3, 2> key_frame_;
};

/// Share of the whole work that one call of paint() is.
struct Part {
    double begin = 0, size = 1;
};

/// Fills the window of `image` whose upper left corner is (left, top).
void paint(const Painter& painter, const View& view, Image& image, int left, int top, Part part,
           Progress* progress) {
    const int across = (view.width + kTile - 1) / kTile, down = (view.height + kTile - 1) / kTile;
    std::atomic<int> n_done{0};
    const int n_tiles = across * down, n_report = std::max(1, n_tiles / 100);
    tbb::parallel_for(0, n_tiles, [&](int tile) {
        check_cancelled(progress);
        const int x0 = tile % across * kTile, y0 = tile / across * kTile;
        for (int y = y0; y < std::min(view.height, y0 + kTile); ++y)
            for (int x = x0; x < std::min(view.width, x0 + kTile); ++x) {
                const Vec3 color = painter.pixel(x, y);
                float* to = image.at(left + x, top + y);
                for (int k = 0; k < 3; ++k)
                    to[k] = static_cast<float>(color[k]);
            }
        const int done = ++n_done;
        if (done % n_report == 0)
            report_fraction(progress, part.begin + part.size * done / n_tiles);
    });
}

double mean_edge_px(const RayScene& scene, const TriMesh& mesh, const View& view) {
    double sum = 0;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto c = scene.corners(i);
        sum += length(c[1] - c[0]) + length(c[2] - c[1]) + length(c[0] - c[2]);
    }
    const double mean = sum / 3 / static_cast<double>(mesh.triangles.size());
    return mean / kEyeDistance / view.half_u * 0.5 * view.width;
}

/// The window of the inset: about the mesh's point that is seen nearest to the middle.
View inset_view(const RayScene& scene, const TriMesh& mesh, const View& panel) {
    constexpr int kGrid = 64;
    double best = std::numeric_limits<double>::infinity(), u = 0, v = 0;
    for (int j = 0; j <= kGrid; ++j)
        for (int i = 0; i <= kGrid; ++i) {
            const double x = static_cast<double>(i) / kGrid, y = static_cast<double>(j) / kGrid;
            const double off = std::hypot(x - 0.5, y - 0.5);
            Hit ignored;
            if (off < best &&
                scene.nearest(panel.eye, panel.direction(x * panel.width, y * panel.height),
                              ignored)) {
                best = off;
                u = panel.half_u * (2 * x - 1);
                v = panel.half_v * (1 - 2 * y);
            }
        }
    View inset = panel;
    inset.width = inset.height =
        static_cast<int>(kInsetShare * std::min(panel.width, panel.height));
    const double zoom = std::clamp(kInsetEdgePx / mean_edge_px(scene, mesh, panel), 1.0, 50.0);
    inset.half_u = inset.half_v = panel.half_u * inset.width / panel.width / zoom;
    inset.u_mid = u;
    inset.v_mid = v;
    return inset;
}

void fill(Image& image, int x0, int y0, int x1, int y1, float grey) {
    for (int y = y0; y < y1; ++y)
        std::fill(image.at(x0, y), image.at(x0, y) + 3 * (x1 - x0), grey);
}

} // namespace

Image render(const TriMesh& mesh, const RenderSettings& settings, Progress* progress) {
    check(settings);
    const std::span<const TriMesh> levels(&mesh, 1);
    const ScenePlacement place = placement(checked_bounds(levels), settings.turntable_deg);
    const View view = framed(levels, place, settings);
    report_stage(progress, "rendering");
    const RayScene scene(mesh, place);
    Image image(settings.width, settings.height, 3);
    paint(Painter(scene, place, view, settings, kPanelStream), view, image, 0, 0, {}, progress);
    return image;
}

Image render_sheet(std::span<const TriMesh> levels, const RenderSettings& settings,
                   Progress* progress) {
    check(settings);
    require(!levels.empty() && levels.size() <= kMaxLevels, "the number of levels",
            static_cast<double>(levels.size()), "1..64");
    const double n_pixels = static_cast<double>(levels.size()) * settings.width * settings.height;
    require(n_pixels <= 0x1p28, "the number of pixels", n_pixels, "at most 2^28");
    const ScenePlacement place = placement(checked_bounds(levels), settings.turntable_deg);
    const View view = framed(levels, place, settings);
    RenderSettings wired = settings;
    wired.wireframe = true;
    wired.ground = false;
    report_stage(progress, "rendering");
    Image image(settings.width * static_cast<int>(levels.size()), settings.height, 3);
    View inset;
    for (std::size_t i = 0; i < levels.size(); ++i) {
        const RayScene scene(levels[i], place);
        if (i == 0)
            inset = inset_view(scene, levels[i], view);
        const double share = 1.0 / static_cast<double>(levels.size());
        const double begin = share * static_cast<double>(i);
        const int left = settings.width * static_cast<int>(i);
        paint(Painter(scene, place, view, settings, kPanelStream), view, image, left, 0,
              {begin, 0.9 * share}, progress);
        const int frame = std::max(1, inset.width / 96), gap = 2 * frame;
        const int x = left + settings.width - inset.width - gap;
        const int y = settings.height - inset.height - gap;
        fill(image, x - frame, y - frame, x + inset.width + frame, y + inset.height + frame, 0.1f);
        paint(Painter(scene, place, inset, wired, kInsetStream), inset, image, x, y,
              {begin + 0.9 * share, 0.1 * share}, progress);
    }
    return image;
}

} // namespace taihu
