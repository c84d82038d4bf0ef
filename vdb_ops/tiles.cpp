#include "vdb_ops/tiles.h"

#include <cmath>
#include <set>
#include <system_error>

#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/file_set.h"
#include "stats/core/folder_file.h"
#include "stats/core/sha256.h"
#include "stats/core/temporary_detail.h"
#include "stats/core/text.h"
#include "stats/io/json_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/tile_parts_detail.h"
#include "vdb_ops/vdb_file.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;
using openvdb::Coord;
using openvdb::CoordBBox;
using TopNode = openvdb::FloatTree::RootNodeType::ChildNodeType;
using Node = TopNode::ChildNodeType;

constexpr int kVersion = 1;
constexpr double kMostVoxel = 0x1p30;

ordered_json box_json(const CoordBBox& box) {
    return {{box.min().x(), box.min().y(), box.min().z()},
            {box.max().x(), box.max().y(), box.max().z()}};
}

CoordBBox box_of(const json& box, const std::string& where) {
    Coord corners[2];
    if (!box.is_array() || box.size() != 2)
        throw Error(Fault::bad_input, where + ": 'box' must be two corners; correct it");
    for (std::size_t c = 0; c < 2; ++c)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (!box[c].is_array() || box[c].size() != 3 || !box[c][axis].is_number_integer() ||
                std::fabs(box[c][axis].get<double>()) > kMostVoxel)
                throw Error(Fault::bad_input, where + ": 'box' must be two corners of three whole "
                                                      "numbers each; correct it");
            corners[c][static_cast<int>(axis)] = box[c][axis].get<int>();
        }
    if (!(corners[0][0] <= corners[1][0] && corners[0][1] <= corners[1][1] &&
          corners[0][2] <= corners[1][2]))
        throw Error(Fault::bad_input,
                    where + ": 'box' has its corners in the wrong order; give the lower one first");
    return {corners[0], corners[1]};
}

/// `tile_-1_0_2.vdb`, by the place in the lattice of tiles.
std::string file_name(const CoordBBox& box) {
    const int edge = box.dim().x();
    std::string name = "tile";
    for (int axis = 0; axis < 3; ++axis)
        name += "_" + std::to_string(box.min()[axis] / edge);
    return name + ".vdb";
}

std::string format_tile_set(const TileSet& set) {
    ordered_json out = {
        {"taihu_tiles", kVersion},
        {"voxel_m", set.lattice.voxel_m},
        {"origin_m", {set.lattice.origin.x, set.lattice.origin.y, set.lattice.origin.z}},
        {"half_width_vox", static_cast<double>(set.lattice.half_width_vox)},
        {"tile_voxels", set.tile_voxels}};
    out["recipe"] = set.recipe.empty() ? ordered_json(nullptr) : ordered_json::parse(set.recipe);
    out["tiles"] = ordered_json::array();
    for (const Tile& t : set.tiles)
        out["tiles"].push_back({{"file", t.file},
                                {"box", box_json(t.box)},
                                {"leaves", t.n_leaves},
                                {"bytes", t.n_bytes},
                                {"sha256", t.sha256}});
    return out.dump(1) + "\n";
}

/// Whether a name is one of file_name()'s.
bool is_tile_name(const std::string& name) {
    return name.starts_with("tile_") && name.ends_with(".vdb") &&
           name.find_first_not_of("0123456789_-", 5) == name.size() - 4;
}

/// The tiles in a folder that holds nothing else: an earlier set, of which a run that was killed
/// while it replaced them may have left no list.
std::vector<std::string> earlier_tiles(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code failed;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed)) {
        const std::string name = entry->path().filename().string();
        if (is_tile_name(name))
            names.push_back(name);
        else if (name != kTileSetName && !is_temporary(name))
            throw Error(Fault::io, folder.string() + ": a folder with other files; choose a new "
                                                     "one for the tiles");
    }
    return names;
}

/// The work of write_tiles().
class TileWriter {
public:
    TileWriter(FileSet& files, const LatticeField& field, const Lattice& lattice,
               const TileSettings& settings, Progress* progress)
        : files_(files), field_(field), lattice_(lattice), settings_(settings), progress_(progress),
          tiles_(field.bounds(), settings.tile_voxels), parts_(tiles_) {
        result_.set.lattice = lattice;
        result_.set.tile_voxels = settings.tile_voxels;
    }

    TilesResult run() {
        if (settings_.clean)
            choose();
        report_stage(progress_, "writing tiles");
        for (std::size_t n = 0; n < tiles_.size(); ++n) {
            report_fraction(progress_, double(n) / double(tiles_.size()));
            write(tiles_.tile(n), n);
        }
        return result_;
    }

private:
    openvdb::FloatGrid::Ptr made(const CoordBBox& region) const {
        return rasterize(field_, lattice_, region, nullptr);
    }

    /// Names the parts of all tiles, chooses, and marks what changes side.
    void choose() {
        report_stage(progress_, "looking for pieces");
        for (std::size_t n = 0; n < tiles_.size(); ++n) {
            check_cancelled(progress_);
            report_fraction(progress_, double(n) / double(tiles_.size()));
            parts_.add(n, Components(*made(tiles_.tile(n)), tiles_.tile(n), tiles_.world()));
        }
        result_.cleaned = parts_.choose(*settings_.clean);
        report_stage(progress_, "marking what goes");
        for (std::size_t n = 0; n < tiles_.size(); ++n) {
            check_cancelled(progress_);
            report_fraction(progress_, double(n) / double(tiles_.size()));
            if (parts_.any(n))
                parts_.mark(n, Components(*made(tiles_.tile(n)), tiles_.tile(n), tiles_.world()),
                            removed_, filled_);
        }
    }

    /// A tile as cleaning leaves it: what surrounds it, as far as rebuilding looks, is made, too.
    openvdb::FloatGrid::Ptr cleaned(const CoordBBox& box) {
        const bool removing = result_.cleaned->n_pieces_removed > 0,
                   filling = result_.cleaned->n_bubbles_filled > 0;
        const int reach = 8 * flip_reach_blocks(lattice_.half_width_vox);
        CoordBBox once = box, twice = box;
        once.expand(filling ? reach : 0);
        twice.expand((filling ? reach : 0) + (removing ? reach : 0));
        openvdb::FloatGrid::Ptr grid = made(twice);
        double before_m3 = volume_m3(*grid, box);
        result_.cleaned->before_m3 += before_m3;
        if (removing) {
            grid = flip(*grid, removed_, once, progress_);
            const double now_m3 = volume_m3(*grid, box);
            result_.cleaned->removed_m3 += before_m3 - now_m3;
            before_m3 = now_m3;
        }
        if (filling) {
            grid = flip(*grid, filled_, box, progress_);
            result_.cleaned->filled_m3 += volume_m3(*grid) - before_m3;
        }
        return grid;
    }

    void write(const CoordBBox& box, std::size_t n) {
        check_cancelled(progress_);
        const auto grid = settings_.clean ? cleaned(box) : made(box);
        if (grid->tree().root().childCount() == 0)
            return;
        Tile tile;
        tile.file = file_name(box);
        tile.box = box;
        tile.n_leaves = grid->tree().leafCount();
        const ordered_json about = {{"box", box_json(box)}, {"of", kTileSetName}};
        const std::string bytes = format_vdb(*grid, "", tile.file, about.dump());
        tile.n_bytes = bytes.size();
        tile.sha256 = sha256_hex(bytes);
        result_.volume_m3 += volume_m3(*grid);
        files_.add(tile.file, bytes);
        result_.set.tiles.push_back(std::move(tile));
        report_fraction(progress_, double(n + 1) / double(tiles_.size()));
    }

    FileSet& files_;
    const LatticeField& field_;
    Lattice lattice_;
    const TileSettings& settings_;
    Progress* progress_;
    TileLattice tiles_;
    TileParts parts_;
    openvdb::MaskTree removed_, filled_;
    TilesResult result_;
};

Tile tile_of(const json& entry, const std::string& where) {
    static constexpr std::string_view kKeys[] = {"file", "box", "leaves", "bytes", "sha256"};
    check_keys(entry, where, kKeys);
    Tile tile;
    tile.file = json_text(entry, where, "file");
    if (!is_plain_name(tile.file) || !tile.file.ends_with(".vdb"))
        throw Error(Fault::bad_input, where + ": 'file' is '" + printable(tile.file) +
                                          "', must be the base name of a .vdb; correct it");
    tile.box = box_of(entry["box"], where);
    tile.n_leaves = static_cast<std::size_t>(json_number(entry, where, "leaves", 0, 1e15));
    tile.n_bytes = static_cast<std::size_t>(json_number(entry, where, "bytes", 0, 1e15));
    tile.sha256 = json_text(entry, where, "sha256");
    return tile;
}

} // namespace

TilesResult write_tiles(const fs::path& folder, const Field& field, const Lattice& lattice,
                        const TileSettings& settings, const std::string& recipe,
                        Progress* progress) {
    if (settings.tile_voxels < kLeastTile || settings.tile_voxels > kMostTile ||
        settings.tile_voxels % kLeastTile != 0)
        throw Error(Fault::bad_argument, "tiles: an edge of " +
                                             std::to_string(settings.tile_voxels) +
                                             " voxels, must be a multiple of 128 in 128..4096");
    if (settings.clean)
        check_clean_settings(*settings.clean);
    if (settings.clean && (settings.clean->min_neck_m > 0 || settings.clean->foot_deg > 0))
        throw Error(Fault::unsupported,
                    "tiles: necks and feet are not seen in tiles; drop min_neck and foot, or make "
                    "the whole with a larger voxel");
    empty_level_set(lattice); // refuses what is none
    const auto sampled = field.on(lattice, CoordBBox::inf());
    const std::vector<std::string> earlier = earlier_tiles(folder);
    FileSet files(folder);
    TilesResult result = TileWriter(files, *sampled, lattice, settings, progress).run();
    result.set.recipe = recipe;
    files.add(kTileSetName, format_tile_set(result.set));
    check_cancelled(progress);
    files.publish(kTileSetName, earlier);
    return result;
}

TileSet read_tile_set(const fs::path& path) {
    static constexpr std::string_view kKeys[] = {
        "taihu_tiles", "voxel_m", "origin_m", "half_width_vox", "tile_voxels", "recipe", "tiles"};
    const std::string where = base_name(path);
    constexpr std::size_t kMostBytes = std::size_t{1} << 30;
    const std::string bytes = read_file(path, kMostBytes);
    const json text = parse_json(bytes, where, kMostBytes);
    check_keys(text, where, kKeys);
    if (text["taihu_tiles"] != kVersion)
        throw Error(Fault::bad_input, where + ": 'taihu_tiles' is " +
                                          printable(text["taihu_tiles"].dump()) +
                                          ", this program reads 1; use a later taihu");
    TileSet set;
    set.lattice.voxel_m = json_number(text, where, "voxel_m", 1e-12, 1e9);
    set.lattice.half_width_vox =
        static_cast<float>(json_number(text, where, "half_width_vox", 2, 16));
    set.tile_voxels =
        static_cast<int>(json_number(text, where, "tile_voxels", kLeastTile, kMostTile));
    const json& origin = text["origin_m"];
    if (!origin.is_array() || origin.size() != 3)
        throw Error(Fault::bad_input, where + ": 'origin_m' must be three numbers; correct it");
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!origin[axis].is_number())
            throw Error(Fault::bad_input, where + ": 'origin_m' must be three numbers; correct it");
        set.lattice.origin[static_cast<int>(axis)] = origin[axis].get<double>();
    }
    if (!text["recipe"].is_null())
        set.recipe = parse_ordered_json(bytes, where, kMostBytes)["recipe"].dump();
    if (!text["tiles"].is_array())
        throw Error(Fault::bad_input, where + ": 'tiles' must be a list; correct it");
    std::set<std::string> names;
    for (std::size_t i = 0; i < text["tiles"].size(); ++i) {
        const std::string place = where + ": tiles[" + std::to_string(i) + "]";
        set.tiles.push_back(tile_of(text["tiles"][i], place));
        if (!names.insert(set.tiles.back().file).second)
            throw Error(Fault::bad_input,
                        place + ": '" + set.tiles.back().file + "' is there twice; drop one");
    }
    return set;
}

openvdb::FloatGrid::Ptr read_tile(const fs::path& folder, const Tile& tile,
                                  const Lattice& lattice) {
    const auto path = file_in(folder, tile.file);
    if (!path)
        throw Error(Fault::io, (folder / tile.file).string() +
                                   ": there is no such file; put the tile beside " + kTileSetName);
    if (sha256_hex(read_file(*path)) != tile.sha256)
        throw Error(Fault::bad_input, path->string() + ": another file than the one that " +
                                          kTileSetName + " means; write the tiles again");
    const auto grid = read_vdb(*path).solid;
    const Lattice own = lattice_of(*grid);
    constexpr double kSame = 1e-9; // of a voxel
    if (std::abs(own.half_width_vox - lattice.half_width_vox) > 1e-5f * lattice.half_width_vox ||
        std::abs(own.voxel_m - lattice.voxel_m) > kSame * lattice.voxel_m ||
        length(own.origin - lattice.origin) > kSame * lattice.voxel_m)
        throw Error(Fault::bad_input,
                    tile.file + ": has another lattice than the set; write the tiles again");
    return grid;
}

VdbFile read_solid_vdb(const fs::path& path, Progress* progress) {
    VdbFile file = read_vdb(path, progress);
    if (file.tile.empty())
        return file;
    const std::string where = base_name(path) + ": taihu_tile";
    const json tile = parse_json(file.tile, where);
    const CoordBBox box = box_of(tile.is_object() ? tile.value("box", json()) : json(), where);
    openvdb::CoordBBox leaves;
    const bool any = file.solid->tree().evalLeafBoundingBox(leaves);
    bool whole = !box.empty() && (!any || box.isInside(leaves));
    for (int axis = 0; axis < 3 && whole; ++axis)
        whole =
            box.min()[axis] % 8 == 0 && box.dim()[axis] % 8 == 0 && box.dim()[axis] <= kMostTile;
    if (!whole)
        throw Error(Fault::bad_input, where + ": its box is not that of a tile; write it again");
    file.solid = tile_solid(*file.solid, box);
    return file;
}

openvdb::FloatGrid::Ptr read_tiles(const fs::path& set_path, Progress* progress) {
    const TileSet set = read_tile_set(set_path);
    auto whole = empty_level_set(set.lattice);
    auto& root = whole->tree().root();
    for (const Tile& t : set.tiles) {
        check_cancelled(progress);
        const auto grid = read_tile(set_path.parent_path(), t, set.lattice);
        // Tiles are whole nodes of 128^3, so nodes change hands and nothing is merged.
        std::vector<Coord> origins;
        for (auto top = grid->tree().root().beginChildOn(); top; ++top)
            for (openvdb::Index i = 0; i < TopNode::NUM_VALUES; ++i) {
                const Coord at = top->offsetToGlobalCoord(i);
                const bool child = top->isChildMaskOn(i);
                if (!child && top->getTable()[i].getValue() > 0)
                    continue;
                if (!t.box.isInside(at))
                    throw Error(Fault::bad_input,
                                t.file + ": reaches beyond its box; write the tiles again");
                if (!root.probeNode<TopNode>(at))
                    root.addChild(new TopNode(at, whole->background(), false));
                auto* to = root.probeNode<TopNode>(at);
                if (child)
                    origins.push_back(at);
                else
                    to->addTile(TopNode::coordToOffset(at), -whole->background(), false);
            }
        for (const Coord& at : origins) {
            Node* node = grid->tree().root().stealNode<Node>(at, whole->background(), false);
            root.probeNode<TopNode>(at)->addChild(node);
        }
    }
    return whole;
}

} // namespace taihu
