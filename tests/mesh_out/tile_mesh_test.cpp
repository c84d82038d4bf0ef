#include <algorithm>
#include <array>
#include <tuple>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "mesh_out/certificate.h"
#include "mesh_out/io/mesh_file.h"
#include "mesh_out/piece_sides_detail.h"
#include "mesh_out/tile_mesh.h"
#include "stats/core/file.h"
#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/scratch.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/tiles.h"

namespace taihu {
namespace {

const Lattice kLattice{0.05, {0.0113, -0.0071, 0.0037}, 3};

/// A hollow ball over the corner of eight tiles and another one, with holes.
std::shared_ptr<const Field> solid() {
    std::vector<Sphere> holes = {{{-0.4, 0.2, 0}, 0.4}};
    for (std::uint64_t i = 0; i < 40; ++i)
        holes.push_back({random_vec(i) * 1.1, 0.05 * (1 + 4 * random_number(i, 5))});
    return std::make_shared<DifferenceField>(std::make_shared<BallsField>(std::vector<Sphere>{
                                                 {{-0.4, 0.2, 0}, 0.9}, {{1.9, 0.5, 0.3}, 0.9}}),
                                             std::make_shared<BallsField>(holes));
}

using Face = std::array<std::array<double, 3>, 3>;

/// As floats, sorted, each from its least corner.
std::vector<Face> faces(const std::vector<Vec3>& positions,
                        const std::vector<Triangle>& triangles) {
    std::vector<Face> all;
    for (const Triangle& t : triangles) {
        Face f;
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t axis = 0; axis < 3; ++axis)
                f[k][axis] = static_cast<float>(positions[t[k]][static_cast<int>(axis)]);
        std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
        all.push_back(f);
    }
    std::sort(all.begin(), all.end());
    return all;
}

TEST(TileMesh, IsTheSurfaceOfTheWhole) {
    const Scratch folder;
    write_tiles(folder / "tiles", *solid(), kLattice, {.tile_voxels = 128, .clean = {}}, "");
    const auto set = folder / "tiles" / kTileSetName;
    const TileMeshResult made = write_tile_mesh(set, folder / "rock.ply");
    EXPECT_TRUE(made.holds());
    EXPECT_EQ(made.n_tiles, read_tile_set(set).tiles.size());
    EXPECT_EQ(made.n_tiles, 8u);
    EXPECT_EQ(made.n_self_intersections, 0u);
    EXPECT_EQ(made.n_bytes, std::filesystem::file_size(folder / "rock.ply"));

    TriMesh mesh = read_mesh(folder / "rock.ply").levels.front();
    turn_small_pieces(mesh.positions, mesh.triangles); // which takes the whole
    const LabelledMesh whole = extract(*read_tiles(set), nullptr);
    EXPECT_EQ(faces(mesh.positions, mesh.triangles), faces(whole.positions, whole.triangles));
    const Certificate c = certify(mesh);
    EXPECT_TRUE(c.holds());
    EXPECT_EQ(made.n_vertices, c.n_vertices);
    EXPECT_EQ(made.n_triangles, c.n_triangles);
    EXPECT_EQ(made.n_components, c.n_components);
    EXPECT_EQ(made.genus, c.genus);
    // Pieces of a voxel or two were turned.
    EXPECT_NEAR(made.volume_m3, c.volume_m3, 1e-4 * c.volume_m3);
    EXPECT_NEAR(made.area_m2, c.area_m2, 1e-9 * c.area_m2);
    for (const auto& file : std::filesystem::directory_iterator(folder.path()))
        EXPECT_THAT(file.path().filename().string(), testing::AnyOf("tiles", "rock.ply"));
}

TEST(TileMesh, RefusesTilesThatAreNone) {
    const Scratch folder;
    write_tiles(folder / "tiles", *solid(), kLattice, {.tile_voxels = 128, .clean = {}}, "");
    const auto set = folder / "tiles" / kTileSetName;
    const auto refused = [&](const std::string& text, const std::string& message) {
        write_file(set, text);
        expect_error(Fault::bad_input, message, [&] { write_tile_mesh(set, folder / "rock.ply"); });
        EXPECT_FALSE(std::filesystem::exists(folder / "rock.ply"));
    };
    const auto good = nlohmann::json::parse(read_file(set));
    auto bad = good;
    bad["tiles"][0]["box"][0][0] = good["tiles"][0]["box"][0][0].get<int>() + 1;
    refused(bad.dump(), "its box is not one of a tile");
    bad = good;
    bad["tiles"][1]["box"] = bad["tiles"][0]["box"];
    refused(bad.dump(), "or another's");
    bad = good;
    bad["tile_voxels"] = 130;
    refused(bad.dump(), "must be a multiple of 128");
    bad = good;
    bad["tiles"][0]["sha256"] = bad["tiles"][1]["sha256"];
    refused(bad.dump(), "another file than the one");
}

} // namespace
} // namespace taihu
