#include "mesh_out/chart_atlas.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "mesh_out/charts_detail.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr double kFinerThanTexel = 16; ///< texture points on a grid of at least so many a texel
constexpr double kLeastFacing = 0.1;   ///< of a normal, below which tangents lean no further

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "chart atlas: " + what);
}

void check(const TriMesh& mesh, const AtlasSettings& s) {
    check_writable(mesh, "chart atlas");
    if (mesh.normals.empty())
        refuse("the mesh has no normals; give one for each position");
    if (s.side_px < 64 || s.side_px > 8192)
        refuse("side_px is " + std::to_string(s.side_px) + ", must be 64..8192");
    if (s.gutter_px < 1 || s.gutter_px > 16)
        refuse("gutter_px is " + std::to_string(s.gutter_px) + ", must be 1..16");
    if (!(s.tiny_area_rel >= 0 && s.tiny_area_rel <= 0.1))
        refuse("tiny_area_rel is " + std::to_string(s.tiny_area_rel) + ", must be 0..0.1");
    if (!(s.merge_stretch >= std::numbers::sqrt3 && s.merge_stretch <= 10))
        refuse("merge_stretch is " + std::to_string(s.merge_stretch) + ", must be sqrt(3)..10");
}

/// Along growing u where the surface of normal `n` cuts the plane of u and the direction, which is
/// at right angles to v. A normal that hardly faces the direction, as on a rim, is taken to face it
/// a little: else the tangent would turn over.
Vec3 tangent(const Vec3& n, const Vec3& v_axis, const Vec3& direction) {
    const Vec3 facing = n + direction * std::max(0.0, kLeastFacing - dot(n, direction));
    const Vec3 along = cross(v_axis, facing);
    const Vec3 t = normalized(along - n * dot(n, along));
    return t == Vec3{} ? cross(v_axis, direction) : t;
}

/// Builds the atlas of one mesh.
class Builder {
public:
    Builder(const TriMesh& mesh, const AtlasSettings& settings, Progress* progress)
        : mesh_(mesh), settings_(settings), progress_(progress) {}
    ChartAtlas build();

private:
    void measure_faces();
    void make_charts();
    void pack();
    void cut();
    void judge();
    TexturePoint texture_point(const Chart& chart, const Vec3& p) const;

    const TriMesh& mesh_;
    const AtlasSettings& settings_;
    Progress* progress_;
    std::vector<Vec3> normals_;
    std::vector<double> areas_m2_;
    ChartAtlas atlas_;
};

void Builder::measure_faces() {
    for (std::size_t f = 0; f < mesh_.triangles.size(); ++f) {
        const auto& [a, b, c] = mesh_.triangles[f];
        const Vec3 n =
            cross(mesh_.positions[b] - mesh_.positions[a], mesh_.positions[c] - mesh_.positions[a]);
        if (!(length(n) > 0))
            refuse("triangles[" + std::to_string(f) + "] has no area; mend the mesh first");
        normals_.push_back(normalized(n));
        areas_m2_.push_back(length(n) / 2);
    }
}

void Builder::make_charts() {
    const auto neighbours = face_neighbours(mesh_.triangles);
    const auto directions = chart_directions(normals_, areas_m2_, neighbours, mesh_, settings_);
    check_cancelled(progress_);
    atlas_.chart_of = split_charts(mesh_, directions, neighbours, progress_);
    const std::uint32_t n = 1 + *std::max_element(atlas_.chart_of.begin(), atlas_.chart_of.end());
    atlas_.charts.resize(n);
    for (std::size_t f = 0; f < directions.size(); ++f) {
        Chart& chart = atlas_.charts[atlas_.chart_of[f]];
        chart.direction = directions[f];
        ++chart.n_triangles;
    }
}

void Builder::pack() {
    struct Range {
        double lo = std::numeric_limits<double>::infinity(), hi = -lo;
        void include(double x) {
            lo = std::min(lo, x);
            hi = std::max(hi, x);
        }
    };
    std::vector<std::array<Range, 2>> ranges(atlas_.charts.size());
    for (std::size_t f = 0; f < mesh_.triangles.size(); ++f) {
        const auto [u, v] = projection(atlas_.charts[atlas_.chart_of[f]].direction);
        auto& range = ranges[atlas_.chart_of[f]];
        for (const std::uint32_t i : mesh_.triangles[f]) {
            range[0].include(dot(mesh_.positions[i], u));
            range[1].include(dot(mesh_.positions[i], v));
        }
    }
    std::vector<ChartSize> sizes;
    for (std::size_t c = 0; c < ranges.size(); ++c) {
        Chart& chart = atlas_.charts[c];
        auto [u, v] = ranges[c];
        const Projection seen = projection(chart.direction);
        chart.u_axis = seen.u_axis;
        chart.v_axis = seen.v_axis;
        if (v.hi - v.lo > u.hi - u.lo) { // lying charts waste less of their shelves
            chart.u_axis = seen.v_axis;
            chart.v_axis = -seen.u_axis;
            const Range old_u = u;
            u = v;
            v = {-old_u.hi, -old_u.lo};
        }
        chart.u_m = u.lo;
        chart.v_m = v.lo;
        sizes.push_back({u.hi - u.lo, v.hi - v.lo});
    }
    const auto shelves = pack_shelves(sizes, settings_.side_px, settings_.gutter_px);
    if (!shelves)
        throw Error(Fault::numeric, "chart atlas: " + std::to_string(sizes.size()) +
                                        " charts do not fit a texture of " +
                                        std::to_string(settings_.side_px) + " x " +
                                        std::to_string(settings_.side_px) +
                                        " texels; use a larger one, or a mesh of fewer triangles");
    atlas_.side_px = settings_.side_px;
    atlas_.texel_m = shelves->texel_m;
    for (std::size_t c = 0; c < sizes.size(); ++c) {
        const auto& [x, y, width, height] = shelves->places[c];
        Chart& chart = atlas_.charts[c];
        chart.x_px = x;
        chart.y_px = y;
        chart.width_px = width;
        chart.height_px = height;
    }
}

TexturePoint Builder::texture_point(const Chart& chart, const Vec3& p) const {
    const double grid =
        kFinerThanTexel * std::exp2(std::ceil(std::log2(double(settings_.side_px))));
    const double x = chart.x_px + (dot(p, chart.u_axis) - chart.u_m) / atlas_.texel_m;
    const double y =
        chart.y_px + chart.height_px - (dot(p, chart.v_axis) - chart.v_m) / atlas_.texel_m;
    const auto on_grid = [&](double px) {
        return std::round(px / settings_.side_px * grid) / grid;
    };
    return {on_grid(x), 1 - on_grid(y)};
}

void Builder::cut() {
    TexturedMesh& out = atlas_.textured;
    // Vertices in the order of their first corner; a vertex is one for each of its charts.
    std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> made(mesh_.positions.size());
    for (std::size_t f = 0; f < mesh_.triangles.size(); ++f) {
        const std::uint32_t c = atlas_.chart_of[f];
        const Chart& chart = atlas_.charts[c];
        Triangle& corners = out.mesh.triangles.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t source = mesh_.triangles[f][k];
            auto& list = made[source];
            const auto known = std::find_if(list.begin(), list.end(),
                                            [&](const auto& entry) { return entry.first == c; });
            if (known != list.end()) {
                corners[k] = known->second;
                continue;
            }
            corners[k] = static_cast<std::uint32_t>(out.mesh.positions.size());
            list.emplace_back(c, corners[k]);
            out.mesh.positions.push_back(mesh_.positions[source]);
            out.mesh.normals.push_back(mesh_.normals[source]);
            if (!mesh_.openness.empty())
                out.mesh.openness.push_back(mesh_.openness[source]);
            out.texture.push_back(texture_point(chart, mesh_.positions[source]));
            out.tangents.push_back(
                tangent(mesh_.normals[source], chart.v_axis, direction_vector(chart.direction)));
        }
    }
}

void Builder::judge() {
    double area = 0, stretched = 0, image = 0;
    for (std::size_t f = 0; f < normals_.size(); ++f) {
        const Vec3 d = direction_vector(atlas_.charts[atlas_.chart_of[f]].direction);
        const double facing = dot(normals_[f], d);
        atlas_.most_stretch = std::max(atlas_.most_stretch, 1 / facing);
        area += areas_m2_[f];
        image += areas_m2_[f] * facing;
        if (1 / facing > std::numbers::sqrt3 * (1 + 1e-9))
            stretched += areas_m2_[f];
    }
    atlas_.stretched_area_rel = stretched / area;
    const double side_m = settings_.side_px * atlas_.texel_m;
    atlas_.used_rel = image / (side_m * side_m);
}

ChartAtlas Builder::build() {
    measure_faces();
    make_charts();
    check_cancelled(progress_);
    pack();
    cut();
    judge();
    return std::move(atlas_);
}

} // namespace

ChartAtlas chart_atlas(const TriMesh& mesh, const AtlasSettings& settings, Progress* progress) {
    check(mesh, settings);
    report_stage(progress, "charts");
    return Builder(mesh, settings, progress).build();
}

} // namespace taihu
