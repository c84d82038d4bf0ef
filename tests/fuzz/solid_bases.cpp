// A few small valid level sets and recipes.
#include <map>

#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "tests/fuzz/formats.h"
#include "tests/support/level_sets.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

const std::string kRecipe = R"({"taihu_recipe":1,"seed":0,"voxel_m":0.1,"solid":)"
                            R"({"sphere":{"size_m":[1,1,1]}}})";

} // namespace

std::vector<std::string> vdb_bases() {
    const auto solid = ball_grid(0.2, 0.1);
    return {
        format_vdb(*solid, kRecipe, "base"),
        format_vdb(*solid, "", "base", R"({"box":[[-64,-64,-64],[63,63,63]],"of":"tiles.json"})"),
        format_vdb(*ball_grid(0.25, 0.2), "", "base")};
}

namespace {

/// The files that recipes name, by name.
std::map<std::string, std::string> recipe_files() {
    return {{"rock.ply", ply_bases().front()},
            {"holes.csv", holes_bases().front()},
            {"law.json", law_bases().front()},
            {"tile.exr", exr_bases().front()},
            {"base.vdb", format_vdb(*ball_grid(0.5, 0.1), "", "base")}};
}

std::string recipe(const std::string& solid, const std::string& more = {}) {
    return R"({"taihu_recipe": 1, "seed": 3, "dim": 32, )" + more + R"("solid": )" + solid + "}";
}

} // namespace

void write_recipe_files(const std::filesystem::path& folder) {
    for (const auto& [name, bytes] : recipe_files())
        write_file(folder / name, bytes);
}

std::vector<std::string> recipe_bases() {
    std::map<std::string, std::string> named; // `"file": NAME, "sha256": HASH`
    for (const auto& [name, bytes] : recipe_files())
        named[name] = '"' + name + R"(", "sha256": ")" + sha256_hex(bytes) + '"';
    const std::string ball = R"({"sphere": {"size_m": [1, 1, 1]}})";
    const std::string lod = R"("about": "x", "set": {"size": "/solid/union/of"}, "lod":
 {"levels": 3, "bound_vox": 0.5, "factor": 2, "openness": true, "origin": "foot", "maps":
 {"size_px": 128, "gutter_px": 2, "rays": 16, "cage_m": 0.1, "grain_m": 0.01, "only": 0}}, )";
    const std::string holes =
        R"({"holes": {"law": {"family": "exponential", "parameters": {"rate": 9}}, "count": 5,
 "scale_m": 0.5, "seed": 1, "pattern": {"thomas": {"clusters_m3": 4, "spread_m": 0.1}},
 "height": [0.1, 0.9], "box_m": [[-1, -1, -1], [1, 1, 1]]}})";
    return {
        recipe(ball),
        recipe(R"({"union": {"blend_m": 0.05, "of": [{"ellipsoid": {"size_m": [1, 2, 1]}},
 {"rounded_box": {"size_m": [1, 1, 1], "round_m": 0.1}}, {"cylinder": {"size_m": [1, 1, 1]}},
 {"torus": {"size_m": [1, 0.3, 1], "tube_m": 0.2}},
 {"superquadric": {"size_m": [1, 1, 1], "exponents": [0.5, 1.5]}},
 {"boulder": {"size_m": [1, 1, 1], "subdivisions": 2, "relief": 0.3, "lumps": 2, "seed": 5}},
 {"fractal_rock": {"size_m": [1, 1, 1], "base": 1, "iterations": 1, "damping": "none",
  "along": "radius", "amplitude": 0.2, "hurst": [0.5, 0.7], "corners": 0.2, "roundness": 0.5}}]}})",
               lod),
        recipe(R"({"clean": {"pieces": 2, "bubbles": "keep", "foot_deg": 5, "of": {"difference":
 {"of": [{"intersection": {"of": [{"plane": {"normal": [0, 1, 0.1], "point_m": [0, 0.2, 0]}}, )" +
                   ball + R"(]}}, {"material": {}}, )" + holes + R"(]}}}})",
               R"("material": {"file": )" + named["holes.csv"] + "}, "),
        recipe(R"({"transform": {"scale": 2, "axis": [0, 1, 0], "angle_deg": 30,
 "move_m": [1, 0, 0], "of": {"shell": {"inwards_m": 0.1, "outwards_m": 0.05, "of":
 {"offset": {"by_m": 0.1, "of": {"embed": {"gap_m": 0.01, "of": [{"mesh": {"file": )" +
               named["rock.ply"] + R"(, "unit_m": 0.5, "up": "z", "close": "winding"}},
 {"level_set": {"file": )" +
               named["base.vdb"] + R"(}}]}}}}}}}})"),
        recipe(R"({"rough": {"relief": "furrows", "amplitude_m": 0.02, "largest_m": 0.2,
 "smallest_m": 0.05, "stretch": 2, "along": [0, 1, 0], "of": {"weather": {"sigma_m": 0.05,
 "steps": 2, "rounding": 0.5, "durability": {"contrast": 0.5, "largest_m": 0.3}, "of":
 {"warp": {"amplitude_m": 0.03, "largest_m": 0.8, "hurst": 0.6, "of": {"bites": {"count": 4,
 "mean_m": 0.15, "least_m": 0.1, "most_m": 0.3, "chain": 2, "clusters": {"count": 2,
 "spread_m": 0.2}, "of": )" +
               ball + R"(}}}}}}}})"),
        recipe(R"({"relief": {"tile": {"file": )" + named["tile.exr"] +
               R"(}, "amplitude_m": 0.02, "side_m": 0.5, "sharpness": 4, "facing": [0.1, 0.8, 1],
 "of": {"relief": {"tile": {"taihu_relief": 1, "law": "fractal", "size_px": 17, "hurst": 0.5},
 "amplitude_m": 0.01, "of": {"difference": {"of": [)" +
               ball + R"(, {"holes": {"law": )" + named["law.json"] +
               R"(, "porosity": 0.1, "scale_m": 1, "seed": 7,
 "pattern": {"joints": {"n": 3, "scatter_m": 0.01}}}}]}}}}}})")};
}

} // namespace taihu
