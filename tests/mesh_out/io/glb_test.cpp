#include "mesh_out/io/glb.h"

#include <nlohmann/json.hpp>

#include "mesh_out/io/binary_detail.h"
#include "tests/mesh_out/io/grid_ball.h"
#include "tests/mesh_out/io/mesh_bytes.h"

namespace taihu {
namespace {

using Json = nlohmann::json;

struct Chunks {
    Json json;
    std::string bin;
};

std::string join(const Chunks& chunks) {
    std::string text = chunks.json.dump(), bin = chunks.bin, out = "glTF";
    text.resize((text.size() + 3) / 4 * 4, ' ');
    bin.resize((bin.size() + 3) / 4 * 4);
    append_number(out, std::uint32_t{2});
    append_number(out, static_cast<std::uint32_t>(28 + text.size() + bin.size()));
    append_number(out, static_cast<std::uint32_t>(text.size()));
    out += "JSON" + text;
    append_number(out, static_cast<std::uint32_t>(bin.size()));
    return out + std::string("BIN\0", 4) + bin;
}

Chunks split(const std::string& bytes) {
    const auto n = load_number<std::uint32_t>(bytes.data() + 12);
    return {Json::parse(bytes.substr(20, n)), bytes.substr(28 + n)};
}

MeshFile parse(const std::string& bytes) {
    return parse_mesh(bytes, MeshFormat::glb, "rock");
}

/// One node with one primitive: 5 float positions and 6 indices of a type of one's own.
template <class Index>
Chunks two_triangles(std::uint64_t type) {
    Chunks out;
    for (const float v : {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 2, 0})
        append_number(out.bin, v);
    for (const int i : {0, 1, 2, 1, 3, 2})
        append_number(out.bin, static_cast<Index>(i));
    out.json = {
        {"asset", {{"version", "2.0"}, {"generator", "a test"}}},
        {"scene", 0},
        {"scenes", {{{"nodes", {0}}}}},
        {"nodes", {{{"mesh", 0}}}},
        {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}}},
        {"accessors",
         {{{"bufferView", 0}, {"componentType", 5126}, {"count", 5}, {"type", "VEC3"}},
          {{"bufferView", 1}, {"componentType", type}, {"count", 6}, {"type", "SCALAR"}}}},
        {"bufferViews",
         {{{"buffer", 0}, {"byteLength", 60}},
          {{"buffer", 0}, {"byteOffset", 60}, {"byteLength", 6 * sizeof(Index)}}}},
        {"buffers", {{{"byteLength", out.bin.size()}}}}};
    return out;
}

Chunks small() {
    return two_triangles<std::uint16_t>(5123);
}

std::vector<EncodedLevel> levels() {
    std::vector<EncodedLevel> out;
    for (const int n : {8, 4, 2}) {
        out.push_back(encode_draco(grid_ball(n, 1, 0x1p-8), centred_grid(0x1p-8, 10)));
        out.back().screen_coverage = n / 16.0;
    }
    return out;
}

/// A file of one Draco level, with 4 n^2 + 2 points.
std::string draco_glb(int n) {
    const EncodedLevel level = encode_draco(grid_ball(n, 1, 0x1p-8), centred_grid(0x1p-8, 10));
    return format_glb({&level, 1});
}

void refused(const Json& patch, Fault fault, const std::vector<std::string>& parts) {
    Chunks chunks = small();
    chunks.json = chunks.json.patch(patch);
    expect_refused(join(chunks), MeshFormat::glb, fault, parts);
}
Json replaced(const std::string& path, const Json& value) {
    return Json::array({{{"op", "add"}, {"path", path}, {"value", value}}});
}

TEST(GlbReader, ReadsEveryTypeOfIndex) {
    for (const std::string& bytes :
         {join(two_triangles<std::uint8_t>(5121)), join(two_triangles<std::uint16_t>(5123)),
          join(two_triangles<std::uint32_t>(5125))}) {
        const MeshFile file = parse(bytes);
        EXPECT_EQ(file.levels[0].triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
        EXPECT_EQ(file.levels[0].positions[4], (Vec3{2, 2, 0}));
        EXPECT_EQ(file.generator, "a test");
        EXPECT_FALSE(file.draco);
    }
}

TEST(GlbReader, ReadsStripsFansAndUnindexedTriangles) {
    const auto with = [](int mode, bool indexed, int n) {
        Chunks chunks = small();
        Json& primitive = chunks.json["meshes"][0]["primitives"][0];
        primitive["mode"] = mode;
        chunks.json["accessors"][0]["count"] = n;
        if (!indexed)
            primitive.erase("indices");
        return parse(join(chunks));
    };
    EXPECT_EQ(with(5, false, 5).levels[0].triangles,
              (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
    EXPECT_EQ(with(6, false, 5).levels[0].triangles,
              (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
    EXPECT_EQ(with(4, false, 3).levels[0].triangles, (std::vector<Triangle>{{0, 1, 2}}));
    // 0 1 2 1 3 2: the second triangle of the strip folds; it only carries the strip on.
    const MeshFile strip = with(5, true, 5);
    EXPECT_EQ(strip.levels[0].triangles.size(), 3u);
    EXPECT_EQ(strip.n_degenerate_faces, 0u);
}

TEST(GlbReader, ReadsQuantisedPositionsWithAStride) {
    for (const bool normalized : {false, true}) {
        Chunks chunks = small();
        chunks.bin.clear();
        for (const int v : {0, 0, 0, 9, -32768, 0, 0, 9, 0, 32767, 0, 9}) // every fourth is padding
            append_number(chunks.bin, static_cast<std::int16_t>(v));
        chunks.json["accessors"] = {{{"bufferView", 0},
                                     {"componentType", 5122},
                                     {"normalized", normalized},
                                     {"count", 3},
                                     {"type", "VEC3"}}};
        chunks.json["bufferViews"] = {{{"buffer", 0}, {"byteLength", 24}, {"byteStride", 8}}};
        chunks.json["buffers"][0]["byteLength"] = 24;
        chunks.json["meshes"][0]["primitives"][0].erase("indices");
        chunks.json["extensionsRequired"] = {"KHR_mesh_quantization", "KHR_materials_unlit"};
        const double s = normalized ? 1.0 / 32767 : 1;
        EXPECT_EQ(parse(join(chunks)).levels[0].positions,
                  (std::vector<Vec3>{
                      {0, 0, 0}, {normalized ? -1.0 : -32768.0, 0, 0}, {0, 32767 * s, 0}}));
    }
}

TEST(GlbReader, PlacesNodesAndTurnsMirroredFaces) {
    Chunks chunks = small();
    chunks.json["nodes"] = {
        {{"children", {1, 2}}, {"translation", {10, 0, 0}}, {"scale", {2, 2, 2}}},
        {{"mesh", 0}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}}, // x becomes y
        {{"mesh", 0}, {"matrix", {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1}}}};
    const TriMesh mesh = parse(join(chunks)).levels[0];
    ASSERT_EQ(mesh.positions.size(), 10u);
    EXPECT_NEAR(length(mesh.positions[1] - Vec3{10, 2, 0}), 0, 1e-15); // of sqrt(0.5)^2
    EXPECT_EQ(mesh.positions[6], (Vec3{8, 0, 10}));
    EXPECT_EQ(mesh.triangles[2], (Triangle{5, 7, 6}));
}

TEST(GlbReader, NamesWhatIsWrong) {
    const auto bad = Fault::bad_input;
    refused(replaced("/accessors/0/count", 6), bad, {"byte 20", "accessors[0] with 6 elements"});
    refused(replaced("/accessors/0/count", 4294967296), bad, {"with 4294967296 elements"});
    refused(replaced("/accessors/0/count", 18446744073709551615u), bad, {"0 to 2^32"});
    refused(replaced("/accessors/0/count", -1), bad, {"accessors[0].count is -1"});
    refused(replaced("/accessors/0/count", 1.5), bad, {"accessors[0].count is 1.5"});
    refused(replaced("/accessors/0/count", 0), bad, {"0 elements"});
    refused(replaced("/accessors/0/byteOffset", 4294967288), bad, {"does not fit"});
    refused(replaced("/accessors/0/type", "VEC2"), bad, {"accessors[0].type"});
    refused(replaced("/accessors/0/componentType", 5124), bad, {"componentType is 5124"});
    refused(replaced("/accessors/1/componentType", 5126), bad, {"accessors[1] with 6 elements"});
    refused(replaced("/accessors/1/count", 5), bad, {"has 5 corners"});
    refused(replaced("/accessors/0/count", 3), bad, {"is 3, but there are 3 vertices"});
    refused(replaced("/accessors/0/sparse", Json::object()), Fault::unsupported, {"is sparse"});
    refused(replaced("/bufferViews/0/byteLength", 1000), bad, {"bufferViews[0] reaches"});
    refused(replaced("/bufferViews/0/byteOffset", 4294967295), bad, {"bufferViews[0] reaches"});
    refused(replaced("/bufferViews/0/byteStride", 300), bad, {"byteStride is 300"});
    refused(replaced("/bufferViews/0/byteStride", 4), bad, {"byteStride is 4"});
    refused(replaced("/bufferViews/0/buffer", 1), bad, {"buffers[1] is named, but there are 1"});
    refused(replaced("/bufferViews/0/extensions", {{"EXT_meshopt_compression", Json::object()}}),
            Fault::unsupported, {"EXT_meshopt_compression"});
    refused(replaced("/buffers/0/byteLength", 1000), bad, {"the BIN chunk 72"});
    refused(replaced("/buffers/0/uri", "../../etc/passwd"), Fault::unsupported,
            {"external file '../../etc/passwd'"});
    refused(replaced("/buffers/0/uri", "data:application/octet-stream;base64,AAAA"),
            Fault::unsupported, {"data: URI"});
    refused(replaced("/extensionsRequired", {"EXT_meshopt_compression"}), Fault::unsupported,
            {"requires the extension 'EXT_meshopt_compression'"});
    refused(replaced("/nodes/0/children", {0}), bad, {"nodes[0] is reached twice"});
    refused(replaced("/nodes/0/children", {7}), bad, {"nodes[7] is named"});
    refused(replaced("/nodes/0/mesh", 1), bad, {"meshes[1] is named"});
    refused(replaced("/nodes/0/scale", {1, 2}), bad, {"nodes[0].scale is not 3 finite"});
    refused(replaced("/nodes/0/rotation", {0, 0, 0, 2}), bad, {"unit quaternion"});
    refused(
        replaced("/nodes/0/matrix", Json::array({1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1})),
        bad, {"not affine"});
    refused(replaced("/nodes/0/extensions", {{"EXT_mesh_gpu_instancing", Json::object()}}),
            Fault::unsupported, {"EXT_mesh_gpu_instancing"});
    refused(replaced("/meshes/0/primitives/0/mode", 7), bad, {"mode is 7"});
    refused(replaced("/meshes/0/primitives/0/mode", 1), bad, {"no face"});
    refused(replaced("/meshes/0/primitives/0/attributes", Json::object()), bad, {"no POSITION"});
    refused(replaced("/scene", 3), bad, {"scenes[3] is named"});
    refused(replaced("/asset", 3), bad, {"there is no asset"});
    Chunks chunks = small();
    chunks.bin.replace(0, 4, std::string("\0\0\xc0\x7f", 4));
    expect_refused(join(chunks), MeshFormat::glb, bad, {"element 0 of accessors[0] is not finite"});
}

TEST(GlbReader, NamesWhatIsWrongWithTheContainer) {
    const auto bad = [](std::string bytes, std::size_t at, char value, const std::string& part) {
        bytes[at] = value;
        expect_refused(bytes, MeshFormat::glb, at == 4 ? Fault::unsupported : Fault::bad_input,
                       {part});
    };
    const std::string bytes = join(small());
    bad(bytes, 0, 'x', "byte 0: the file does not begin with glTF");
    bad(bytes, 4, 1, "byte 4: glTF version 1");
    bad(bytes, 8, 0, "byte 8: the header says");
    bad(bytes, 15, 1, "byte 12: a chunk reaches past");
    bad(bytes, 16, 'X', "byte 12: the first chunk is not JSON");
    bad(bytes, 21, '!', "JSON:1:2: not JSON");
    std::string twice = bytes;
    twice.replace(twice.find("\"nodes\""), 7, "\"asset\"");
    expect_refused(twice, MeshFormat::glb, Fault::bad_input, {"key \"asset\" is there twice"});
    expect_refused("{\"asset\": {}}", MeshFormat::glb, Fault::bad_input, {"save the .gltf"});
    std::string deep(100000, '[');
    std::string file = "glTF";
    for (const std::size_t word : {std::size_t{2}, 20 + deep.size(), deep.size()})
        append_number(file, static_cast<std::uint32_t>(word));
    expect_refused(file + "JSON" + deep, MeshFormat::glb, Fault::bad_input, {"nested deeper"});
}

TEST(GlbReader, RefusesFilesThatUnfoldWithoutEnd) {
    Chunks chunks = small();
    chunks.bin.resize(60000); // 5000 positions
    chunks.json["buffers"][0]["byteLength"] = 60000;
    chunks.json["bufferViews"][0]["byteLength"] = 60000;
    chunks.json["accessors"][0]["count"] = 5000;
    for (int i = 1; i < 4000; ++i) {
        chunks.json["nodes"].push_back({{"mesh", 0}});
        chunks.json["scenes"][0]["nodes"].push_back(i);
    }
    expect_refused(join(chunks), MeshFormat::glb, Fault::bad_input, {"unfolds into over 16777216"});
    chunks = small();
    for (int i = 0; i < 100; ++i) {
        chunks.json["nodes"][static_cast<std::size_t>(i)]["children"] = {i + 1};
        chunks.json["nodes"].push_back({{"mesh", 0}});
    }
    expect_refused(join(chunks), MeshFormat::glb, Fault::bad_input, {"nested deeper than 64"});
}

TEST(GlbReader, RefusesPartsWithoutTrianglesWithoutEnd) {
    Chunks chunks = small();
    for (int i = 0; i < 1500; ++i)
        chunks.json["meshes"][0]["primitives"].push_back({{"mode", 0}});
    for (int i = 1; i < 1500; ++i) {
        chunks.json["nodes"].push_back({{"mesh", 0}});
        chunks.json["scenes"][0]["nodes"].push_back(i);
    }
    expect_refused(join(chunks), MeshFormat::glb, Fault::bad_input, {"unfolds into over 16777216"});
}

TEST(GlbReader, RefusesEveryShorterFileAndSurvivesChangedBytes) {
    expect_prefixes_refused(join(small()), MeshFormat::glb);
    expect_mutations_safe(join(small()), MeshFormat::glb, 4000);
    const std::string draco = draco_glb(2);
    expect_prefixes_refused(draco, MeshFormat::glb);
    expect_mutations_safe(draco, MeshFormat::glb, 4000);
}

TEST(PlainGlb, RoundTripsWithNormalsAndRecipe) {
    const TriMesh ball = grid_ball(4, 1, 0x1p-8);
    const std::string bytes = format_mesh(ball, MeshFormat::glb, "{\"seed\": 1, \"dim\": [64]}");
    const MeshFile back = parse(bytes);
    EXPECT_EQ(back.levels[0].positions, ball.positions);
    EXPECT_EQ(back.levels[0].triangles, ball.triangles);
    ASSERT_EQ(back.levels[0].normals.size(), ball.normals.size());
    for (std::size_t i = 0; i < ball.normals.size(); ++i) // normals are floats in the file
        EXPECT_LT(length(back.levels[0].normals[i] - ball.normals[i]), 1e-6);
    EXPECT_EQ(back.recipe, R"({"dim":[64],"seed":1})");
    EXPECT_EQ(back.generator, "taihu");
    const Json json = split(bytes).json;
    EXPECT_EQ(json["asset"]["extras"]["taihu_recipe"]["seed"], 1);
    EXPECT_TRUE(json["meshes"][0]["primitives"][0]["attributes"].contains("NORMAL"));
    EXPECT_EQ(json["accessors"][0]["min"], Json({-1.0, -1.0, -1.0}));
    EXPECT_EQ(bytes.size() % 4, 0u);
    EXPECT_EQ(parse(format_mesh(ball, MeshFormat::glb, "no JSON")).recipe, "no JSON");
}

TEST(GlbReader, NormalsTurnWithTheirNodeAndStayAtRightAngles) {
    Chunks chunks = split(format_mesh(grid_ball(4, 1, 0x1p-8), MeshFormat::glb, ""));
    // Mirrored, turned a quarter about Z and stretched: x' = -y, y' = -2 x, z' = 3 z.
    chunks.json["nodes"][0]["matrix"] = {0, -2, 0, 0, -1, 0, 0, 0, 0, 0, 3, 0, 5, 6, 7, 1};
    const TriMesh mesh = parse(join(chunks)).levels[0];
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    EXPECT_GT(signed_volume_m3(mesh), 0);
    for (const Triangle& t : mesh.triangles) {
        const Vec3 face = cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                                mesh.positions[t[2]] - mesh.positions[t[0]]);
        for (const std::uint32_t v : t)
            EXPECT_GT(dot(face, mesh.normals[v]), 0);
    }
    chunks.json["meshes"][0]["primitives"][0]["attributes"].erase("NORMAL");
    EXPECT_TRUE(parse(join(chunks)).levels[0].normals.empty());
}

TEST(FormatGlb, GivesBackEveryLevel) {
    const auto made = levels();
    const std::string bytes = format_glb(made, {.name = "stone", .recipe = "{\"seed\":1}"});
    EXPECT_EQ(bytes, format_glb(made, {.name = "stone", .recipe = "{\"seed\":1}"}));
    const MeshFile file = parse(bytes);
    EXPECT_TRUE(file.draco);
    EXPECT_EQ(file.recipe, "{\"seed\":1}");
    EXPECT_EQ(file.coverages, (std::vector<double>{0.5, 0.25, 0.125}));
    ASSERT_EQ(file.levels.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(file.levels[i].positions, made[i].decoded.positions);
        EXPECT_EQ(file.levels[i].triangles, made[i].decoded.triangles);
    }
    const Json json = split(bytes).json;
    EXPECT_EQ(json["scenes"], Json::array({{{"nodes", {0}}}}));
    EXPECT_EQ(json["nodes"][0]["extensions"]["MSFT_lod"]["ids"], Json({1, 2}));
    EXPECT_EQ(json["nodes"][2]["name"], "stone_lod2");
    EXPECT_EQ(json["extensionsRequired"], Json({"KHR_draco_mesh_compression"}));
    EXPECT_EQ(json["extensionsUsed"], Json({"KHR_draco_mesh_compression", "MSFT_lod"}));
    EXPECT_EQ(json["materials"].size(), 1u);
}

TEST(FormatGlb, NeedsNoLodExtensionForOneLevel) {
    const Json json = split(draco_glb(8)).json;
    EXPECT_EQ(json["extensionsUsed"], Json({"KHR_draco_mesh_compression"}));
    EXPECT_FALSE(json["nodes"][0].contains("extensions"));
}

TEST(FormatGlb, RefusesSettingsOutOfRange) {
    EXPECT_THROW(format_glb({}), Error);
    EXPECT_THROW(format_glb(levels(), {.roughness = 1.5}), Error);
    EXPECT_THROW(format_glb(levels(), {.grey = -0.1}), Error);
    EXPECT_THROW(format_glb(std::vector<EncodedLevel>(1)), Error);
}

// Four files that the official validator and viewers take without a word.
TEST(DracoGlb, PartsShareAStreamOrHaveTheirOwn) {
    Chunks chunks = split(draco_glb(4));
    Json& primitives = chunks.json["meshes"][0]["primitives"];
    const std::size_t n = parse(join(chunks)).levels[0].triangles.size();
    for (int i = 0; i < 40; ++i)
        primitives.push_back(primitives[0]);
    EXPECT_EQ(parse(join(chunks)).levels[0].triangles.size(), 41 * n);

    // Streams of their own, more than one program reads at once.
    Chunks apart = chunks;
    const Json first = apart.json["bufferViews"][0];
    const std::string stream = apart.bin.substr(first.value("byteOffset", std::size_t{0}),
                                                first["byteLength"].get<std::size_t>());
    for (std::size_t i = 1; i < 41; ++i) {
        apart.json["meshes"][0]["primitives"][i]["extensions"]["KHR_draco_mesh_compression"]
                  ["bufferView"] = apart.json["bufferViews"].size();
        apart.json["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", apart.bin.size()}, {"byteLength", stream.size()}});
        apart.bin += stream;
        apart.bin.resize((apart.bin.size() + 3) / 4 * 4);
    }
    apart.json["buffers"][0]["byteLength"] = apart.bin.size();
    EXPECT_EQ(parse(join(apart)).levels[0].triangles.size(), 41 * n);
    apart.bin[apart.bin.size() - stream.size()] = 'X';
    expect_refused(join(apart), MeshFormat::glb, Fault::bad_input, {"not a Draco stream"});

    // A view of its own of the same bytes, and one more than the file can have.
    Json& view = primitives[1]["extensions"]["KHR_draco_mesh_compression"]["bufferView"];
    view = chunks.json["bufferViews"].size();
    chunks.json["bufferViews"].push_back(chunks.json["bufferViews"][0]);
    EXPECT_EQ(parse(join(chunks)).levels[0].triangles.size(), 41 * n);
    for (std::size_t i = 2; i < 41; ++i) {
        primitives[i]["extensions"]["KHR_draco_mesh_compression"]["bufferView"] =
            chunks.json["bufferViews"].size();
        chunks.json["bufferViews"].push_back(chunks.json["bufferViews"][0]);
    }
    expect_refused(join(chunks), MeshFormat::glb, Fault::bad_input,
                   {"Draco streams overlap", "export it again"});
}

TEST(DracoGlb, IsRefusedWhenItsAccessorsAreNotTheDecodedOnes) {
    const Chunks good = split(draco_glb(8));
    const Json& primitive = good.json["meshes"][0]["primitives"][0];
    const auto position = primitive["attributes"]["POSITION"].get<std::size_t>();
    const auto indices = primitive["indices"].get<std::size_t>();
    EXPECT_NO_THROW(parse(join(good)));

    Chunks broken = good;
    broken.json["accessors"][position]["count"] = 77;
    expect_refused(join(broken), MeshFormat::glb, Fault::bad_input,
                   {".count is 77, but Draco holds 258 points"});
    broken = good;
    broken.json["accessors"][indices]["count"] = 3;
    expect_refused(join(broken), MeshFormat::glb, Fault::bad_input,
                   {".count is 3, but Draco holds 1536 indices"});
    broken = good;
    broken.json["accessors"][position]["min"] = {0, 0, 0};
    broken.json["accessors"][position]["max"] = {0, 0, 0};
    expect_refused(join(broken), MeshFormat::glb, Fault::bad_input,
                   {"min and max are not those of the Draco positions"});
    broken = good;
    broken.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]
               ["attributes"] = {{"POSITION", 1}, {"NORMAL", 0}};
    expect_refused(join(broken), MeshFormat::glb, Fault::bad_input, {"is Draco attribute"});
}

} // namespace
} // namespace taihu
