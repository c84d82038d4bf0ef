#include "stats/io/law_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <span>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"
#include "stats/io/json_detail.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

using nlohmann::json;

constexpr double kGreatest = std::numeric_limits<double>::max();
constexpr std::size_t kMostBytes = std::size_t{16} << 20;

constexpr std::array<std::string_view, 13> kRequired = {
    "taihu_law", "family",          "parameters", "intervals", "level",   "unit",  "mean_diameter",
    "n_v",       "detection_limit", "n_profiles", "area",      "ranking", "source"};
constexpr std::array<std::string_view, 1> kOptional = {"empirical"};

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what);
}

std::string list(std::initializer_list<double> values) {
    std::string text = "[";
    for (const double v : values)
        text += (text.size() > 1 ? ", " : "") + shortest(v);
    return text + "]";
}

std::string number_or_null(const std::optional<double>& value) {
    return value ? shortest(*value) : "null";
}

// The items of an array, each on its own line.
std::string lines(const std::vector<std::string>& items) {
    std::string text = "[";
    for (const std::string& item : items)
        text += (text.size() > 1 ? ",\n    " : "\n    ") + item;
    return text + (items.empty() ? "]" : "\n  ]");
}

std::string format(const LawFile& file) {
    const auto names = parameter_names(file.law.family());
    std::string parameters, intervals;
    for (std::size_t i = 0; i < names.size(); ++i)
        parameters +=
            (i > 0 ? ", " : "") + json_quoted(names[i]) + ": " + shortest(file.law.parameters()[i]);
    for (std::size_t i = 0; i < file.intervals.size(); ++i)
        intervals += (i > 0 ? ", " : "") + json_quoted(names[i]) + ": " +
                     list({file.intervals[i].lo, file.intervals[i].hi});
    std::string n_v = "null";
    if (file.n_v)
        n_v = "{\"estimate\": " + shortest(file.n_v->estimate) +
              ", \"lo\": " + shortest(file.n_v->lo) + ", \"hi\": " + shortest(file.n_v->hi) +
              ", \"extrapolated_share\": " + shortest(file.n_v->extrapolated_share) + "}";
    std::vector<std::string> ranking, empirical, source;
    for (const RankedFamily& r : file.ranking)
        ranking.push_back("{\"family\": " + json_quoted(family_name(r.family)) + ", \"aicc\": " +
                          shortest(r.aicc) + ", \"weight\": " + shortest(r.weight) + "}");
    const auto points =
        file.law.family() == Family::empirical ? file.law.points() : std::span(file.empirical);
    for (const CdfPoint& p : points)
        empirical.push_back(list({p.diameter, p.cdf}));
    for (const SourceFile& s : file.source)
        source.push_back("{\"name\": " + json_quoted(s.name) +
                         ", \"sha256\": " + json_quoted(s.sha256) + "}");

    std::string text = "{\n  \"taihu_law\": 1";
    const auto add = [&](const char* key, const std::string& value) {
        text += std::string(",\n  \"") + key + "\": " + value;
    };
    add("family", json_quoted(family_name(file.law.family())));
    add("parameters", "{" + parameters + "}");
    add("intervals", "{" + intervals + "}");
    add("level", number_or_null(file.level));
    add("unit", json_quoted(unit_name(file.unit)));
    add("mean_diameter", shortest(file.law.mean()));
    add("n_v", n_v);
    add("detection_limit", number_or_null(file.detection_limit));
    add("n_profiles", std::to_string(file.n_profiles));
    add("area", number_or_null(file.area));
    add("ranking", lines(ranking));
    if (!empirical.empty())
        add("empirical", lines(empirical));
    add("source", lines(source));
    return text + "\n}\n";
}

std::optional<double> optional_number(const json& object, const std::string& where,
                                      std::string_view key, double lo, double hi) {
    if (object.at(std::string(key)).is_null())
        return std::nullopt;
    return json_number(object, where, key, lo, hi);
}

// `object[key]` as an array of at most `most` items.
const json& array_at(const json& object, const std::string& where, const char* key,
                     std::size_t most) {
    const json& items = object.at(key);
    if (!items.is_array() || items.size() > most)
        refuse(where, std::string("'") + key + "' is " +
                          (items.is_array() ? std::to_string(items.size()) + " items"
                                            : std::string(items.type_name())) +
                          ", must be a list of at most " + std::to_string(most) + "; correct it");
    return items;
}

std::array<double, 2> pair_of_numbers(const json& value, const std::string& where) {
    if (!value.is_array() || value.size() != 2 || !value[0].is_number() || !value[1].is_number())
        refuse(where, "must be a list of two numbers; correct it");
    return {value[0].get<double>(), value[1].get<double>()};
}

Family family_at(const json& object, const std::string& where) {
    try {
        return family_from_name(json_text(object, where, "family"));
    } catch (const Error& e) {
        if (e.fault() == Fault::bad_input)
            throw;
        refuse(where, e.what());
    }
}

std::vector<CdfPoint> parse_points(const json& root, const std::string& where) {
    std::vector<CdfPoint> points;
    if (!root.contains("empirical"))
        return points;
    for (const json& item : array_at(root, where, "empirical", 100'000)) {
        const auto name = where + ": empirical[" + std::to_string(points.size()) + "]";
        const auto [diameter, share] = pair_of_numbers(item, name);
        points.push_back({diameter, share});
    }
    if (points.empty())
        refuse(where, "'empirical' is empty; leave it out");
    return points;
}

Law parse_law(const json& root, const std::string& where, const std::vector<CdfPoint>& points) {
    const Family family = family_at(root, where);
    const auto names = parameter_names(family);
    const json& object = root.at("parameters");
    const std::string inside = where + ": parameters";
    check_keys(object, inside, names);
    std::vector<double> parameters;
    for (const std::string_view name : names)
        parameters.push_back(json_number(object, inside, name, -kGreatest, kGreatest));
    if (family == Family::empirical && points.empty())
        refuse(where, "the family is empirical but 'empirical' is missing; add its points");
    try {
        if (!points.empty()) { // a table beside another law must be one, too
            const Law table = Law::empirical(points);
            if (family == Family::empirical)
                return table;
        }
        return Law(family, parameters);
    } catch (const Error& e) {
        refuse(where, e.what());
    }
}

std::vector<Interval> parse_intervals(const json& root, const std::string& where, const Law& law) {
    const json& object = root.at("intervals");
    const std::string inside = where + ": intervals";
    const auto names = parameter_names(law.family());
    if (object.is_object() && object.empty())
        return {};
    check_keys(object, inside, names);
    std::vector<Interval> intervals;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::string name(names[i]);
        const auto [lo, hi] = pair_of_numbers(object.at(name), inside + ": '" + name + "'");
        const double value = law.parameters()[i];
        if (!(lo <= value && value <= hi))
            refuse(inside, "'" + name + "' is " + list({lo, hi}) + ", which leaves out its value " +
                               shortest(value) + "; correct one of them");
        intervals.push_back({lo, hi});
    }
    return intervals;
}

std::optional<NumberDensity> parse_n_v(const json& root, const std::string& where) {
    static constexpr std::array<std::string_view, 4> kKeys = {"estimate", "lo", "hi",
                                                              "extrapolated_share"};
    const json& object = root.at("n_v");
    if (object.is_null())
        return std::nullopt;
    const std::string inside = where + ": n_v";
    check_keys(object, inside, kKeys);
    NumberDensity n_v;
    n_v.estimate = json_number(object, inside, "estimate", 0, kGreatest);
    n_v.lo = json_number(object, inside, "lo", 0, n_v.estimate);
    n_v.hi = json_number(object, inside, "hi", n_v.estimate, kGreatest);
    n_v.extrapolated_share = json_number(object, inside, "extrapolated_share", 0, 1);
    return n_v;
}

std::vector<RankedFamily> parse_ranking(const json& root, const std::string& where) {
    static constexpr std::array<std::string_view, 3> kKeys = {"family", "aicc", "weight"};
    std::vector<RankedFamily> ranking;
    for (const json& item : array_at(root, where, "ranking", 100)) {
        const auto inside = where + ": ranking[" + std::to_string(ranking.size()) + "]";
        check_keys(item, inside, kKeys);
        ranking.push_back({family_at(item, inside),
                           json_number(item, inside, "aicc", -kGreatest, kGreatest),
                           json_number(item, inside, "weight", 0, 1)});
    }
    return ranking;
}

std::vector<SourceFile> parse_source(const json& root, const std::string& where) {
    static constexpr std::array<std::string_view, 2> kKeys = {"name", "sha256"};
    std::vector<SourceFile> source;
    for (const json& item : array_at(root, where, "source", 10'000)) {
        const auto inside = where + ": source[" + std::to_string(source.size()) + "]";
        check_keys(item, inside, kKeys);
        SourceFile file{json_text(item, inside, "name"), json_text(item, inside, "sha256")};
        if (file.name.find_first_of("/\\") != std::string::npos)
            refuse(inside, "'name' is '" + printable(file.name) + "'; must be a name, no path");
        if (file.sha256.size() != 64 ||
            file.sha256.find_first_not_of("0123456789abcdef") != std::string::npos)
            refuse(inside, "'sha256' is '" + printable(file.sha256) +
                               "'; must be 64 hexadecimal digits in lower case");
        source.push_back(std::move(file));
    }
    return source;
}

LengthUnit parse_unit(const json& root, const std::string& where) {
    try {
        return unit_from_name(json_text(root, where, "unit"));
    } catch (const Error& e) {
        if (e.fault() == Fault::bad_input)
            throw;
        refuse(where, e.what());
    }
}

void check_version(const json& root, const std::string& where) {
    if (!root.is_object() || !root.contains("taihu_law"))
        refuse(where, "has no 'taihu_law'; give the JSON file of a law");
    const json& version = root.at("taihu_law");
    if (version != json(1))
        refuse(where, "'taihu_law' is " + printable(version.dump(-1, ' ', true)) +
                          ", this program reads version 1; update it or write the law again");
}

} // namespace

LawFile make_law_file(const LawRanking& ranking, const Measurements& measurements) {
    if (ranking.fits.empty() || ranking.weights.size() != ranking.fits.size())
        throw Error(Fault::bad_argument, "law file: the ranking has " +
                                             std::to_string(ranking.fits.size()) + " fits and " +
                                             std::to_string(ranking.weights.size()) +
                                             " weights; fit a law first");
    const Fit& fit = ranking.fits.front();
    LawFile file;
    file.law = fit.law;
    file.unit = measurements.sample.unit;
    file.intervals = fit.intervals;
    file.level = fit.level;
    file.n_v = fit.n_v;
    file.detection_limit = fit.detection_limit;
    file.n_profiles = fit.n_profiles;
    file.area = searched_area(measurements.sample);
    for (std::size_t i = 0; i < ranking.fits.size(); ++i)
        file.ranking.push_back({ranking.fits[i].law.family(), ranking.fits[i].aicc,
                                std::min(1.0, ranking.weights[i])});
    file.source = measurements.sources;
    return file;
}

std::string format_law_file(const LawFile& file) {
    std::string text = format(file);
    try { // one set of checks, the reader's: nan and inf are no JSON, the rest has ranges
        parse_law_file(text, "law");
    } catch (const Error& e) {
        throw Error(Fault::bad_argument, e.what());
    }
    return text;
}

LawFile parse_law_file(std::string_view text, const std::string& where) {
    const json root = parse_json(text, where, kMostBytes);
    check_version(root, where);
    check_keys(root, where, kRequired, kOptional);
    LawFile file;
    std::vector<CdfPoint> points = parse_points(root, where);
    file.law = parse_law(root, where, points);
    if (file.law.family() != Family::empirical)
        file.empirical = std::move(points);
    file.intervals = parse_intervals(root, where, file.law);
    file.unit = parse_unit(root, where);
    file.level = optional_number(root, where, "level", 0.5, 0.9999);
    file.n_v = parse_n_v(root, where);
    if (!file.level && (file.n_v || !file.intervals.empty()))
        refuse(where, "'level' is null although there are intervals; give it, as 0.95");
    const double mean = json_number(root, where, "mean_diameter", 0, kGreatest);
    if (!(std::abs(mean - file.law.mean()) <= 1e-6 * file.law.mean()))
        refuse(where, "'mean_diameter' is " + shortest(mean) + " but that of the law is " +
                          shortest(file.law.mean()) + "; correct one of them");
    file.detection_limit = optional_number(root, where, "detection_limit", 0, kGreatest);
    const double n = json_number(root, where, "n_profiles", 0, 1e9);
    if (n != std::floor(n))
        refuse(where, "'n_profiles' is " + shortest(n) + ", must be a whole number; correct it");
    file.n_profiles = static_cast<std::uint64_t>(n);
    file.area = optional_number(root, where, "area", std::numeric_limits<double>::min(), kGreatest);
    file.ranking = parse_ranking(root, where);
    file.source = parse_source(root, where);
    return file;
}

LawFile read_law_file(const std::filesystem::path& path) {
    return parse_law_file(read_file(path, kMostBytes), base_name(path));
}

} // namespace taihu
