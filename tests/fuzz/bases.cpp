// A few small valid files of every format, made by the writers where there are any.
#include <array>
#include <bit>
#include <cmath>

#include "mesh_out/io/exr_file.h"
#include "mesh_out/io/glb.h"
#include "mesh_out/io/image_file.h"
#include "mesh_out/io/mesh_file.h"
#include "mesh_out/position_grid.h"
#include "stats/core/file.h"
#include "stats/io/holes_file.h"
#include "stats/io/law_file.h"
#include "tests/fuzz/formats.h"
#include "tests/stats/io/annotation_makers.h"
#include "tests/stats/io/png_maker.h"
#include "tests/support/scratch.h"
#include "vdb_ops/icosphere.h"
#include "vdb_ops/relief.h"

namespace taihu {
namespace {

const std::string kRecipe = R"({"taihu_recipe":1,"seed":0,"voxel_m":0.1,"solid":)"
                            R"({"sphere":{"size_m":[1,1,1]}}})";

TriMesh tetrahedron() {
    return {{{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}},
            {{0, 1, 3}, {0, 3, 2}, {0, 2, 1}, {1, 2, 3}},
            {}};
}

/// On a grid of 1/256 and with normals and openness.
TriMesh ball() {
    TriMesh mesh = icosphere(1);
    for (Vec3& p : mesh.positions) {
        mesh.normals.push_back(normalized(p));
        mesh.openness.push_back(0.5f);
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = std::round(p[axis] * 256) / 256;
    }
    return mesh;
}

PositionGrid ball_grid_of_positions() {
    return {{-2, -2, -2}, 1.0 / 256, 10};
}

std::string png(int channels) {
    Image image(5, 4, channels);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = static_cast<float>(i % 7) / 6;
    return format_png(image, PngValues::light, "base");
}

EncodedLevel textured_level() {
    TexturedMesh textured{ball(), {}, {}};
    for (std::size_t i = 0; i < textured.mesh.positions.size(); ++i) {
        const Vec3 n = textured.mesh.normals[i];
        textured.texture.push_back(
            {(1 + std::round((n.x + 1) * 31)) / 64, (1 + std::round((n.y + 1) * 31)) / 64});
        textured.tangents.push_back(
            normalized(cross(std::fabs(n.y) < 0.9 ? Vec3{0, 1, 0} : Vec3{1, 0, 0}, n)));
    }
    const VertexValues values[] = {
        {"_CURVATURE", std::vector<float>(textured.mesh.positions.size(), 0.25f)}};
    EncodedLevel level = encode_draco(textured, ball_grid_of_positions(), values);
    level.normal_png = png(3);
    level.occlusion_png = png(1);
    level.colour_png = png(3);
    return level;
}

std::string exr(const ExrImage& image) {
    const Scratch scratch;
    write_exr(scratch / "base.exr", image);
    return read_file(scratch / "base.exr");
}

Image heights() {
    Image image(8, 8, 1);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = 0.01f * static_cast<float>(i % 5);
    return image;
}

std::string relief_text() {
    ReliefSettings settings;
    settings.size_px = 9;
    settings.corners_m = {0, 0.01, 0, 0.02};
    return format_relief(settings);
}

} // namespace

std::vector<std::string> obj_bases() {
    return {format_mesh(tetrahedron(), MeshFormat::obj, kRecipe),
            "# quads and n-gons\nmtllib a.mtl\no rock\nv -1 -1 -1 1 0 0\nv 1 -1 -1\nv 1 1 -1 0.5\n"
            "v -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nvt 0 0\nvn 0 0 1\nusemtl stone\n"
            "s off\nf 1/1/1 4//1 3 2\nf 5 6 7 8\nf 1 2 \\\n6 5\nf -6 -5 -1 -2\nf 4 8 7 3\n"
            "f 1 5 8 4\n",
            "\xef\xbb\xbfv 0 0 0\r\nv +1 0 0\r\nv 0 1e0 0\r\nv 1 1 0.5\r\nv 2 0.5 0\r\n"
            "f 1 2 5 4 3\r\n"};
}

std::vector<std::string> ply_bases() {
    const std::string header = "element vertex 4\nproperty double x\nproperty float y\n"
                               "property float z\nproperty uchar red\nelement face 2\n"
                               "property list uchar int vertex_indices\nend_header\n";
    std::string big = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\n"
                      "property float y\nproperty float z\nelement tristrips 1\n"
                      "property list int int vertex_indices\nend_header\n";
    for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f})
        big += big_endian(std::bit_cast<std::uint32_t>(x), 4);
    for (const std::uint32_t i : {4u, 0u, 1u, 2u, 0xffffffffu})
        big += big_endian(i, 4);
    return {format_mesh(tetrahedron(), MeshFormat::ply, kRecipe),
            "ply\nformat ascii 1.0\ncomment a comment\n" + header +
                "0 0 0 255\n1 0 0 0\n0 1 0 1\n1 1 .5 2\n3 0 1 2\n4 0 1 3 2\n",
            "ply\r\nformat ascii 1.0\r\nobj_info x\r\nelement face 1\r\n"
            "property list uchar uint vertex_index\r\nelement vertex 3\r\nproperty float x\r\n"
            "property float y\r\nproperty float z\r\nelement other 1\r\n"
            "property list ushort float weights\r\nend_header\r\n3 0 1 2\r\n0 0 0\r\n1 0 0\r\n"
            "0 1 0\r\n2 .5 .5\r\n",
            big};
}

std::vector<std::string> stl_bases() {
    const std::string facet = "  facet normal 0 0 1\n    outer loop\n      vertex 0 0 0\n"
                              "      vertex 1 0 0\n      vertex 0 1e0 0\n    endloop\n"
                              "  endfacet\n";
    return {format_mesh(tetrahedron(), MeshFormat::stl),
            "solid rock of two\n" + facet + facet + "endsolid rock of two\n",
            "solid\n" + facet + "endsolid\nsolid b\n" + facet + "endsolid b\n"};
}

std::vector<std::string> off_bases() {
    return {format_mesh(tetrahedron(), MeshFormat::off, kRecipe),
            "COFF\n# colours\n4 2 0\n0 0 0 255 0 0 255\n1 0 0 1 1 1 1\n0 1 0 0 0 0 1\n"
            "1 1 0.5 9 9 9 9\n3 0 1 2 255 255 0\n4 0 1 3 2\n",
            "NOFF 3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3\n0\n1\n2\n"};
}

std::vector<std::string> glb_bases() {
    const EncodedLevel level = encode_draco(ball(), ball_grid_of_positions());
    TriMesh small = tetrahedron();
    EncodedLevel coarse = encode_draco(small, *grid_of(small));
    coarse.screen_coverage = 0.1;
    const EncodedLevel one[] = {level}, levels[] = {level, coarse}, maps[] = {textured_level()};
    GlbSettings settings;
    settings.recipe = kRecipe;
    settings.shift = {0, 1, 0};
    return {format_mesh(ball(), MeshFormat::glb, kRecipe), format_mesh(small, MeshFormat::glb),
            format_glb(one, settings), format_glb(levels, settings), format_glb(maps, settings)};
}

std::vector<std::string> drc_bases() {
    return {format_mesh(ball(), MeshFormat::drc, kRecipe),
            format_mesh(tetrahedron(), MeshFormat::drc)};
}

std::vector<std::string> exr_bases() {
    return {exr({heights(),
                 {"Y"},
                 {{"pixel_m", "0.001"}, {"wrap", "periodic"}, {"taihu_relief", relief_text()}}}),
            exr({heights(), {"Y"}, {}})};
}

std::vector<std::string> png_bases() {
    std::vector<std::string> bases = {png(1), png(3), png(4)};
    const std::vector<unsigned char> samples(6 * 3 * 8, 100);
    for (const unsigned format :
         {unsigned{PNG_FORMAT_GRAY}, unsigned{PNG_FORMAT_GA}, unsigned{PNG_FORMAT_LINEAR_RGB}})
        bases.push_back(png_of(6, 3, format, samples));
    return bases;
}

std::vector<std::string> holes_bases() {
    const std::vector<Sphere> holes = {{{0.1, 0, -0.2}, 0.05}, {{1, 2, 3}, 1e-3}};
    const std::vector<std::string> comments = {"seed 7"};
    return {format_holes(holes, comments),
            "\xef\xbb\xbfradius_m;x_m;y_m;z_m\r\n0,5;1;2;3\r\n\"0,25\";0;0;0\r\n",
            "x_m\ty_m\tz_m\tdiameter_m\n1\t2\t3\t4\n"};
}

std::vector<std::string> table_bases() {
    return {"# unit=m\n# area=12.5\ndiameter\n0.1\n0.2\n0.15\n0.3\n0.12\n0.4\n0.22\n0.19\n1e-1\n",
            "# unit=greatest\ndiameter_lo,diameter_hi,count\n0,0.2,10\n0.2,0.4,5\n0.4,0.6,0\n"
            "0.6,1,3\n",
            "# unit=m\n" + csv_text(eight_holes(), "0.001"),
            "# area_m2=1.5\n# planes=2\n# volume_m3=0.7\nplane,u_m,v_m,diameter_m\n"
            "0,0.1,0.2,0.1\n0,0.3,0.1,0.2\n0,0,0,0.15\n1,0,0,0.12\n1,1,1,0.1\n1,0,1,0.3\n"
            "1,1,0,0.2\n0,1,0,0.25\n",
            imagej_results_text(eight_holes()),
            "\xef\xbb\xbf# unit=px\n\xe7\x9b\xb4\xe5\xbe\x84\n1\n2\n3\n4\n5\n6\n7\n8\n"};
}

std::vector<std::string> labelme_bases() {
    return {labelme_text(eight_holes())};
}

std::vector<std::string> via_bases() {
    return {via_json_text(eight_holes()), via_json_text(eight_holes(), ViaRegions::object),
            via_project_text(eight_holes()), via_csv_text(eight_holes()),
            via_csv_text(eight_holes(), "#")};
}

std::vector<std::string> cvat_bases() {
    return {cvat_text(eight_holes())};
}

std::vector<std::string> roi_bases() {
    const Drawn drawn = eight_holes().front();
    std::string polyline(64, '\0');
    polyline.replace(0, 8, "Iout" + big_endian(228, 2) + std::string("\x05\0", 2));
    polyline.replace(16, 2, big_endian(2, 2));
    for (const std::uint32_t v : {0u, 10u, 0u, 20u})
        polyline += big_endian(v, 2);
    return {roi_bytes(drawn), polyline};
}

std::vector<std::string> zip_bases() {
    return {roi_zip_bytes(eight_holes())};
}

std::vector<std::string> law_bases() {
    LawFile full;
    const double shape_scale[] = {1.257, 0.25};
    full.law = Law(Family::weibull, shape_scale);
    full.unit = LengthUnit::greatest;
    full.intervals = {{1.0, 1.5}, {0.2, 0.4}};
    full.level = 0.95;
    full.n_v = NumberDensity{31.7, 20.4, 48.3, 0.42};
    full.detection_limit = 0.1;
    full.n_profiles = 46;
    full.area = 10;
    full.ranking = {{Family::weibull, 172.8, 0.7}, {Family::exponential, 174.2, 0.3}};
    full.empirical = {{0, 0}, {0.25, 0.7}, {1, 1}};
    full.source = {{"rock.csv", std::string(64, 'a')}};
    LawFile bare;
    bare.law = Law::exponential(7);
    LawFile table;
    table.law = Law::empirical({{0, 0}, {0.5, 0.5}, {2, 1}});
    return {format_law_file(full), format_law_file(bare), format_law_file(table)};
}

std::vector<std::string> tiles_bases() {
    return {R"({"taihu_tiles": 1, "voxel_m": 0.01, "origin_m": [0, 0.5, 0], "half_width_vox": 3,
 "tile_voxels": 128, "recipe": )" +
            kRecipe + R"(, "tiles": [
  {"file": "tile_0_0_0.vdb", "box": [[0, 0, 0], [127, 127, 127]], "leaves": 10, "bytes": 1000,
   "sha256": ")" +
            std::string(64, 'a') + R"("},
  {"file": "tile_128_0_0.vdb", "box": [[128, 0, 0], [255, 127, 127]], "leaves": 3, "bytes": 99,
   "sha256": ")" +
            std::string(64, 'b') + R"("}]})"};
}

std::vector<std::string> relief_bases() {
    std::vector<std::string> bases = {relief_text()};
    for (const ReliefLaw law :
         {ReliefLaw::casting, ReliefLaw::convex, ReliefLaw::sinusoid, ReliefLaw::damped_wave}) {
        ReliefSettings settings;
        settings.law = law;
        settings.n_colors = 3;
        bases.push_back(format_relief(settings));
    }
    return bases;
}

} // namespace taihu
