#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "mesh_out/lod.h"

namespace taihu {

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

constexpr int kReportVersion = 1;

constexpr std::size_t kMostListed = 100; ///< thousands help nobody

nlohmann::ordered_json vector_json(const Vec3& v) {
    return {v.x, v.y, v.z};
}

nlohmann::ordered_json unseen_json(const std::vector<Sphere>& unseen) {
    nlohmann::ordered_json json = {{"n", unseen.size()}, {"some", nlohmann::json::array()}};
    for (std::size_t i = 0; i < std::min(kMostListed, unseen.size()); ++i)
        json["some"].push_back(vector_json(unseen[i].center));
    return json;
}

nlohmann::ordered_json unresolved_json(std::vector<UnresolvedPlace> places) {
    std::stable_sort(places.begin(), places.end(),
                     [](const auto& a, const auto& b) { return a.radius_m > b.radius_m; });
    nlohmann::ordered_json json = {{"n", places.size()}, {"largest", nlohmann::json::array()}};
    for (std::size_t i = 0; i < std::min(kMostListed, places.size()); ++i)
        json["largest"].push_back(
            {{"center_m", vector_json(places[i].center)}, {"radius_m", places[i].radius_m}});
    return json;
}

/// \param before  the finest level.
nlohmann::ordered_json closed_json(std::vector<Sphere> closed, const Certificate& before) {
    std::stable_sort(closed.begin(), closed.end(),
                     [](const auto& a, const auto& b) { return a.radius_m > b.radius_m; });
    nlohmann::ordered_json json = {{"n", closed.size()},
                                   {"genus_before", before.genus},
                                   {"components_before", before.n_components},
                                   {"largest", nlohmann::json::array()}};
    for (std::size_t i = 0; i < std::min(kMostListed, closed.size()); ++i)
        json["largest"].push_back(
            {{"center_m", vector_json(closed[i].center)}, {"diameter_m", 2 * closed[i].radius_m}});
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
        "point, both ways, on the decoded meshes, outside of the places listed and of what is "
        "within the bound of a hole that was closed";
    report["n_reference_triangles"] = chain.n_reference_triangles;
    report["note"] = chain.note;
    report["unseen"] = unseen_json(chain.unseen);
    report["levels"] = nlohmann::ordered_json::array();
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        const LodLevel& level = chain.levels[j];
        const Certificate& c = level.certificate;
        report["levels"].push_back(
            {{"triangles", c.n_triangles},
             {"bytes", level.encoded.draco.size()},
             {"error_m", level.error_m},
             {"bound_m", level.bound_m},
             {"rms_m", level.rms_m},
             {"genus", c.genus},
             {"holes_closed", level.holes_closed},
             {"closed", closed_json(level.closed, chain.levels.front().certificate)},
             {"screen_coverage", coverages[j]},
             {"vertices", c.n_vertices},
             {"components", c.n_components},
             {"cavities", c.n_cavities},
             {"volume_m3", c.volume_m3},
             {"area_m2", c.area_m2},
             {"n_self_intersections", c.n_self_intersections},
             {"position_step_m", level.grid.step_m},
             {"position_bits", level.grid.bits},
             {"unresolved", unresolved_json(level.unresolved)},
             {"unresolved_error_m", level.unresolved_error_m}});
    }
    return report.dump(2) + "\n";
}

} // namespace taihu
