#include "vdb_ops/recipe_node_detail.h"

#include <algorithm>

#include "stats/core/error.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/level_set_field.h"
#include "vdb_ops/offset_field.h"
#include "vdb_ops/place.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/stored_field.h"
#include "vdb_ops/surface_field.h"

namespace taihu {
namespace {

using Node = std::unique_ptr<RecipeNode>;

constexpr double kResolved_vox = 1.5; ///< radius from which a hole keeps its shape

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what);
}

Box grown(const Box& box, double by_m) {
    Box out;
    out.include(box.lo - Vec3{by_m, by_m, by_m});
    out.include(box.hi + Vec3{by_m, by_m, by_m});
    return out;
}

/// To build on: of a level set between its voxels where it has no other.
std::shared_ptr<const Field> base_field(const NodeSolid& solid) {
    if (solid.field)
        return solid.field;
    return std::make_shared<PlacedLevelSetField>(solid.grid);
}

/// The lattice giver of the first of `nodes` that has one.
const openvdb::FloatGrid* first_giver(const std::vector<Node>& nodes) {
    for (const Node& n : nodes)
        if (const openvdb::FloatGrid* giver = n->lattice_giver())
            return giver;
    return nullptr;
}

/// Holes of a table, or of a law in a box or in the solid before them.
class HolesNode final : public RecipeNode {
public:
    explicit HolesNode(std::vector<Sphere> spheres) : spheres_(std::move(spheres)) {}
    HolesNode(Law law, Placement placement, const std::optional<Box>& box, std::string where)
        : law_(std::move(law)), placement_(std::move(placement)), where_(std::move(where)) {
        if (!box)
            return;
        spheres_ = place_holes(*law_, placement_, *box).holes;
        law_.reset();
    }

    /// Whether they need a solid to be placed in.
    bool needs_solid() const { return law_.has_value(); }

    std::vector<Sphere> spheres(const Similarity& at) const {
        if (law_)
            refuse(where_, "holes of a law need a solid; put them behind it in a difference, or "
                           "give box_m");
        return moved(spheres_, at);
    }
    /// \param solid  what they are placed in, before `at`.
    std::vector<Sphere> spheres_in(const openvdb::FloatGrid& solid, const RecipeScene& scene,
                                   const Similarity& at) const {
        PlacedHoles holes = place_holes(*law_, placement_, solid, scene.progress);
        scene.found.push_back(where_ + ": " + std::to_string(holes.holes.size()) + " holes");
        return moved(std::move(holes.holes), at);
    }

    Box box(const Similarity& at) const override {
        Box box;
        for (const Sphere& s : spheres(at)) {
            box.include(s.center - Vec3{s.radius_m, s.radius_m, s.radius_m});
            box.include(s.center + Vec3{s.radius_m, s.radius_m, s.radius_m});
        }
        return box;
    }
    std::shared_ptr<const Field> field(const RecipeScene&, const Similarity& at) const override {
        return std::make_shared<BallsField>(spheres(at));
    }

private:
    static std::vector<Sphere> moved(std::vector<Sphere> spheres, const Similarity& at) {
        if (!at.is_identity())
            for (Sphere& s : spheres)
                s = placed(s, at);
        return spheres;
    }
    std::optional<Law> law_;
    Placement placement_;
    std::vector<Sphere> spheres_;
    std::string where_;
};

// Nodes made of others.

class CombineNode final : public RecipeNode {
public:
    CombineNode(Combine how, std::vector<Node> of, double blend_m)
        : how_(how), of_(std::move(of)), blend_m_(blend_m) {}
    Box box(const Similarity& at) const override {
        Box all = of_.front()->box(at);
        for (std::size_t i = 1; i < of_.size() && how_ != Combine::subtract; ++i) {
            const Box b = of_[i]->box(at);
            if (how_ == Combine::unite) {
                all.include(b.lo);
                all.include(b.hi);
            } else {
                for (int axis = 0; axis < 3; ++axis) {
                    all.lo[axis] = std::max(all.lo[axis], b.lo[axis]);
                    all.hi[axis] = std::min(all.hi[axis], b.hi[axis]);
                }
            }
        }
        return how_ == Combine::unite ? grown(all, blend_m_ * at.scale()) : all;
    }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        std::vector<std::shared_ptr<const Field>> fields;
        for (const Node& n : of_)
            fields.push_back(n->field(scene, at));
        return std::make_shared<CombineField>(how_, std::move(fields), blend_m_ * at.scale());
    }
    const openvdb::FloatGrid* lattice_giver() const override { return first_giver(of_); }

private:
    Combine how_;
    std::vector<Node> of_;
    double blend_m_;
};

/// A solid minus holes and other solids. Holes are carved from its level set, as the verb does.
class CarvedNode final : public RecipeNode {
public:
    CarvedNode(std::vector<Node> of, double blend_m) : of_(std::move(of)), blend_m_(blend_m) {}
    Box box(const Similarity& at) const override { return of_.front()->box(at); }

    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        std::vector<std::shared_ptr<const Field>> fields = {of_.front()->field(scene, at)};
        fields.push_back(std::make_shared<BallsField>(spheres(scene, at, nullptr)));
        add_others(scene, at, fields);
        return std::make_shared<CombineField>(Combine::subtract, std::move(fields),
                                              blend_m_ * at.scale());
    }
    NodeSolid solid(const RecipeScene& scene, const Similarity& at) const override {
        if (blend_m_ > 0)
            return RecipeNode::solid(scene, at);
        const NodeSolid base = of_.front()->solid(scene, at);
        std::vector<Sphere> holes = spheres(scene, at, base.grid);
        NodeSolid rock{carve(*base.grid, holes, scene.progress).rock, nullptr};
        std::vector<std::shared_ptr<const Field>> others;
        add_others(scene, at, others);
        std::vector<std::shared_ptr<const Field>> parts = {base_field(base),
                                                           std::make_shared<BallsField>(holes)};
        parts.insert(parts.end(), others.begin(), others.end());
        rock.field = std::make_shared<CombineField>(Combine::subtract, std::move(parts));
        if (others.empty())
            return rock;
        others.insert(others.begin(), std::make_shared<LevelSetField>(rock.grid));
        rock.grid = rasterize(CombineField(Combine::subtract, std::move(others)), scene.lattice,
                              scene.progress);
        return rock;
    }
    std::shared_ptr<const Field> tile_field(const RecipeScene& scene,
                                            const Similarity& at) const override {
        if (blend_m_ > 0)
            return field(scene, at);
        const auto base = std::make_shared<StoredField>(of_.front()->tile_field(scene, at));
        const auto holes = std::make_shared<BallsField>(spheres(scene, at, nullptr));
        const auto rock = std::make_shared<DifferenceField>(base, holes);
        std::vector<std::shared_ptr<const Field>> fields = {std::make_shared<StoredField>(rock)};
        add_others(scene, at, fields);
        if (fields.size() == 1)
            return rock;
        return std::make_shared<CombineField>(Combine::subtract, std::move(fields));
    }
    const openvdb::FloatGrid* lattice_giver() const override { return first_giver(of_); }

private:
    /// \param base  the first operand at `at`, where it is there already.
    std::vector<Sphere> spheres(const RecipeScene& scene, const Similarity& at,
                                openvdb::FloatGrid::ConstPtr base) const {
        std::vector<Sphere> all;
        std::vector<Sphere> none;
        RecipeScene own{scene.lattice, scene.found, none, scene.progress};
        if (!at.is_identity()) { // where the holes are placed: before it is moved
            base = nullptr;
            own.lattice = {scene.lattice.voxel_m / at.scale(), {}, scene.lattice.half_width_vox};
        }
        for (std::size_t i = 1; i < of_.size(); ++i) {
            const auto* holes = dynamic_cast<const HolesNode*>(of_[i].get());
            if (!holes)
                continue;
            if (holes->needs_solid() && !base)
                base = of_.front()->solid(own, {}).grid;
            const auto some =
                holes->needs_solid() ? holes->spheres_in(*base, own, at) : holes->spheres(at);
            all.insert(all.end(), some.begin(), some.end());
        }
        const auto n_small = std::count_if(all.begin(), all.end(), [&](const Sphere& hole) {
            return hole.radius_m < kResolved_vox * scene.lattice.voxel_m;
        });
        if (n_small > 0)
            scene.found.push_back(std::to_string(n_small) + " of " + std::to_string(all.size()) +
                                  " holes below 1.5 voxels: carved, but not in shape");
        scene.holes.insert(scene.holes.end(), all.begin(), all.end());
        return all;
    }
    void add_others(const RecipeScene& scene, const Similarity& at,
                    std::vector<std::shared_ptr<const Field>>& fields) const {
        for (std::size_t i = 1; i < of_.size(); ++i)
            if (!dynamic_cast<const HolesNode*>(of_[i].get()))
                fields.push_back(of_[i]->field(scene, at));
    }
    std::vector<Node> of_;
    double blend_m_;
};

class TransformNode final : public RecipeNode {
public:
    TransformNode(Node of, const Similarity& by) : of_(std::move(of)), by_(by) {}
    Box box(const Similarity& at) const override { return of_->box(at * by_); }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        return of_->field(scene, at * by_);
    }
    NodeSolid solid(const RecipeScene& scene, const Similarity& at) const override {
        return of_->solid(scene, at * by_);
    }
    std::shared_ptr<const Field> tile_field(const RecipeScene& scene,
                                            const Similarity& at) const override {
        return of_->tile_field(scene, at * by_);
    }
    std::optional<RecipeCleaning> cleaning() const override {
        auto cleaning = of_->cleaning();
        if (cleaning)
            cleaning->by = by_ * cleaning->by;
        return cleaning;
    }

private:
    Node of_;
    Similarity by_;
};

class OffsetNode final : public RecipeNode {
public:
    OffsetNode(Node of, double by_m) : of_(std::move(of)), by_m_(by_m) {}
    Box box(const Similarity& at) const override { return grown(of_->box(at), by_m_ * at.scale()); }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        return std::make_shared<OffsetField>(of_->field(scene, at), by_m_ * at.scale());
    }
    const openvdb::FloatGrid* lattice_giver() const override { return of_->lattice_giver(); }

private:
    Node of_;
    double by_m_;
};

class ShellNode final : public RecipeNode {
public:
    ShellNode(Node of, double inwards_m, double outwards_m)
        : of_(std::move(of)), inwards_m_(inwards_m), outwards_m_(outwards_m) {}
    Box box(const Similarity& at) const override {
        return grown(of_->box(at), outwards_m_ * at.scale());
    }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        return std::make_shared<ShellField>(of_->field(scene, at), inwards_m_ * at.scale(),
                                            outwards_m_ * at.scale());
    }
    const openvdb::FloatGrid* lattice_giver() const override { return of_->lattice_giver(); }

private:
    Node of_;
    double inwards_m_, outwards_m_;
};

/// Smaller solids set into the first, each in a bed that leaves a gap around it.
class EmbedNode final : public RecipeNode {
public:
    EmbedNode(std::vector<Node> of, double gap_m) : of_(std::move(of)), gap_m_(gap_m) {}
    Box box(const Similarity& at) const override {
        Box all = of_.front()->box(at);
        for (std::size_t i = 1; i < of_.size(); ++i) {
            all.include(of_[i]->box(at).lo);
            all.include(of_[i]->box(at).hi);
        }
        return all;
    }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        std::vector<std::shared_ptr<const Field>> beds = {of_.front()->field(scene, at)}, all;
        for (std::size_t i = 1; i < of_.size(); ++i) {
            all.push_back(of_[i]->field(scene, at));
            beds.push_back(std::make_shared<OffsetField>(all.back(), gap_m_ * at.scale()));
        }
        all.push_back(std::make_shared<CombineField>(Combine::subtract, std::move(beds)));
        return std::make_shared<CombineField>(Combine::unite, std::move(all));
    }
    const openvdb::FloatGrid* lattice_giver() const override { return first_giver(of_); }

private:
    std::vector<Node> of_;
    double gap_m_;
};

class CleanNode final : public RecipeNode {
public:
    CleanNode(Node of, const CleanSettings& settings, std::string where)
        : of_(std::move(of)), settings_(settings), where_(std::move(where)) {}
    Box box(const Similarity& at) const override { return of_->box(at); }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        return std::make_shared<PlacedLevelSetField>(solid(scene, at).grid, Similarity());
    }
    NodeSolid solid(const RecipeScene& scene, const Similarity& at) const override {
        const NodeSolid of = of_->solid(scene, at);
        report_stage(scene.progress, "cleaning");
        const CleanResult result = clean(*of.grid, settings(at), scene.progress);
        for (const std::string& line : cleaning_lines(result))
            scene.found.push_back(where_ + ": " + line);
        return {result.solid, cleaned_field(of.field, result)};
    }
    std::shared_ptr<const Field> tile_field(const RecipeScene& scene,
                                            const Similarity& at) const override {
        return std::make_shared<LevelSetField>(solid(scene, at).grid);
    }
    std::optional<RecipeCleaning> cleaning() const override {
        return RecipeCleaning{of_.get(), settings_, {}};
    }
    const openvdb::FloatGrid* lattice_giver() const override { return of_->lattice_giver(); }

private:
    CleanSettings settings(const Similarity& at) const {
        CleanSettings placed = settings_;
        placed.min_neck_m *= at.scale();
        return placed;
    }
    Node of_;
    CleanSettings settings_;
    std::string where_;
};

} // namespace

NodeSolid RecipeNode::solid(const RecipeScene& scene, const Similarity& at) const {
    const auto own = field(scene, at);
    const openvdb::FloatGrid::Ptr grid = rasterize(*own, scene.lattice, scene.progress);
    if (is_slow(*own))
        return {grid, surface_field(own, grid)};
    std::vector<std::string> unsaid; // it was said
    std::vector<Sphere> uncounted;
    return {grid, field({scene.lattice, unsaid, uncounted, scene.progress, true}, at)};
}

std::shared_ptr<const Field> RecipeNode::tile_field(const RecipeScene& scene,
                                                    const Similarity& at) const {
    return field(scene, at);
}

Node make_holes_node(std::vector<Sphere> spheres) {
    return std::make_unique<HolesNode>(std::move(spheres));
}

Node make_holes_node(Law law, Placement placement, const std::optional<Box>& box,
                     std::string where) {
    return std::make_unique<HolesNode>(std::move(law), std::move(placement), box, std::move(where));
}

Node make_combined_node(Combine how, std::vector<Node> of, double blend_m) {
    const bool has_holes = std::any_of(of.begin() + 1, of.end(), [](const Node& n) {
        return dynamic_cast<const HolesNode*>(n.get()) != nullptr;
    });
    if (how == Combine::subtract && has_holes)
        return std::make_unique<CarvedNode>(std::move(of), blend_m);
    return std::make_unique<CombineNode>(how, std::move(of), blend_m);
}

Node make_transform_node(Node of, const Similarity& by) {
    return std::make_unique<TransformNode>(std::move(of), by);
}

Node make_offset_node(Node of, double by_m) {
    return std::make_unique<OffsetNode>(std::move(of), by_m);
}

Node make_shell_node(Node of, double inwards_m, double outwards_m) {
    return std::make_unique<ShellNode>(std::move(of), inwards_m, outwards_m);
}

Node make_embed_node(std::vector<Node> of, double gap_m) {
    return std::make_unique<EmbedNode>(std::move(of), gap_m);
}

Node make_clean_node(Node of, const CleanSettings& settings, std::string where) {
    return std::make_unique<CleanNode>(std::move(of), settings, std::move(where));
}

} // namespace taihu
