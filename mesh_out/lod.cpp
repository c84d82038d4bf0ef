#include "mesh_out/lod.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

#include "mesh_out/covering_balls_detail.h"
#include "mesh_out/crossings_detail.h"
#include "mesh_out/extract.h"
#include "mesh_out/field_distance.h"
#include "mesh_out/held_surface_detail.h"
#include "mesh_out/lost_surface_detail.h"
#include "mesh_out/openness.h"
#include "mesh_out/part_sheets_detail.h"
#include "mesh_out/piece_sides_detail.h"
#include "mesh_out/small_pieces_detail.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/coarser_solid.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr double kRoundingShare = 0.1; ///< of a bound, for moving vertices onto the grid
constexpr double kTightest = 0.9;      ///< by how much one more attempt may lower the inner bound
constexpr double kFewBeyond = 2e-5;    ///< share of samples over a bound that are named, not mended
constexpr std::size_t kFewCrossings = 40; ///< that are better parted than rounded less
constexpr double kMostBeyond = 0.01;      ///< share of samples over a bound that is held at all
constexpr double kGrown = 0.25;           ///< of a bound, for walls that coarser voxels would lose
constexpr double kShut = 0.5;            ///< of a bound: what lies deeper in a grown solid was shut
constexpr double kAlike = 0.5;           ///< cosine of the angle between normals of the same place
constexpr double kFewBeyondGrown = 1e-3; ///< as kFewBeyond, of levels on coarser voxels
constexpr double kShrink = 0.68, kLeastShrink = 0.5; ///< of levels, as Chain::shrink_
constexpr int kCoarsest = 8;                         ///< voxels along one of a level's own
constexpr double kLeastMove = 1.0 / 16; ///< of what rounding may take, where faces would cross
constexpr double kLost = 0.25;          ///< of the finest bound: not worth a look
constexpr double kNearly = 0.75;        ///< of a bound, at one point: beyond it beside
constexpr double kSpeck = 2, kLargestSpeck = 16; ///< bounds: pieces that long are dropped
constexpr double kNearCount = 0.97;              ///< of the triangles asked for: not said
constexpr int kAttempts = 2, kMostAttempts = 4, kMostLevels = 8, kMostBits = 18;

std::string shown(double value) {
    return rounded(value, 6);
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
    void use_field(double bound_m);
    bool use_coarser(double bound_m, LabelledMesh& surface);
    BoundedSimplifier simplifier(LabelledMesh surface) const;
    /// A level, and where it is not what it should be.
    struct Written {
        LodLevel level;
        std::vector<Vec3> beyond, crossings;
        std::size_t n_samples = 0;
    };
    std::vector<Vec3> normals(const LabelledMesh& mesh) const;
    TriMesh snapped(const BoundedMesh& mesh, double bound_m, double most_m,
                    PositionGrid& grid) const;
    void name_lost(LodLevel& level, const std::vector<Vec3>& dropped) const;
    Written written(const BoundedMesh& mesh, double bound_m, double move_m, double speck) const;
    bool simplified(double bound_m, LabelledMesh& surface, LodLevel& level) const;
    bool within(double bound_m, const LodLevel* before, LodLevel& level);
    bool of_triangles(std::size_t n, LodLevel& level, std::string& why);

    /// What a level is simplified against: the field, or a level set made for it.
    struct Model {
        std::unique_ptr<const Field> own;
        double spacing_m = 0;
        double off_m = 0; ///< from the solid's surface, where nothing was shut
        std::vector<Sphere> closed;
        std::shared_ptr<const FieldProbe> probe;  ///< as far as this level needs distances
        std::shared_ptr<const FieldProbe> around; ///< as far as its faces are long
        TriMesh held; ///< the part of the reference that was not shut; all of it when empty
    };
    std::shared_ptr<const FieldProbe> probe(const Field& field, double reach_m) const {
        return field.probe(box_.dilated(reach_m), reach_m);
    }
    const TriMesh& held() const { return model_.held.triangles.empty() ? reference_ : model_.held; }
    void drop_unseen(const SurfaceDistance& to_reference);
    void drop_shut(double bound_m, const LabelledMesh& surface);

    const openvdb::FloatGrid& solid_;
    const LodSettings& settings_;
    Progress* progress_;
    const double voxel_m_;
    std::unique_ptr<const Field> own_; ///< where none was given
    const Field* field_;
    TriMesh reference_;
    std::vector<Vec3> lost_;     ///< on the field's surface, where the level set may not see it
    std::vector<Sphere> unseen_; ///< round those that are far from all it sees
    Box box_;
    double origin_step_m_ = 0;
    LabelledMesh last_; ///< as the last level of the field left it, on the surface
    Model model_;
    std::shared_ptr<const FieldProbe> truth_; ///< of the field
    bool is_coarse_ = false;                  ///< the last level was made on coarser voxels
    double shrink_ = 1; ///< of the last level of the field: -log n / log bound
};

/// The finest bound that is asked for; a fraction of a voxel where only triangles are.
double Chain::finest_bound_m() const {
    const double bound_m = settings_.levels.front().bound_m;
    return bound_m > 0 ? bound_m : 0.25 * voxel_m_;
}

Chain::Chain(const openvdb::FloatGrid& solid, const Field* field, const LodSettings& settings,
             Progress* progress)
    : solid_(solid), settings_(settings), progress_(progress), voxel_m_(lattice_of(solid).voxel_m),
      field_(field) {
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
    } else {
        const SurfaceDistance to_reference(reference_);
        lost_ = lost_surface(solid, *probe(*field, 2 * voxel_m_), to_reference,
                             kLost * finest_bound_m(), progress);
        drop_unseen(to_reference);
    }
}

void Chain::drop_unseen(const SurfaceDistance& to_reference) {
    const double far_m = 2 * voxel_m_;
    const auto far = std::stable_partition(
        lost_.begin(), lost_.end(), [&](const Vec3& p) { return !(to_reference(p) > far_m); });
    unseen_ = balls_apart({far, lost_.end()}, far_m);
    lost_.erase(far, lost_.end());
}

void Chain::use_field(double bound_m) {
    model_ = {};
    model_.spacing_m = voxel_m_;
    model_.around = probe(*field_, 8 * voxel_m_ + 5.5 * bound_m); // the wider one first
    truth_ = probe(*field_, 2 * (voxel_m_ + bound_m));
    model_.probe = truth_;
}

/// For levels that see fewer rims and holes than the field has: grown on voxels half as wide as the
/// bound, or on the solid's own. False where the bound is too small for that, or so large that
/// nothing is left.
bool Chain::use_coarser(double bound_m, LabelledMesh& surface) {
    if (bound_m < voxel_m_ || bound_m > box_.longest() / 4)
        return false;
    int coarser = 1;
    while (coarser < kCoarsest && 4 * coarser * voxel_m_ <= bound_m * (1 + 1e-9))
        coarser *= 2;
    Model model;
    model.spacing_m = coarser * voxel_m_;
    model.off_m = std::min(kGrown * bound_m, model.spacing_m);
    CoarserSolid coarse =
        coarser_solid(solid_, {.coarser = coarser, .grow_m = model.off_m}, progress_);
    if (!coarse.solid)
        return false;
    const double bound_vox = std::clamp(0.3 * bound_m / model.spacing_m, 0.05, 1.0);
    surface = extract(*coarse.solid, nullptr, {.bound_vox = bound_vox}, progress_);
    model.own = std::make_unique<PlacedLevelSetField>(coarse.solid);
    model.closed = std::move(coarse.closed);
    truth_ = probe(*field_, 2 * (voxel_m_ + bound_m));
    model.around = probe(*model.own, 8 * model.spacing_m + 5.5 * bound_m);
    model.probe = model.around;
    model_ = std::move(model);
    drop_shut(bound_m, surface);
    return true;
}

/// What was shut is not held to the bound, but named.
void Chain::drop_shut(double bound_m, const LabelledMesh& surface) {
    HeldSurface held =
        held_surface(reference_, {surface.positions, surface.triangles, {}}, *model_.probe,
                     model_.closed, model_.off_m + kShut * bound_m, bound_m);
    model_.held = std::move(held.mesh);
    const std::vector<Sphere> ways = balls_over_cubes(held.shut, bound_m);
    model_.closed.insert(model_.closed.end(), ways.begin(), ways.end());
}

BoundedSimplifier Chain::simplifier(LabelledMesh surface) const {
    return {std::move(surface), *model_.around,
            BoundedSettings{.spacing_m = model_.spacing_m, .few_crossings = kFewCrossings}};
}

/// The field's, but where holes were shut.
std::vector<Vec3> Chain::normals(const LabelledMesh& mesh) const {
    std::vector<Vec3> out = surface_normals(mesh, *model_.probe);
    if (!model_.own)
        return out;
    tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t v) {
        const Vec3& p = mesh.positions[v];
        const Vec3 sharp = truth_->of(truth_->at(p).primitive, p).gradient;
        if (dot(sharp, out[v]) > kAlike * length(sharp))
            out[v] = normalized(sharp);
    });
    return out;
}

/// On the coarsest position grid of the chain on which no faces cross.
TriMesh Chain::snapped(const BoundedMesh& mesh, double bound_m, double most_m,
                       PositionGrid& grid) const {
    const TriMesh plain{mesh.mesh.positions, mesh.mesh.triangles, normals(mesh.mesh)};
    Box box = box_.dilated(std::min(bound_m, box_.longest())); // balanced vertices lie off
    for (const Vec3& p : plain.positions)
        box.include(p); // of parts that are named, farther
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

/// Fins and slits of which the voxels show nothing, nor the mesh; and what it dropped.
void Chain::name_lost(LodLevel& level, const std::vector<Vec3>& dropped) const {
    std::vector<Vec3> lost = lost_;
    lost.insert(lost.end(), dropped.begin(), dropped.end());
    if (lost.empty())
        return;
    const SurfaceDistance to_mesh(level.encoded.decoded);
    std::vector<Vec3> beyond;
    for (const Vec3& p : lost)
        if (const double off_m = to_mesh(p); off_m > kNearly * level.bound_m) {
            beyond.push_back(p);
            level.unresolved_error_m = std::max(level.unresolved_error_m, off_m);
        }
    for (const Sphere& ball : balls_over_cubes(beyond, 2 * voxel_m_))
        level.unresolved.push_back({ball.center, ball.radius_m, level.unresolved_error_m});
}

/// `mesh` as a file holds it, without specks: snapped, coded, decoded; certified and measured so.
Chain::Written Chain::written(const BoundedMesh& mesh, double bound_m, double move_m,
                              double speck) const {
    Written out;
    LodLevel& level = out.level;
    level.bound_m = bound_m;
    level.unresolved = mesh.unresolved;
    level.closed = model_.closed;
    TriMesh mesh_on_grid = snapped(mesh, bound_m, move_m, level.grid);
    turn_small_pieces(mesh_on_grid.positions, mesh_on_grid.triangles);
    std::vector<Vec3> dropped;
    for (;; speck = std::max(2 * speck, kSpeck)) {
        const std::vector<Vec3> more = drop_small_pieces(mesh_on_grid, speck * bound_m);
        dropped.insert(dropped.end(), more.begin(), more.end());
        if (settings_.openness)
            mesh_on_grid.openness = openness(mesh_on_grid, {}, progress_);
        check_cancelled(progress_);
        level.encoded = encode_draco(mesh_on_grid, level.grid);
        level.certificate = certify(level.encoded.decoded);
        if (level.certificate.n_misplaced_pieces == 0 || speck >= kLargestSpeck)
            break;
    }
    const TriMesh& decoded = level.encoded.decoded;
    require_certificate(level.certificate, "lod: the level of bound " + shown(bound_m) + " m");
    if (level.certificate.n_self_intersections > 0)
        for (const auto& [f, g] : crossing_pairs(decoded.positions, decoded.triangles))
            for (const std::uint32_t v : decoded.triangles[f])
                out.crossings.push_back(decoded.positions[v]);
    name_lost(level, dropped);
    std::vector<Sphere> apart;
    for (const UnresolvedPlace& place : level.unresolved)
        apart.push_back({place.center, place.radius_m + bound_m});
    // Every face has a few samples; it was certified before it was rounded.
    FieldDistance distance = field_distance(
        decoded, *truth_, held(), std::max(voxel_m_, 0.5 * bound_m), bound_m, apart, progress_);
    level.error_m = distance.max_m;
    level.rms_m = distance.rms_m;
    level.unresolved_error_m = std::max(level.unresolved_error_m, distance.max_apart_m);
    out.beyond = std::move(distance.beyond);
    out.n_samples = distance.n_samples;
    return out;
}

/// A level within a bound from a surface, which it leaves as its own: where it does not hold as
/// decoded, or faces cross, what was there before stays. What no attempt mends is named. Returns
/// false, and what was nearest to it in `level`, when that is nearly everywhere.
bool Chain::simplified(double bound_m, LabelledMesh& surface, LodLevel& level) const {
    const BoundedSimplifier start = simplifier(std::move(surface));
    const double few = model_.own ? kFewBeyondGrown : kFewBeyond;
    double inner_m = bound_m - max_move_m(bound_m) - model_.off_m;
    std::vector<Sphere> kept;
    for (int attempt = 0;; ++attempt) {
        BoundedSimplifier next = start;
        Written out =
            written(next.within(inner_m, kept, progress_), bound_m, max_move_m(bound_m), kSpeck);
        level = std::move(out.level);
        const double share = double(out.beyond.size()) / double(out.n_samples);
        const bool is_fair = out.crossings.empty() && share <= kMostBeyond;
        const bool no_more = attempt + 1 >= (is_fair ? kAttempts : kMostAttempts);
        const bool last = no_more || share <= few;
        if (last && share <= kMostBeyond) {
            for (const Sphere& ball : balls_over_cubes(out.beyond, 2 * voxel_m_))
                level.unresolved.push_back({ball.center, ball.radius_m, level.error_m});
            level.unresolved_error_m = std::max(level.unresolved_error_m, level.error_m);
            level.error_m = std::min(level.error_m, bound_m);
        }
        if (level.error_m <= bound_m && (no_more || out.crossings.empty())) {
            surface = next.surface();
            return true;
        }
        if (no_more) {
            surface = start.surface();
            return false;
        }
        if (share > kMostBeyond)
            inner_m *= std::max(kTightest, 0.97 * bound_m / level.error_m);
        out.beyond.insert(out.beyond.end(), out.crossings.begin(), out.crossings.end());
        const auto more = balls_over_cubes(out.beyond, (2 << attempt) * voxel_m_);
        kept.insert(kept.end(), more.begin(), more.end());
    }
}

/// A level within a bound: by the field from the one before, sharp; or, where its rims and holes
/// leave too many triangles, on coarser voxels. \param before  the level before, or null.
bool Chain::within(double bound_m, const LodLevel* before, LodLevel& level) {
    // On the solid's own voxels it takes long: only where there is little else.
    const bool is_quick = bound_m >= 4 * voxel_m_;
    bool made = false;
    if (!is_coarse_ && !(is_quick && shrink_ < kShrink)) {
        use_field(bound_m);
        made = simplified(bound_m, last_, level);
        if (made && before)
            shrink_ = std::log(double(before->certificate.n_triangles) /
                               double(level.certificate.n_triangles)) /
                      std::log(bound_m / before->bound_m);
        if (made &&
            (before ? shrink_ >= (is_quick ? kShrink : kLeastShrink) : bound_m < 2 * voxel_m_))
            return true;
    }
    LabelledMesh surface;
    LodLevel coarse;
    if (use_coarser(bound_m, surface) && simplified(bound_m, surface, coarse) &&
        (!made || coarse.certificate.n_triangles < level.certificate.n_triangles)) {
        level = std::move(coarse);
        is_coarse_ = true;
        return true;
    }
    if (!made) {
        use_field(bound_m);
        made = simplified(bound_m, last_, level);
    }
    return made;
}

/// A level of so many triangles, whatever its bound then is. Returns false, and why, when there is
/// none.
bool Chain::of_triangles(std::size_t n, LodLevel& level, std::string& why) {
    use_field(box_.longest() / 16);
    BoundedSimplifier start = simplifier(last_);
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
    level = written(mesh, bound_m, max_move_m(bound_m) / 4, 0).level;
    level.bound_m = std::max(bound_m, level.error_m);
    return true;
}

LodChain Chain::make() {
    LodChain chain;
    chain.n_reference_triangles = reference_.triangles.size();
    chain.unseen = unseen_;
    const std::size_t n = settings_.levels.size();
    for (std::size_t j = 0; j < n; ++j) {
        report_stage(progress_, "level " + std::to_string(j + 1) + " of " + std::to_string(n));
        check_cancelled(progress_);
        const LodGoal& goal = settings_.levels[j];
        LodLevel level;
        const LodLevel* before = j > 0 ? &chain.levels.back() : nullptr;
        std::string why;
        const bool made = goal.n_triangles > 0 ? of_triangles(goal.n_triangles, level, why)
                                               : within(goal.bound_m, before, level);
        if (!why.empty() && !before)
            throw Error(Fault::numeric, "lod: " + why);
        if (!why.empty()) {
            chain.note = std::to_string(j) + " of " + std::to_string(n) + " levels: " + why;
            break;
        }
        if (double(level.certificate.n_triangles) < kNearCount * double(goal.n_triangles))
            chain.note = "level " + std::to_string(j) + ": no bound leads nearer to " +
                         std::to_string(goal.n_triangles) + " triangles";
        if (!made && !before)
            throw Error(Fault::numeric, "lod: the bound " + shown(level.bound_m) +
                                            " m cannot be met, the best mesh is " +
                                            shown(level.error_m) + " m off; ask for " +
                                            shown(1.05 * level.error_m) +
                                            " m or more, or use smaller voxels");
        if (!made || (before && level.certificate.n_triangles >= before->certificate.n_triangles)) {
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

LodChain make_lods(const openvdb::FloatGrid& solid, const Field* field, const LodSettings& settings,
                   Progress* progress) {
    require(settings);
    return Chain(solid, field, settings, progress).make();
}

} // namespace taihu
