#include "stats/io/json_detail.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

using testing::HasSubstr;

std::string refusal(std::string_view text, std::size_t max_bytes = 1000, std::size_t depth = 64) {
    try {
        parse_json(text, "a.json", max_bytes, depth);
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        return e.what();
    }
    return "accepted";
}

TEST(ParseJson, ReadsWhatIsJson) {
    const auto value = parse_json("{\"a\": [1, 2.5, \"{[,\\\"\"], \"b\": {\"a\": null}}", "a.json");
    EXPECT_EQ(value["a"][1], 2.5);
    EXPECT_EQ(value["a"][2], "{[,\"");
    EXPECT_TRUE(value["b"]["a"].is_null());
    EXPECT_EQ(refusal("[\"a\", \"a\", {\"a\": \"a\"}, {\"a\": 1}]"), "accepted");
}

TEST(ParseJson, RefusesAKeyThatIsThereTwice) {
    EXPECT_THAT(refusal("{\"a\": 1,\n \"b\": {\"a\": 2, \"a\": 3}}"),
                HasSubstr("a.json:2:16: key \"a\" is there twice; keep one of them"));
    EXPECT_THAT(refusal("{\"key\": 1, \"k\\u0065y\": 2}"), HasSubstr("is there twice"));
}

TEST(ParseJson, TakesAThousandKeysInTheirOrder) {
    const auto object = [](int n) {
        std::string text = "{";
        for (int i = n; i > 0; --i)
            text += '"' + std::to_string(i) + "\": 0" + (i > 1 ? "," : "}");
        return text;
    };
    EXPECT_EQ(parse_ordered_json(object(1000), "a.json").begin().key(), "1000");
    expect_error(Fault::bad_input, "a.json:1:8898: an object of more than 1000 keys; split it",
                 [&] { parse_ordered_json(object(1001), "a.json"); });
    EXPECT_EQ(parse_json(object(5000), "a.json").size(), 5000u);
}

TEST(ParseJson, RefusesDepthAndSize) {
    EXPECT_EQ(refusal("[[1]]", 1000, 2), "accepted");
    EXPECT_THAT(refusal("[[[1]]]", 1000, 2), HasSubstr("a.json:1:3: nested deeper than 2 levels"));
    EXPECT_THAT(refusal(std::string(500, '[')), HasSubstr("nested deeper than 64"));
    EXPECT_THAT(refusal("[1, 2]", 5), HasSubstr("6 bytes of JSON, at most 5"));
}

TEST(ParseJson, SaysWhereItIsNotJson) {
    EXPECT_THAT(refusal("{\n  \"a\": nope\n}"), HasSubstr("a.json:2:9: not JSON: "));
    EXPECT_THAT(refusal(""), HasSubstr("a.json:1:1: not JSON: "));
    EXPECT_THAT(refusal("{\"a\": 1"), HasSubstr("a.json:1:8: not JSON: "));
    EXPECT_THAT(refusal("{\"a\": 1} x"), HasSubstr("not JSON"));
    EXPECT_THAT(refusal("[NaN]"), HasSubstr("not JSON"));
    EXPECT_THAT(refusal("[\"\xff\"]"), HasSubstr("ill-formed UTF-8"));
    EXPECT_THAT(refusal("[1e999]"), HasSubstr("too great for a double"));
    EXPECT_THAT(refusal("]}\"\\"), HasSubstr("not JSON"));
    // Columns count characters: the two-byte letter is one.
    EXPECT_THAT(refusal("{\"\xc3\xa4\": x}"), HasSubstr("a.json:1:7: "));
}

TEST(ParseJson, KeepsControlCharactersOutOfMessages) {
    const std::string message = refusal("[\"a\nb\"]");
    EXPECT_EQ(message.find('\n'), std::string::npos);
}

TEST(CheckKeys, NamesTheKey) {
    constexpr std::array<std::string_view, 2> kRequired = {"scale", "shape"};
    constexpr std::array<std::string_view, 1> kOptional = {"remark"};
    const auto refusal_of = [&](const char* text) -> std::string {
        try {
            check_keys(parse_json(text, "a"), "a.json: law", kRequired, kOptional);
        } catch (const Error& e) {
            return e.what();
        }
        return "accepted";
    };
    EXPECT_EQ(refusal_of("{\"shape\": 1, \"scale\": 2}"), "accepted");
    EXPECT_EQ(refusal_of("{\"shape\": 1, \"scale\": 2, \"remark\": 3}"), "accepted");
    EXPECT_EQ(refusal_of("{\"shape\": 1, \"scael\": 2}"),
              "a.json: law: unknown key 'scael'; did you mean 'scale'?");
    EXPECT_EQ(refusal_of("{\"shape\": 1}"), "a.json: law: key 'scale' is missing; add it");
    EXPECT_EQ(refusal_of("[1]"), "a.json: law: is array, must be an object; correct it");
}

TEST(JsonNumber, ChecksKindAndRange) {
    const auto object = parse_json("{\"a\": 3, \"b\": \"3\"}", "a");
    EXPECT_EQ(json_number(object, "a.json", "a", 0, 5), 3);
    const auto refusal_of = [&](const char* key) -> std::string {
        try {
            json_number(object, "a.json", key, 0, 2);
        } catch (const Error& e) {
            return e.what();
        }
        return "accepted";
    };
    EXPECT_EQ(refusal_of("a"), "a.json: 'a' is 3, must be in 0..2; correct it");
    EXPECT_EQ(refusal_of("b"), "a.json: 'b' is string, must be a number; correct it");
    EXPECT_EQ(refusal_of("c"), "a.json: 'c' is missing, must be a number; correct it");
    EXPECT_EQ(json_text(object, "a.json", "b"), "3");
    EXPECT_THROW(json_text(object, "a.json", "a"), Error);
}

TEST(JsonQuoted, EscapesAndReplaces) {
    EXPECT_EQ(json_quoted("a\"b\n"), "\"a\\\"b\\n\"");
    EXPECT_EQ(json_quoted("\xff"), "\"\xef\xbf\xbd\"");
}

TEST(ParseJson, RefusesMoreValuesThanMemoryShouldHold) {
    expect_error(Fault::bad_input, "a.json: more than 8000000 values",
                 [] { parse_json("[" + std::string(8'000'000, ','), "a.json"); });
}

} // namespace
} // namespace taihu
