// taihu section: a solid cut by planes, its holes as profiles.
#include "vdb_ops/section.h"

#include "stats/core/file.h"
#include "stats/io/holes_file.h"
#include "tools/solid_files.h"

namespace taihu {
namespace {

struct SectionArgs {
    SolidOptions solid;
    std::filesystem::path base, holes, out;
    std::vector<double> direction;
    bool major = false;
    SectionSettings settings;
};

void tell(const Section& cut, const SectionArgs& args, const Console& console) {
    const std::string out = args.out.string();
    const auto n_clipped = std::count_if(cut.profiles.begin(), cut.profiles.end(),
                                         [](const Profile& p) { return p.clipped; });
    console.result({{"file", out},
                    {"planes", cut.planes.size()},
                    {"profiles", cut.profiles.size()},
                    {"area_m2", cut.area_m2},
                    {"resolution_m", cut.resolution_m},
                    {"small", cut.n_small},
                    {"clipped", n_clipped}});
    console.say("{}: {} profiles on {} planes, {:.4g} m^2", out, cut.profiles.size(),
                cut.planes.size(), cut.area_m2);
    if (!args.holes.empty())
        return;
    console.say("{} regions below {:.4g} m left out; fit with --detection-limit {:.4g}",
                cut.n_small, cut.resolution_m, cut.resolution_m);
    if (n_clipped > 0)
        console.say("{} profiles are open to the air: larger than they look", n_clipped);
}

void run(SectionArgs args, const Console& console) {
    console.may_write(args.out);
    if (!args.direction.empty())
        args.settings.direction = {args.direction[0], args.direction[1], args.direction[2]};
    const Solid solid = read_solid(args.solid, console);
    SectionKnown known;
    Solid base;
    if (!args.base.empty()) {
        SolidOptions options = args.solid;
        options.path = args.base;
        base = read_solid(options, console);
        known.base = base.grid.get();
    }
    std::vector<Sphere> holes;
    if (!args.holes.empty()) {
        holes = read_holes(args.holes);
        known.holes = holes;
    }
    const Section cut = section(*solid.grid, known, args.settings, console.progress);
    write_file(args.out, format_profiles(cut, args.major));
    tell(cut, args, console);
}

} // namespace

void add_section(CLI::App& app, Console& console) {
    auto args = std::make_shared<SectionArgs>();
    auto* verb = console.verb(
        app, "section", "Cut a solid by planes and measure its holes",
        "  taihu section rock.vdb --planes 20 -o profiles.csv\n"
        "  taihu section rock.vdb --holes holes.csv --base base.vdb -o profiles.csv\n"
        "  taihu section rock.vdb --base base.vdb --direction 0,1,0 --planes 5 -o profiles.csv");
    verb->add_option("solid", args->solid.path, "Solid with holes (.vdb or a mesh)")->required();
    verb->add_option("-o,--output", args->out,
                     "Table to write, which fit reads: plane,u_m,v_m,diameter_m (.csv)")
        ->required();
    verb->add_option("--planes", args->settings.n_planes, "How many, 1..10000")
        ->check(CLI::Range(1, 10'000))
        ->capture_default_str();
    verb->add_option("--direction", args->direction,
                     "Normal X,Y,Z of parallel planes [random planes]")
        ->delimiter(',')
        ->expected(3);
    verb->add_option("--seed", args->settings.seed, "Of the planes")->capture_default_str();
    auto* holes = verb->add_option("--holes", args->holes,
                                   "The holes there are (.csv): exact circles, hidden ones too");
    verb->add_option("--base", args->base, "The solid before it was carved [the filled outline]");
    verb->add_flag("--major", args->major, "Diameters are major axes, not those of equal area")
        ->excludes(holes);
    args->solid.add_voxel_options(*verb);
    verb->callback([args, &console] { run(*args, console); });
}

} // namespace taihu
