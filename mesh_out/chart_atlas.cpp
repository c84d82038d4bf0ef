#include "mesh_out/chart_atlas.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "mesh_out/charts_detail.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr double kFinerThanTexel = 16; ///< texture points on a grid of at least so many a texel
constexpr int kTurns = 12;             ///< within a quarter, of a chart that is packed
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
    void make_charts(bool grown);
    /// \param n_turns  of a chart within a quarter that are tried.
    void pack(int n_turns);
    void cut();
    void judge();
    TexturePoint texture_point(const Chart& chart, const Vec3& p) const;

    const TriMesh& mesh_;
    const AtlasSettings& settings_;
    Progress* progress_;
    std::vector<Vec3> normals_;
    std::vector<double> areas_m2_;
    std::vector<std::array<std::uint32_t, 3>> neighbours_;
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

void Builder::make_charts(bool grown) {
    GrownCharts made;
    if (grown) {
        made = grow_charts(normals_, areas_m2_, neighbours_, mesh_, settings_, progress_);
    } else {
        const auto directions =
            chart_directions(normals_, areas_m2_, neighbours_, mesh_, settings_);
        check_cancelled(progress_);
        made.of_face = split_charts(mesh_, directions, neighbours_, progress_);
        made.directions.resize(1 + *std::max_element(made.of_face.begin(), made.of_face.end()));
        for (std::size_t f = 0; f < directions.size(); ++f)
            made.directions[made.of_face[f]] = direction_vector(directions[f]);
    }
    atlas_.chart_of = std::move(made.of_face);
    for (const Vec3& direction : made.directions)
        atlas_.charts.emplace_back().direction = direction;
    for (const std::uint32_t c : atlas_.chart_of)
        ++atlas_.charts[c].n_triangles;
}

void Builder::pack(int n_turns) {
    struct Range {
        double lo = std::numeric_limits<double>::infinity(), hi = -lo;
        void include(double x) {
            lo = std::min(lo, x);
            hi = std::max(hi, x);
        }
    };
    std::vector<std::vector<std::uint32_t>> corners(atlas_.charts.size());
    for (std::size_t f = 0; f < mesh_.triangles.size(); ++f)
        for (const std::uint32_t i : mesh_.triangles[f])
            corners[atlas_.chart_of[f]].push_back(i);
    std::vector<ChartSize> sizes;
    for (std::size_t c = 0; c < corners.size(); ++c) {
        Chart& chart = atlas_.charts[c];
        const Projection seen = projection(chart.direction);
        double least_m2 = std::numeric_limits<double>::infinity();
        for (int turn = 0; turn < n_turns; ++turn) {
            const double angle = turn * std::numbers::pi / 2 / n_turns;
            const Vec3 u_axis = seen.u_axis * std::cos(angle) + seen.v_axis * std::sin(angle),
                       v_axis = seen.v_axis * std::cos(angle) - seen.u_axis * std::sin(angle);
            Range u, v;
            for (const std::uint32_t i : corners[c]) {
                u.include(dot(mesh_.positions[i], u_axis));
                v.include(dot(mesh_.positions[i], v_axis));
            }
            const double width = u.hi - u.lo, height = v.hi - v.lo;
            if (width * height >= least_m2)
                continue;
            least_m2 = width * height;
            chart.u_axis = u_axis;
            chart.v_axis = v_axis;
            chart.u_m = u.lo;
            chart.v_m = v.lo;
            if (height > width) { // lying charts waste less of their shelves
                chart.u_axis = v_axis;
                chart.v_axis = -u_axis;
                chart.u_m = v.lo;
                chart.v_m = -u.hi;
            }
            if (sizes.size() == c)
                sizes.emplace_back();
            sizes[c] = {std::max(width, height), std::min(width, height)};
        }
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
            out.tangents.push_back(tangent(mesh_.normals[source], chart.v_axis, chart.direction));
        }
    }
}

void Builder::judge() {
    double area = 0, stretched = 0, image = 0;
    for (std::size_t f = 0; f < normals_.size(); ++f) {
        const double facing = dot(normals_[f], atlas_.charts[atlas_.chart_of[f]].direction);
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
    neighbours_ = face_neighbours(mesh_.triangles);
    std::optional<ChartAtlas> best;
    std::optional<Error> why;
    for (const bool grown : {false, true}) {
        atlas_ = {};
        make_charts(grown);
        check_cancelled(progress_);
        try {
            pack(grown ? kTurns : 1);
        } catch (const Error& e) { // no room for so many charts; the other way may make fewer
            why = e;
            continue;
        }
        if (!best || atlas_.texel_m < best->texel_m)
            best = atlas_;
    }
    if (!best)
        throw *why;
    atlas_ = std::move(*best);
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
