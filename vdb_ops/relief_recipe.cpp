// The settings of a relief tile as JSON and back.
#include <array>
#include <limits>
#include <utility>

#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/io/json_detail.h"
#include "vdb_ops/relief.h"

namespace taihu {
namespace {

using nlohmann::json;

constexpr std::array<std::pair<ReliefLaw, std::string_view>, 6> kLaws = {
    {{ReliefLaw::fractal, "fractal"},
     {ReliefLaw::casting, "casting"},
     {ReliefLaw::convex, "convex"},
     {ReliefLaw::concave, "concave"},
     {ReliefLaw::sinusoid, "sinusoid"},
     {ReliefLaw::damped_wave, "damped_wave"}}};
constexpr std::array<std::pair<MidpointDraws, std::string_view>, 2> kDraws = {
    {{MidpointDraws::uniform, "uniform"}, {MidpointDraws::gaussian, "gaussian"}}};

template <class Enum, std::size_t n>
std::string_view name_of(const std::array<std::pair<Enum, std::string_view>, n>& names,
                         Enum value) {
    for (const auto& [known, name] : names)
        if (known == value)
            return name;
    return {};
}

bool is_wave(ReliefLaw law) {
    return law == ReliefLaw::sinusoid || law == ReliefLaw::damped_wave;
}

/// Keys that a law uses, in the order in which they are written.
std::vector<std::string_view> keys_of(ReliefLaw law) {
    std::vector<std::string_view> keys = {"size_px", "pixel_m", "amplitude_m", "tileable", "seed"};
    const auto add = [&](std::initializer_list<std::string_view> more) {
        keys.insert(keys.end(), more);
    };
    if (law == ReliefLaw::fractal)
        add({"draws"});
    if (is_midpoint(law))
        add({"hurst", "patches", "corners_m"});
    else
        add({"n_regions"});
    if (is_wave(law))
        add({"wavelength_m", "phase_turns", "arms"});
    else if (!is_midpoint(law))
        add({"radius_m"});
    add({"n_colors", "color_seed"});
    return keys;
}

/// Reads one object; a value that is missing keeps its default.
class Reader {
public:
    Reader(const json& object, const std::string& where) : object_(object), where_(where) {}

    void number(std::string_view key, double& value, double lo, double hi) const {
        if (object_.contains(key))
            value = json_number(object_, where_, key, lo, hi);
    }
    void integer(std::string_view key, int& value, int lo, int hi) const {
        double number = value;
        this->number(key, number, lo, hi);
        value = static_cast<int>(number);
        if (value != number)
            refuse("'" + std::string(key) + "' must be a whole number");
    }
    void seed(std::string_view key, std::uint64_t& value) const {
        if (!object_.contains(key))
            return;
        if (!object_.at(std::string(key)).is_number_unsigned())
            refuse("'" + std::string(key) + "' must be a whole number, 0..2^64 - 1");
        value = object_.at(std::string(key)).get<std::uint64_t>();
    }
    template <class Enum, std::size_t n>
    void word(std::string_view key, const std::array<std::pair<Enum, std::string_view>, n>& names,
              Enum& value) const {
        if (!object_.contains(key))
            return;
        const std::string text = json_text(object_, where_, key);
        std::vector<std::string_view> known;
        for (const auto& [candidate, name] : names) {
            if (name == text)
                return void(value = candidate);
            known.push_back(name);
        }
        refuse("unknown " + std::string(key) + " '" + printable(text) + "'" +
               did_you_mean(text, known));
    }
    [[noreturn]] void refuse(const std::string& what) const {
        throw Error(Fault::bad_input, where_ + ": " + what + "; correct the file");
    }

private:
    const json& object_;
    const std::string& where_;
};

} // namespace

std::string format_relief(const ReliefSettings& s) {
    const nlohmann::ordered_json all = {{"size_px", s.size_px},
                                        {"pixel_m", s.pixel_m},
                                        {"amplitude_m", s.amplitude_m},
                                        {"tileable", s.tileable},
                                        {"seed", s.seed},
                                        {"draws", name_of(kDraws, s.draws)},
                                        {"hurst", s.hurst},
                                        {"patches", s.patches},
                                        {"corners_m", s.corners_m},
                                        {"n_regions", s.n_regions},
                                        {"wavelength_m", s.wavelength_m},
                                        {"phase_turns", s.phase_turns},
                                        {"arms", s.arms},
                                        {"radius_m", s.radius_m},
                                        {"n_colors", s.n_colors},
                                        {"color_seed", s.color_seed}};
    nlohmann::ordered_json out = {{"taihu_relief", 1}, {"law", name_of(kLaws, s.law)}};
    for (const std::string_view key : keys_of(s.law)) {
        const bool unused = (key == "corners_m" && s.corners_m.empty()) ||
                            (s.n_colors == 0 && (key == "n_colors" || key == "color_seed"));
        if (!unused)
            out[std::string(key)] = all.at(std::string(key));
    }
    return out.dump();
}

ReliefSettings parse_relief(std::string_view text, const std::string& where) {
    const json object = parse_json(text, where, std::size_t{1} << 24, 4);
    const Reader reader(object, where);
    ReliefSettings s;
    if (!object.is_object())
        reader.refuse("is no object with 'taihu_relief'");
    reader.word("law", kLaws, s.law);
    const std::array<std::string_view, 2> required = {"taihu_relief", "law"};
    check_keys(object, where, required, keys_of(s.law));
    json_number(object, where, "taihu_relief", 1, 1);
    constexpr double kLength = 1e6;
    reader.integer("size_px", s.size_px, 2, 8193);
    reader.number("pixel_m", s.pixel_m, 1e-9, kLength);
    reader.number("amplitude_m", s.amplitude_m, 0, kLength);
    if (object.contains("tileable")) {
        if (!object["tileable"].is_boolean())
            reader.refuse("'tileable' must be true or false");
        s.tileable = object["tileable"].get<bool>();
    }
    reader.seed("seed", s.seed);
    reader.word("draws", kDraws, s.draws);
    reader.number("hurst", s.hurst, 0, 2);
    reader.integer("patches", s.patches, 1, 4096);
    if (object.contains("corners_m")) {
        for (const json& h : object["corners_m"]) {
            if (!h.is_number())
                reader.refuse("'corners_m' must be numbers");
            s.corners_m.push_back(h.get<double>());
        }
    }
    reader.integer("n_regions", s.n_regions, 1, 100'000);
    reader.number("wavelength_m", s.wavelength_m, 1e-9, 1e9);
    reader.number("phase_turns", s.phase_turns, -1e6, 1e6);
    reader.integer("arms", s.arms, -64, 64);
    reader.number("radius_m", s.radius_m, 0, 1e9);
    reader.integer("n_colors", s.n_colors, 0, 100'000);
    reader.seed("color_seed", s.color_seed);
    return s;
}

} // namespace taihu
