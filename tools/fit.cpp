// taihu fit: measured profiles as a law of hole diameters.
#include "stats/fit.h"

#include <algorithm>
#include <tuple>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "stats/bootstrap.h"
#include "stats/chi_squared.h"
#include "stats/core/error.h"
#include "stats/core/file_set.h"
#include "stats/core/text.h"
#include "stats/expect.h"
#include "stats/io/law_file.h"
#include "stats/thesis.h"
#include "stats/unfold.h"
#include "tools/fit_plots.h"
#include "tools/fit_report.h"
#include "tools/solid_files.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

constexpr double kEmsShare = 0.1; // that EMS gives to each neighbouring class

struct FitArgs {
    std::vector<std::filesystem::path> files;
    std::filesystem::path out, report, solid, expect;
    std::string method = "ml", unfold = "em", counting = "centre", unit, scale_bar, expect_scale,
                limit;
    std::vector<std::string> masks, families;
    std::optional<double> volume, resolution, expect_density;
    MeasurementSettings settings;
    FitSettings fit;
    AssessSettings assess;
};

/// By name: the law does not depend on the order in which files were given.
std::vector<SourceFile> sorted(std::vector<SourceFile> sources) {
    std::sort(sources.begin(), sources.end(), [](const SourceFile& a, const SourceFile& b) {
        return std::tie(a.name, a.sha256) < std::tie(b.name, b.sha256);
    });
    return sources;
}

/// The tables of the thesis, from binned counts; its F3 is a law to draw from, if asked for.
void run_thesis(const FitArgs& args, const Measurements& measurements, const Console& console) {
    if (measurements.sample.bins.empty())
        throw Error(Fault::bad_input, args.files.front().string() +
                                          ": the thesis' method takes binned counts "
                                          "(diameter_lo,diameter_hi,count); bin the diameters");
    const ThesisInversion inversion = thesis_inversion(measurements.sample.bins);
    const std::vector<ThesisTest> tests = thesis_tests(inversion);
    if (!args.out.empty()) {
        LawFile file;
        file.law = empirical_law(inversion);
        file.unit = measurements.sample.unit;
        file.n_profiles = n_profiles(measurements.sample);
        file.source = sorted(measurements.sources);
        write_file(args.out, format_law_file(file));
        console.say("{}: the thesis' F3 as a law to draw from", args.out.string());
    }
    if (!console.json) {
        fmt::print("{}", format_thesis_tables(inversion, tests));
        return;
    }
    nlohmann::ordered_json json = {
        {"d", inversion.centers},       {"counts", inversion.counts},
        {"f2", inversion.f2},           {"f3", inversion.f3},
        {"density", inversion.density}, {"tests", nlohmann::ordered_json::array()}};
    for (const ThesisTest& t : tests)
        json["tests"].push_back({{"law", t.law},
                                 {"chi_squared", t.chi_squared},
                                 {"df", t.df},
                                 {"critical", t.critical},
                                 {"rejected", t.rejected}});
    console.result(json);
}

/// A small sample has a fit, but no chi-squared test.
std::string chi_squared_line(const Sample& sample, const Fit& fit) {
    try {
        const ChiSquaredTest chi =
            chi_squared_test(sample, fit.law, static_cast<int>(fit.intervals.size()));
        return fmt::format("chi-squared on the profiles: {:.2f}, df {}, p {:.2f}", chi.statistic,
                           chi.df, chi.p_value);
    } catch (const Error& e) {
        return e.what();
    }
}

/// `rate 5.539 per m (95 % interval 4.318..6.988)` for each parameter.
std::string parameters_line(const Fit& fit, const std::string& per) {
    std::string line;
    const auto names = parameter_names(fit.law.family());
    for (std::size_t i = 0; i < names.size(); ++i)
        line +=
            fmt::format("{}{} {:.4g}{} ({:.0f} % interval {:.4g}..{:.4g})", i > 0 ? ", " : "",
                        names[i], fit.law.parameters()[i], names[i] == "rate" ? " per " + per : "",
                        100 * fit.level, fit.intervals[i].lo, fit.intervals[i].hi);
    return line;
}

/// How the families compare, and what their choice does to the number of holes.
void tell_ranking(const LawRanking& ranking, const std::string& per, const Console& console) {
    std::string line;
    for (std::size_t i = 0; i < ranking.fits.size(); ++i)
        line += fmt::format("{}{} {:.2f}", i > 0 ? ", " : "",
                            family_name(ranking.fits[i].law.family()), ranking.weights[i]);
    if (ranking.fits.size() > 1)
        console.say("weights of the laws (Akaike): {}", line);
    if (ranking.fits.size() > 1 && ranking.n_v)
        console.say("holes per {}^3 if no law is taken for granted: {:.4g} ({:.4g}..{:.4g})", per,
                    ranking.n_v->mean, ranking.n_v->lo, ranking.n_v->hi);
    for (const std::string& note : ranking.notes)
        console.say_text(note);
}

void tell(const LawRanking& ranking, const Sample& sample, const Console& console) {
    const Fit& fit = ranking.fits.front();
    const std::string unit(unit_name(sample.unit));
    const std::string per = unit == "greatest" ? "greatest diameter" : unit;
    console.say("{}: {}, mean diameter {:.4g}", family_name(fit.law.family()),
                parameters_line(fit, per), fit.law.mean());
    console.say("{} profiles, detection limit {:.4g}, log-likelihood {:.2f}, AICc {:.1f}",
                fit.n_profiles, fit.detection_limit, fit.log_likelihood, fit.aicc);
    console.say_text(chi_squared_line(sample, fit));
    if (fit.n_v)
        console.say(
            "holes per {}^3: {:.4g} ({:.4g}..{:.4g}), {:.0f} % of them below the detection limit",
            per, fit.n_v->estimate, fit.n_v->lo, fit.n_v->hi, 100 * fit.n_v->extrapolated_share);
    else
        console.say("holes per volume: unknown, because the area searched is (--area)");
    for (const std::string& note : fit.notes)
        console.say_text(note);
    tell_ranking(ranking, per, console);
}

/// `PHOTO=MASK.png`, or `MASK.png` for the only photo.
PhotoMask parse_mask(const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos)
        return {"", text};
    return {text.substr(0, equals), text.substr(equals + 1)};
}

/// People think of a bar in centimetres; a bare number would be taken for metres.
double bar_length_m(const std::string& text) {
    if (parse_number(text))
        throw Error(Fault::bad_argument, "--scale-bar: '" + printable(text) +
                                             "' has no unit; write " + text + "cm or " + text +
                                             "m");
    return length_m("--scale-bar", text);
}

Measurements read(FitArgs& args) {
    if (!args.unit.empty())
        args.settings.unit = unit_from_name(args.unit);
    if (!args.scale_bar.empty())
        args.settings.scale_bar_m = bar_length_m(args.scale_bar);
    for (const std::string& mask : args.masks)
        args.settings.masks.push_back(parse_mask(mask));
    if (args.counting == "whole")
        args.settings.counting = Counting::whole;
    // A number is in the unit of the lengths; a length with a unit needs them to be metres.
    const auto plain = parse_number(args.limit);
    if (!args.limit.empty())
        args.settings.detection_limit = plain ? *plain : length_m("--detection-limit", args.limit);
    Measurements measurements = read_measurements(args.files, args.settings);
    if (!args.limit.empty() && !plain && measurements.sample.unit != LengthUnit::metre)
        throw Error(Fault::bad_argument, "--detection-limit: the lengths are in '" +
                                             std::string(unit_name(measurements.sample.unit)) +
                                             "'; give a number in that unit, or --scale-bar");
    return measurements;
}

/// What lengths were rounded to: as said, or the coarsest pixel of the photos.
std::optional<double> resolution_of(const FitArgs& args, const Measurements& measurements) {
    std::optional<double> coarsest;
    for (const Photo& photo : measurements.photos)
        coarsest = std::max(coarsest.value_or(0), photo.unit_per_px);
    return args.resolution ? args.resolution : coarsest;
}

std::vector<Family> families_of(const FitArgs& args) {
    std::vector<Family> families;
    for (const std::string& name : args.families)
        families.push_back(family_from_name(name));
    if (families.empty())
        families.assign(kUsualFamilies.begin(), kUsualFamilies.end());
    return families;
}

/// The rock whose holes are to be counted, in the unit of the sample.
std::optional<SolidSize> solid_of(const FitArgs& args, LengthUnit unit, const Console& console) {
    if (!args.volume && args.solid.empty())
        return std::nullopt;
    if (unit != LengthUnit::metre)
        throw Error(Fault::bad_argument,
                    std::string(args.volume ? "--volume" : "--in") + ": the lengths are in '" +
                        std::string(unit_name(unit)) + "', a rock is in metres; give --scale-bar");
    if (args.volume)
        return SolidSize{*args.volume, 0};
    SolidOptions options;
    options.path = args.solid;
    const Solid solid = read_solid(options, console);
    const TriMesh surface = extract_uniform(*solid.grid, console.progress);
    return SolidSize{volume_m3(*solid.grid),
                     certify(surface, {.self_intersections = false}).area_m2};
}

/// F3 above the limit with no family assumed; nothing, and why, where the sample is too poor.
std::optional<Law> unfolded(const FitArgs& args, const Sample& sample, const Console& console) {
    try {
        if (args.unfold == "isotonic")
            return unfold_isotonic(sample);
        if (args.unfold == "saltykov")
            return schwartz_saltykov(sample).law();
        return unfold_em(sample, {.smoothing = args.unfold == "ems" ? kEmsShare : 0}).law();
    } catch (const Error& e) {
        if (e.fault() == Fault::bad_argument)
            throw;
        console.say("no table of the photos alone: {}", e.what());
        return std::nullopt;
    }
}

/// 60 diameters up to where F3 has almost ended, and past what was marked.
std::vector<double> band_diameters(const Law& law, const Sample& sample) {
    const double end = std::max(law.quantile(0.995), greatest_profile(sample));
    std::vector<double> diameters;
    for (int i = 0; i <= 60; ++i)
        diameters.push_back(end * i / 60);
    return diameters;
}

std::string format_report(const FitArgs& args, const Measurements& measurements,
                          const LawRanking& ranking, const Assessment& assessment,
                          const std::optional<Law>& photos, const Console& console) {
    if (args.report.extension() == ".json")
        return assessment_json(assessment, measurements).dump(2) + "\n";
    report_stage(console.progress, "drawing the report");
    const Law& law = ranking.fits.front().law;
    const Band band = f3_band(measurements.sample, law, band_diameters(law, measurements.sample),
                              {.n_resamples = args.assess.n_resamples,
                               .level = args.fit.level,
                               .seed = args.assess.seed,
                               .resolution = args.fit.resolution},
                              console.progress);
    return format_report_html({measurements, ranking, assessment, band, photos, console.progress});
}

/// Whether the sample obeys the law of a file. Returns the keys of the JSON result.
nlohmann::ordered_json judge(const FitArgs& args, const LawFile& asked,
                             const Measurements& measurements, const Console& console) {
    const Sample& sample = measurements.sample;
    double scale = 1;
    if (!args.expect_scale.empty()) {
        if (sample.unit != LengthUnit::metre)
            throw Error(Fault::bad_argument, "--expect-scale: the profiles are not in metres; "
                                             "give --scale-bar or --unit m");
        scale = length_m("--expect-scale", args.expect_scale);
    } else if (asked.unit != sample.unit) {
        throw Error(Fault::bad_argument,
                    args.expect.string() + ": its unit is '" + std::string(unit_name(asked.unit)) +
                        "', the profiles are in '" + std::string(unit_name(sample.unit)) +
                        "'; say the length of one unit, as --expect-scale 0.4m");
    }
    std::optional<double> n_v = args.expect_density;
    if (!n_v && asked.n_v)
        n_v = asked.n_v->estimate / (scale * scale * scale);
    const Expectation e = expect_law(sample, scaled(asked.law, scale), n_v, measurements.shared,
                                     {args.assess.n_resamples, args.assess.seed}, console.progress);
    const GoodnessTest& sizes = e.sizes.anderson_darling;
    console.say("sizes against {}: Anderson-Darling {:.3g}, p {:.3f}", args.expect.string(),
                sizes.statistic, sizes.p_value);
    nlohmann::ordered_json json = {{"obeys", e.obeys}, {"sizes_p", sizes.p_value}};
    if (e.number) {
        console.say("number of profiles: {} found, {:.1f} expected, p {:.3f}", e.number->found,
                    e.number->expected, e.number->p_value);
        json["number"] = {{"found", e.number->found},
                          {"expected", e.number->expected},
                          {"p_value", e.number->p_value}};
    } else {
        console.say_text("number of profiles: not judged; it takes the area searched, and the "
                         "law's n_v or --expect-density");
    }
    if (e.number && e.number->shared > 0.3)
        console.say_text("many holes were cut by several planes: a no to their sizes is less sure; "
                         "cut with fewer planes");
    console.say("the profiles {} the law asked for (together the tests reject one true law in 20)",
                e.obeys ? "obey" : "do not obey");
    if (!e.obeys && measurements.shared)
        console.say_text("of a carved rock: were bubbles filled (carve --bubbles keep), and did "
                         "section know the --holes and the --base");
    return json;
}

void check_outputs(const FitArgs& args, const Console& console) {
    if (!args.out.empty() && args.out.extension() != ".json")
        throw Error(Fault::unsupported, args.out.string() + ": a law is a .json; name one");
    if (!args.report.empty() && args.report.extension() != ".html" &&
        args.report.extension() != ".json")
        throw Error(Fault::unsupported,
                    args.report.string() + ": a report is a .html or a .json; name one");
    if (args.method == "thesis" && !(args.report.empty() && args.expect.empty()))
        throw Error(Fault::bad_argument,
                    "fit: --report and --expect are for --method ml; drop them");
    for (const auto& out : {args.out, args.report})
        for (const auto& file : args.files)
            if (!out.empty())
                console.may_write(out,
                                  {file, args.expect, out == args.out ? args.report : args.out});
}

void run(FitArgs& args, const Console& console) {
    check_outputs(args, console);
    std::optional<LawFile> asked;
    if (!args.expect.empty())
        asked = read_law_file(args.expect);
    const Measurements measurements = read(args);
    for (const std::string& warning : measurements.warnings)
        console.say_text(warning);
    if (args.method == "thesis")
        return run_thesis(args, measurements, console);
    const Sample& sample = measurements.sample;
    args.fit.resolution = args.assess.resolution = resolution_of(args, measurements);
    args.assess.solid = solid_of(args, sample.unit, console);
    const LawRanking ranking = fit_laws(sample, families_of(args), args.fit);
    const Assessment assessment =
        assess(ranking.fits.front(), measurements, args.assess, console.progress);
    const std::optional<Law> photos = unfolded(args, sample, console);
    LawFile file = make_law_file(ranking, measurements);
    if (photos)
        file.empirical.assign(photos->points().begin(), photos->points().end());
    file.source = sorted(file.source);
    const std::string law = format_law_file(file);
    tell(ranking, sample, console);
    for (const std::string& finding : assessment.findings)
        console.say_text(finding);
    OutputFiles outputs;
    if (!args.report.empty())
        outputs.add(args.report,
                    format_report(args, measurements, ranking, assessment, photos, console));
    outputs.add(args.out, law);
    check_cancelled(console.progress);
    outputs.publish();
    if (!args.report.empty())
        console.say("{}: the report", args.report.string());
    if (!args.out.empty())
        console.say("{}: the law", args.out.string());
    auto json = nlohmann::ordered_json::parse(law);
    if (!asked)
        return console.result(json);
    auto verdict = judge(args, *asked, measurements, console);
    const bool obeys = verdict["obeys"];
    verdict["law"] = std::move(json);
    console.result(verdict);
    if (!obeys)
        throw CLI::RuntimeError(kSaysNo);
}

void add_photo_options(CLI::App& verb, FitArgs& args) {
    const auto add = [&](const char* name, auto& value, const char* what) {
        return verb.add_option(name, value, what)->group("What was measured");
    };
    add("--unit", args.unit, "Unit of the lengths: m, px or greatest [what the file says]");
    add("--scale", args.settings.unit_per_px,
        "Length of a pixel, for segments that have none [unit/px]");
    add("--scale-bar", args.scale_bar,
        "Length of what the segments labelled 'scale' were drawn along: 0.5m, 20cm");
    add("--label", args.settings.label,
        "Only segments with this label are holes [all but 'scale']");
    add("--mask", args.masks,
        "What was searched of a photo, as PNG, bright there: rock-mask.png for rock.jpg, any name "
        "for the only photo, or PHOTO=MASK.png [all of it, where its size is known]");
    add("--area", args.settings.area, "Area searched in all files together [unit^2]");
    add("--area-factor", args.settings.area_factor,
        "Surface / its image, where the camera looked at a slant: 1 / cos of the angle [1]");
    add("--counting", args.counting,
        "Holes at the edge: centre (marked to their end if their middle is inside) or whole (only "
        "those wholly inside)")
        ->check(CLI::IsMember({"centre", "whole"}))
        ->capture_default_str();
    add("--detection-limit", args.limit,
        "Nothing smaller was marked: 8mm, or a number in the unit [the smallest marked]");
    add("--resolution", args.resolution,
        "Lengths are rounded to this [unit; a pixel of the photo]");
}

void add_fit_options(CLI::App& verb, FitArgs& args) {
    const auto add = [&](const char* name, auto& value, const char* what) {
        return verb.add_option(name, value, what)->group("How it is fitted");
    };
    add("--method", args.method,
        "ml: maximum likelihood above the detection limit; thesis: the tables of the thesis")
        ->check(CLI::IsMember({"ml", "thesis"}))
        ->capture_default_str();
    add("--family", args.families,
        "Laws to try: exponential, gamma, weibull, lognormal, truncated_normal, uniform, constant "
        "[exponential,gamma,weibull,lognormal,constant]")
        ->delimiter(',');
    add("--unfold", args.unfold,
        "Table of the photos alone, beside the law: em, ems (smoothed), isotonic or saltykov")
        ->check(CLI::IsMember({"em", "ems", "isotonic", "saltykov"}))
        ->capture_default_str();
    add("--level", args.fit.level, "Of the intervals, 0.5..0.9999")
        ->check(CLI::Range(0.5, 0.9999))
        ->capture_default_str();
    add("--resamples", args.assess.n_resamples, "Drawn samples behind tests and bands, 19..100000")
        ->check(CLI::Range(19, 100'000))
        ->capture_default_str();
    add("--seed", args.assess.seed, "Of the drawn samples")->capture_default_str();
}

void add_count_options(CLI::App& verb, FitArgs& args) {
    const auto add = [&](const char* name, auto& value, const char* what) {
        return verb.add_option(name, value, what)->group("What it is for");
    };
    auto* solid = add("--in", args.solid, "Count the holes of this rock (.vdb or a mesh, metres)");
    add("--volume", args.volume, "or of a rock of this volume [m^3]")->excludes(solid);
    auto* expect =
        add("--expect", args.expect, "Say whether the profiles obey this law (exit 3 if not)");
    add("--expect-scale", args.expect_scale, "Length of one unit of that law [its own unit]")
        ->needs(expect);
    add("--expect-density", args.expect_density, "Its holes per unit^3 [the law's n_v]")
        ->needs(expect);
}

} // namespace

void add_fit(CLI::App& app, Console& console) {
    auto args = std::make_shared<FitArgs>();
    auto* verb =
        console.verb(app, "fit", "Fit the law of hole diameters to profiles measured on pictures",
                     "  taihu fit rock1.csv -o law.json\n"
                     "  taihu fit photo.json --scale-bar 0.5m --in rock.obj --report report.html\n"
                     "  taihu fit a.json b.json --mask a.jpg=a.png --scale-bar 20cm -o law.json\n"
                     "  taihu fit profiles.csv --expect law.json\n"
                     "  taihu fit data/measurements/rock1.csv --method thesis");
    verb->add_option("files", args->files,
                     "Tables: diameter; diameter_lo,diameter_hi,count; or segments "
                     "image,label,x1,y1,x2,y2,unit_per_px; segments of labelme, VIA, ImageJ (.roi, "
                     "zip, results) or CVAT")
        ->required();
    verb->add_option("-o,--output", args->out, "Where to write the law (.json)");
    verb->add_option("--report", args->report,
                     "Where to write what it means: a page (.html), or its figures (.json)");
    add_photo_options(*verb, *args);
    add_fit_options(*verb, *args);
    add_count_options(*verb, *args);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
