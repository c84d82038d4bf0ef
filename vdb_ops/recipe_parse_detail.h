#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "vdb_ops/recipe_node_detail.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {

/// What is known beside the text of a node.
struct RecipeParser {
    const RecipeAssets& assets;
    std::uint64_t seed = 0;                   ///< of the recipe
    const nlohmann::json* material = nullptr; ///< its hole material, or null
    std::uint64_t n_seeded = 0;               ///< nodes so far that took a seed from the recipe's
    double most_bytes = 0;                    ///< that its parts may take
    std::uint64_t n_tile_points = 0;          ///< of all height tiles so far
    double n_bytes = 0;                       ///< of all shapes, meshes and level sets so far

    /// The seed of a node that has none of its own.
    std::uint64_t next_seed();
    /// Before a part is made or kept. \throws Error unsupported: all so far are more than may be.
    void charge(double bytes, const std::string& where);
};

/// A node and all below it, their files read.
/// \param where  its place: `rock.json: solid`.
/// \throws Error as make_recipe.
std::unique_ptr<RecipeNode> parse_node(const nlohmann::json& node, const std::string& where,
                                       RecipeParser& parser);

} // namespace taihu
