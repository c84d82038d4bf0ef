#include "mesh_out/lod.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "mesh_out/crossings_detail.h"
#include "mesh_out/extract.h"
#include "mesh_out/field_distance.h"
#include "mesh_out/openness.h"
#include "mesh_out/part_sheets_detail.h"
#include "stats/core/error.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr double kRoundingShare = 0.1; ///< of a bound, for moving vertices onto the grid
constexpr double kTightest = 0.9;      ///< by how much one more attempt may lower the inner bound
constexpr double kFewBeyond = 2e-5;    ///< share of samples over a bound that are named, not mended
constexpr std::size_t kFewCrossings = 40; ///< that are better parted than rounded less
constexpr double kMostBeyond = 0.01;      ///< share of samples over a bound that is held at all
constexpr double kLeastMove = 1.0 / 16;   ///< of what rounding may take, where faces would cross
constexpr int kAttempts = 2, kMostLevels = 8, kMostBits = 18;
constexpr int kReportVersion = 1;

std::string shown(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

void require(const LodSettings& settings) {
    const auto refuse = [](const std::string& what) {
        throw Error(Fault::bad_argument, "lod: " + what);
    };
    const std::vector<LodGoal>& levels = settings.levels;
    if (levels.empty() || levels.size() > kMostLevels)
        refuse(std::to_string(levels.size()) + " levels, must be 1..8");
    for (std::size_t j = 0; j < levels.size(); ++j) {
        const std::string which = "level " + std::to_string(j);
        const auto [bound_m, n] = levels[j];
        if ((bound_m != 0) == (n != 0))
            refuse(which + ": give a bound or a number of triangles");
        if (n == 0 && (!(bound_m > 0) || !std::isfinite(bound_m)))
            refuse(which + ": bound_m is " + shown(bound_m) + ", must be finite and > 0");
        if (n != 0 && n < 4)
            refuse(which + ": " + std::to_string(n) + " triangles, a solid has at least 4");
        if (j > 0 && n == 0 && levels[j - 1].n_triangles == 0 && bound_m <= levels[j - 1].bound_m)
            refuse(which + ": bound_m is " + shown(bound_m) +
                   ", must be greater than that of the level before");
        if (j > 0 && n != 0 && levels[j - 1].n_triangles != 0 && n >= levels[j - 1].n_triangles)
            refuse(which + ": " + std::to_string(n) +
                   " triangles, must be fewer than the level before");
    }
}

double power_of_two_below(double x) {
    return std::exp2(std::floor(std::log2(x)));
}

/// Makes the levels of one solid.
class Chain {
public:
    Chain(const openvdb::FloatGrid& solid, const Field* field, const LodSettings& settings,
          Progress* progress);
    LodChain make();

private:
    double finest_bound_m() const;
    /// What rounding may take of a bound; a step as long as the mesh itself would help nobody.
    double max_move_m(double bound_m) const {
        return std::min(kRoundingShare * bound_m, box_.longest() / 16);
    }
    /// From the last level, with probes for a level of this bound.
    BoundedSimplifier simplifier(double bound_m);
    /// A level, and where it is not what it should be.
    struct Written {
        LodLevel level;
        std::vector<Vec3> beyond, crossings;
        std::size_t n_samples = 0;
    };
    TriMesh snapped(const BoundedMesh& mesh, double bound_m, double most_m,
                    PositionGrid& grid) const;
    Written written(const BoundedMesh& mesh, double bound_m, double move_m) const;
    std::vector<Sphere> around(const std::vector<Vec3>& points, double radius_m) const;
    bool within(double bound_m, LodLevel& level);
    bool of_triangles(std::size_t n, LodLevel& level, std::string& why);

    const LodSettings& settings_;
    Progress* progress_;
    const double voxel_m_;
    std::unique_ptr<const Field> own_; ///< where none was given
    const Field* field_;
    TriMesh reference_;
    Box box_;
    double origin_step_m_ = 0;
    LabelledMesh last_;                        ///< as the last level left it, on the surface
    std::unique_ptr<const FieldProbe> probe_;  ///< as far as this level needs distances
    std::unique_ptr<const FieldProbe> around_; ///< as far as its faces are long
};

/// The finest bound that is asked for; a fraction of a voxel where only triangles are.
double Chain::finest_bound_m() const {
    const double bound_m = settings_.levels.front().bound_m;
    return bound_m > 0 ? bound_m : 0.25 * voxel_m_;
}

Chain::Chain(const openvdb::FloatGrid& solid, const Field* field, const LodSettings& settings,
             Progress* progress)
    : settings_(settings), progress_(progress), voxel_m_(lattice_of(solid).voxel_m), field_(field) {
    report_stage(progress, "extracting the surface");
    const double bound_vox = std::clamp(2 * finest_bound_m() / voxel_m_, 0.05, 1.0);
    last_ = extract(solid, field, {.bound_vox = bound_vox}, progress);
    reference_ = {last_.positions, last_.triangles, {}};
    box_ = bounds(reference_);
    origin_step_m_ = power_of_two_below(box_.longest() / 8);
    const double finest_m = finest_grid(box_).step_m * std::sqrt(3.0) / 2;
    if (settings.levels.front().bound_m > 0 && max_move_m(finest_bound_m()) < finest_m)
        throw Error(Fault::numeric, "lod: a largest error of " + shown(finest_bound_m()) +
                                        " m is finer than positions of 18 bits; allow at least " +
                                        shown(finest_m / kRoundingShare * 1.001) + " m");
    if (!field) {
        own_ = std::make_unique<PlacedLevelSetField>(solid.copy()); // its band may be widened
        field_ = own_.get();
    }
}

BoundedSimplifier Chain::simplifier(double bound_m) {
    const auto probe = [&](double reach_m) {
        return field_->probe(box_.dilated(reach_m), reach_m);
    };
    around_ = probe(8 * voxel_m_ + 5.5 * bound_m);
    probe_ = probe(2 * (voxel_m_ + bound_m));
    return {last_, *around_,
            BoundedSettings{.spacing_m = voxel_m_, .few_crossings = kFewCrossings}};
}

/// On the coarsest position grid of the chain on which no faces cross.
TriMesh Chain::snapped(const BoundedMesh& mesh, double bound_m, double most_m,
                       PositionGrid& grid) const {
    const TriMesh plain{mesh.mesh.positions, mesh.mesh.triangles,
                        surface_normals(mesh.mesh, *probe_)};
    const Box box = box_.dilated(std::min(bound_m, box_.longest())); // balanced vertices lie off
    const double least_m =
        std::max(kLeastMove * most_m, 1.001 * finest_grid(box).step_m * std::sqrt(3.0) / 2);
    for (double move_m = most_m;; move_m /= 4) {
        check_cancelled(progress_);
        grid = position_grid(box, std::max(move_m, std::min(least_m, most_m)), origin_step_m_);
        const bool finest = move_m <= least_m || grid.bits == kMostBits;
        try {
            TriMesh out = snap_to_grid(plain, grid).mesh;
            std::size_t n = count_crossings(out.positions, out.triangles);
            if (n > 0 && (finest || n <= kFewCrossings)) {
                part_sheets(out, grid, 2 * max_move_m(bound_m));
                n = count_crossings(out.positions, out.triangles);
            }
            if (finest || n == 0)
                return out;
        } catch (const Error& e) { // vertices that find no place of their own
            if (finest || e.fault() != Fault::numeric)
                throw;
        }
    }
}

/// `mesh` as a file holds it: snapped, coded, decoded; certified and measured as decoded.
Chain::Written Chain::written(const BoundedMesh& mesh, double bound_m, double move_m) const {
    Written out;
    LodLevel& level = out.level;
    level.bound_m = bound_m;
    level.unresolved = mesh.unresolved;
    TriMesh mesh_on_grid = snapped(mesh, bound_m, move_m, level.grid);
    if (settings_.openness)
        mesh_on_grid.openness = openness(mesh_on_grid, {}, progress_);
    check_cancelled(progress_);
    level.encoded = encode_draco(mesh_on_grid, level.grid);
    const TriMesh& decoded = level.encoded.decoded;
    level.certificate = certify(decoded);
    if (!level.certificate.holds()) {
        std::string what;
        for (const std::string& fault : faults(level.certificate))
            what += (what.empty() ? "" : ", ") + fault;
        throw Error(Fault::numeric, "lod: the level of bound " + shown(bound_m) +
                                        " m came out with " + what + "; use a smaller bound");
    }
    if (level.certificate.n_self_intersections > 0)
        for (const auto& [f, g] : crossing_pairs(decoded.positions, decoded.triangles))
            for (const std::uint32_t v : decoded.triangles[f])
                out.crossings.push_back(decoded.positions[v]);
    check_cancelled(progress_);
    std::vector<Sphere> apart;
    for (const UnresolvedPlace& place : mesh.unresolved)
        apart.push_back({place.center, place.radius_m + bound_m});
    // Every face has a few samples; it was certified before it was rounded.
    FieldDistance distance = field_distance(
        decoded, *probe_, reference_, std::max(voxel_m_, 0.5 * bound_m), bound_m, apart, progress_);
    level.error_m = distance.max_m;
    level.rms_m = distance.rms_m;
    level.unresolved_error_m = distance.max_apart_m;
    out.beyond = std::move(distance.beyond);
    out.n_samples = distance.n_samples;
    return out;
}

/// Balls round points, one for all that lie in a cube as wide as their radius.
std::vector<Sphere> Chain::around(const std::vector<Vec3>& points, double radius_m) const {
    std::vector<std::array<std::int64_t, 3>> cubes;
    for (const Vec3& p : points) {
        const Vec3 at = (p - box_.lo) / radius_m;
        cubes.push_back({std::llround(at.x), std::llround(at.y), std::llround(at.z)});
    }
    std::sort(cubes.begin(), cubes.end());
    cubes.erase(std::unique(cubes.begin(), cubes.end()), cubes.end());
    std::vector<Sphere> balls;
    for (const auto& [x, y, z] : cubes)
        balls.push_back({box_.lo + Vec3{double(x), double(y), double(z)} * radius_m, radius_m});
    return balls;
}

/// A level within a bound, from the one before: where it does not hold as decoded, or faces cross,
/// what was there before stays. What no attempt mends is named. Returns false, and what was nearest
/// to it in `level`, when that is nearly everywhere.
bool Chain::within(double bound_m, LodLevel& level) {
    const BoundedSimplifier start = simplifier(bound_m);
    double inner_m = bound_m - max_move_m(bound_m);
    std::vector<Sphere> kept;
    for (int attempt = 0;; ++attempt) {
        BoundedSimplifier next = start;
        Written out = written(next.within(inner_m, kept, progress_), bound_m, max_move_m(bound_m));
        level = std::move(out.level);
        const double share = double(out.beyond.size()) / double(out.n_samples);
        const bool last = attempt + 1 == kAttempts || share <= kFewBeyond;
        if (last && share <= kMostBeyond) {
            for (const Sphere& ball : around(out.beyond, 2 * voxel_m_))
                level.unresolved.push_back({ball.center, ball.radius_m, level.error_m});
            level.unresolved_error_m = std::max(level.unresolved_error_m, level.error_m);
            level.error_m = std::min(level.error_m, bound_m);
        }
        if (level.error_m <= bound_m && (attempt + 1 == kAttempts || out.crossings.empty())) {
            last_ = next.surface();
            return true;
        }
        if (attempt + 1 == kAttempts)
            return false;
        if (share > kMostBeyond)
            inner_m *= std::max(kTightest, 0.97 * bound_m / level.error_m);
        out.beyond.insert(out.beyond.end(), out.crossings.begin(), out.crossings.end());
        const auto more = around(out.beyond, (2 << attempt) * voxel_m_);
        kept.insert(kept.end(), more.begin(), more.end());
    }
}

/// A level of so many triangles, whatever its bound then is. Returns false, and why, when there is
/// none.
bool Chain::of_triangles(std::size_t n, LodLevel& level, std::string& why) {
    BoundedSimplifier start = simplifier(box_.longest() / 16);
    BoundedMesh mesh;
    try {
        mesh = start.to_triangles(n, progress_);
    } catch (const Error& e) {
        if (e.fault() != Fault::numeric)
            throw;
        why = e.what();
        return false;
    }
    last_ = start.surface();
    const double bound_m = mesh.bound_m / (1 - kRoundingShare);
    // Rounding may take some triangles more: not many.
    level = written(mesh, bound_m, max_move_m(bound_m) / 4).level;
    level.bound_m = std::max(bound_m, level.error_m);
    return true;
}

LodChain Chain::make() {
    LodChain chain;
    chain.n_reference_triangles = reference_.triangles.size();
    const std::size_t n = settings_.levels.size();
    for (std::size_t j = 0; j < n; ++j) {
        report_stage(progress_, "level " + std::to_string(j + 1) + " of " + std::to_string(n));
        check_cancelled(progress_);
        const LodGoal& goal = settings_.levels[j];
        LodLevel level;
        bool made = true;
        std::string why;
        if (goal.n_triangles > 0)
            made = of_triangles(goal.n_triangles, level, why);
        else
            made = within(goal.bound_m, level);
        if (!why.empty() && j > 0) {
            chain.note = std::to_string(j) + " of " + std::to_string(n) + " levels: " + why;
            break;
        }
        if (!why.empty())
            throw Error(Fault::numeric, "lod: " + why);
        if (!made && j == 0)
            throw Error(Fault::numeric, "lod: the bound " + shown(level.bound_m) +
                                            " m cannot be met, the best mesh is " +
                                            shown(level.error_m) + " m off; ask for " +
                                            shown(1.05 * level.error_m) +
                                            " m or more, or use smaller voxels");
        if (!made || (j > 0 && level.certificate.n_triangles >=
                                   chain.levels.back().certificate.n_triangles)) {
            chain.note = std::to_string(j) + " of " + std::to_string(n) + " levels: within " +
                         shown(level.bound_m) + " m no mesh with fewer triangles than level " +
                         std::to_string(j - 1) + " was found";
            break;
        }
        if (j > 0)
            level.holes_closed = chain.levels.front().certificate.genus - level.certificate.genus;
        chain.levels.push_back(std::move(level));
    }
    return chain;
}

} // namespace

std::vector<LodGoal> bounds_by_factor(int n_levels, double bound_m, double factor) {
    std::vector<LodGoal> goals;
    for (int j = 0; j < n_levels; ++j)
        goals.push_back({bound_m * std::pow(factor, j), 0});
    return goals;
}

std::vector<double> screen_coverages(const LodChain& chain) {
    std::vector<double> coverages;
    constexpr double kPixels = 1920.0 * 1080.0, kCull = 1e-4;
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        double coverage = kCull;
        if (j + 1 < chain.levels.size()) {
            const Vec3 size = chain.levels[j].certificate.box.size();
            const double face_m2 = std::max({size.x * size.y, size.y * size.z, size.z * size.x});
            const double pixel_m = chain.levels[j + 1].error_m;
            coverage = std::min(1.0, face_m2 / (pixel_m * pixel_m * kPixels));
        }
        coverages.push_back(j == 0 ? coverage : std::min(coverage, coverages.back() / 2));
    }
    return coverages;
}

LodChain make_lods(const openvdb::FloatGrid& solid, const Field* field, const LodSettings& settings,
                   Progress* progress) {
    require(settings);
    return Chain(solid, field, settings, progress).make();
}

std::string format_glb(const LodChain& chain, const GlbSettings& settings) {
    const std::vector<double> coverages = screen_coverages(chain);
    std::vector<EncodedLevel> levels;
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        levels.push_back(chain.levels[j].encoded);
        levels.back().screen_coverage = coverages[j];
    }
    return format_glb(levels, settings);
}

namespace {

/// The largest of them: thousands help nobody.
nlohmann::ordered_json places_json(std::vector<UnresolvedPlace> places) {
    constexpr std::size_t kMost = 100;
    std::stable_sort(places.begin(), places.end(),
                     [](const auto& a, const auto& b) { return a.radius_m > b.radius_m; });
    auto json = nlohmann::ordered_json{{"n", places.size()}, {"largest", nlohmann::json::array()}};
    for (std::size_t i = 0; i < std::min(kMost, places.size()); ++i) {
        const Vec3& c = places[i].center;
        json["largest"].push_back(
            {{"center_m", {c.x, c.y, c.z}}, {"radius_m", places[i].radius_m}});
    }
    return json;
}

} // namespace

std::string format_report(const LodChain& chain, const std::string& file) {
    const std::vector<double> coverages = screen_coverages(chain);
    nlohmann::ordered_json report;
    report["taihu_report"] = kReportVersion;
    report["file"] = file;
    report["reference"] =
        "surface of the field, or of the level set where there is none; distances by closest "
        "point, both ways, on the decoded meshes, outside of the places listed";
    report["n_reference_triangles"] = chain.n_reference_triangles;
    report["note"] = chain.note;
    report["levels"] = nlohmann::ordered_json::array();
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        const LodLevel& level = chain.levels[j];
        const Certificate& c = level.certificate;
        report["levels"].push_back({{"triangles", c.n_triangles},
                                    {"bytes", level.encoded.draco.size()},
                                    {"error_m", level.error_m},
                                    {"bound_m", level.bound_m},
                                    {"rms_m", level.rms_m},
                                    {"genus", c.genus},
                                    {"holes_closed", level.holes_closed},
                                    {"screen_coverage", coverages[j]},
                                    {"vertices", c.n_vertices},
                                    {"components", c.n_components},
                                    {"cavities", c.n_cavities},
                                    {"volume_m3", c.volume_m3},
                                    {"area_m2", c.area_m2},
                                    {"n_self_intersections", c.n_self_intersections},
                                    {"position_step_m", level.grid.step_m},
                                    {"position_bits", level.grid.bits},
                                    {"unresolved", places_json(level.unresolved)},
                                    {"unresolved_error_m", level.unresolved_error_m}});
    }
    return report.dump(2) + "\n";
}

} // namespace taihu
