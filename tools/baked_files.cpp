#include "tools/baked_files.h"

#include <algorithm>
#include <vector>

#include "mesh_out/io/mesh_file.h"
#include "mesh_out/lod.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

LodChain make_chain(const openvdb::FloatGrid& grid, const Field* field, const RecipeLod& lod,
                    const Console& console) {
    LodSettings settings;
    for (const double bound_m : lod.bounds_m)
        settings.levels.push_back({bound_m, 0});
    for (const std::uint64_t n : lod.triangles)
        settings.levels.push_back({0, n});
    const auto only = lod.maps->only;
    settings.openness = lod.openness && only.has_value(); // baked ones have a texture for it
    LodChain chain = make_lods(grid, field, settings, console.progress);
    if (only && static_cast<std::size_t>(*only) >= chain.levels.size())
        throw Error(Fault::bad_argument, "--only: there is no level " + std::to_string(*only) +
                                             " of " + std::to_string(chain.levels.size()) +
                                             "; levels are counted from 0, the finest");
    return chain;
}

void tell(const fs::path& out, std::size_t j, const LodLevel& level, const BakedLevel& baked,
          const Console& console) {
    console.say("{}: level {}: {} triangles, error {:.3g} m; {} charts, {} x {} texels of {:.3g} m "
                "({:.0f} % used), normals {:.2f} degrees off, {:.2f} without the map",
                out.string(), j, level.certificate.n_triangles, level.error_m, baked.n_charts,
                baked.maps.normal.width, baked.maps.normal.height, baked.texel_m,
                100 * baked.used_rel, baked.relit.mean_deg, baked.relit.plain_mean_deg);
}

/// Bakes the levels of a chain one after another.
struct Baker {
    const fs::path& out;
    const LodChain& chain;
    const BakeSource& source;
    const RecipeLod& lod;
    double voxel_m;
    std::optional<FileSet>& masters;
    const Console& console;

    /// Far enough to reach what a level lost, and not the next wall.
    static double reach_m(const LodLevel& level, const RecipeLod& lod, double voxel_m) {
        return lod.maps->cage_m.value_or(voxel_m + 2 * level.bound_m);
    }
    BakedLevel bake(const LodLevel& level, double texel_m) const {
        const RecipeMaps& maps = *lod.maps;
        return bake_level(level, source,
                          {.reach_m = reach_m(level, lod, voxel_m),
                           .side_px = maps.side_px.value_or(kSide_px),
                           .texel_m = texel_m,
                           .most_side_px = maps.side_px.value_or(kMostSide_px),
                           .gutter_px = maps.gutter_px,
                           .grain_m = maps.grain_m,
                           .grain_contrast = maps.grain_contrast,
                           .occlusion = lod.openness,
                           .masters = masters.has_value(),
                           .vertices = maps.vertices},
                          console.progress);
    }
    /// The levels as they go into the file, and their figures into the report.
    std::vector<EncodedLevel> bake_all(nlohmann::ordered_json& report) const {
        const std::vector<double> coverages = screen_coverages(chain);
        std::vector<EncodedLevel> levels;
        double texel_per_bound = 0; // of the first level with maps: others are seen from farther
        for (std::size_t j = 0; j < chain.levels.size(); ++j) {
            const LodLevel& level = chain.levels[j];
            levels.push_back(level.encoded);
            if (!lod.maps->only || static_cast<std::size_t>(*lod.maps->only) == j) {
                BakedLevel baked = bake(level, texel_per_bound * level.bound_m);
                if (texel_per_bound == 0)
                    texel_per_bound = baked.texel_m / level.bound_m;
                tell(out, j, level, baked, console);
                report["levels"][j]["bytes"] = baked.encoded.draco.size();
                report["levels"][j]["maps"] = maps_json(baked);
                if (masters)
                    masters->add_by([&](const fs::path& folder) {
                        write_maps(folder, fmt::format("level{}", j), baked.maps);
                    });
                levels.back() = std::move(baked.encoded);
            }
            levels.back().screen_coverage = coverages[j];
        }
        return levels;
    }
};

} // namespace

void BakedFiles::check(std::initializer_list<fs::path> inputs, const Console& console) const {
    if (mesh_format(out) != MeshFormat::glb)
        throw Error(Fault::unsupported, out.string() + ": maps go into a .glb; name one");
    std::vector<fs::path> others = inputs;
    const auto may_write = [&](const fs::path& path) {
        for (const fs::path& other : others)
            console.may_write(path, {other});
        others.push_back(path);
    };
    may_write(out);
    if (!report.empty())
        may_write(report);
    if (!maps.empty() && !fs::is_directory(maps))
        may_write(maps);
    for (int j = 0; !maps.empty() && fs::is_directory(maps) && j < 8; ++j)
        console.may_write(maps / fmt::format("level{}_normal.exr", j));
}

void write_together(const BakedFiles& files, std::optional<FileSet>& maps, std::string_view glb,
                    const nlohmann::ordered_json& report, const Console& console) {
    OutputFiles outputs;
    outputs.add(files.out, glb);
    outputs.add(files.report, report.dump(2) + "\n");
    if (maps)
        maps->list();
    const Publishing together;
    check_cancelled(console.progress);
    if (maps)
        maps->publish(kFileListName);
    outputs.publish();
}

nlohmann::ordered_json maps_json(const BakedLevel& baked) {
    return {{"size_px", baked.maps.normal.width},
            {"charts", baked.n_charts},
            {"texel_m", baked.texel_m},
            {"used", baked.used_rel},
            {"most_stretch", baked.most_stretch},
            {"stretched_area", baked.stretched_area_rel},
            {"texels", baked.maps.n_texels},
            {"nearest_texels", baked.maps.n_nearest},
            {"rms_displacement_m", baked.maps.rms_displacement_m},
            {"most_displacement_m", baked.maps.most_displacement_m},
            {"normal_error_deg", baked.relit.mean_deg},
            {"normal_error_without_deg", baked.relit.plain_mean_deg}};
}

nlohmann::ordered_json write_baked(const BakedFiles& files, openvdb::FloatGrid::ConstPtr grid,
                                   std::shared_ptr<const Field> field, const RecipeLod& lod,
                                   const std::string& recipe, const Console& console) {
    const double voxel_m = lattice_of(*grid).voxel_m;
    std::optional<FileSet> masters;
    if (!files.maps.empty())
        masters.emplace(files.maps);
    const LodChain chain = make_chain(*grid, field.get(), lod, console);
    if (!field)
        field = std::make_shared<PlacedLevelSetField>(grid);
    double reach_m = 0;
    for (const LodLevel& level : chain.levels)
        reach_m = std::max(reach_m, Baker::reach_m(level, lod, voxel_m));
    const BakeSource source =
        bake_source(*grid, *field, reach_m, lod.openness ? lod.maps->n_rays : 0, console.progress);
    auto report = nlohmann::ordered_json::parse(format_report(chain, base_name(files.out)));
    const auto levels =
        Baker{files.out, chain, source, lod, voxel_m, masters, console}.bake_all(report);
    GlbSettings glb{.recipe = recipe};
    if (lod.at_foot)
        glb.shift = foot_shift(chain.levels.front().certificate.box);
    const std::string bytes = format_glb(levels, glb);
    write_together(files, masters, bytes, report, console);
    console.say("{}: {} levels, {} bytes", files.out.string(), levels.size(), bytes.size());
    if (!chain.note.empty())
        console.say("{}: {}", files.out.string(), chain.note);
    return report;
}

} // namespace taihu
