#include "tools/holes_options.h"

#include <cmath>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "stats/core/text.h"
#include "stats/io/law_file.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

// Of the solid's longest axis, where the user says nothing: what shows on a rock of any size.
constexpr double kClusters = 20; // in a cube as long
constexpr const char *kThomasSpread = "7%", *kMaternSpread = "18%", *kScatter = "1.5%",
                     *kGap = "0.5%", *kSpacing = "10%";

struct Given {
    const char* option;
    bool given;
    std::string_view patterns; ///< that use it; empty: all
};

std::vector<Given> given_options(const PlacementOptions& o) {
    return {{"--scale", !o.scale.empty(), ""},
            {"--count", o.count.has_value(), ""},
            {"--porosity", o.porosity.has_value(), ""},
            {"--density", o.density.has_value(), ""},
            {"--seed", o.seed.has_value(), ""},
            {"--empirical", o.empirical, ""},
            {"--pattern", o.pattern.has_value(), ""},
            {"--clusters", o.clusters.has_value(), "thomas or matern"},
            {"--spread", !o.spread.empty(), "thomas or matern"},
            {"--joints", o.joints.has_value(), "joints"},
            {"--scatter", !o.scatter.empty(), "joints"},
            {"--gap", !o.gap.empty(), "hard-core"},
            {"--spacing", !o.spacing.empty(), "lattice"},
            {"--height", !o.height.empty(), ""},
            {"--where", !o.where.empty(), ""}};
}

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, what);
}

double length_or(const std::string& option, const std::string& text, const char* by_default,
                 const Measure& measure) {
    return length_m(option, text.empty() ? by_default : text, measure);
}

/// One placement in the making, and what is said about it.
struct Choice {
    const LawFile& law;
    const PlacementOptions& options;
    const Measure& measure;
    std::string where; ///< the law's file
    Placement placement;
    HoleSources sources;
    std::vector<std::string> comments;

    template <class... Args>
    void say(fmt::format_string<Args...> format, Args&&... args) {
        comments.push_back(fmt::format(format, std::forward<Args>(args)...));
    }
    /// The family's own number speaks of all holes, a table made from the profiles of those above
    /// the detection limit.
    bool table_in_place_of_family() const {
        return options.empirical && law.law.family() != Family::empirical;
    }
};

/// The law that diameters are drawn from.
Law choose_law(Choice& c) {
    const auto family = family_name(c.law.law.family());
    if (!c.table_in_place_of_family()) {
        c.say("law {}: {} (measured, {} profiles)", c.where, family, c.law.n_profiles);
        return c.law.law;
    }
    if (c.law.empirical.empty())
        refuse(c.where +
               ": has no table 'empirical' for --empirical to draw from; drop it to draw "
               "from the fitted " +
               std::string(family) + " law, or fit the measurements again");
    c.sources.empirical = true;
    c.say("law {}: empirical table of {} points (measured, {} profiles), in place of the fitted {} "
          "(chosen)",
          c.where, c.law.empirical.size(), c.law.n_profiles, family);
    return Law::empirical(c.law.empirical);
}

void choose_scale(Choice& c) {
    const std::string& scale = c.options.scale;
    if (scale.empty() && c.law.unit != LengthUnit::metre)
        refuse(c.where + ": the law's unit is '" + std::string(unit_name(c.law.unit)) +
               "'; say how long one unit is, as --scale 0.4m or --scale 25%");
    if (!scale.empty()) {
        c.placement.scale_m = length_m("--scale", scale, c.measure);
        c.say("scale {:.6g} m per law unit (chosen)", c.placement.scale_m);
    }
}

/// The law's own N_V when the user gave no number.
double density_of_law(Choice& c) {
    if (!c.law.n_v)
        refuse(c.where + ": the law has no n_v, because the area searched is unknown; give one "
                         "of --count, --porosity and --density");
    const double scale_m = c.placement.scale_m;
    const double all = c.law.n_v->estimate / (scale_m * scale_m * scale_m);
    if (!c.table_in_place_of_family()) {
        c.say("density {:.6g} per m^3 (measured: the law's n_v)", all);
        return all;
    }
    const double seen = 1 - c.law.n_v->extrapolated_share;
    c.say("density {:.6g} per m^3 (measured: the law's n_v of {:.6g} times {:.4g}, because the "
          "table has no holes below the detection limit)",
          all * seen, all, seen);
    return all * seen;
}

/// Which number decides how many holes there are.
void choose_number(Choice& c) {
    const PlacementOptions& o = c.options;
    c.placement.count = o.count;
    c.placement.porosity = o.porosity;
    c.placement.density_m3 = o.density;
    if (o.count)
        c.say("count {} (chosen)", *o.count);
    else if (o.porosity)
        c.say("porosity {:.6g} (chosen)", *o.porosity);
    else if (o.density)
        c.say("density {:.6g} per m^3 (chosen)", *o.density);
    else
        c.placement.density_m3 = density_of_law(c);
}

/// The spacing of a lattice is its number, too.
void choose_lattice(Choice& c) {
    const PlacementOptions& o = c.options;
    if (o.count || o.porosity)
        refuse(std::string(o.count ? "--count" : "--porosity") +
               ": a lattice has as many holes as its spacing fits in; give --spacing or --density");
    if (o.density && !o.spacing.empty())
        refuse("--density: --spacing says it already; drop one of them");
    LatticePattern lattice;
    if (o.density || (o.spacing.empty() && c.law.n_v)) {
        choose_number(c);
        lattice.spacing_m = 1 / std::cbrt(*c.placement.density_m3);
        c.placement.density_m3.reset();
    } else {
        lattice.spacing_m = length_or("--spacing", o.spacing, kSpacing, c.measure);
    }
    c.say("pattern lattice (chosen): spacing {:.6g} m", lattice.spacing_m);
    c.placement.pattern = lattice;
}

void choose_clusters(Choice& c, ClusterSettings::Shape shape) {
    const double longest_m = c.measure.longest_m;
    ClusterSettings clusters;
    clusters.shape = shape;
    clusters.parents_m3 =
        c.options.clusters.value_or(kClusters / (longest_m * longest_m * longest_m));
    clusters.spread_m = length_or(
        "--spread", c.options.spread,
        shape == ClusterSettings::Shape::thomas ? kThomasSpread : kMaternSpread, c.measure);
    c.placement.pattern = clusters;
    c.say("pattern {}: {:.6g} clusters per m^3, spread {:.6g} m (chosen)",
          pattern_name(c.placement.pattern), clusters.parents_m3, clusters.spread_m);
}

void choose_pattern(Choice& c) {
    const PlacementOptions& o = c.options;
    const std::string pattern = o.pattern.value_or("uniform");
    for (const Given& g : given_options(o))
        if (g.given && !g.patterns.empty() && g.patterns.find(pattern) == std::string_view::npos)
            refuse(fmt::format("{}: is for --pattern {}, not {}; drop it or change the pattern",
                               g.option, g.patterns, pattern));
    if (pattern == "lattice")
        return choose_lattice(c);
    choose_number(c);
    if (pattern == "thomas")
        choose_clusters(c, ClusterSettings::Shape::thomas);
    if (pattern == "matern")
        choose_clusters(c, ClusterSettings::Shape::matern);
    if (pattern == "joints") {
        JointsPattern joints;
        joints.n = o.joints.value_or(joints.n);
        joints.scatter_m = length_or("--scatter", o.scatter, kScatter, c.measure);
        c.placement.pattern = joints;
        c.say("pattern joints: {} planes, scatter {:.6g} m (chosen)", joints.n, joints.scatter_m);
    }
    if (pattern == "hard-core") {
        // No other length may be 0.
        const HardCorePattern apart{o.gap == "0" ? 0 : length_or("--gap", o.gap, kGap, c.measure)};
        c.placement.pattern = apart;
        c.say("pattern hard-core: gap {:.6g} m (chosen)", apart.gap_m);
    }
}

/// `BOTTOM:TOP`, shares.
HeightShare parse_height(const std::string& text) {
    const std::size_t colon = std::min(text.find(':'), text.size());
    const auto bottom = parse_number(std::string_view(text).substr(0, colon));
    const auto top = parse_number(std::string_view(text).substr(std::min(colon + 1, text.size())));
    if (!bottom || !top || !(*bottom >= 0 && *bottom <= 1 && *top >= 0 && *top <= 1) ||
        *bottom + *top == 0)
        refuse("--height: '" + printable(text) +
               "' must be the shares at the bottom and at the top, 0..1 and not both 0, as 0.2:1");
    return {*bottom, *top};
}

void choose_shares(Choice& c) {
    if (!c.options.height.empty()) {
        c.placement.height = parse_height(c.options.height);
        c.say("height: {:.6g} of the holes at the bottom, {:.6g} at the top (chosen)",
              c.placement.height->bottom, c.placement.height->top);
    }
    if (!c.options.where.empty()) {
        const auto grid = read_volume(c.options.where);
        const std::string name = base_name(c.options.where);
        c.placement.where = grid;
        c.sources.where = SourceFile{name, sha256_hex(read_file(c.options.where))};
        c.say("where {}: {} (chosen)", name,
              grid->getGridClass() == openvdb::GRID_LEVEL_SET
                  ? "inside alone"
                  : "its values are the share of holes");
    }
}

void add_pattern_options(PlacementOptions& o, CLI::App& verb) {
    const std::string group =
        "Where the holes of a law lie (lengths: 5cm, or 7% of the longest axis)";
    verb.add_option(
            "--pattern", o.pattern,
            "uniform; thomas or matern: in clusters, fading or round; joints: along planes; "
            "hard-core: apart; lattice [uniform]")
        ->check(CLI::IsMember({"uniform", "thomas", "matern", "joints", "hard-core", "lattice"}))
        ->group(group);
    verb.add_option("--clusters", o.clusters,
                    "Clusters per m^3 [20 in a cube as long as the longest axis]")
        ->check(CLI::Range(1e-12, 1e12))
        ->group(group);
    verb.add_option("--spread", o.spread,
                    "Of a cluster: thomas its standard deviation [7%], matern its radius [18%]")
        ->group(group);
    verb.add_option("--joints", o.joints, "Planes, in random directions, 1..1000 [3]")
        ->check(CLI::Range(1, 1000))
        ->group(group);
    verb.add_option("--scatter", o.scatter, "Standard deviation of the distance to a plane [1.5%]")
        ->group(group);
    verb.add_option("--gap", o.gap, "Of hard-core: least distance between two holes, or 0 [0.5%]")
        ->group(group);
    verb.add_option("--spacing", o.spacing,
                    "Of a lattice, in place of a number [that of the density, or 10%]")
        ->group(group);
    verb.add_option("--height", o.height,
                    "Share of the holes at the bottom and at the top of the solid: 0.2:1")
        ->group(group);
    verb.add_option("--where", o.where,
                    "Volume (.vdb): a level set that all centres lie in, or a fog volume whose "
                    "values 0..1 are the share of holes")
        ->group(group);
}

} // namespace

void PlacementOptions::add_options(CLI::App& verb) {
    const std::string group = "Placing a law";
    verb.add_option(
            "--scale", scale,
            "Length of one unit of the law: 0.4m, or 25% of the longest axis; needed unless the "
            "law is in metres")
        ->group(group);
    auto* by_count = verb.add_option("--count", count, "Exactly this many centres inside, 1..1e8")
                         ->check(CLI::Range(1.0, 1e8))
                         ->group(group);
    auto* by_porosity = verb.add_option("--porosity", porosity,
                                        "Removed volume / volume, 0..0.95, met within 0.005")
                            ->check(CLI::Range(0.0, 0.95))
                            ->group(group);
    auto* by_density =
        verb.add_option("--density", density, "Centres per m^3 [the law's own n_v]")->group(group);
    by_count->excludes(by_porosity)->excludes(by_density);
    by_porosity->excludes(by_density);
    verb.add_option("--seed", seed, "Which of the samples [0]")
        ->check(CLI::Range(0.0, 9.2e18))
        ->group(group);
    verb.add_flag("--empirical", empirical,
                  "Diameters from the law's table of what was measured, not from the fitted family")
        ->group(group);
    add_pattern_options(*this, verb);
}

std::optional<std::string> PlacementOptions::any() const {
    for (const Given& g : given_options(*this))
        if (g.given)
            return g.option;
    return std::nullopt;
}

LawHoles place_law(const std::filesystem::path& law_path, const PlacementOptions& options,
                   const Measure& measure,
                   const std::function<PlacedHoles(const Law&, const Placement&)>& place) {
    const LawFile file = read_law_file(law_path);
    Choice c{file, options, measure, base_name(law_path), {}, {}, {}};
    c.placement.seed = options.seed.value_or(0);
    const Law law = choose_law(c);
    choose_scale(c);
    choose_pattern(c);
    choose_shares(c);
    c.say("seed {}", c.placement.seed);
    LawHoles holes;
    holes.placed = place(law, c.placement);
    holes.node = holes_node(c.where, sha256_hex(read_file(law_path)), c.placement, c.sources);
    holes.comments = std::move(c.comments);
    return holes;
}

} // namespace taihu
