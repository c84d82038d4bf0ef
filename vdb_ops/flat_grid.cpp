#include "vdb_ops/flat_grid_detail.h"

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>

#include <openvdb/math/Maps.h>

#include "stats/core/text.h"

namespace taihu {
namespace {

using openvdb::Coord;
using Tree = openvdb::FloatTree;
using Root = Tree::RootNodeType;
using Upper = Root::ChildNodeType;
using Lower = Upper::ChildNodeType;
using Leaf = Tree::LeafNodeType;

enum class Slot : std::uint8_t { off, on, child };

std::array<std::int32_t, 3> numbers(const Coord& c) {
    return {c.x(), c.y(), c.z()};
}

float finite(FlatReader& in, const Coord& at) {
    const auto value = in.get<float>();
    if (!std::isfinite(value))
        in.fail("has a voxel that is not finite near (" + std::to_string(at.x()) + ", " +
                std::to_string(at.y()) + ", " + std::to_string(at.z()) + ")");
    return value;
}

void put_node(FlatWriter& out, const Leaf& leaf) {
    for (openvdb::Index w = 0; w < Leaf::NodeMaskType::WORD_COUNT; ++w)
        out.put(leaf.getValueMask().getWord<std::uint64_t>(w));
    out.bytes.append(reinterpret_cast<const char*>(leaf.buffer().data()),
                     sizeof(float) * Leaf::SIZE);
}

/// Slots that are alike, one after the other, are put once, with their number.
template <class Node>
void put_node(FlatWriter& out, const Node& node) {
    for (openvdb::Index i = 0; i < Node::NUM_VALUES;) {
        if (node.isChildMaskOn(i)) {
            out.put(Slot::child);
            put_node(out, *node.getTable()[i].getChild());
            ++i;
            continue;
        }
        const float value = node.getTable()[i].getValue();
        const bool is_on = node.isValueMaskOn(i);
        openvdb::Index n = 1;
        while (i + n < Node::NUM_VALUES && !node.isChildMaskOn(i + n) &&
               node.isValueMaskOn(i + n) == is_on && node.getTable()[i + n].getValue() == value)
            ++n;
        out.put(is_on ? Slot::on : Slot::off);
        out.put(value);
        out.put<std::uint32_t>(n);
        i += n;
    }
}

std::unique_ptr<Leaf> get_node(FlatReader& in, const Coord& origin, float background,
                               const Leaf* /*kind*/) {
    auto leaf = std::make_unique<Leaf>(origin, background, false);
    for (openvdb::Index w = 0; w < Leaf::NodeMaskType::WORD_COUNT; ++w)
        leaf->getValueMask().getWord<std::uint64_t>(w) = in.get<std::uint64_t>();
    float* values = leaf->buffer().data();
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i)
        values[i] = finite(in, origin);
    return leaf;
}

template <class Node>
std::unique_ptr<Node> get_node(FlatReader& in, const Coord& origin, float background,
                               const Node* /*kind*/) {
    using Child = typename Node::ChildNodeType;
    auto node = std::make_unique<Node>(origin, background, false);
    for (openvdb::Index i = 0; i < Node::NUM_VALUES;) {
        const auto slot = in.get<Slot>();
        if (slot == Slot::child) {
            node->addChild(get_node(in, node->offsetToGlobalCoord(i), background,
                                    static_cast<const Child*>(nullptr))
                               .release());
            ++i;
            continue;
        }
        if (slot > Slot::child)
            in.fail("has a node of no kind");
        const float value = finite(in, origin);
        const auto n = in.get<std::uint32_t>();
        if (n < 1 || n > Node::NUM_VALUES - i)
            in.fail("has a node with too many parts");
        for (const openvdb::Index end = i + n; i < end; ++i)
            node->addTile(i, value, slot == Slot::on);
    }
    return node;
}

void put_tree(FlatWriter& out, const Tree& tree) {
    out.put(tree.background());
    const Root& root = tree.root();
    for (auto tile = root.cbeginValueAll(); tile; ++tile) {
        out.put(tile.isValueOn() ? Slot::on : Slot::off);
        out.put(numbers(tile.getCoord()));
        out.put(tile.getValue());
    }
    for (auto child = root.cbeginChildOn(); child; ++child) {
        out.put(Slot::child);
        out.put(numbers(child->origin()));
        put_node(out, *child);
    }
    out.put(Slot{0xff});
}

Tree::Ptr get_tree(FlatReader& in) {
    auto tree = std::make_shared<Tree>(finite(in, {}));
    Root& root = tree->root();
    std::map<Coord, bool> seen;
    for (auto slot = in.get<Slot>(); slot != Slot{0xff}; slot = in.get<Slot>()) {
        const auto [x, y, z] = in.get<std::array<std::int32_t, 3>>();
        const Coord origin(x, y, z);
        if (slot > Slot::child || ((x | y | z) & (Upper::DIM - 1)) != 0 ||
            !seen.emplace(origin, true).second)
            in.fail("has a part of no kind or place");
        if (slot == Slot::child)
            root.addChild(
                get_node(in, origin, tree->background(), static_cast<const Upper*>(nullptr))
                    .release());
        else
            root.addTile(origin, finite(in, origin), slot == Slot::on);
    }
    return tree;
}

} // namespace

void put_grid(FlatWriter& out, const openvdb::FloatGrid& grid) {
    if (!grid.transform().isLinear())
        throw Error(Fault::unsupported, "its grid '" + grid.getName() +
                                            "' has a transform that is not linear; resample it");
    const openvdb::Mat4d matrix = grid.transform().baseMap()->getAffineMap()->getMat4();
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            out.put<double>(matrix(i, j));
    out.put(static_cast<std::uint8_t>(grid.getGridClass()));
    std::map<std::string, std::string> texts;
    for (auto it = grid.beginMeta(); it != grid.endMeta(); ++it)
        if (it->second && it->second->typeName() == openvdb::StringMetadata::staticTypeName())
            texts.emplace(it->first, it->second->str());
    out.put<std::uint32_t>(static_cast<std::uint32_t>(texts.size()));
    for (const auto& [key, text] : texts) {
        out.put_text(key);
        out.put_text(text);
    }
    put_tree(out, grid.tree());
}

openvdb::FloatGrid::Ptr get_grid(FlatReader& in) {
    openvdb::Mat4d matrix;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            matrix(i, j) = in.get<double>();
            if (!std::isfinite(matrix(i, j)))
                in.fail("has a transform that is not finite");
        }
    const auto kind = in.get<std::uint8_t>();
    if (kind >= openvdb::NUM_GRID_CLASSES)
        in.fail("has a grid of no kind");
    std::map<std::string, std::string> texts;
    const auto n_texts = in.get<std::uint32_t>();
    for (std::uint32_t i = 0; i < n_texts; ++i) {
        const std::string key = in.get_text();
        texts[key] = in.get_text();
    }
    const auto grid = openvdb::FloatGrid::create(get_tree(in));
    grid->setGridClass(static_cast<openvdb::GridClass>(kind));
    try {
        for (const auto& [key, text] : texts)
            grid->insertMeta(key, openvdb::StringMetadata(text));
        grid->setTransform(std::make_shared<openvdb::math::Transform>(
            openvdb::math::simplify(std::make_shared<openvdb::math::AffineMap>(matrix))));
    } catch (const openvdb::Exception& e) { // nameless metadata, a matrix without an inverse
        in.fail("is refused by OpenVDB (" + printable(e.what(), 80) + ")");
    }
    return grid;
}

} // namespace taihu
