#include "mesh_out/bounded_simplify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "mesh_out/bounded_surface_detail.h"
#include "mesh_out/collapse_detail.h"
#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr const char* kWhere = "simplify";
constexpr int kPasses = 3;
constexpr double kBlockEdges = 48;     ///< edges along a block, as they are on average
constexpr double kShift = 3. / 7;      ///< of a block from pass to pass
constexpr double kCentredShare = 0.75; ///< of the bound, for errors that balancing will centre
constexpr double kCountTolerance = 0.02;
constexpr int kMostTrials = 24;
constexpr double kMostGrowth = 8;   ///< of a bound from trial to trial
constexpr double kNarrow = 1.001;   ///< brackets in which no other number is sought
constexpr double kLeastStep = 0.15; ///< of a bracket
constexpr int kMostTries = 3; ///< to balance and mend one simplified surface without crossings
constexpr int kMostFreezes = 2;
constexpr double kFirstBound = 0.1; ///< of a spacing, where a search begins

void require(bool holds, const std::string& message) {
    if (!holds)
        throw Error(Fault::bad_argument, std::string(kWhere) + ": " + message);
}

/// Which points lie in the balls, grown by `margin_m`.
std::vector<std::uint8_t> near(const std::vector<Vec3>& points, const std::vector<Sphere>& balls,
                               double margin_m) {
    std::vector<std::uint8_t> out(points.size(), 0);
    for (const Sphere& ball : balls) {
        const double r = ball.radius_m + margin_m;
        for (std::size_t i = 0; i < points.size(); ++i)
            out[i] |= length_squared(points[i] - ball.center) <= r * r;
    }
    return out;
}

/// Fewer vertices of a surface, with the numbers of their label sets.
struct Collapsed {
    LabelledMesh mesh;
    std::vector<std::uint32_t> labels;
};

/// What the table still has, renumbered.
Collapsed compact(const CornerTable& table, const LabelledMesh& from, const FaceErrors& errors) {
    Collapsed out;
    std::vector<std::uint32_t> renamed(from.positions.size(), CornerTable::kNone);
    for (std::uint32_t v = 0; v < renamed.size(); ++v)
        if (table.has_vertex(v)) {
            renamed[v] = static_cast<std::uint32_t>(out.labels.size());
            out.mesh.positions.push_back(from.positions[v]);
            out.mesh.labels.push_back(from.labels[v]);
            out.labels.push_back(errors.labels()[v]);
        }
    for (std::size_t t = 0; t < table.n_triangles(); ++t)
        if (table.has_triangle(t)) {
            const Triangle v = table.triangle(t);
            out.mesh.triangles.push_back({renamed[v[0]], renamed[v[1]], renamed[v[2]]});
        }
    return out;
}

} // namespace

BoundedSimplifier::BoundedSimplifier(LabelledMesh mesh, const FieldProbe& field,
                                     const BoundedSettings& settings)
    : surface_{std::move(mesh), {}}, field_(field), settings_(settings) {
    require(settings.spacing_m > 0 && std::isfinite(settings.spacing_m),
            "spacing_m is " + rounded(settings.spacing_m) + ", must be finite and > 0");
    require(settings.max_turn_deg > 0 && settings.max_turn_deg <= 90,
            "max_turn_deg is " + rounded(settings.max_turn_deg) + ", must be in (0, 90]");
    const LabelledMesh& m = surface_.mesh;
    require(m.labels.size() == m.positions.size(),
            std::to_string(m.labels.size()) + " labels for " + std::to_string(m.positions.size()) +
                " positions; give one each");
    for (std::size_t v = 0; v < m.positions.size(); ++v)
        if (!is_finite(m.positions[v]))
            require(false, "the position of vertex " + std::to_string(v) +
                               " is not finite; extract the mesh again");
    surface_.table = std::make_shared<CornerTable>(m.positions.size(), m.triangles, kWhere);
}

BoundedMesh BoundedSimplifier::level(double bound_m, std::span<const Sphere> kept,
                                     Surface& collapsed, Progress* progress) const {
    report_stage(progress, "simplify");
    const LabelledMesh& from = surface_.mesh;
    FaceErrors errors(from, field_, bound_m, settings_.spacing_m);
    Collapser::Rules rules;
    rules.face.face_m = (settings_.balance ? kCentredShare : 1) * bound_m;
    rules.face.rim_m = bound_m;
    rules.face.centred = settings_.balance;
    rules.face.turn_cosine = std::cos(settings_.max_turn_deg * std::numbers::pi / 180);
    rules.off_m = 0.1 * bound_m;
    std::vector<Sphere> crossings(kept.begin(), kept.end());
    std::vector<std::uint8_t> frozen = near(from.positions, crossings, 0);
    for (int freeze = 0;; ++freeze) {
        if (freeze > 0)
            report_stage(progress, "simplify");
        Collapsed fewer;
        {
            CornerTable table = *surface_.table;
            Collapser collapser(table, from.positions, frozen, errors, rules);
            const double block = kBlockEdges * collapser.mean_edge_m();
            for (int i = 0; i < kPasses; ++i)
                collapser.pass(block, i * kShift * block, progress);
            fewer = compact(table, from, errors);
        }
        collapsed.mesh = std::move(fewer.mesh);
        const LabelledMesh& mesh = collapsed.mesh;
        collapsed.table =
            std::make_shared<CornerTable>(mesh.positions.size(), mesh.triangles, kWhere);
        report_stage(progress, "check the bound");
        BoundedSurface surface{*collapsed.table,
                               mesh.positions,
                               mesh.positions,
                               std::move(fewer.labels),
                               errors,
                               bound_m,
                               settings_.spacing_m,
                               near(mesh.positions, crossings, settings_.spacing_m),
                               {},
                               {}};
        if (settings_.balance)
            balance(surface);
        // Balancing and splitting may make faces cross: not there, then. If that does not help,
        // the input stays round them; it does not cross itself.
        const bool can_freeze = freeze < kMostFreezes;
        for (int trial = 0;; ++trial) {
            const std::size_t most = !can_freeze && trial == kMostTries
                                         ? std::numeric_limits<std::size_t>::max()
                                     : trial > 0 ? settings_.few_crossings
                                                 : 0;
            Repaired repaired = repair(surface, most, progress);
            if (repaired.crossings.size() <= most)
                return std::move(repaired.result);
            crossings.insert(crossings.end(), repaired.crossings.begin(), repaired.crossings.end());
            const bool is_new =
                keep(surface, near(mesh.positions, repaired.crossings, settings_.spacing_m));
            if (can_freeze && (trial == kMostTries || !is_new))
                break;
        }
        frozen = near(from.positions, crossings, (1 << freeze) * settings_.spacing_m);
    }
}

BoundedMesh BoundedSimplifier::within(double bound_m, std::span<const Sphere> kept,
                                      Progress* progress) {
    require(bound_m > 0 && std::isfinite(bound_m) && bound_m >= bound_m_,
            "bound_m is " + rounded(bound_m) + ", must be finite, > 0 and not below " +
                rounded(bound_m_) + " of the level before");
    Surface collapsed;
    BoundedMesh out = level(bound_m, kept, collapsed, progress);
    surface_ = std::move(collapsed);
    bound_m_ = bound_m;
    return out;
}

BoundedMesh BoundedSimplifier::to_triangles(std::size_t n, Progress* progress) {
    require(n >= 4 && n <= surface_.mesh.triangles.size(),
            std::to_string(n) + " triangles of " + std::to_string(surface_.mesh.triangles.size()) +
                "; must be at least 4 and no more than there are");
    // Counts fall about as the bound to the power -2/3, and never rise by much: start there, then
    // keep a bracket. Too coarse a trial is kept in case that nothing is nearer; one too fine is
    // what the next starts from.
    struct Trial {
        double bound_m = 0, count = 0;
    };
    const double wanted = (1 - kCountTolerance / 2) * double(n);
    Box box;
    for (const Vec3& p : surface_.mesh.positions)
        box.include(p);
    const double most_m = box.longest() / 4;
    Trial fine{bound_m_}, coarse;
    double bound_m = fine.bound_m > 0 ? fine.bound_m : kFirstBound * settings_.spacing_m;
    std::optional<std::pair<BoundedMesh, Surface>> best;
    std::size_t fewest = surface_.mesh.triangles.size();
    for (int trial = 0; trial < kMostTrials; ++trial) {
        Surface collapsed;
        BoundedMesh out = level(bound_m, {}, collapsed, progress);
        const std::size_t count = out.mesh.triangles.size();
        fewest = std::min(fewest, count);
        const Trial here{bound_m, double(count)};
        if (count > n) {
            fine = here;
            surface_ = std::move(collapsed);
            bound_m_ = bound_m;
        } else {
            coarse = here;
            if (!best || count > best->first.mesh.triangles.size())
                best.emplace(std::move(out), std::move(collapsed));
            if (here.count >= (1 - kCountTolerance) * double(n))
                break;
        }
        const double guess_m = bound_m * std::pow(here.count / wanted, 1.5);
        if (coarse.bound_m == 0) {
            if (bound_m >= most_m)
                break;
            bound_m = std::min(std::clamp(guess_m, 1.05 * bound_m, kMostGrowth * bound_m), most_m);
        } else if (fine.count == 0) {
            bound_m = std::max(std::min(guess_m, 0.95 * bound_m), fine.bound_m);
            if (bound_m == coarse.bound_m)
                break; // coarser than that it was before
        } else {
            if (coarse.bound_m < kNarrow * fine.bound_m)
                break;
            const double at = std::log(fine.count / wanted) / std::log(fine.count / coarse.count);
            bound_m = fine.bound_m * std::pow(coarse.bound_m / fine.bound_m,
                                              std::clamp(at, kLeastStep, 1 - kLeastStep));
        }
    }
    if (!best)
        throw Error(Fault::numeric, std::string(kWhere) + ": " + std::to_string(n) +
                                        " triangles are too few for its rims and tunnels, the "
                                        "fewest found are " +
                                        std::to_string(fewest) + "; ask for more");
    surface_ = std::move(best->second);
    bound_m_ = best->first.bound_m;
    return std::move(best->first);
}

} // namespace taihu
