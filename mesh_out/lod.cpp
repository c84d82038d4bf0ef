#include "mesh_out/lod.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <nlohmann/json.hpp>

#include "mesh_out/extract.h"
#include "mesh_out/simplify.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr double kRoundingShare = 0.1;     ///< of a bound, for moving vertices onto the grid
constexpr double kSimplifyingShare = 0.82; ///< of a bound; what is left covers what samples miss
constexpr double kTightest = 0.75; ///< by how much one more attempt may lower the inner bound
constexpr int kAttempts = 4;
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
    if (settings.n_levels < 1 || settings.n_levels > 8)
        refuse("n_levels is " + std::to_string(settings.n_levels) + ", must be 1..8");
    if (!(settings.bound_m > 0) || !std::isfinite(settings.bound_m))
        refuse("bound_m is " + shown(settings.bound_m) + ", must be finite and > 0");
    if (!(settings.factor > 1) || !std::isfinite(settings.factor))
        refuse("factor is " + shown(settings.factor) + ", must be finite and > 1");
}

/// Makes the levels of one solid.
class Chain {
public:
    Chain(const openvdb::FloatGrid& solid, const LodSettings& settings, Progress* progress)
        : solid_(solid), settings_(settings), progress_(progress),
          reference_((report_stage(progress, "extract"), extract_uniform(solid, progress))),
          box_(bounds(reference_)) {
        origin_step_m_ = position_grid(box_, max_move_m(bound_m(settings.n_levels - 1))).step_m;
        const double least_step = std::exp2(std::ceil(std::log2(box_.longest() / 0x1p17)));
        if (max_move_m(bound_m(0)) < least_step * std::sqrt(3.0) / 2)
            throw Error(Fault::numeric,
                        "lod: a largest error of " + shown(bound_m(0)) +
                            " m is finer than positions of 18 bits; allow at least " +
                            shown(least_step * std::sqrt(3.0) / 2 / kRoundingShare * 1.001) + " m");
    }

    LodChain make();

private:
    double bound_m(int j) const { return settings_.bound_m * std::pow(settings_.factor, j); }
    /// What rounding may take of a bound; a step as long as the mesh itself would help nobody.
    double max_move_m(double bound_m) const {
        return std::min(kRoundingShare * bound_m, box_.longest() / 8);
    }
    LodLevel written(const TriMesh& mesh, double bound_m) const;
    bool next_level(int j, LodLevel& level);
    [[noreturn]] void refuse_bound(double bound_m, double error_m) const;

    const openvdb::FloatGrid& solid_;
    const LodSettings& settings_;
    Progress* progress_;
    const TriMesh reference_;
    const Box box_;
    double origin_step_m_ = 0;
    TriMesh current_; ///< the last level before it was moved onto its grid
};

/// `mesh` as a file holds it: snapped, coded, decoded; certified and measured as decoded.
LodLevel Chain::written(const TriMesh& mesh, double bound_m) const {
    LodLevel level;
    level.bound_m = bound_m;
    level.grid = position_grid(box_, max_move_m(bound_m), origin_step_m_);
    TriMesh snapped = snap_to_grid(mesh, level.grid).mesh;
    if (settings_.normals)
        snapped.normals = surface_normals(solid_, snapped.positions);
    check_cancelled(progress_);
    level.encoded = encode_draco(snapped, level.grid);
    const TriMesh& decoded = level.encoded.decoded;
    level.certificate = certify(decoded);
    if (!level.certificate.holds()) {
        std::string what;
        for (const std::string& fault : faults(level.certificate))
            what += (what.empty() ? "" : ", ") + fault;
        throw Error(Fault::numeric, "lod: the level of bound " + shown(bound_m) +
                                        " m came out with " + what + "; use a smaller bound");
    }
    check_cancelled(progress_);
    // Half a voxel is finer than the reference's own faces; a wide bound need not be known so well.
    const double spacing_m = std::max(0.5 * solid_.voxelSize()[0], 0.5 * bound_m);
    const TwoSidedDistance distance = two_sided_distance(decoded, reference_, spacing_m);
    level.error_m = distance.max_m;
    level.rms_m = distance.rms_m;
    check_cancelled(progress_);
    return level;
}

void Chain::refuse_bound(double bound_m, double error_m) const {
    throw Error(Fault::numeric, "lod: the bound " + shown(bound_m) +
                                    " m cannot be met, the best mesh is " + shown(error_m) +
                                    " m off; ask for " + shown(1.05 * error_m) +
                                    " m or more, or use smaller voxels");
}

/// Level j from current_, or false when nothing within its bound has fewer triangles. Level 0 may
/// fall back to the uniform mesh itself.
bool Chain::next_level(int j, LodLevel& level) {
    const TriMesh& start = j == 0 ? reference_ : current_;
    double inner_m = kSimplifyingShare * bound_m(j);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        TriMesh simplified = simplify(start, reference_, {.bound_m = inner_m}, progress_);
        if (j > 0 && simplified.triangles.size() >= start.triangles.size())
            return false;
        level = written(simplified, bound_m(j));
        if (level.error_m > level.bound_m) {
            inner_m *= std::max(kTightest, 0.97 * level.bound_m / level.error_m);
            continue;
        }
        current_ = std::move(simplified);
        return true;
    }
    if (j > 0)
        return false;
    level = written(reference_, bound_m(0));
    if (level.error_m > level.bound_m)
        refuse_bound(level.bound_m, level.error_m);
    current_ = reference_;
    return true;
}

LodChain Chain::make() {
    LodChain chain;
    chain.n_reference_triangles = reference_.triangles.size();
    for (int j = 0; j < settings_.n_levels; ++j) {
        report_stage(progress_, "level " + std::to_string(j + 1) + " of " +
                                    std::to_string(settings_.n_levels));
        check_cancelled(progress_);
        LodLevel level;
        const bool made = next_level(j, level);
        if (j > 0 && (!made || level.certificate.n_triangles >=
                                   chain.levels.back().certificate.n_triangles)) {
            chain.note = std::to_string(j) + " of " + std::to_string(settings_.n_levels) +
                         " levels: within " + shown(bound_m(j)) +
                         " m no mesh with fewer triangles than level " + std::to_string(j - 1) +
                         " was found";
            break;
        }
        if (j > 0)
            level.holes_closed = chain.levels.front().certificate.genus - level.certificate.genus;
        chain.levels.push_back(std::move(level));
    }
    return chain;
}

/// MSFT_screencoverage of each level: the share of a screen of 1920 x 1080 pixels that the box's
/// largest face covers where a pixel is as wide as the error of the *next* level; from there on the
/// next one looks the same. At most 1, each at most half of the one before; the last is the size
/// below which the rock may be dropped: 1e-4, or less where the levels reach that far down.
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

} // namespace

LodChain make_lods(const openvdb::FloatGrid& solid, const LodSettings& settings,
                   Progress* progress) {
    require(settings);
    return Chain(solid, settings, progress).make();
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

std::string format_report(const LodChain& chain, const std::string& file) {
    const std::vector<double> coverages = screen_coverages(chain);
    nlohmann::ordered_json report;
    report["taihu_report"] = kReportVersion;
    report["file"] = file;
    report["reference"] =
        "uniform surface of the level set; distances by closest point, both ways, "
        "on the decoded meshes";
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
                                    {"position_bits", level.grid.bits}});
    }
    return report.dump(2) + "\n";
}

} // namespace taihu
