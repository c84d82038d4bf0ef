#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/core/vec3.h"
#include "stats/io/json_detail.h"
#include "stats/number_detail.h"
#include "vdb_ops/recipe_parse_detail.h"

namespace taihu {

inline constexpr double kMostLength_m = 1e6; // lengths and places

[[noreturn]] inline void refuse(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what);
}

/// The body of a node, read key by key.
class Keys {
public:
    Keys(const nlohmann::json& body, std::string where,
         std::initializer_list<std::string_view> required,
         std::initializer_list<std::string_view> optional = {})
        : body_(body), where_(std::move(where)) {
        check_keys(body, where_, {required.begin(), required.size()},
                   {optional.begin(), optional.size()});
    }
    const std::string& where() const { return where_; }
    bool has(const char* key) const { return body_.contains(key); }
    const nlohmann::json& value(const char* key) const { return body_.at(key); }

    double number(const char* key, double lo, double hi) const {
        return json_number(body_, where_, key, lo, hi);
    }
    double number_or(const char* key, double fallback, double lo, double hi) const {
        return has(key) ? number(key, lo, hi) : fallback;
    }
    double length(const char* key) const { return number(key, 1e-9, kMostLength_m); }
    std::string text(const char* key) const { return json_text(body_, where_, key); }
    std::uint64_t whole(const char* key, double hi) const {
        const double v = number(key, 0, hi);
        if (v != std::floor(v))
            refuse(where_,
                   "'" + std::string(key) + "' is " + shortest(v) + "; must be a whole number");
        return body_.at(key).is_number_unsigned() ? body_.at(key).get<std::uint64_t>()
                                                  : static_cast<std::uint64_t>(v);
    }
    Vec3 vector(const char* key, double lo, double hi) const {
        const nlohmann::json& v = numbers(key, 3, "three", lo, hi);
        return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()};
    }
    std::pair<double, double> pair(const char* key, double lo, double hi) const {
        const nlohmann::json& v = numbers(key, 2, "two", lo, hi);
        return {v[0].get<double>(), v[1].get<double>()};
    }
    template <class... Words>
    std::string word(const char* key, const char* fallback, Words... words) const {
        const std::string value = has(key) ? text(key) : fallback;
        std::string list;
        for (const std::string_view w : {std::string_view(words)...}) {
            if (value == w)
                return value;
            list += (list.empty() ? "" : ", ") + std::string(w);
        }
        refuse(where_,
               "'" + std::string(key) + "' is '" + printable(value) + "'; must be one of " + list);
    }

private:
    const nlohmann::json& numbers(const char* key, std::size_t n, const char* words, double lo,
                                  double hi) const {
        const nlohmann::json& v = body_.at(key);
        const auto good = [&](const nlohmann::json& x) {
            return x.is_number() && x.get<double>() >= lo && x.get<double>() <= hi;
        };
        if (!v.is_array() || v.size() != n || !std::all_of(v.begin(), v.end(), good))
            refuse(where_, "'" + std::string(key) + "' is " + printable(v.dump(), 60) +
                               "; must be " + words + " numbers in " + shortest(lo) + ".." +
                               shortest(hi));
        return v;
    }
    const nlohmann::json& body_;
    std::string where_;
};

/// A node made of one or more others.
std::vector<std::unique_ptr<RecipeNode>> parse_children(const Keys& keys, RecipeParser& parser,
                                                        std::size_t at_least);
/// A node's own seed, or one that follows from the recipe's.
std::uint64_t seed_of(const Keys& keys, RecipeParser& parser);
/// The file that `key` names, in a folder of the recipe's, with the hash that `sha256` says.
std::filesystem::path file_of(const Keys& keys, const char* key, const RecipeParser& parser);

// Nodes of recipe_rough.cpp.
std::unique_ptr<RecipeNode> parse_rough(const nlohmann::json& body, const std::string& where,
                                        RecipeParser& parser);
std::unique_ptr<RecipeNode> parse_relief_node(const nlohmann::json& body, const std::string& where,
                                              RecipeParser& parser);
std::unique_ptr<RecipeNode> parse_warp(const nlohmann::json& body, const std::string& where,
                                       RecipeParser& parser);
std::unique_ptr<RecipeNode> parse_weather(const nlohmann::json& body, const std::string& where,
                                          RecipeParser& parser);
std::unique_ptr<RecipeNode> parse_bites(const nlohmann::json& body, const std::string& where,
                                        RecipeParser& parser);

} // namespace taihu
