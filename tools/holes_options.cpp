#include "tools/holes_options.h"

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "stats/io/law_file.h"
#include "vdb_ops/recipe.h"

namespace taihu {
namespace {

/// Which number decides how many holes there are; the law's own N_V when the user gave none.
Placement placement_of(const LawFile& law, const PlacementOptions& options, const Measure& measure,
                       const std::string& where, std::vector<std::string>& comments) {
    Placement p;
    p.seed = options.seed.value_or(0);
    if (options.scale.empty() && law.unit != LengthUnit::metre)
        throw Error(Fault::bad_argument,
                    where + ": the law's unit is '" + std::string(unit_name(law.unit)) +
                        "'; say how long one unit is, as --scale 0.4m or --scale 25%");
    p.scale_m = options.scale.empty() ? 1 : length_m("--scale", options.scale, measure);
    p.count = options.count;
    p.porosity = options.porosity;
    p.density_m3 = options.density;
    comments.push_back(fmt::format("law {}: {} (measured, {} profiles)", where,
                                   family_name(law.law.family()), law.n_profiles));
    if (!options.scale.empty())
        comments.push_back(fmt::format("scale {:.6g} m per law unit (chosen)", p.scale_m));
    if (options.count)
        comments.push_back(fmt::format("count {} (chosen)", *p.count));
    if (options.porosity)
        comments.push_back(fmt::format("porosity {:.6g} (chosen)", *p.porosity));
    if (options.density)
        comments.push_back(fmt::format("density {:.6g} per m^3 (chosen)", *p.density_m3));
    if (!p.count && !p.porosity && !p.density_m3) {
        if (!law.n_v)
            throw Error(Fault::bad_argument,
                        where +
                            ": the law has no n_v, because the area searched is unknown; give one "
                            "of --count, --porosity and --density");
        p.density_m3 = law.n_v->estimate / (p.scale_m * p.scale_m * p.scale_m);
        comments.push_back(
            fmt::format("density {:.6g} per m^3 (measured: the law's n_v)", *p.density_m3));
    }
    comments.push_back(fmt::format("seed {}", p.seed));
    return p;
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
}

LawHoles place_law(const std::filesystem::path& law_path, const PlacementOptions& options,
                   const Measure& measure,
                   const std::function<PlacedHoles(const Law&, const Placement&)>& place) {
    const LawFile law = read_law_file(law_path);
    LawHoles holes;
    const std::string name = base_name(law_path);
    const Placement placement = placement_of(law, options, measure, name, holes.comments);
    holes.placed = place(law.law, placement);
    holes.node = holes_node(name, sha256_hex(read_file(law_path)), placement);
    return holes;
}

} // namespace taihu
