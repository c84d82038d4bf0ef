// taihu mesh: the surface of a solid, certified.
#include "stats/core/error.h"
#include "tools/solid_files.h"
#include "tools/tile_files.h"
#include "vdb_ops/recipe.h"

namespace taihu {
namespace {

struct MeshArgs {
    SolidOptions solid;
    std::filesystem::path out;
    SurfaceOptions surface;
};

void run(const MeshArgs& args, const Console& console) {
    if (!mesh_format(args.out))
        throw Error(Fault::unsupported,
                    args.out.string() +
                        ": not a mesh format; use .obj, .ply, .stl, .off, .glb or .drc");
    if (is_tile_set(args.solid.path)) {
        const auto option = args.surface.any();
        if (option || args.solid.dim || !args.solid.voxel.empty() || args.solid.any_mesh_option())
            throw Error(Fault::bad_argument,
                        args.solid.path.string() +
                            ": tiles keep their voxels, and their surface "
                            "is not simplified; drop " +
                            option.value_or("--dim, --voxel and the options of meshes"));
        return console.result(mesh_tiles(args.solid.path, args.out, console));
    }
    args.surface.check(args.out);
    console.may_write(args.out, {args.solid.path});
    const Solid solid = read_solid(args.solid, console, Surfaces::wanted);
    const std::string recipe = format_recipe(solid.node, solid.measure.voxel_m, 0,
                                             args.surface.lod(args.out, solid.measure));
    console.result(write_solid(args.out, *solid.grid, solid.field.get(), recipe,
                               args.surface.settings(solid.measure), console));
}

} // namespace

void add_mesh(CLI::App& app, Console& console) {
    auto args = std::make_shared<MeshArgs>();
    auto* verb = console.verb(app, "mesh",
                              "Turn a solid into a closed mesh, sharp and adaptive within an error",
                              "  taihu mesh rock.vdb -o rock.obj\n"
                              "  taihu mesh rock.vdb --max-error 2mm -o rock.glb\n"
                              "  taihu mesh rock.vdb --uniform -o rock.stl\n"
                              "  taihu mesh tiles/tiles.json -o rock.ply");
    verb->add_option("solid", args->solid.path,
                     "Level set to mesh (.vdb, a mesh to remesh, or tiles.json of a solid larger "
                     "than memory, tile by tile and not simplified)")
        ->required();
    verb->add_option("-o,--output", args->out, "Where to write it (.obj .ply .stl .off .glb .drc)")
        ->required();
    args->surface.add_options(*verb);
    args->solid.add_voxel_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
