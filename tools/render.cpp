// taihu render: a picture.
#include "mesh_out/render.h"

#include <algorithm>
#include <cmath>

#include "mesh_out/extract.h"
#include "mesh_out/io/image_file.h"
#include "mesh_out/io/relief_file.h"
#include "stats/core/error.h"
#include "stats/core/file_set.h"
#include "stats/core/text.h"
#include "tools/solid_files.h"
#include "tools/units.h"
#include "vdb_ops/relief.h"
#include "vdb_ops/relief_around.h"

namespace taihu {
namespace {

constexpr double kPixel_bytes = 18; // at the peak, as measured

struct RenderArgs {
    SolidOptions file;
    std::filesystem::path out;
    std::string size;
    std::filesystem::path relief, grain;
    std::string around = "triplanar", tile_side, material, light_azimuth, light_elevation;
    double relief_scale = 1;
    std::optional<int> views;
    bool levels = false, no_ground = false, flat = false, displace = false, colors = false;
    std::vector<double> reflection;
    RenderSettings settings;
};

constexpr int kMostViews = 360;

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
        const openvdb::FloatGrid::Ptr solid = read_level_set(args.file.path, console);
        TriMesh mesh = extract_uniform(*solid, console.progress);
        mesh.normals = surface_normals(*solid, mesh.positions);
        return {std::move(mesh)};
    }
    std::vector<TriMesh> levels =
        read_mesh(args.file.path, args.file.mesh_settings(), console.progress).levels;
    for (const TriMesh& level : levels)
        if (!(bounds(level).longest() > 0))
            throw Error(Fault::bad_input,
                        args.file.path.string() + ": has no extent; export it again");
    return levels;
}

ReliefMap map_of(const std::string& name) {
    return name == "planar"     ? ReliefMap::planar
           : name == "sphere"   ? ReliefMap::sphere
           : name == "cube"     ? ReliefMap::cube
           : name == "cylinder" ? ReliefMap::cylinder
                                : ReliefMap::triplanar;
}

/// One channel of a tile of `taihu relief`, or of any EXR that has it, as `value` makes of it.
template <class Value>
std::shared_ptr<const ReliefAround>
tile_around(const RenderArgs& args, const std::filesystem::path& path, const char* channel,
            const Box& frame, Value&& value) {
    ReliefTile tile = read_relief(path, channel);
    if (!args.tile_side.empty())
        tile.pixel_m = length_m("--tile-side", args.tile_side, {0, frame.longest()}) /
                       std::max(1, tile.heights.width - !tile.tileable);
    if (!(tile.pixel_m > 0))
        throw Error(Fault::bad_input, path.string() + ": does not say how large it is; give "
                                                      "--tile-side");
    for (float& p : tile.heights.pixels)
        p = static_cast<float>(value(p));
    return std::make_shared<ReliefAround>(std::move(tile.heights), tile.pixel_m, tile.tileable,
                                          map_of(args.around), frame);
}

/// The colour subregions of the tile, blended over a pixel at their borders.
void paint_regions(RenderArgs& args, const Box& frame) {
    const auto part = [&](int c) {
        return tile_around(args, args.relief, "color_region", frame,
                           [c](float id) { return region_color(id)[c]; });
    };
    args.settings.tint_at = [red = part(0), green = part(1), blue = part(2)](const Vec3& p,
                                                                             const Vec3& n) {
        return Vec3{red->height_m(p, n), green->height_m(p, n), blue->height_m(p, n)};
    };
}

void lay_relief(RenderArgs& args, TriMesh& mesh) {
    const Box frame = bounds(mesh);
    if (!args.grain.empty())
        args.settings.albedo_at = [grain = tile_around(args, args.grain, "Y", frame, [](float y) {
                                       return std::clamp(y, 0.0F, 1.0F);
                                   })](const Vec3& p, const Vec3& n) {
            return grain->height_m(p, n);
        };
    if (args.colors)
        paint_regions(args, frame);
    if (args.relief.empty())
        return;
    const auto relief =
        tile_around(args, args.relief, "Y", frame, [&](float h) { return h * args.relief_scale; });
    if (args.displace) {
        mesh = relief->displaced(mesh);
        return;
    }
    args.settings.normal_at = [relief](const Vec3& p, const Vec3& n) {
        return relief->bumped(p, n);
    };
}

void light_plainly(RenderArgs& args) {
    const ReliefMaterial& material = relief_preset(args.material).material;
    PlainLight plain{material.reflection, material.color, {}};
    if (const std::vector<double>& r = args.reflection; !r.empty())
        plain.reflection = {r[0], r[1], r[2], r[3]};
    if (!args.light_azimuth.empty())
        plain.light.azimuth_deg = angle_deg("--light-azimuth", args.light_azimuth);
    if (!args.light_elevation.empty())
        plain.light.elevation_deg = angle_deg("--light-elevation", args.light_elevation);
    args.settings.plain = plain;
}

/// The name of picture `i`: # stand for its digits.
std::filesystem::path numbered(const std::filesystem::path& out, int i) {
    std::string name = out.filename().string();
    const std::size_t first = name.find('#'), n = name.find_first_not_of('#', first) - first;
    std::string digits = std::to_string(i);
    if (digits.size() < n)
        digits.insert(0, n - digits.size(), '0');
    return out.parent_path() / name.replace(first, n, digits);
}

/// A full turn: files of their own where the name has #, else a sheet as square as it gets.
std::vector<std::string> render_turn(const RenderArgs& args, const TriMesh& mesh,
                                     const Console& console) {
    const int n = *args.views;
    const bool apart = args.out.filename().string().find('#') != std::string::npos;
    const int columns = static_cast<int>(std::ceil(std::sqrt(n))),
              rows = (n + columns - 1) / columns;
    const RenderSettings& s = args.settings;
    if (!apart && (columns * s.width > 16384 || rows * s.height > 16384))
        throw Error(Fault::bad_argument,
                    "--views: a sheet of " + std::to_string(columns) + " x " +
                        std::to_string(rows) +
                        " pictures is larger than 16384 pixels; use a smaller --size, or # in the "
                        "name for a file each");
    for (int i = 0; apart && i < n; ++i)
        console.may_write(numbered(args.out, i), {args.relief, args.grain});
    std::optional<FileSet> pictures; // of one folder, whatever else is in it
    if (apart)
        pictures.emplace(args.out.parent_path());
    Image sheet = apart ? Image() : Image(columns * s.width, rows * s.height, 3);
    std::vector<std::string> files;
    for (int i = 0; i < n; ++i) {
        report_stage(console.progress,
                     "view " + std::to_string(i + 1) + " of " + std::to_string(n));
        RenderSettings view = s;
        view.turntable_deg += 360.0 * i / n;
        const Image image = render(mesh, view, console.progress);
        if (apart) {
            const std::filesystem::path file = numbered(args.out, i);
            pictures->add_by([&](const std::filesystem::path& folder) {
                write_image(folder / file.filename(), image);
            });
            files.push_back(file.string());
            continue;
        }
        for (int y = 0; y < s.height; ++y)
            std::copy_n(image.at(0, y), 3 * s.width,
                        sheet.at(i % columns * s.width, i / columns * s.height + y));
    }
    check_cancelled(console.progress);
    if (apart) {
        pictures->publish(std::filesystem::path(files.back()).filename());
    } else {
        write_image(args.out, sheet);
        files.push_back(args.out.string());
    }
    return files;
}

void check_options(const RenderArgs& args) {
    const auto needs = [](bool given, const char* option, const char* other) {
        if (given)
            throw Error(Fault::bad_argument,
                        std::string(option) + ": is for " + other + "; give that, or drop it");
    };
    const bool tiled = !args.relief.empty() || !args.grain.empty();
    needs(args.displace && args.relief.empty(), "--displace", "--relief");
    needs(args.colors && args.relief.empty(), "--colors", "--relief");
    needs(args.relief_scale != 1 && args.relief.empty(), "--relief-scale", "--relief");
    needs(!args.tile_side.empty() && !tiled, "--tile-side", "--relief or --grain");
    needs(!args.reflection.empty() && args.material.empty(), "--reflection", "--material");
    needs(!args.light_azimuth.empty() && args.material.empty(), "--light-azimuth", "--material");
    needs(!args.light_elevation.empty() && args.material.empty(), "--light-elevation",
          "--material");
}

void run(RenderArgs& args, const Console& console) {
    check_options(args);
    console.may_write(args.out, {args.relief, args.grain});
    if (args.out.extension() != ".png" && args.out.extension() != ".exr")
        throw Error(Fault::unsupported,
                    args.out.string() + ": not a picture format; use .png or .exr");
    if (!args.size.empty())
        parse_picture_size(args.size, args.settings);
    args.settings.ground = !args.no_ground;
    args.settings.smooth = !args.flat;
    if (!args.material.empty())
        light_plainly(args);
    console.require_memory(double(args.settings.width) * args.settings.height, kPixel_bytes,
                           "give a smaller --size");
    std::vector<TriMesh> meshes = meshes_of(args, console);
    lay_relief(args, meshes.front());
    report_stage(console.progress, "rendering");
    std::vector<std::string> files = {args.out.string()};
    if (args.views)
        files = render_turn(args, meshes.front(), console);
    else
        write_image(args.out, args.levels
                                  ? render_sheet(meshes, args.settings, console.progress)
                                  : render(meshes.front(), args.settings, console.progress));
    for (const std::string& file : files)
        console.say("{}: written", file);
    console.result({{"files", files},
                    {"width", args.settings.width},
                    {"height", args.settings.height},
                    {"views", args.views.value_or(1)}});
}

} // namespace

void add_render(CLI::App& app, Console& console) {
    auto args = std::make_shared<RenderArgs>();
    auto* verb = console.verb(app, "render", "Make a picture of a solid or a mesh",
                              "  taihu render rock.glb -o rock.png\n"
                              "  taihu render rock.vdb --turntable 90 --size 800x1000 -o side.exr\n"
                              "  taihu render rock.glb --levels -o sheet.png\n"
                              "  taihu render rock.glb --views 12 -o turn_##.png\n"
                              "  taihu render ball.ply --relief tile.exr --around sphere "
                              "--material broken-rock -o ball.png");
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
    auto* levels = verb->add_flag("--levels", args->levels,
                                  "All levels of a GLB side by side, wireframes inset");
    verb->add_option("--views", args->views,
                     "A full turn in so many views, 1..360: a sheet, or files where # stand for "
                     "digits in the name")
        ->check(CLI::Range(1, kMostViews))
        ->excludes(levels);
    verb->add_option("--relief", args->relief,
                     "A height tile (.exr of taihu relief) laid around it: bumps its normals")
        ->excludes(levels);
    verb->add_option(
            "--around", args->around,
            "How: planar (from the front), sphere, cube, cylinder, or triplanar, along three "
            "axes without seams")
        ->check(CLI::IsMember({"planar", "sphere", "cube", "cylinder", "triplanar"}))
        ->capture_default_str();
    verb->add_option("--relief-scale", args->relief_scale, "Its heights times this")
        ->check(CLI::Range(-1e6, 1e6))
        ->capture_default_str();
    verb->add_flag("--displace", args->displace, "Move the vertices, too, not the normals alone");
    verb->add_flag("--colors", args->colors, "Paint its colour subregions (relief --colors), too");
    verb->add_option("--grain", args->grain,
                     "A tile (.exr) of albedo, 0..1, laid around it likewise")
        ->excludes(levels);
    verb->add_option("--tile-side", args->tile_side,
                     "Of a tile on the object: 20cm, or 50% of its longest side [its own]");
    verb->add_option("--material", args->material,
                     "Light it plainly, as a relief preset is: broken-rock, unglazed-china, "
                     "casting, ... [sky and sun]");
    verb->add_option("--reflection", args->reflection,
                     "With --material: ambient, diffuse, specular weight and exponent instead of "
                     "its own, as 0.2,1,1,20")
        ->delimiter(',')
        ->expected(4)
        ->check(CLI::Range(0.0, 1000.0));
    verb->add_option("--light-azimuth", args->light_azimuth,
                     "With --material: where light comes from, from the right towards up [135]");
    verb->add_option("--light-elevation", args->light_elevation,
                     "With --material: towards the eye [40]");
    verb->add_flag("--wireframe", s.wireframe, "Show the triangles");
    verb->add_flag("--flat", args->flat, "Shade by faces instead of by normals");
    verb->add_flag("--no-ground", args->no_ground, "Without the plain that takes the shadow");
    verb->add_option("--seed", s.seed, "Of the sampling")
        ->check(CLI::Range(0.0, 9.2e18))
        ->capture_default_str();
    args->file.add_mesh_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
