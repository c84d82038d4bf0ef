#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/console.h"
#include "tools/units.h"
#include "vdb_ops/place.h"

namespace taihu {

/// The words by which verbs place a law in a solid.
struct PlacementOptions {
    bool empirical = false;
    std::string scale;
    std::optional<std::uint64_t> count;
    std::optional<double> porosity, density;
    std::optional<std::uint64_t> seed;  ///< 0 when not given
    std::optional<std::string> pattern; ///< uniform when not given
    std::optional<double> clusters;
    std::optional<int> joints;
    std::string spread, scatter, gap, spacing; ///< lengths, or empty
    std::string height;
    std::filesystem::path where;

    void add_options(CLI::App& verb);
    /// The name of one that was given, or nothing.
    std::optional<std::string> any() const;
};

/// A law placed: the holes, what a recipe says of them, and which figures were chosen.
struct LawHoles {
    PlacedHoles placed;
    std::string node;
    std::vector<std::string> comments; ///< what was measured and what was chosen
};

/// Place the law of a file.
/// \param place  place_holes() of the solid or box.
LawHoles place_law(const std::filesystem::path& law_path, const PlacementOptions& options,
                   const Measure& measure,
                   const std::function<PlacedHoles(const Law&, const Placement&)>& place);

} // namespace taihu
