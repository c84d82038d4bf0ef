#include "vdb_ops/mesh_diagnosis.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

constexpr std::array<std::pair<std::string_view, CloseRule>, 4> kCloseRules = {
    {{"loops", CloseRule::loops},
     {"winding", CloseRule::winding},
     {"plane", CloseRule::plane},
     {"none", CloseRule::none}}};
constexpr std::array<std::pair<std::string_view, ShellRule>, 2> kShellRules = {
    {{"union", ShellRule::unite}, {"parity", ShellRule::parity}}};

template <class Rules>
auto rule_named(const Rules& rules, const char* what, std::string_view name) {
    std::string list;
    for (const auto& [known, rule] : rules) {
        if (known == name)
            return rule;
        list += (list.empty() ? "" : ", ") + std::string(known);
    }
    throw Error(Fault::bad_argument,
                std::string(what) + ": '" + printable(name) + "' must be one of " + list);
}

template <class Rules, class Rule>
std::string name_of(const Rules& rules, Rule rule) {
    return std::string(std::find_if(rules.begin(), rules.end(), [rule](const auto& r) {
                           return r.second == rule;
                       })->first);
}

/// Lines in the order in which they are said.
class Lines {
public:
    explicit Lines(const MeshDiagnosis& found) : d_(found) {}

    std::vector<std::string> run(double voxel_m) {
        corners_and_faces();
        openings();
        sides();
        shells(voxel_m);
        return std::move(out_);
    }

private:
    void say(const char* line) { out_.emplace_back(line); }

    template <class... Values>
    void say(const char* format, Values... values) {
        char text[256];
        std::snprintf(text, sizeof text, format, values...);
        out_.emplace_back(text);
    }

    void corners_and_faces() {
        if (d_.n_bad + d_.n_repeated > 0)
            say("%zu faces dropped: %zu not finite or out of range, %zu with a repeated vertex",
                d_.n_bad + d_.n_repeated, d_.n_bad, d_.n_repeated);
        if (d_.weld_tolerance_m > 0)
            say("cracks welded at %.3g m (%.0e of its diagonal)", d_.weld_tolerance_m,
                d_.weld_share);
        if (d_.n_duplicate > 0)
            say("%zu duplicate faces merged", d_.n_duplicate);
        if (d_.two_sided)
            say("every face is given twice (two-sided): one copy kept");
        else if (d_.n_opposite_pairs > 0)
            say("%zu walls without thickness (a face and its back) dropped", d_.n_opposite_pairs);
    }

    void openings() {
        if (d_.loops.empty())
            return;
        if (d_.rule == CloseRule::winding) {
            say("open: %zu edges in %zu loops, closed where the winding number is 1/2%s",
                d_.n_open_edges, d_.loops.size(),
                d_.undecided > 0.5 ? " (doubtful: much of it is neither in nor out)" : "");
        } else {
            // Walls and bases of `plane` are as large as they need be.
            const double share = 100 * d_.cap_area_m2 / d_.area_m2;
            say("open: %zu edges in %zu loops, closed with %s = %.2g %% of the surface%s",
                d_.n_open_edges, d_.loops.size(),
                d_.rule == CloseRule::plane ? "flat bases" : "caps", share,
                d_.rule == CloseRule::loops && share > 10 ? " (doubtful)" : "");
        }
        constexpr std::size_t kNamed = 8;
        for (std::size_t i = 0; i < std::min(d_.loops.size(), kNamed); ++i)
            say("  loop %zu: %zu edges, %.4g m around, at (%.4g, %.4g, %.4g)", i + 1,
                d_.loops[i].n_edges, d_.loops[i].perimeter_m, d_.loops[i].center.x,
                d_.loops[i].center.y, d_.loops[i].center.z);
        if (d_.loops.size() > kNamed)
            say("  and %zu more", d_.loops.size() - kNamed);
    }

    void sides() {
        if (d_.n_nonmanifold_edges > 0)
            say("%zu edges of three faces or more", d_.n_nonmanifold_edges);
        if (d_.n_flipped_edges > 0)
            say("%zu edges disagreed on the side: made consistent", d_.n_flipped_edges);
        if (d_.n_one_sided > 0)
            say("%zu edges of a one-sided surface: no side is right there", d_.n_one_sided);
        if (d_.n_inverted > 0)
            say("%zu of %zu solid shells had their faces pointing inward", d_.n_inverted,
                d_.n_solids);
    }

    void shells(double voxel_m) {
        if (d_.n_solids + d_.n_cavities + d_.n_sheets > 1)
            say("%zu shells: %zu solid, %zu cavities, %zu sheets without an inside left out "
                "(%.3g m^2)",
                d_.n_solids + d_.n_cavities + d_.n_sheets, d_.n_solids, d_.n_cavities, d_.n_sheets,
                d_.sheet_area_m2);
        if (d_.n_overlapping > 0)
            say("%zu shells overlap themselves: what is inside any part is inside, distances near "
                "the crossing are approximate",
                d_.n_overlapping);
        std::size_t n_thin = 0;
        double thinnest_m = 2 * voxel_m;
        for (const double t : d_.thickness_m) {
            n_thin += t < 2 * voxel_m;
            thinnest_m = std::min(thinnest_m, t);
        }
        if (n_thin > 0)
            say("%zu of %zu solid shells are thinner than two voxels, down to %.2g, and will break "
                "up; a voxel of %.3g m holds them",
                n_thin, d_.thickness_m.size(), thinnest_m / voxel_m, thinnest_m / 2);
    }

    const MeshDiagnosis& d_;
    std::vector<std::string> out_;
};

} // namespace

CloseSettings close_settings(std::string_view rule, std::string_view shells) {
    const CloseSettings settings{rule_named(kCloseRules, "close", rule),
                                 rule_named(kShellRules, "shells", shells)};
    if (settings.rule == CloseRule::winding && settings.shells == ShellRule::parity)
        throw Error(Fault::bad_argument, "shells: 'parity' counts shells one by one, and close "
                                         "'winding' all at once; drop one of them");
    return settings;
}

std::string close_rule_name(CloseRule rule) {
    return name_of(kCloseRules, rule);
}

std::string shell_rule_name(ShellRule rule) {
    return name_of(kShellRules, rule);
}

std::vector<std::string> MeshDiagnosis::lines(double voxel_m) const {
    return Lines(*this).run(voxel_m);
}

} // namespace taihu
