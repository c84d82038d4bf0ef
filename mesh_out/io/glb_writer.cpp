#include <cmath>
#include <limits>
#include <optional>

#include <nlohmann/json.hpp>

#include "mesh_out/io/binary_detail.h"
#include "mesh_out/io/draco_codec_detail.h"
#include "mesh_out/io/glb.h"
#include "mesh_out/io/glb_document_detail.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

using Json = nlohmann::json;

constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963; ///< WebGL's names of view targets

/// A GLB while it grows: JSON and the binary chunk.
struct Assembly {
    Json json;
    std::string bin;

    explicit Assembly(const std::string& recipe) {
        json["asset"] = {{"version", "2.0"}, {"generator", "taihu"}};
        if (!recipe.empty())
            json["asset"]["extras"]["taihu_recipe"] = recipe_value(recipe);
        json["scene"] = 0;
        json["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
    }

    /// An object if the text is one, else the text.
    static Json recipe_value(const std::string& recipe) {
        // Deeper text would give a file that nobody reads; 4 levels stand above it.
        if (json_depth(recipe) + 4 <= kMaxJsonDepth)
            if (Json parsed = Json::parse(recipe, nullptr, false); parsed.is_object())
                return parsed;
        return recipe;
    }

    /// Index of a new view of `bytes`; no `target` for data that only an extension reads, no
    /// `stride` for elements without gaps.
    std::size_t add_view(std::string_view bytes, int target = 0, int stride = 0) {
        Json view = {{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes.size()}};
        if (target != 0)
            view["target"] = target;
        if (stride != 0)
            view["byteStride"] = stride;
        bin += bytes;
        bin.resize((bin.size() + 3) / 4 * 4); // glTF aligns views to their numbers
        json["bufferViews"].push_back(view);
        return json["bufferViews"].size() - 1;
    }

    std::size_t add_accessor(Json accessor) {
        json["accessors"].push_back(std::move(accessor));
        return json["accessors"].size() - 1;
    }

    /// What a viewer needs to know of an array, wherever its data are.
    static Json describe_vectors(const std::vector<Vec3>& vectors) {
        return describe_floats("VEC3", vectors.size());
    }
    static Json describe_floats(const char* type, std::size_t count) {
        return {{"componentType", kGltfFloat}, {"count", count}, {"type", type}};
    }
    static Json describe_colours(const std::vector<float>& openness) {
        return {{"componentType", kGltfUbyte},
                {"count", openness.size()},
                {"type", "VEC3"},
                {"normalized", true}};
    }
    static Json describe_positions(const std::vector<Vec3>& positions) {
        Json out = describe_vectors(positions);
        Box box;
        for (const Vec3& p : positions)
            box.include(p);
        for (int axis = 0; axis < 3; ++axis) { // as the file holds them: floats
            out["min"].push_back(static_cast<double>(static_cast<float>(box.lo[axis])));
            out["max"].push_back(static_cast<double>(static_cast<float>(box.hi[axis])));
        }
        return out;
    }
    static Json describe_indices(const std::vector<Triangle>& triangles) {
        return {{"componentType", kGltfUint}, {"count", 3 * triangles.size()}, {"type", "SCALAR"}};
    }

    std::string bytes() {
        json["buffers"] = Json::array({{{"byteLength", bin.size()}}});
        // Names and recipes come from outside: what is no UTF-8 in them is replaced.
        std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const std::size_t size = 12 + 8 + text.size() + 8 + bin.size();
        if (size > std::numeric_limits<std::uint32_t>::max())
            throw Error(Fault::bad_argument, "format_glb: " + std::to_string(size) +
                                                 " bytes, a GLB holds 2^32 - 1; simplify the mesh");
        std::string out;
        out.reserve(size);
        for (const std::size_t word :
             {std::size_t{kGlbMagic}, std::size_t{2}, size, text.size(), std::size_t{kGlbJson}})
            append_number(out, static_cast<std::uint32_t>(word));
        out += text;
        append_number(out, static_cast<std::uint32_t>(bin.size()));
        append_number(out, kGlbBin);
        return out += bin;
    }
};

std::string float_bytes(const std::vector<Vec3>& vectors) {
    std::string out;
    out.reserve(12 * vectors.size());
    for (const Vec3& v : vectors)
        for (int axis = 0; axis < 3; ++axis)
            append_number(out, static_cast<float>(v[axis]));
    return out;
}

/// An index for `texture` of a material.
Json add_texture(Assembly& glb, const std::string& png) {
    if (!glb.json.contains("samplers")) // linear, with mipmaps, clamped
        glb.json["samplers"] = Json::array(
            {{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33071}}});
    glb.json["images"].push_back({{"bufferView", glb.add_view(png)}, {"mimeType", "image/png"}});
    const std::size_t source = glb.json["images"].size() - 1;
    glb.json["textures"].push_back({{"sampler", 0}, {"source", source}});
    return {{"index", glb.json["textures"].size() - 1}};
}

bool has_images(const EncodedLevel& level) {
    return !level.normal_png.empty() || !level.occlusion_png.empty() || !level.colour_png.empty();
}

/// Of levels without images, one for all; of others, one each. Returns its index.
std::size_t add_material(Assembly& glb, const EncodedLevel& level, const GlbSettings& settings,
                         std::optional<std::size_t>& plain) {
    const bool is_plain = !has_images(level);
    if (is_plain && plain)
        return *plain;
    Json material = {{"pbrMetallicRoughness",
                      {{"baseColorFactor", {settings.grey, settings.grey, settings.grey, 1.0}},
                       {"metallicFactor", 0.0},
                       {"roughnessFactor", settings.roughness}}},
                     {"doubleSided", false}};
    if (!level.normal_png.empty())
        material["normalTexture"] = add_texture(glb, level.normal_png);
    if (!level.occlusion_png.empty())
        material["occlusionTexture"] = add_texture(glb, level.occlusion_png);
    if (!level.colour_png.empty())
        material["pbrMetallicRoughness"]["baseColorTexture"] = add_texture(glb, level.colour_png);
    glb.json["materials"].push_back(std::move(material));
    const std::size_t index = glb.json["materials"].size() - 1;
    if (is_plain)
        plain = index;
    return index;
}

Json draco_primitive(Assembly& glb, const EncodedLevel& level, std::size_t material) {
    const TriMesh& mesh = level.decoded;
    const std::size_t view = glb.add_view(level.draco);
    Json attributes = {{"POSITION", kDracoPositionId}};
    Json primitive = {
        {"material", material},
        {"mode", 4},
        {"indices", glb.add_accessor(Assembly::describe_indices(mesh.triangles))},
        {"attributes",
         {{"POSITION", glb.add_accessor(Assembly::describe_positions(mesh.positions))}}}};
    if (!mesh.normals.empty()) {
        attributes["NORMAL"] = kDracoNormalId;
        primitive["attributes"]["NORMAL"] =
            glb.add_accessor(Assembly::describe_vectors(mesh.normals));
    }
    if (!mesh.openness.empty()) {
        attributes["COLOR_0"] = draco_colour_id(mesh);
        primitive["attributes"]["COLOR_0"] =
            glb.add_accessor(Assembly::describe_colours(mesh.openness));
    }
    if (!level.texture.empty()) {
        attributes["TEXCOORD_0"] = draco_texture_id(mesh);
        attributes["TANGENT"] = draco_tangent_id(mesh);
        primitive["attributes"]["TEXCOORD_0"] =
            glb.add_accessor(Assembly::describe_floats("VEC2", level.texture.size()));
        primitive["attributes"]["TANGENT"] =
            glb.add_accessor(Assembly::describe_floats("VEC4", level.tangents.size()));
    }
    for (std::size_t i = 0; i < level.values.size(); ++i) {
        attributes[level.values[i]] = draco_values_id(mesh) + i;
        primitive["attributes"][level.values[i]] =
            glb.add_accessor(Assembly::describe_floats("SCALAR", mesh.positions.size()));
    }
    primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view},
                                                             {"attributes", attributes}};
    return primitive;
}

void check_levels(std::span<const EncodedLevel> levels, const GlbSettings& settings) {
    const auto fail = [](const std::string& what, const char* remedy) {
        throw Error(Fault::bad_argument, "format_glb: " + what + "; " + remedy);
    };
    if (levels.empty())
        fail("no level", "give one or more");
    for (std::size_t i = 0; i < levels.size(); ++i)
        if (levels[i].draco.empty() || levels[i].decoded.triangles.empty())
            fail("levels[" + std::to_string(i) + "] is empty", "make it by encode_draco()");
    for (std::size_t i = 0; i < levels.size(); ++i)
        if (levels[i].texture.size() != levels[i].tangents.size() ||
            (levels[i].texture.empty() && has_images(levels[i])))
            fail("levels[" + std::to_string(i) + "] has images without texture points",
                 "encode it with its texture");
    if (!(settings.roughness >= 0 && settings.roughness <= 1))
        fail("roughness is " + std::to_string(settings.roughness), "give 0 to 1");
    if (!(settings.grey >= 0 && settings.grey <= 1))
        fail("grey is " + std::to_string(settings.grey), "give 0 to 1");
}

} // namespace

std::string format_plain_glb(const TriMesh& mesh, const std::string& recipe) {
    Assembly glb(recipe);
    Json position = Assembly::describe_positions(mesh.positions);
    position["bufferView"] = glb.add_view(float_bytes(mesh.positions), kArrayBuffer);
    Json attributes = {{"POSITION", glb.add_accessor(position)}};
    if (!mesh.normals.empty()) {
        Json normal = Assembly::describe_vectors(mesh.normals);
        normal["bufferView"] = glb.add_view(float_bytes(mesh.normals), kArrayBuffer);
        attributes["NORMAL"] = glb.add_accessor(normal);
    }
    if (!mesh.openness.empty()) {
        std::string greys; // of four bytes each: a view of vertices is aligned to four
        for (const float o : mesh.openness)
            greys.append(3, static_cast<char>(std::lround(255 * o))) += '\0';
        Json colour = Assembly::describe_colours(mesh.openness);
        colour["bufferView"] = glb.add_view(greys, kArrayBuffer, 4);
        attributes["COLOR_0"] = glb.add_accessor(colour);
    }
    std::string corners;
    corners.reserve(12 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t corner : t)
            append_number(corners, corner);
    Json indices = Assembly::describe_indices(mesh.triangles);
    indices["bufferView"] = glb.add_view(corners, kElementArrayBuffer);
    glb.json["meshes"].push_back(
        {{"primitives",
          Json::array({{{"attributes", attributes}, {"indices", glb.add_accessor(indices)}}})}});
    glb.json["nodes"].push_back({{"mesh", 0}});
    return glb.bytes();
}

Vec3 foot_shift(const Box& box) {
    // A power of two, so that positions stay on their grids.
    const double step = std::exp2(std::floor(std::log2(box.longest() / 4096)));
    const auto rounded = [&](double v) { return std::round(v / step) * step; };
    return {-rounded(box.center().x), -rounded(box.lo.y), -rounded(box.center().z)};
}

std::string format_glb(std::span<const EncodedLevel> levels, const GlbSettings& settings) {
    check_levels(levels, settings);
    Assembly glb(settings.recipe);
    glb.json["extensionsUsed"] = {"KHR_draco_mesh_compression"};
    glb.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    std::optional<std::size_t> plain;
    Json lower = Json::array(), coverages = Json::array();
    for (std::size_t i = 0; i < levels.size(); ++i) {
        const std::string name =
            i == 0 ? settings.name : settings.name + "_lod" + std::to_string(i);
        const std::size_t material = add_material(glb, levels[i], settings, plain);
        glb.json["meshes"].push_back(
            {{"name", name},
             {"primitives", Json::array({draco_primitive(glb, levels[i], material)})}});
        Json node = {{"name", name}, {"mesh", i}};
        if (const Vec3& s = settings.shift; s != Vec3{})
            node["translation"] = {s.x, s.y, s.z};
        glb.json["nodes"].push_back(std::move(node));
        coverages.push_back(levels[i].screen_coverage);
        if (i > 0)
            lower.push_back(i);
    }
    if (levels.size() > 1) {
        glb.json["extensionsUsed"].push_back("MSFT_lod");
        Json& first = glb.json["nodes"][0];
        first["extensions"]["MSFT_lod"]["ids"] = lower;
        first["extras"]["MSFT_screencoverage"] = coverages;
    }
    return glb.bytes();
}

} // namespace taihu
