// taihu fit: measured profiles as a law of hole diameters.
#include "stats/fit.h"

#include "stats/chi_squared.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/io/law_file.h"
#include "stats/io/measurements.h"
#include "stats/thesis.h"
#include "tools/console.h"
#include "tools/units.h"

namespace taihu {
namespace {

struct FitArgs {
    std::vector<std::filesystem::path> files;
    std::filesystem::path out;
    std::string method = "ml", unit, scale_bar;
    std::vector<std::string> masks;
    MeasurementSettings settings;
    FitSettings fit;
};

/// The tables of the thesis, from binned counts.
void run_thesis(const FitArgs& args, const Measurements& measurements, const Console& console) {
    if (!args.out.empty())
        throw Error(Fault::bad_argument,
                    "fit: --method thesis prints its tables and fits no law; drop "
                    "-o, or use --method ml");
    if (measurements.sample.bins.empty())
        throw Error(Fault::bad_input, args.files.front().string() +
                                          ": the thesis' method takes binned counts "
                                          "(diameter_lo,diameter_hi,count); bin the diameters");
    const ThesisInversion inversion = thesis_inversion(measurements.sample.bins);
    const std::vector<ThesisTest> tests = thesis_tests(inversion);
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
        console.say("holes per {}^3 by all of them: {:.4g}, standard deviation {:.4g}", per,
                    ranking.n_v->mean, ranking.n_v->sd);
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

void run(FitArgs& args, const Console& console) {
    if (!args.out.empty()) {
        if (args.out.extension() != ".json")
            throw Error(Fault::unsupported, args.out.string() + ": a law is a .json; name one");
        for (const auto& file : args.files)
            console.may_write(args.out, {file});
    }
    if (!args.unit.empty())
        args.settings.unit = unit_from_name(args.unit);
    if (!args.scale_bar.empty())
        args.settings.scale_bar_m = length_m("--scale-bar", args.scale_bar);
    for (const std::string& mask : args.masks)
        args.settings.masks.push_back(parse_mask(mask));
    const Measurements measurements = read_measurements(args.files, args.settings);
    for (const std::string& warning : measurements.warnings)
        console.say_text(warning);
    if (args.method == "thesis")
        return run_thesis(args, measurements, console);
    const LawRanking ranking = fit_laws(measurements.sample, kUsualFamilies, args.fit);
    const std::string law = format_law_file(make_law_file(ranking, measurements));
    tell(ranking, measurements.sample, console);
    if (!args.out.empty()) {
        write_file(args.out, law);
        console.say("{}: the law", args.out.string());
    }
    console.result(nlohmann::ordered_json::parse(law));
}

} // namespace

void add_fit(CLI::App& app, Console& console) {
    auto args = std::make_shared<FitArgs>();
    auto* verb =
        console.verb(app, "fit", "Fit the law of hole diameters to profiles measured on pictures",
                     "  taihu fit rock1.csv -o law.json\n"
                     "  taihu fit rock1.json rock2.json --scale-bar 0.5m -o law.json\n"
                     "  taihu fit segments.csv --area 1.2 --detection-limit 0.02 -o law.json\n"
                     "  taihu fit data/measurements/rock1.csv --method thesis");
    verb->add_option("files", args->files,
                     "Tables: diameter; diameter_lo,diameter_hi,count; or segments "
                     "image,label,x1,y1,x2,y2,unit_per_px; segments of labelme, VIA, ImageJ (.roi, "
                     "zip, results) or CVAT")
        ->required();
    verb->add_option("-o,--output", args->out, "Where to write the law (.json)");
    verb->add_option(
            "--method", args->method,
            "ml: maximum likelihood above the detection limit; thesis: the tables of the thesis")
        ->check(CLI::IsMember({"ml", "thesis"}))
        ->capture_default_str();
    verb->add_option("--unit", args->unit,
                     "Unit of the lengths: m, px or greatest [what the file says]");
    verb->add_option("--scale", args->settings.unit_per_px,
                     "Length of a pixel, for segments that have none [unit/px]");
    verb->add_option("--scale-bar", args->scale_bar,
                     "Length of what the segments labelled 'scale' were drawn along: 0.5m, 20cm");
    verb->add_option("--label", args->settings.label,
                     "Only segments with this label are holes [all but 'scale']");
    verb->add_option("--mask", args->masks,
                     "What was searched of a photo, as PNG, bright there: PHOTO=MASK.png, or "
                     "MASK.png for the only photo [all of it, where its size is known]");
    verb->add_option("--area", args->settings.area, "Area searched in all files together [unit^2]");
    verb->add_option("--detection-limit", args->settings.detection_limit,
                     "Nothing smaller was marked [unit; the smallest marked]");
    verb->add_option("--level", args->fit.level, "Of the intervals, 0.5..0.9999")
        ->check(CLI::Range(0.5, 0.9999))
        ->capture_default_str();
    verb->callback([args, &console] { console.with_threads([&] { run(*args, console); }); });
}

} // namespace taihu
