#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "stats/core/sphere.h"
#include "stats/core/tri_mesh.h"
#include "stats/law.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/field.h"
#include "vdb_ops/mesh_diagnosis.h"
#include "vdb_ops/place.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/similarity.h"

namespace taihu {

/// One evaluation of a recipe.
struct RecipeScene {
    Lattice lattice;
    std::vector<std::string>& found; ///< what was repaired, placed and removed
    std::vector<Sphere>& holes;      ///< that were carved
    Progress* progress = nullptr;
    bool sampled = false; ///< shapes that cost much to ask by their level sets (surface_field())
};

/// A solid as a level set, and what its surface is made of: null where nothing but that says.
struct NodeSolid {
    openvdb::FloatGrid::Ptr grid;
    std::shared_ptr<const Field> field;
};

class RecipeNode;

/// What a node that cleans does: to which solid, put where.
struct RecipeCleaning {
    const RecipeNode* of = nullptr;
    CleanSettings settings;
    Similarity by; ///< `of` is put at `at * by` where the node is put at `at`
};

/// A solid of a recipe's tree, its files read, wherever it is put.
class RecipeNode {
public:
    virtual ~RecipeNode() = default;

    /// Holds the solid, put at `at`; infinite where it has no bounds.
    virtual Box box(const Similarity& at) const = 0;
    virtual std::shared_ptr<const Field> field(const RecipeScene& scene,
                                               const Similarity& at) const = 0;
    /// With the level set on the scene's lattice; that of field() unless a node needs one anyway.
    virtual NodeSolid solid(const RecipeScene& scene, const Similarity& at) const;
    /// A field that rasterizes to the grid of solid(), bit for bit, in any part of space alone.
    virtual std::shared_ptr<const Field> tile_field(const RecipeScene& scene,
                                                    const Similarity& at) const;
    /// Of a node that cleans, so that others may do it; nothing for the rest.
    virtual std::optional<RecipeCleaning> cleaning() const { return std::nullopt; }
    /// A level set file in the tree, whose lattice the whole then takes; null without one.
    virtual const openvdb::FloatGrid* lattice_giver() const { return nullptr; }
};

// The nodes there are; `where` stands for one in messages. All throw what they are made of.

std::unique_ptr<RecipeNode> make_shape_node(const ShapeSettings& shape);
/// What lies below y = 0, put at `at`.
std::unique_ptr<RecipeNode> make_plane_node(const Similarity& at);
std::unique_ptr<RecipeNode> make_mesh_node(TriMesh mesh, std::string where,
                                           const CloseSettings& close);
std::unique_ptr<RecipeNode> make_level_set_node(openvdb::FloatGrid::Ptr grid);
std::unique_ptr<RecipeNode> make_holes_node(std::vector<Sphere> spheres);
/// \param box  where they are placed; nothing: in the solid that stands before them in a
/// difference.
std::unique_ptr<RecipeNode> make_holes_node(Law law, Placement placement,
                                            const std::optional<Box>& box, std::string where);
/// Holes that are subtracted are carved from the level set of the first, as the verb does.
std::unique_ptr<RecipeNode>
make_combined_node(Combine how, std::vector<std::unique_ptr<RecipeNode>> of, double blend_m);
std::unique_ptr<RecipeNode> make_transform_node(std::unique_ptr<RecipeNode> of,
                                                const Similarity& by);
std::unique_ptr<RecipeNode> make_offset_node(std::unique_ptr<RecipeNode> of, double by_m);
std::unique_ptr<RecipeNode> make_shell_node(std::unique_ptr<RecipeNode> of, double inwards_m,
                                            double outwards_m);
/// The later ones set into the first, each in a bed that is wider by `gap_m`.
std::unique_ptr<RecipeNode> make_embed_node(std::vector<std::unique_ptr<RecipeNode>> of,
                                            double gap_m);
std::unique_ptr<RecipeNode> make_clean_node(std::unique_ptr<RecipeNode> of,
                                            const CleanSettings& settings, std::string where);

} // namespace taihu
