// taihu voxelize: any mesh as a level set.
#include "stats/core/error.h"
#include "tools/solid_files.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

struct VoxelizeArgs {
    SolidOptions mesh;
    std::filesystem::path out;
};

void run(const VoxelizeArgs& args, const Console& console) {
    if (!is_vdb(args.out))
        throw Error(Fault::bad_argument,
                    args.out.string() + ": voxelize writes a .vdb; use `taihu mesh` for a mesh");
    console.may_write(args.out, {args.mesh.path});
    const Solid solid = read_solid(args.mesh, console);
    const std::string recipe = format_recipe(solid.node, solid.measure.voxel_m, 0);
    auto json = write_solid(args.out, *solid.grid, nullptr, recipe, {}, console);
    json["voxel_m"] = solid.measure.voxel_m;
    json["volume_m3"] = volume_m3(*solid.grid);
    json["found"] = solid.found;
    console.result(json);
}

} // namespace

void add_voxelize(CLI::App& app, Console& console) {
    auto args = std::make_shared<VoxelizeArgs>();
    auto* verb =
        console.verb(app, "voxelize", "Turn a mesh into a level set, closing it if it is open",
                     "  taihu voxelize scan.ply --dim 400 -o base.vdb\n"
                     "  taihu voxelize part.stl --unit mm --up z --voxel 0.5mm -o part.vdb\n"
                     "  taihu voxelize terrain.obj --close plane -o pedestal.vdb\n"
                     "  taihu voxelize torn.ply --close winding -o whole.vdb");
    verb->add_option("mesh", args->mesh.path, "Mesh to read (.obj .ply .stl .off .glb .drc)")
        ->required();
    verb->add_option("-o,--output", args->out, "Where to write the level set (.vdb)")->required();
    args->mesh.add_voxel_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
