#include "stats/io/law_file.h"

#include <cmath>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

LawFile full() {
    const double shape_scale[] = {1.257, 0.25};
    LawFile file;
    file.law = Law(Family::weibull, shape_scale);
    file.unit = LengthUnit::greatest;
    file.intervals = {{1.0, 1.5}, {0.2, 1.0 / 3}};
    file.level = 0.95;
    file.n_v = NumberDensity{31.7, 20.4, 48.3, 0.42};
    file.detection_limit = 0.1;
    file.n_profiles = 46;
    file.area = 10;
    file.ranking = {{Family::weibull, 172.8, 0.7}, {Family::exponential, 174.2, 0.3}};
    file.empirical = {{0, 0}, {0.25, 0.7}, {1, 1}};
    file.source = {{"rock \"1\".csv", std::string(64, 'a')}};
    return file;
}

TEST(LawFile, ReadsBackTheSame) {
    EXPECT_EQ(parse_law_file(format_law_file(full()), "law.json"), full());
    LawFile bare; // a law that was thought of
    bare.law = Law::exponential(7);
    EXPECT_EQ(parse_law_file(format_law_file(bare), "law.json"), bare);
    LawFile table;
    table.law = Law::empirical({{0, 0}, {0.5, 0.5}, {2, 1}});
    EXPECT_EQ(parse_law_file(format_law_file(table), "law.json"), table);
    const Scratch scratch;
    write_file(scratch / "law.json", format_law_file(full()));
    EXPECT_EQ(read_law_file(scratch / "law.json"), full());
}

TEST(LawFile, HasTheDocumentedForm) {
    LawFile file;
    file.law = Law::exponential(5);
    file.intervals = {{4, 6.5}};
    file.level = 0.95;
    file.source = {{"a.csv", std::string(64, '0')}};
    EXPECT_EQ(format_law_file(file), "{\n"
                                     "  \"taihu_law\": 1,\n"
                                     "  \"family\": \"exponential\",\n"
                                     "  \"parameters\": {\"rate\": 5},\n"
                                     "  \"intervals\": {\"rate\": [4, 6.5]},\n"
                                     "  \"level\": 0.95,\n"
                                     "  \"unit\": \"m\",\n"
                                     "  \"mean_diameter\": 0.2,\n"
                                     "  \"n_v\": null,\n"
                                     "  \"detection_limit\": null,\n"
                                     "  \"n_profiles\": 0,\n"
                                     "  \"area\": null,\n"
                                     "  \"ranking\": [],\n"
                                     "  \"source\": [\n"
                                     "    {\"name\": \"a.csv\", \"sha256\": \"" +
                                         std::string(64, '0') + "\"}\n  ]\n}\n");
}

std::set<std::string> keys(const json& object) {
    std::set<std::string> names;
    for (const auto& [name, value] : object.items())
        names.insert(name);
    return names;
}

// An object against the part of the schema that describes it: all that is required is there, all
// that is there is described, and so on inwards.
void expect_described(const json& value, const json& schema, const std::string& where) {
    if (value.is_object() && schema.contains("properties")) {
        EXPECT_EQ(schema["additionalProperties"], false) << where;
        for (const json& name : schema["required"])
            EXPECT_TRUE(value.contains(name.get<std::string>())) << where << " " << name;
        for (const auto& [name, item] : value.items()) {
            ASSERT_TRUE(schema["properties"].contains(name)) << where << " " << name;
            expect_described(item, schema["properties"][name], where + "." + name);
        }
    }
    if (value.is_array() && schema.contains("items") && schema["items"].is_object())
        for (const json& item : value)
            expect_described(item, schema["items"], where + "[]");
}

TEST(LawFile, IsWhatItsSchemaSays) {
    const json schema = json::parse(read_file(TAIHU_DATA "/schema/law.schema.json"));
    expect_described(json::parse(format_law_file(full())), schema, "law");

    std::set<std::string> required;
    for (const json& name : schema["required"])
        required.insert(name);
    LawFile bare;
    EXPECT_EQ(keys(json::parse(format_law_file(bare))), required);
    required.insert("empirical");
    EXPECT_EQ(keys(schema["properties"]), required);
    // The reader demands what the schema does.
    for (const json& name : schema["required"]) {
        json without = json::parse(format_law_file(bare));
        without.erase(name.get<std::string>());
        EXPECT_THROW(parse_law_file(without.dump(), "law.json"), Error) << name;
    }
    for (const json& name : schema["$defs"]["family"]["enum"])
        EXPECT_EQ(family_name(family_from_name(name.get<std::string>())), name);
    EXPECT_EQ(schema["$defs"]["family"]["enum"].size(), 8u);
    for (const json& name : schema["properties"]["unit"]["enum"])
        EXPECT_EQ(unit_name(unit_from_name(name.get<std::string>())), name);
}

// The message when `key` of a good file is replaced.
std::string refusal(const std::string& pointer, const json& value) {
    json root = json::parse(format_law_file(full()));
    root[json::json_pointer(pointer)] = value;
    try {
        parse_law_file(root.dump(), "law.json");
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        return e.what();
    }
    return "accepted";
}

TEST(LawFile, SaysWhatIsWrong) {
    EXPECT_EQ(refusal("/level", 0.95), "accepted");
    EXPECT_THAT(refusal("/taihu_law", 2),
                HasSubstr("'taihu_law' is 2, this program reads version 1"));
    EXPECT_THAT(refusal("/taihu_law", "1"), HasSubstr("reads version 1"));
    EXPECT_THAT(refusal("/n_w", 2), HasSubstr("law.json: unknown key 'n_w'; did you mean 'n_v'?"));
    EXPECT_THAT(refusal("/family", "weibul"), HasSubstr("did you mean 'weibull'?"));
    EXPECT_THAT(refusal("/family", 3), HasSubstr("'family' is number, must be a string"));
    EXPECT_THAT(refusal("/family", "gamma"), HasSubstr("'mean_diameter' is"));
    EXPECT_THAT(refusal("/family", "exponential"),
                HasSubstr("law.json: parameters: unknown key 's"));
    EXPECT_THAT(refusal("/parameters/shape", -1),
                HasSubstr("weibull law: shape is -1; must be in"));
    EXPECT_THAT(refusal("/parameters/shape", "2"), HasSubstr("'shape' is string"));
    EXPECT_THAT(refusal("/intervals/shape", {2, 3}),
                HasSubstr("'shape' is [2, 3], which leaves out"));
    EXPECT_THAT(refusal("/intervals/shape", {2}), HasSubstr("must be a list of two numbers"));
    EXPECT_THAT(refusal("/level", 95), HasSubstr("'level' is 95, must be in 0.5..0.9999"));
    EXPECT_THAT(refusal("/level", nullptr), HasSubstr("'level' is null although"));
    EXPECT_THAT(refusal("/unit", "cm"), HasSubstr("'cm' is none; use m, px or greatest"));
    EXPECT_THAT(refusal("/mean_diameter", 0.3), HasSubstr("but that of the law is 0.23"));
    EXPECT_THAT(refusal("/n_v/lo", 40), HasSubstr("law.json: n_v: 'lo' is 40, must be in 0..31.7"));
    EXPECT_THAT(refusal("/n_v/extrapolated_share", 1.5), HasSubstr("must be in 0..1"));
    EXPECT_THAT(refusal("/n_profiles", 1.5), HasSubstr("must be a whole number"));
    EXPECT_THAT(refusal("/n_profiles", -1), HasSubstr("'n_profiles' is -1"));
    EXPECT_THAT(refusal("/area", 0), HasSubstr("'area' is 0"));
    EXPECT_THAT(refusal("/ranking/0/weight", 2), HasSubstr("ranking[0]: 'weight' is 2"));
    EXPECT_THAT(refusal("/ranking", 2), HasSubstr("'ranking' is number, must be a list"));
    EXPECT_THAT(refusal("/empirical/1", {0.3, 1.2}), HasSubstr("point 1: the CDF is 1.2"));
    EXPECT_THAT(refusal("/empirical", json::array()), HasSubstr("'empirical' is empty"));
    EXPECT_THAT(refusal("/source/0/sha256", "zz"), HasSubstr("64 hexadecimal digits"));
    EXPECT_THAT(refusal("/source/0/name", "/home/a.csv"), HasSubstr("must be a name, no path"));
}

TEST(LawFile, RefusesWhatIsNoLaw) {
    for (const char* text : {"", "[]", "{}", "{\"taihu_law\": 1}", "null", "{\"taihu_law\": 1"})
        EXPECT_THROW(parse_law_file(text, "law.json"), Error) << text;
    const std::string good = format_law_file(full());
    for (std::size_t n = 0; n + 2 < good.size(); n += 7) // the last two are `}` and a line break
        EXPECT_THROW(parse_law_file(good.substr(0, n), "law.json"), Error) << n;
}

TEST(LawFile, WritesNothingThatItWouldRefuse) {
    LawFile file = full();
    file.area = std::nan("");
    try {
        format_law_file(file);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_argument);
    }
}

TEST(LawFile, CarriesAFit) {
    const std::vector<std::filesystem::path> paths = {TAIHU_DATA "/measurements/rock1.csv"};
    const Measurements measured = read_measurements(paths);
    const LawFile file = make_law_file(fit_laws(measured.sample), measured);
    const LawFile back = parse_law_file(format_law_file(file), "law.json");
    EXPECT_EQ(back, file);
    EXPECT_EQ(back.unit, LengthUnit::greatest);
    EXPECT_EQ(back.n_profiles, 46u);
    EXPECT_EQ(back.detection_limit, 0.1);
    EXPECT_FALSE(back.n_v);
    ASSERT_EQ(back.ranking.size(), kUsualFamilies.size());
    EXPECT_EQ(back.ranking.front().family, back.law.family());
    ASSERT_EQ(back.source.size(), 1u);
    EXPECT_EQ(back.source[0].name, "rock1.csv");
}

} // namespace
} // namespace taihu
