#include <cmath>
#include <utility>

#include "vdb_ops/level_set_box.h"
#include "vdb_ops/level_set_field.h"
#include "vdb_ops/mesh_solid.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/recipe_node_detail.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/surface_field.h"

// Leaves of a recipe's tree.

namespace taihu {
namespace {

using Node = std::unique_ptr<RecipeNode>;

/// For a scene that is sampled, surface_field() of it.
std::shared_ptr<const Field> quick_field(const RecipeScene& scene,
                                         std::shared_ptr<const Field> field) {
    if (!scene.sampled || !is_slow(*field))
        return field;
    return surface_field(field, rasterize(*field, scene.lattice, scene.progress));
}

bool same_lattice(const openvdb::FloatGrid& grid, const Lattice& lattice) {
    const Lattice own = lattice_of(grid);
    return std::fabs(own.voxel_m - lattice.voxel_m) <= 1e-9 * lattice.voxel_m &&
           length(own.origin - lattice.origin) <= 1e-9 * lattice.voxel_m &&
           own.half_width_vox + 1e-3f >= lattice.half_width_vox;
}

class ShapeNode final : public RecipeNode {
public:
    explicit ShapeNode(const ShapeSettings& settings) : settings_(settings) {
        shape_box(settings_); // refuses settings out of range
    }
    Box box(const Similarity& at) const override { return placed(shape_box(settings_), at); }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        return quick_field(scene, shape_field(settings_, at));
    }

private:
    ShapeSettings settings_;
};

/// Everything on one side of a plane.
class PlaneNode final : public RecipeNode {
public:
    explicit PlaneNode(const Similarity& at) : at_(at) {}
    Box box(const Similarity& at) const override {
        return bounds(AnalyticSolid{HalfSpaceSolid{}, at * at_});
    }
    std::shared_ptr<const Field> field(const RecipeScene&, const Similarity& at) const override {
        return std::make_shared<SolidsField>(
            std::vector<AnalyticSolid>{{HalfSpaceSolid{}, at * at_}});
    }

private:
    Similarity at_;
};

class MeshNode final : public RecipeNode {
public:
    MeshNode(TriMesh mesh, std::string where, const CloseSettings& close)
        : mesh_(std::move(mesh)), where_(std::move(where)), close_(close) {}
    Box box(const Similarity& at) const override { return placed(bounds(mesh_), at); }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        const MeshSolid solid =
            mesh_solid(placed(mesh_, at), where_, close_, scene.lattice, scene.progress);
        for (const std::string& line : solid.diagnosis.lines(scene.lattice.voxel_m))
            scene.found.push_back(where_ + ": " + line);
        return quick_field(scene, solid.field);
    }

private:
    TriMesh mesh_;
    std::string where_;
    CloseSettings close_;
};

class LevelSetNode final : public RecipeNode {
public:
    explicit LevelSetNode(openvdb::FloatGrid::Ptr grid) : grid_(std::move(grid)) {}
    Box box(const Similarity& at) const override { return placed(level_set_box(*grid_), at); }
    std::shared_ptr<const Field> field(const RecipeScene&, const Similarity& at) const override {
        return std::make_shared<PlacedLevelSetField>(grid_, at);
    }
    NodeSolid solid(const RecipeScene& scene, const Similarity& at) const override {
        if (at.is_identity() && same_lattice(*grid_, scene.lattice))
            return {grid_, nullptr};
        return RecipeNode::solid(scene, at);
    }
    std::shared_ptr<const Field> tile_field(const RecipeScene& scene,
                                            const Similarity& at) const override {
        if (at.is_identity() && same_lattice(*grid_, scene.lattice))
            return std::make_shared<LevelSetField>(grid_);
        return field(scene, at);
    }
    const openvdb::FloatGrid* lattice_giver() const override { return grid_.get(); }

private:
    openvdb::FloatGrid::Ptr grid_;
};

} // namespace

Node make_shape_node(const ShapeSettings& shape) {
    return std::make_unique<ShapeNode>(shape);
}

Node make_plane_node(const Similarity& at) {
    return std::make_unique<PlaneNode>(at);
}

Node make_mesh_node(TriMesh mesh, std::string where, const CloseSettings& close) {
    return std::make_unique<MeshNode>(std::move(mesh), std::move(where), close);
}

Node make_level_set_node(openvdb::FloatGrid::Ptr grid) {
    return std::make_unique<LevelSetNode>(std::move(grid));
}

} // namespace taihu
