#pragma once
#include <span>
#include <string>
#include <string_view>

namespace taihu {

/// A recipe that comes with the program: data/presets/NAME.json.
struct Preset {
    std::string_view name, recipe;
};

/// All of them, by name.
std::span<const Preset> presets();

/// The recipe of that name. \throws Error bad_argument, with the nearest name.
std::string preset_recipe(const std::string& name);

} // namespace taihu
