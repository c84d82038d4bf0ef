#include "mesh_out/bake.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <tbb/parallel_for.h>

#include "mesh_out/closest_point_detail.h"
#include "mesh_out/grain.h"
#include "mesh_out/io/exr_file.h"
#include "mesh_out/io/image_file.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "mesh_out/openness.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"

namespace taihu {
namespace {

constexpr double kOn_vox = 1e-3;      ///< near enough to the surface [voxels]
constexpr double kGrazing_vox = 0.05; ///< where a ray that hardly gets on is taken to have met it
constexpr double kInside = 0.01;      ///< least weight of a corner where a gutter texel is baked
constexpr int kMostSteps = 64, kBisections = 24;
constexpr int kMostSide_px = 8192, kMostGutter_px = 16;
constexpr std::size_t kMostSamples = 200000;      ///< of relit_error()
constexpr std::uint32_t kPartStream = 0x70617274; // "part"

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "bake: " + what);
}

TriMesh with_openness(TriMesh surface, int n_rays, Progress* progress) {
    check_writable(surface, "bake");
    if (surface.normals.empty())
        refuse("the fine surface has no normals; give one for each position");
    if (surface.openness.empty()) {
        report_stage(progress, "openness of the fine surface");
        surface.openness = openness(surface, {.n_rays = n_rays}, progress);
    }
    return surface;
}

double positive(const char* name, double length_m) {
    if (!(length_m > 0) || !std::isfinite(length_m))
        refuse(std::string(name) + " is " + std::to_string(length_m) + ", must be finite and > 0");
    return length_m;
}

using Weights = std::array<double, 3>;

/// What a viewer interpolates over a face.
struct Frame {
    Vec3 point, tangent, bitangent, normal;

    /// The direction whose multiples along tangent, bitangent and normal are these.
    Vec3 world(const Vec3& v) const {
        return normalized(tangent * v.x + bitangent * v.y + normal * v.z);
    }
    /// The other way: by Cramer, since an interpolated frame is not quite square.
    Vec3 local(const Vec3& v) const {
        const Vec3 bn = cross(bitangent, normal);
        const double det = dot(tangent, bn);
        if (!(std::fabs(det) > 1e-3)) // nothing to go by
            return {0, 0, 1};
        return normalized(
            Vec3{dot(v, bn), dot(v, cross(normal, tangent)), dot(v, cross(tangent, bitangent))} /
            det);
    }
};

Frame frame_at(const TexturedMesh& coarse, std::uint32_t face, const Weights& w) {
    Frame out;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t i = coarse.mesh.triangles[face][k];
        const Vec3 n = normalized(coarse.mesh.normals[i]), t = normalized(coarse.tangents[i]);
        out.point += coarse.mesh.positions[i] * w[k];
        out.normal += n * w[k];
        out.tangent += t * w[k];
        out.bitangent += normalized(cross(n, t)) * w[k];
    }
    out.normal = normalized(out.normal);
    out.tangent = normalized(out.tangent);
    out.bitangent = normalized(out.bitangent);
    return out;
}

/// Of a place outside of the face, weights a little inside of it: on an edge itself the fine
/// surface may turn sharply, and which side of it is met would be chance.
Weights held(Weights w) {
    if (*std::min_element(w.begin(), w.end()) >= 0)
        return w;
    double sum = 0;
    for (double& x : w)
        sum += x = std::max(x, kInside);
    for (double& x : w)
        x /= sum;
    return w;
}

/// Grows faces over texels beside them, a ring at a time.
void grow(std::vector<std::uint32_t>& owners, int side_px, int n_rings) {
    constexpr std::array<std::array<int, 2>, 8> kBeside = {
        {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
    const auto index = [&](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(side_px) +
               static_cast<std::size_t>(x);
    };
    for (int ring = 0; ring < n_rings; ++ring) {
        const std::vector<std::uint32_t> before = owners;
        tbb::parallel_for(0, side_px, [&](int y) {
            for (int x = 0; x < side_px; ++x)
                for (std::size_t k = 0; k < 8 && owners[index(x, y)] == kNoFace; ++k) {
                    const int i = x + kBeside[k][0], j = y + kBeside[k][1];
                    if (i >= 0 && j >= 0 && i < side_px && j < side_px)
                        owners[index(x, y)] = before[index(i, j)];
                }
        });
    }
}

void set(Image& image, int x, int y, const Vec3& v) {
    for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] = static_cast<float>(v[c]);
}

/// An 8-bit sample as a reader has it, 0..1.
double stored(double value) {
    return std::floor(255 * std::clamp(value, 0.0, 1.0) + 0.5) / 255;
}

Image halved(const Image& normals) {
    Image out = normals;
    for (float& v : out.pixels)
        v = (v + 1) / 2;
    return out;
}

/// The normal that a viewer reads from the 8-bit map between four texels.
Vec3 read_normal(const Image& map, int x, int y) {
    Vec3 sum;
    for (const auto& [i, j] : {std::array{x - 1, y - 1}, {x, y - 1}, {x - 1, y}, {x, y}})
        for (int c = 0; c < 3; ++c)
            sum[c] += (2 * stored((double{map.at(i, j)[c]} + 1) / 2) - 1) / 4;
    return sum;
}

double angle_deg(const Vec3& a, const Vec3& b) {
    return std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

} // namespace

BakeSource::BakeSource(const Field& field, TriMesh surface, const BakeSourceSettings& settings,
                       Progress* progress)
    : surface_(with_openness(std::move(surface), settings.n_rays, progress)), nearest_(surface_),
      voxel_m_(positive("voxel_m", settings.voxel_m)),
      reach_m_(positive("reach_m", settings.reach_m)), normals_(settings.normals) {
    // A coarse mesh lies in the cage, and the step of curvatures reaches a little beyond.
    probe_ = field.probe(bounds(surface_).dilated(2 * (reach_m_ + voxel_m_)), reach_m_ + voxel_m_);
}

BakeSource::Place BakeSource::meet(const Vec3& p, const Vec3& normal, double reach_m) const {
    const double on_m = kOn_vox * voxel_m_;
    double value = probe_->at(p).value_m, t = 0;
    const double way = value > 0 ? -1 : 1;
    const auto at = [&](double along) { return p + normal * (way * along); };
    bool is_met = std::fabs(value) <= on_m;
    for (int i = 0; i < kMostSteps && !is_met && t <= reach_m; ++i) {
        const double step = std::max(std::fabs(value), on_m);
        const double next = probe_->at(at(t + step)).value_m;
        if (next * value < 0) { // past it: fields of voxels are no exact distances
            double lo = t, hi = t + step;
            for (int k = 0; k < kBisections; ++k) {
                const double middle = (lo + hi) / 2;
                (probe_->at(at(middle)).value_m * value > 0 ? lo : hi) = middle;
            }
            t = hi;
            is_met = true;
        } else {
            t += step;
            value = next;
            is_met = std::fabs(value) <= on_m;
        }
    }
    is_met = (is_met || std::fabs(value) <= kGrazing_vox * voxel_m_) && t <= reach_m;
    Place out;
    out.is_traced = is_met;
    out.point = is_met ? at(t) : nearest_.nearest(p);
    out.offset_m = dot(out.point - p, normal);
    out.primitive = probe_->at(out.point).primitive;
    if (normals_ == NormalsOf::field) {
        out.normal = normalized(probe_->of(out.primitive, out.point).gradient);
    } else {
        const auto [corners, w] = nearest_weights(out.point);
        out.normal =
            normalized(surface_.normals[corners[0]] * w[0] + surface_.normals[corners[1]] * w[1] +
                       surface_.normals[corners[2]] * w[2]);
    }
    if (out.normal == Vec3{})
        out.normal = normal;
    return out;
}

std::pair<Triangle, std::array<double, 3>> BakeSource::nearest_weights(const Vec3& p) const {
    const Triangle& t = surface_.triangles[nearest_.nearest_triangle(p)];
    const Vec3 &a = surface_.positions[t[0]], &b = surface_.positions[t[1]],
               &c = surface_.positions[t[2]];
    const Vec3 q = closest_point_on_triangle(p, a, b, c);
    Weights w = {length(cross(b - q, c - q)), length(cross(c - q, a - q)),
                 length(cross(a - q, b - q))};
    const double sum = w[0] + w[1] + w[2];
    for (double& x : w)
        x = sum > 0 ? x / sum : 1.0 / 3;
    return {t, w};
}

double BakeSource::openness_at(const Vec3& p) const {
    const auto [corners, w] = nearest_weights(p);
    double out = 0;
    for (std::size_t k = 0; k < 3; ++k)
        out += w[k] * double{surface_.openness[corners[k]]};
    return out;
}

double BakeSource::curvature_at(const Vec3& p) const {
    const auto value = [&](const Vec3& q) { return probe_->at(q).value_m; };
    double sum = -6 * value(p);
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 step;
        step[axis] = voxel_m_;
        sum += value(p + step) + value(p - step);
    }
    return std::clamp(sum / (2 * voxel_m_ * voxel_m_), -1 / voxel_m_, 1 / voxel_m_);
}

namespace {

void check(const TexturedMesh& coarse, const BakeSource& fine, const BakeSettings& s) {
    if (s.side_px < 1 || s.side_px > kMostSide_px)
        refuse("side_px is " + std::to_string(s.side_px) + ", must be 1..8192");
    if (!(s.reach_m > 0 && s.reach_m <= fine.reach_m()))
        refuse("reach_m is " + std::to_string(s.reach_m) +
               ", must be > 0 and at most that of the fine surface, " +
               std::to_string(fine.reach_m()));
    if (s.gutter_px < 0 || s.gutter_px > kMostGutter_px)
        refuse("gutter_px is " + std::to_string(s.gutter_px) + ", must be 0..16");
    if (!(s.grain_m >= 0) || !std::isfinite(s.grain_m))
        refuse("grain_m is " + std::to_string(s.grain_m) + ", must be finite and >= 0");
    if (!(s.grain_contrast >= 0 && s.grain_contrast <= 1))
        refuse("grain_contrast is " + std::to_string(s.grain_contrast) + ", must be 0..1");
    if (coarse.mesh.normals.size() != coarse.mesh.positions.size() ||
        coarse.tangents.size() != coarse.mesh.positions.size())
        refuse("the mesh needs a normal and a tangent for each position");
}

/// As they are where there is no face.
BakedMaps flat_maps(const BakeSettings& s) {
    const int all = s.side_px, masters = s.masters ? all : 0, colour = s.grain_m > 0 ? all : 0;
    BakedMaps out{.normal = {all, all, 3},
                  .object_normal = {masters, masters, 3},
                  .displacement = {masters, masters, 1},
                  .occlusion = {all, all, 1},
                  .curvature = {masters, masters, 1},
                  .colour = {colour, colour, 1},
                  .part = {masters, masters, 1}};
    for (Image* normals : {&out.normal, &out.object_normal})
        for (std::size_t i = 2; i < normals->pixels.size(); i += 3)
            normals->pixels[i] = 1;
    for (Image* shares : {&out.occlusion, &out.colour})
        std::fill(shares->pixels.begin(), shares->pixels.end(), 1.0f);
    return out;
}

/// What the fine surface has for the texel.
BakeSource::Place bake_texel(const TexturedMesh& coarse, std::uint32_t face, int x, int y,
                             const BakeSource& fine, const BakeSettings& s, BakedMaps& out) {
    const Frame frame =
        frame_at(coarse, face, held(texture_weights(coarse, face, x + 0.5, y + 0.5, s.side_px)));
    const BakeSource::Place place = fine.meet(frame.point, frame.normal, s.reach_m);
    set(out.normal, x, y, frame.local(place.normal));
    *out.occlusion.at(x, y) = static_cast<float>(fine.openness_at(place.point));
    if (s.grain_m > 0)
        *out.colour.at(x, y) =
            static_cast<float>(1 - s.grain_contrast * grain(place.point, s.grain_m));
    if (s.masters) {
        set(out.object_normal, x, y, place.normal);
        *out.displacement.at(x, y) = static_cast<float>(place.offset_m);
        *out.curvature.at(x, y) = static_cast<float>(fine.curvature_at(place.point));
        *out.part.at(x, y) = static_cast<float>(place.primitive);
    }
    return place;
}

} // namespace

BakedMaps bake(const TexturedMesh& coarse, const BakeSource& fine, const BakeSettings& settings,
               Progress* progress) {
    check(coarse, fine, settings);
    const int side = settings.side_px;
    const std::vector<std::uint32_t> on_face = texel_faces(coarse, side);
    std::vector<std::uint32_t> owners = on_face;
    grow(owners, side, settings.gutter_px);
    BakedMaps out = flat_maps(settings);
    struct Row {
        std::size_t n = 0, n_nearest = 0;
        double squares = 0, most = 0;
    };
    std::vector<Row> rows(static_cast<std::size_t>(side));
    std::atomic<int> n_done = 0;
    tbb::parallel_for(0, side, [&](int y) {
        check_cancelled(progress);
        Row& row = rows[static_cast<std::size_t>(y)];
        for (int x = 0; x < side; ++x) {
            const std::size_t texel = static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                                      static_cast<std::size_t>(x);
            if (owners[texel] == kNoFace)
                continue;
            const auto place = bake_texel(coarse, owners[texel], x, y, fine, settings, out);
            if (on_face[texel] == kNoFace)
                continue; // a gutter's
            ++row.n;
            row.n_nearest += !place.is_traced;
            row.squares += place.offset_m * place.offset_m;
            row.most = std::max(row.most, std::fabs(place.offset_m));
        }
        if (const int done = ++n_done; done % (side / 100 + 1) == 0)
            report_fraction(progress, double(done) / side);
    });
    double squares = 0;
    for (const Row& row : rows) {
        out.n_texels += row.n;
        out.n_nearest += row.n_nearest;
        squares += row.squares;
        out.most_displacement_m = std::max(out.most_displacement_m, row.most);
    }
    out.rms_displacement_m = out.n_texels > 0 ? std::sqrt(squares / double(out.n_texels)) : 0;
    return out;
}

std::string normal_png(const BakedMaps& maps) {
    return format_png(halved(maps.normal), PngValues::data, "normal map");
}

std::string occlusion_png(const BakedMaps& maps) {
    return format_png(maps.occlusion, PngValues::data, "occlusion map");
}

std::string colour_png(const BakedMaps& maps) {
    return format_png(maps.colour, PngValues::light, "colour map");
}

RelitError relit_error(const TexturedMesh& coarse, const BakeSource& fine, const BakedMaps& maps,
                       double reach_m, Progress* progress) {
    const int side = maps.normal.width;
    const std::vector<std::uint32_t> faces = texel_faces(coarse, side);
    const int step = 1 + static_cast<int>(std::sqrt(double(maps.n_texels) / double(kMostSamples)));
    struct Row {
        double sum = 0, plain = 0;
        std::size_t n = 0;
    };
    std::vector<Row> rows(static_cast<std::size_t>(side));
    tbb::parallel_for(1, side, [&](int y) {
        if (y % step != 0)
            return;
        check_cancelled(progress);
        Row& row = rows[static_cast<std::size_t>(y)];
        for (int x = 1; x < side; ++x) {
            const std::uint32_t face =
                faces[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                      static_cast<std::size_t>(x)];
            if (x % step != 0 || face == kNoFace)
                continue;
            const Weights w = texture_weights(coarse, face, x, y, side); // the texel's corner
            if (*std::min_element(w.begin(), w.end()) < 0)
                continue;
            const Frame frame = frame_at(coarse, face, w);
            const Vec3 truth = fine.meet(frame.point, frame.normal, reach_m).normal;
            row.sum += angle_deg(frame.world(read_normal(maps.normal, x, y)), truth);
            row.plain += angle_deg(frame.normal, truth);
            ++row.n;
        }
    });
    RelitError out;
    for (const Row& row : rows) {
        out.mean_deg += row.sum;
        out.plain_mean_deg += row.plain;
        out.n_samples += row.n;
    }
    if (out.n_samples > 0) {
        out.mean_deg /= double(out.n_samples);
        out.plain_mean_deg /= double(out.n_samples);
    }
    return out;
}

void write_maps(const std::filesystem::path& folder, const std::string& stem,
                const BakedMaps& maps) {
    if (maps.part.pixels.empty())
        refuse("the maps were baked without masters; bake them again with");
    const auto write = [&](const char* name, const Image& image, ExrSamples samples,
                           std::vector<std::pair<std::string, std::string>> attributes) {
        std::vector<std::string> channels = {"Y"};
        if (image.channels > 1)
            channels.assign({"R", "G", "B"});
        if (image.channels > 3)
            channels.emplace_back("part");
        write_exr(folder / (stem + '_' + name + ".exr"), {image, channels, std::move(attributes)},
                  samples);
    };
    Image parts(maps.part.width, maps.part.height, 4);
    for (std::size_t i = 0; i < maps.part.pixels.size(); ++i) {
        const auto part = static_cast<std::uint64_t>(maps.part.pixels[i]);
        for (std::uint32_t c = 0; c < 3; ++c)
            parts.pixels[4 * i + c] = static_cast<float>(Rng{0, kPartStream}.uniform(part, c));
        parts.pixels[4 * i + 3] = maps.part.pixels[i];
    }
    write("normal", maps.normal, ExrSamples::half,
          {{"quantity", "normal"}, {"frame", "tangent, bitangent, normal"}, {"unit", "1"}});
    write("object_normal", maps.object_normal, ExrSamples::half,
          {{"quantity", "normal"}, {"frame", "x, y, z of the mesh, +Y up"}, {"unit", "1"}});
    write("occlusion", maps.occlusion, ExrSamples::half,
          {{"quantity", "share of the sky that is seen"}, {"unit", "1"}});
    if (!maps.colour.pixels.empty())
        write("colour", maps.colour, ExrSamples::half,
              {{"quantity", "share of the base colour"}, {"unit", "1"}});
    write("displacement", maps.displacement, ExrSamples::full,
          {{"quantity", "displacement along the normal"}, {"unit", "m"}, {"scale", "1"}});
    write("curvature", maps.curvature, ExrSamples::full,
          {{"quantity", "mean curvature, positive where convex"}, {"unit", "1/m"}});
    write("part", parts, ExrSamples::full,
          {{"quantity", "number of the surface that the texel is of, and a colour for it"}});
}

} // namespace taihu
