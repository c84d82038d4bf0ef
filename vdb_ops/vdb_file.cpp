#include "vdb_ops/vdb_file.h"

#include <sstream>

#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/foreign.h"
#include "stats/core/of_file.h"
#include "stats/core/sha256.h"
#include "stats/core/text.h"
#include "vdb_ops/flat_grid_detail.h"
#include "vdb_ops/foreign_vdb_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr const char *kRecipeKey = "taihu_recipe", *kTileKey = "taihu_tile";
constexpr char kMagic[] = {' ', 'B', 'D', 'V', 0, 0, 0, 0};
// magic 8, file version 4, library version 8, offsets flag 1: then 36 characters of id.
constexpr std::size_t kIdAt = 21, kIdSize = 36;

/// A 8-4-4-4-12 id from the hash of everything else in the file.
void replace_id(std::string& bytes, const std::string& where) {
    if (bytes.size() < kIdAt + kIdSize)
        throw Error(Fault::io, where + ": cannot write: the file came out short");
    std::fill_n(bytes.begin() + kIdAt, kIdSize, '0');
    const std::string hash = sha256_hex(bytes);
    const std::string id = hash.substr(0, 8) + '-' + hash.substr(8, 4) + '-' + hash.substr(12, 4) +
                           '-' + hash.substr(16, 4) + '-' + hash.substr(20, 12);
    bytes.replace(kIdAt, kIdSize, id);
}

/// OpenVDB's writer over memory: its own file stream does not notice a full disk.
class Archive final : public openvdb::io::Archive {
public:
    std::string bytes(const openvdb::FloatGrid::Ptr& grid) {
        setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
        std::ostringstream out(std::ios::binary);
        out.exceptions(std::ios::badbit | std::ios::failbit);
        write(out, openvdb::GridCPtrVec{grid}, true);
        return std::move(out).str();
    }

private:
    using openvdb::io::Archive::write;
};

enum class GridKind { level_set, any };

/// The first float grid of this kind in a file; null when there is none.
openvdb::FloatGrid::Ptr first_grid(const std::filesystem::path& path, GridKind kind,
                                   Progress* progress) {
    const std::string where = path.string();
    openvdb::initialize();
    std::string flat;
    {
        const std::string bytes = read_file(path); // regular, readable, of a size that memory takes
        if (bytes.size() < sizeof kMagic || bytes.compare(0, 4, kMagic, 4) != 0)
            throw Error(Fault::bad_input, where + ": not an OpenVDB file; give a .vdb");
        flat = read_foreign("vdb", bytes, where, {kind == GridKind::any ? "any" : "level set"},
                            progress);
    }
    if (flat.empty())
        return nullptr;
    FlatReader in(flat, where);
    const auto grid = get_grid(in);
    in.expect_end();
    return grid;
}

} // namespace

std::string flat_vdb(std::string_view /*bytes*/, const std::string& where,
                     const std::vector<std::string>& words) {
    const bool any = !words.empty() && words.front() == "any";
    openvdb::initialize();
    openvdb::FloatGrid::Ptr found;
    openvdb::io::File file("/dev/stdin");
    file.open(false); // no delayed loading
    const auto grids = file.readAllGridMetadata();
    for (const auto& grid : *grids)
        if (!found && grid && grid->isType<openvdb::FloatGrid>() &&
            (any || grid->getGridClass() == openvdb::GRID_LEVEL_SET))
            found = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid(grid->getName()));
    if (!found)
        return {};
    FlatWriter out;
    try {
        put_grid(out, *found);
    } catch (const Error& e) {
        throw Error(e.fault(), where + ": " + e.what());
    }
    return std::move(out.bytes);
}

VdbFile read_vdb(const std::filesystem::path& path, Progress* progress) {
    const std::string where = path.string();
    VdbFile result;
    result.solid = first_grid(path, GridKind::level_set, progress);
    if (!result.solid)
        throw Error(Fault::bad_input,
                    where +
                        ": holds no float level set; convert a fog volume to a level set first");
    of_file(where, [&] { lattice_of(*result.solid); });
    openvdb::CoordBBox box;
    const openvdb::Coord most(1 << 30); // places are counted in int
    if (result.solid->tree().evalLeafBoundingBox(box) &&
        !openvdb::CoordBBox(-most, most).isInside(box))
        throw Error(Fault::bad_input, where + ": reaches beyond voxel 2^30; move the solid nearer "
                                              "to the origin");
    if (const auto recipe = result.solid->getMetadata<openvdb::StringMetadata>(kRecipeKey))
        result.recipe = recipe->value();
    if (const auto tile = result.solid->getMetadata<openvdb::StringMetadata>(kTileKey))
        result.tile = tile->value();
    return result;
}

openvdb::FloatGrid::Ptr read_volume(const std::filesystem::path& path, Progress* progress) {
    const std::string where = path.string();
    const auto grid = first_grid(path, GridKind::any, progress);
    if (!grid)
        throw Error(Fault::bad_input,
                    where + ": holds no grid of floats; give a level set or a fog volume");
    return grid;
}

void write_vdb(const std::filesystem::path& path, const openvdb::FloatGrid& solid,
               const std::string& recipe) {
    write_file(path, format_vdb(solid, recipe, path.string()));
}

std::string format_vdb(const openvdb::FloatGrid& solid, const std::string& recipe,
                       const std::string& where, const std::string& tile) {
    auto grid = openvdb::FloatGrid::create(std::const_pointer_cast<openvdb::FloatTree>(
        std::static_pointer_cast<const openvdb::FloatTree>(
            solid.constTreePtr()))); // shares the tree
    grid->setTransform(solid.transform().copy());
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setName("surface");
    if (!recipe.empty())
        grid->insertMeta(kRecipeKey, openvdb::StringMetadata(recipe));
    if (!tile.empty())
        grid->insertMeta(kTileKey, openvdb::StringMetadata(tile));
    openvdb::initialize();
    std::string bytes;
    try {
        bytes = Archive().bytes(grid);
    } catch (const std::exception& e) {
        throw Error(Fault::io, where + ": cannot write (" + printable(e.what(), 80) +
                                   "); check memory and the folder");
    }
    replace_id(bytes, where);
    return bytes;
}

} // namespace taihu
