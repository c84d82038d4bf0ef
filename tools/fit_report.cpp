#include "tools/fit_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "stats/core/text.h"
#include "stats/number_detail.h"
#include "tools/fit_plots.h"

namespace taihu {
namespace {

constexpr const char* kStyle =
    "body{font:16px/1.5 system-ui,sans-serif;color:#222;background:#fff;max-width:46rem;"
    "margin:2rem auto;padding:0 1rem}"
    "h1{font-size:1.7rem;line-height:1.2}h2{font-size:1.2rem;margin-top:2.2rem}"
    "table{border-collapse:collapse;width:100%;font-size:.9rem}"
    "th,td{text-align:right;padding:.25rem .5rem;border-bottom:1px solid #ddd}"
    "th:first-child,td:first-child{text-align:left}"
    "figure{margin:1rem 0}figcaption{color:#555;font-size:.9rem}svg{width:100%;height:auto}"
    ".key{background:#f3f0e8;padding:.8rem 1.1rem;border-radius:.4rem}.key b{font-size:1.15rem}"
    ".small{color:#555;font-size:.85rem;overflow-wrap:anywhere}";

/// Foreign text in a page: no control bytes, no markup.
std::string html(std::string_view text) {
    std::string safe;
    for (const char c : printable(text, 400))
        switch (c) {
        case '&':
            safe += "&amp;";
            break;
        case '<':
            safe += "&lt;";
            break;
        case '>':
            safe += "&gt;";
            break;
        case '"':
            safe += "&quot;";
            break;
        default:
            safe += c;
        }
    return safe;
}

/// `290 (200–420)`: no more digits than a range so wide can have.
std::string between(double estimate, double lo, double hi) {
    return rounded(estimate, 2) + " (" + rounded(lo, 2) + "–" + rounded(hi, 2) + ")";
}

std::string between(const NumberDensity& n) {
    return between(n.estimate, n.lo, n.hi);
}

/// The number, and the word in the form that it asks for.
std::string counted(std::size_t n, const char* one) {
    return fmt::format("{} {}{}", n, one, n == 1 ? "" : "s");
}

std::string family_words(Family family) {
    switch (family) {
    case Family::exponential:
        return "the smaller, the more of them: there is no typical size";
    case Family::gamma:
    case Family::weibull:
        return "between the two: from many small ones to a typical size";
    case Family::lognormal:
        return "a typical size, few much smaller, some much larger";
    case Family::truncated_normal:
        return "a typical size, as many smaller as larger";
    case Family::uniform:
        return "every size between two limits is as frequent";
    case Family::constant:
        return "all equally large";
    case Family::empirical:
        break;
    }
    return "as the photo shows";
}

std::string key_box(const FitReport& r, const DisplayUnit& unit) {
    const Fit& fit = r.ranking.fits.front();
    std::string text = fmt::format(
        "<p class=\"key\"><b>Holes {} {} across on average.</b><br>Their law is {}: {}.",
        rounded(fit.law.mean() * unit.factor), unit.name, family_name(fit.law.family()),
        family_words(fit.law.family()));
    if (fit.n_v)
        text += "<br>There are about " + between(*fit.n_v) + " in a " + unit.cube + ".";
    else
        text += "<br>How many there are is not known, because the area searched is not.";
    if (const auto& holes = r.assessment.holes)
        text += "<br>Your rock has about <b>" + between(*holes) + " holes.</b>";
    return text + fmt::format("<br><span class=\"small\">The ranges are meant to hold the truth "
                              "in {} of 100 such measurements, if the law is right.</span></p>\n",
                              rounded(100 * fit.level, 4));
}

std::string photos_table(const FitReport& r, const DisplayUnit& unit) {
    const Measurements& m = r.measurements;
    const Fit& fit = r.ranking.fits.front();
    const auto length = [&](double l) { return rounded(l * unit.factor) + " " + unit.name; };
    std::string text = "<h2>What was marked</h2>\n<p>" + counted(fit.n_profiles, "hole section") +
                       ", the smallest " + length(smallest_profile(m.sample)) + ", the largest " +
                       length(greatest_profile(m.sample)) + ". Nothing below " +
                       length(fit.detection_limit) + " counts as marked" +
                       (m.sample.detection_limit ? "" : " (the smallest one marked)") + ".</p>\n";
    if (m.photos.empty())
        return text;
    text += "<table><tr><th>photo</th><th>holes</th><th>a pixel is</th><th>searched</th></tr>\n";
    for (std::size_t i = 0; i < m.photos.size(); ++i) {
        const Photo& p = m.photos[i];
        const auto n = std::count_if(m.segments.begin(), m.segments.end(),
                                     [&](const Segment& s) { return s.photo == i; });
        text += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", html(p.name),
                            n, length(p.unit_per_px),
                            p.window ? rounded(p.window->area()) + " " + unit.square : "unknown");
    }
    return text + "</table>\n";
}

std::string figure(const std::string& svg, const std::string& caption) {
    return "<figure>" + svg + "<figcaption>" + caption + "</figcaption></figure>\n";
}

std::string sizes(const FitReport& r, const DisplayUnit& unit) {
    return "<h2>Sizes</h2>\n" +
           figure(plot_sections(r.measurements.sample, r.ranking, unit, r.progress),
                  "What you measured (bars) are sections: a cut seldom goes through the middle of "
                  "a hole, so most look smaller than they are. The line is what holes of the "
                  "law would show; it should follow the bars.") +
           figure(plot_holes(r.ranking.fits.front(), r.band, r.photos, unit, r.progress),
                  "The holes themselves: the share of them that is at most so large. The band "
                  "shows how well this is known from so many sections; the thin line is what the "
                  "photos say with no law assumed. Left of the dashed line nothing was marked: "
                  "what stands there is the law's guess.");
}

std::string laws_table(const FitReport& r, const DisplayUnit& unit) {
    std::string text =
        "<h2>Which law</h2>\n<p>Several laws were tried. The weight says how much the sections "
        "speak for each; laws with similar weights cannot be told apart, and what they disagree "
        "in is not known.</p>\n<table><tr><th>law</th><th>weight</th><th>mean hole</th>"
        "<th>holes in a " +
        unit.cube + "</th><th>never seen</th></tr>\n";
    for (std::size_t i = 0; i < r.ranking.fits.size(); ++i) {
        const Fit& f = r.ranking.fits[i];
        text += fmt::format(
            "<tr><td>{}: {}</td><td>{:.2f}</td><td>{} {}</td><td>{}</td><td>{}</td></tr>\n",
            family_name(f.law.family()), family_words(f.law.family()), r.ranking.weights[i],
            rounded(f.law.mean() * unit.factor), unit.name, f.n_v ? between(*f.n_v) : "–",
            f.n_v ? rounded(100 * f.n_v->extrapolated_share, 2) + " %" : "–");
    }
    text += "</table>\n";
    if (const auto& all = r.ranking.n_v; all && r.ranking.fits.size() > 1)
        text += "<p>Taking no law for granted there are " + between(all->mean, all->lo, all->hi) +
                " holes in a " + unit.cube + ".</p>\n";
    return text;
}

std::string list(const std::string& title, const std::vector<std::string>& items) {
    if (items.empty())
        return "";
    std::string text = "<h2>" + title + "</h2>\n<ul>\n";
    for (const std::string& item : items)
        text += "<li>" + html(item) + "</li>\n";
    return text + "</ul>\n";
}

std::string places(const FitReport& r, const DisplayUnit& unit) {
    std::string text;
    for (const PhotoLocation& at : r.assessment.locations) {
        if (text.size() > 2'000'000) // a page that a browser still opens
            break;
        text += figure(plot_places(r.measurements, at, unit, r.progress),
                       html(r.measurements.photos[at.photo].name) + ": " +
                           counted(at.points.size(), "hole") +
                           ", each as large as it was marked; grey is what was searched.");
    }
    return text.empty() ? "" : "<h2>Where the holes lie</h2>\n" + text;
}

std::string record(const FitReport& r) {
    const Fit& fit = r.ranking.fits.front();
    std::string text = "<h2>For the record</h2>\n<p class=\"small\">";
    const auto names = parameter_names(fit.law.family());
    text += fmt::format("taihu " TAIHU_VERSION "; maximum likelihood of Wicksell sections above "
                        "the detection limit; {}",
                        family_name(fit.law.family()));
    for (std::size_t i = 0; i < names.size(); ++i)
        text += fmt::format(", {} {:.6g} ({:.6g}–{:.6g})", names[i], fit.law.parameters()[i],
                            fit.intervals[i].lo, fit.intervals[i].hi);
    text += fmt::format("; lengths in {}; log-likelihood {:.2f}, AICc {:.2f}.",
                        unit_name(r.measurements.sample.unit), fit.log_likelihood, fit.aicc);
    if (const auto& g = r.assessment.goodness)
        text +=
            fmt::format(" Tests by {} resamples: Anderson-Darling {:.3f} (p {:.3f}), "
                        "Cramér-von Mises {:.3f} (p {:.3f}), Kolmogorov-Smirnov {:.3f} (p "
                        "{:.3f}), chi-squared {:.2f} (p {:.3f}).",
                        g->n_resamples, g->anderson_darling.statistic, g->anderson_darling.p_value,
                        g->cramer_von_mises.statistic, g->cramer_von_mises.p_value,
                        g->kolmogorov_smirnov.statistic, g->kolmogorov_smirnov.p_value,
                        g->chi_squared.statistic, g->chi_squared.p_value);
    for (const SourceFile& s : r.measurements.sources)
        text += "<br>" + html(s.name) + ", SHA-256 " + s.sha256;
    return text + "</p>\n";
}

nlohmann::ordered_json test_json(const GoodnessTest& t) {
    return {{"statistic", t.statistic}, {"critical", t.critical}, {"p_value", t.p_value}};
}

} // namespace

std::string format_report_html(const FitReport& r) {
    const DisplayUnit unit = display_unit(r.measurements.sample);
    std::vector<std::string> notes = r.measurements.warnings;
    notes.insert(notes.end(), r.ranking.fits.front().notes.begin(),
                 r.ranking.fits.front().notes.end());
    notes.insert(notes.end(), r.ranking.notes.begin(), r.ranking.notes.end());
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
           "<meta name=\"viewport\" content=\"width=device-width\">"
           "<title>The holes of a rock</title><style>" +
           std::string(kStyle) + "</style></head><body>\n<h1>The holes of a rock</h1>\n" +
           key_box(r, unit) + list("What this says", r.assessment.findings) +
           photos_table(r, unit) + sizes(r, unit) + laws_table(r, unit) + places(r, unit) +
           list("What to do better next time", r.assessment.advice) +
           list("Notes of the program", notes) + record(r) + "</body></html>\n";
}

nlohmann::ordered_json assessment_json(const Assessment& a, const Measurements& measurements) {
    nlohmann::ordered_json json;
    json["goodness"] = nullptr;
    if (const auto& g = a.goodness)
        json["goodness"] = {{"n_profiles", g->n_profiles},
                            {"n_resamples", g->n_resamples},
                            {"anderson_darling", test_json(g->anderson_darling)},
                            {"cramer_von_mises", test_json(g->cramer_von_mises)},
                            {"kolmogorov_smirnov", test_json(g->kolmogorov_smirnov)},
                            {"chi_squared", test_json(g->chi_squared)}};
    json["locations"] = nlohmann::ordered_json::array();
    for (const PhotoLocation& at : a.locations) {
        nlohmann::ordered_json one = {{"photo", measurements.photos[at.photo].name},
                                      {"points", at.points.size()}};
        if (at.near)
            one["neighbours"] = {{"nearest_ratio", at.near->nearest_ratio},
                                 {"deviation", at.near->deviation},
                                 {"p_value", at.near->p_value}};
        if (at.cells)
            one["cells"] = {{"observed", at.cells->observed},
                            {"statistic", at.cells->statistic},
                            {"df", at.cells->df},
                            {"p_value", at.cells->p_value}};
        json["locations"].push_back(std::move(one));
    }
    const auto number = [&](const char* key, const std::optional<double>& value) {
        json[key] = value ? nlohmann::ordered_json(*value) : nullptr;
    };
    number("porosity", a.porosity);
    number("n_v_overlap", a.n_v_overlap);
    number("curvature", a.curvature);
    json["holes"] = nullptr;
    if (a.holes)
        json["holes"] = {{"estimate", a.holes->estimate}, {"lo", a.holes->lo}, {"hi", a.holes->hi}};
    number("holes_biting", a.holes_biting);
    json["findings"] = a.findings;
    json["advice"] = a.advice;
    return json;
}

} // namespace taihu
