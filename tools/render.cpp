// taihu render: a picture.
#include "mesh_out/render.h"

#include "mesh_out/extract.h"
#include "mesh_out/io/image_file.h"
#include "stats/core/error.h"
#include "stats/core/text.h"
#include "tools/solid_files.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

struct RenderArgs {
    SolidOptions file;
    std::filesystem::path out;
    std::string size;
    bool levels = false, no_ground = false, flat = false;
    RenderSettings settings;
};

void parse_picture_size(const std::string& text, RenderSettings& settings) {
    const std::size_t x = text.find('x');
    const auto width = parse_integer(std::string_view(text).substr(0, x));
    const auto height =
        x == std::string::npos ? width : parse_integer(std::string_view(text).substr(x + 1));
    if (!width || !height || *width < 16 || *height < 16 || *width > 8192 || *height > 8192)
        throw Error(Fault::bad_argument,
                    "--size: '" + printable(text) + "' must be WIDTHxHEIGHT, each 16..8192 pixels");
    settings.width = static_cast<int>(*width);
    settings.height = static_cast<int>(*height);
}

std::vector<TriMesh> meshes_of(const RenderArgs& args, const Console& console) {
    if (is_vdb(args.file.path)) {
        const VdbFile file = read_solid_vdb(args.file.path);
        TriMesh mesh = extract_uniform(*file.solid, console.progress);
        mesh.normals = surface_normals(*file.solid, mesh.positions);
        return {std::move(mesh)};
    }
    return read_mesh(args.file.path, args.file.mesh_settings(), console.progress).levels;
}

void run(RenderArgs& args, const Console& console) {
    console.may_write(args.out);
    if (args.out.extension() != ".png" && args.out.extension() != ".exr")
        throw Error(Fault::unsupported,
                    args.out.string() + ": not a picture format; use .png or .exr");
    if (!args.size.empty())
        parse_picture_size(args.size, args.settings);
    args.settings.ground = !args.no_ground;
    args.settings.smooth = !args.flat;
    const std::vector<TriMesh> meshes = meshes_of(args, console);
    report_stage(console.progress, "rendering");
    const Image image = args.levels ? render_sheet(meshes, args.settings, console.progress)
                                    : render(meshes.front(), args.settings, console.progress);
    write_image(args.out, image);
    console.say("{}: {} x {} pixels", args.out.string(), image.width, image.height);
    console.result({{"file", args.out.string()}, {"width", image.width}, {"height", image.height}});
}

} // namespace

void add_render(CLI::App& app, Console& console) {
    auto args = std::make_shared<RenderArgs>();
    auto* verb = console.verb(app, "render", "Make a picture of a solid or a mesh",
                              "  taihu render rock.glb -o rock.png\n"
                              "  taihu render rock.vdb --turntable 90 --size 800x1000 -o side.exr\n"
                              "  taihu render rock.glb --levels -o sheet.png");
    RenderSettings& s = args->settings;
    verb->add_option("file", args->file.path, "What to show (.vdb .obj .ply .stl .off .glb .drc)")
        ->required();
    verb->add_option("-o,--output", args->out, "Picture to write (.png, or .exr in linear light)")
        ->required();
    verb->add_option("--size", args->size, "Of the picture, or of one panel [480x640 pixels]");
    verb->add_option("--turntable", s.turntable_deg,
                     "Turn about +Y, counter-clockwise from above [deg]")
        ->check(CLI::Range(-3600.0, 3600.0))
        ->capture_default_str();
    verb->add_option("--elevation", s.elevation_deg, "Of the eye above the horizon, -89..89 [deg]")
        ->check(CLI::Range(-89.0, 89.0))
        ->capture_default_str();
    verb->add_option("--samples", s.samples, "Paths per pixel, 1..4096")
        ->check(CLI::Range(1, 4096))
        ->capture_default_str();
    verb->add_flag("--levels", args->levels, "All levels of a GLB side by side, wireframes inset");
    verb->add_flag("--wireframe", s.wireframe, "Show the triangles");
    verb->add_flag("--flat", args->flat, "Shade by faces instead of by normals");
    verb->add_flag("--no-ground", args->no_ground, "Without the plain that takes the shadow");
    verb->add_option("--seed", s.seed, "Of the sampling")
        ->check(CLI::Range(0.0, 9.2e18))
        ->capture_default_str();
    args->file.add_mesh_options(*verb);
    verb->callback([args, &console] { console.with_threads([&] { run(*args, console); }); });
}

} // namespace taihu
