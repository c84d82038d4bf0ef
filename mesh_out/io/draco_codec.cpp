#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>

#include "mesh_out/io/draco_codec_detail.h"
#include "mesh_out/io/glb.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

constexpr int kNormalBits = 10, kTangentBits = 8, kValueBits = 12, kSpeed = 3,
              kMostTextureBits = 18;
constexpr const char* kRecipeKey = "taihu_recipe";
/// A stream may claim this many faces whatever its length, and 64 more for each of its bytes: far
/// more than any real mesh has, and little enough to allocate.
constexpr std::uint64_t kFreeFaces = std::uint64_t{1} << 22, kFacesPerByte = 64;

[[noreturn]] void fail(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what + "; copy or export the file again");
}

/// The exponent of the grid's step.
int check_on_grid(const TriMesh& mesh, const PositionGrid& grid) {
    int exponent = 0;
    if (!(grid.step_m > 0) || std::frexp(grid.step_m, &exponent) != 0.5 || grid.bits < 1 ||
        grid.bits > 18)
        throw Error(Fault::bad_argument,
                    "encode_draco: a grid of " + std::to_string(grid.bits) + " bits and step " +
                        std::to_string(grid.step_m) +
                        " m; give 1 to 18 bits and a step that is a power of two");
    const double last = std::ldexp(1.0, grid.bits) - 1;
    const auto fits_float = [](double v) {
        return static_cast<double>(static_cast<float>(v)) == v;
    };
    for (int axis = 0; axis < 3; ++axis) {
        const double k = grid.origin[axis] / grid.step_m;
        if (!fits_float(grid.origin[axis]) || k != std::floor(k) || !(std::abs(k) < 0x1p53))
            throw Error(Fault::bad_argument, "encode_draco: the grid's origin is no float multiple "
                                             "of its step; make it by position_grid()");
    }
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) {
            const double p = mesh.positions[i][axis];
            const double q = (p - grid.origin[axis]) / grid.step_m; // exact: a power of two
            if (!(q >= 0 && q <= last) || q != std::floor(q) ||
                grid.origin[axis] + q * grid.step_m != p || !fits_float(p))
                throw Error(Fault::bad_argument, "encode_draco: positions[" + std::to_string(i) +
                                                     "] is not on the grid; snap the mesh to it");
        }
    return exponent - 1;
}

/// k * 2^exponent for strtof: exact, and without a decimal point, which locales differ in.
std::string hex_float(double k, int exponent) {
    char digits[32];
    const auto end =
        std::to_chars(digits, digits + sizeof digits, static_cast<std::int64_t>(std::abs(k)), 16)
            .ptr;
    return (k < 0 ? "-0x" : "0x") + std::string(digits, end) + 'p' + std::to_string(exponent);
}

/// What SetAttributeExplicitQuantization() sets, without its loss: Draco keeps options as text, and
/// that function writes them with six decimals, so that steps below 2^-6 m would come out wrong.
/// Its step is range / (2^bits - 1) in float, here exactly that of the grid.
draco::Options quantization(const PositionGrid& grid, int exponent) {
    std::string origin;
    for (int axis = 0; axis < 3; ++axis)
        origin += hex_float(grid.origin[axis] / grid.step_m, exponent) + ' ';
    draco::Options options;
    options.SetInt("quantization_bits", grid.bits);
    options.SetString("quantization_origin", origin);
    options.SetString("quantization_range", hex_float(std::ldexp(1.0, grid.bits) - 1, exponent));
    return options;
}

/// Which points share a value: the point that has it, for each value, and the value of each point.
struct SharedValues {
    std::vector<std::uint32_t> first, of_point;
};

/// Points of equal positions (and normals) share one value: Draco takes its connectivity from
/// that, which then has no border along seams of a texture.
SharedValues shared_values(const TriMesh& mesh, bool normals) {
    const auto key = [&](std::uint32_t i) {
        const Vec3 &p = mesh.positions[i], n = normals ? mesh.normals[i] : Vec3{};
        return std::array{p.x, p.y, p.z, n.x, n.y, n.z};
    };
    std::vector<std::uint32_t> order(mesh.positions.size());
    for (std::uint32_t i = 0; i < order.size(); ++i)
        order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const auto x = key(a), y = key(b);
        return x != y ? x < y : a < b;
    });
    std::vector<std::uint32_t> leader(order.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        leader[order[i]] =
            i > 0 && key(order[i]) == key(order[i - 1]) ? leader[order[i - 1]] : order[i];
    SharedValues out;
    out.of_point.resize(order.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) { // values in the order of their points
        if (leader[i] == i) {
            out.of_point[i] = static_cast<std::uint32_t>(out.first.size());
            out.first.push_back(i);
        } else {
            out.of_point[i] = out.of_point[leader[i]];
        }
    }
    return out;
}

/// One value per point, or those that are shared. Returns the attribute's number.
template <std::size_t N, class NumbersOf>
int add_floats(draco::Mesh& mesh, draco::GeometryAttribute::Type type, NumbersOf&& numbers_of,
               const SharedValues* shared = nullptr) {
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, N, draco::DT_FLOAT32, false, N * sizeof(float), 0);
    const std::uint32_t n =
        shared ? static_cast<std::uint32_t>(shared->first.size()) : mesh.num_points();
    const int id = mesh.AddAttribute(attribute, !shared, n);
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::array<float, N> v = numbers_of(shared ? shared->first[i] : i);
        mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), v.data());
    }
    for (std::uint32_t i = 0; shared && i < mesh.num_points(); ++i)
        mesh.attribute(id)->SetPointMapEntry(draco::PointIndex(i),
                                             draco::AttributeValueIndex(shared->of_point[i]));
    return id;
}

std::array<float, 3> floats(const Vec3& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

/// Grey, because that is what viewers multiply a material with.
void add_colours(draco::Mesh& mesh, const std::vector<float>& openness) {
    draco::GeometryAttribute attribute;
    attribute.Init(draco::GeometryAttribute::COLOR, nullptr, 3, draco::DT_UINT8, true, 3, 0);
    const int id = mesh.AddAttribute(attribute, true, static_cast<std::uint32_t>(openness.size()));
    for (std::size_t i = 0; i < openness.size(); ++i) {
        const auto grey = static_cast<std::uint8_t>(std::lround(255 * openness[i]));
        const std::uint8_t colour[3] = {grey, grey, grey};
        mesh.attribute(id)->SetAttributeValue(
            draco::AttributeValueIndex(static_cast<std::uint32_t>(i)), colour);
    }
}

/// \param textured  the same mesh with its texture, or null.
std::unique_ptr<draco::Mesh> to_draco(const TriMesh& mesh, const TexturedMesh* textured,
                                      std::span<const VertexValues> values,
                                      const std::string& recipe) {
    auto made = std::make_unique<draco::Mesh>(); // it can be neither copied nor moved
    draco::Mesh& out = *made;
    out.set_num_points(static_cast<std::uint32_t>(mesh.positions.size()));
    SharedValues positions, normals;
    if (textured) {
        positions = shared_values(mesh, false);
        normals = shared_values(mesh, !mesh.normals.empty());
    }
    add_floats<3>(
        out, draco::GeometryAttribute::POSITION,
        [&](std::uint32_t i) { return floats(mesh.positions[i]); },
        textured ? &positions : nullptr);
    if (!mesh.normals.empty())
        add_floats<3>(
            out, draco::GeometryAttribute::NORMAL,
            [&](std::uint32_t i) { return floats(mesh.normals[i]); },
            textured ? &normals : nullptr);
    if (!mesh.openness.empty())
        add_colours(out, mesh.openness);
    if (textured) {
        add_floats<2>(out, draco::GeometryAttribute::TEX_COORD, [&](std::uint32_t i) {
            const auto [u, v] = textured->texture[i]; // glTF's v runs downwards
            return std::array{static_cast<float>(u), static_cast<float>(1 - v)};
        });
        add_floats<4>(out, draco::GeometryAttribute::GENERIC, [&](std::uint32_t i) {
            const auto [x, y, z] = floats(textured->tangents[i]);
            return std::array{x, y, z, 1.0f};
        });
    }
    for (const VertexValues& v : values)
        add_floats<1>(out, draco::GeometryAttribute::GENERIC,
                      [&](std::uint32_t i) { return std::array{v.values[i]}; });
    if (!recipe.empty()) {
        auto metadata = std::make_unique<draco::GeometryMetadata>();
        metadata->AddEntryString(kRecipeKey, recipe);
        out.AddMetadata(std::move(metadata));
    }
    out.SetNumFaces(mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        out.SetFace(draco::FaceIndex(static_cast<std::uint32_t>(i)),
                    {draco::PointIndex(t[0]), draco::PointIndex(t[1]), draco::PointIndex(t[2])});
    }
    return made;
}

/// The corners' positions of all triangles, each begun at its least one, in order: equal for meshes
/// that differ only in how they number things.
std::vector<std::array<Vec3, 3>> sorted_faces(const TriMesh& mesh) {
    const auto less = [](const Vec3& a, const Vec3& b) {
        return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
    };
    std::vector<std::array<Vec3, 3>> faces;
    faces.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
        std::array<Vec3, 3> face = {mesh.positions[t[0]], mesh.positions[t[1]],
                                    mesh.positions[t[2]]};
        std::rotate(face.begin(), std::min_element(face.begin(), face.end(), less), face.end());
        faces.push_back(face);
    }
    std::sort(faces.begin(), faces.end(), [&](const auto& a, const auto& b) {
        return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), less);
    });
    return faces;
}

/// Refuses a header whose numbers of faces or vertices are beyond reason, before Draco allocates
/// for them.
void check_claims(draco::DecoderBuffer buffer, const std::string& where) {
    draco::DracoHeader header;
    if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok())
        fail(where, "not a Draco stream");
    if (header.encoder_type != draco::TRIANGULAR_MESH)
        fail(where, "a Draco stream that is no mesh");
    if (header.version_major != 2 || header.version_minor != 2)
        fail(where, "Draco bit stream " + std::to_string(header.version_major) + '.' +
                        std::to_string(header.version_minor) + ", 2.2 is read");
    buffer.set_bitstream_version(DRACO_BITSTREAM_VERSION(2, 2));
    draco::GeometryMetadata metadata;
    if ((header.flags & METADATA_FLAG_MASK) != 0 &&
        !draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata))
        fail(where, "the Draco metadata are broken");
    if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING)
        buffer.Advance(1);        // the traversal method
    for (int i = 0; i < 2; ++i) { // faces and points, or vertices and faces
        std::uint32_t n = 0;
        if (!draco::DecodeVarint(&n, &buffer))
            fail(where, "the Draco stream ends within its header");
        if (n > kFreeFaces + kFacesPerByte * static_cast<std::uint64_t>(buffer.remaining_size()))
            fail(where, "a Draco stream with " + std::to_string(buffer.remaining_size()) +
                            " bytes of data claims " + std::to_string(n) + " faces or vertices");
    }
}

std::vector<Vec3> vectors_of(const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                             const std::string& where) {
    std::vector<Vec3> out(mesh.num_points());
    for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
        float v[3] = {};
        const auto index = attribute.mapped_index(draco::PointIndex(i));
        if (index.value() >= attribute.size() || !attribute.ConvertValue<float, 3>(index, v))
            fail(where, "the Draco stream has a broken attribute");
        out[i] = {v[0], v[1], v[2]};
        if (!is_finite(out[i]))
            fail(where, "Draco point " + std::to_string(i) + " is not finite");
    }
    return out;
}

/// Red, when it is that of taihu's own streams: three bytes a point.
std::vector<float> openness_of(const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                               const std::string& where) {
    std::vector<float> out(mesh.num_points());
    for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
        std::uint8_t colour[3] = {};
        const auto index = attribute.mapped_index(draco::PointIndex(i));
        if (index.value() >= attribute.size() ||
            !attribute.ConvertValue<std::uint8_t, 3>(index, colour))
            fail(where, "the Draco stream has broken colours");
        out[i] = static_cast<float>(colour[0]) / 255;
    }
    return out;
}

std::unique_ptr<draco::Mesh> decode(std::string_view bytes, const std::string& where) {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    try {
        check_claims(buffer, where);
        draco::Decoder decoder;
        auto result = decoder.DecodeMeshFromBuffer(&buffer);
        if (!result.ok())
            fail(where, "Draco says '" + printable(result.status().error_msg(), 80) + "'");
        return std::move(result).value();
    } catch (const std::bad_alloc&) {
        fail(where, "the Draco stream asks for more memory than there is");
    } catch (const std::length_error&) {
        fail(where, "the Draco stream asks for more memory than there is");
    }
}

} // namespace

TexturedMesh decode_textured_draco(std::string_view bytes, const std::string& where) {
    TexturedMesh out;
    out.mesh = decode_draco_mesh(bytes, where).mesh;
    const auto decoded = decode(bytes, where);
    const auto* texture = decoded->GetNamedAttribute(draco::GeometryAttribute::TEX_COORD);
    const auto* tangents = decoded->GetNamedAttribute(draco::GeometryAttribute::GENERIC);
    if (!texture || !tangents || texture->num_components() != 2 || tangents->num_components() != 4)
        fail(where, "the Draco stream has no texture points and tangents");
    for (std::uint32_t i = 0; i < decoded->num_points(); ++i) {
        float uv[2] = {}, t[4] = {};
        if (!texture->ConvertValue<float, 2>(texture->mapped_index(draco::PointIndex(i)), uv) ||
            !tangents->ConvertValue<float, 4>(tangents->mapped_index(draco::PointIndex(i)), t))
            fail(where, "the Draco stream has a broken attribute");
        out.texture.push_back({uv[0], 1 - double{uv[1]}});
        out.tangents.push_back(normalized({t[0], t[1], t[2]}));
    }
    return out;
}

DracoMesh decode_draco_mesh(std::string_view bytes, const std::string& where) {
    const auto decoded = decode(bytes, where);
    const auto* positions = decoded->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    const auto* normals = decoded->GetNamedAttribute(draco::GeometryAttribute::NORMAL);
    if (!positions || positions->num_components() != 3)
        fail(where, "the Draco stream has no positions");
    if (decoded->num_faces() == 0)
        fail(where, "the Draco stream has no face");
    DracoMesh out;
    out.mesh.positions = vectors_of(*decoded, *positions, where);
    out.position_id = positions->unique_id();
    if (normals && normals->num_components() == 3) {
        out.mesh.normals = vectors_of(*decoded, *normals, where);
        out.normal_id = normals->unique_id();
    }
    const auto* colours = decoded->GetNamedAttribute(draco::GeometryAttribute::COLOR);
    if (colours && colours->num_components() == 3 && colours->data_type() == draco::DT_UINT8) {
        out.mesh.openness = openness_of(*decoded, *colours, where);
        out.colour_id = colours->unique_id();
    }
    if (const auto* metadata = decoded->GetMetadata())
        metadata->GetEntryString(kRecipeKey, &out.recipe);
    for (int i = 0; i < decoded->num_attributes(); ++i)
        out.ids.push_back(decoded->attribute(i)->unique_id());
    out.mesh.triangles.resize(decoded->num_faces());
    for (std::uint32_t i = 0; i < decoded->num_faces(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t corner = decoded->face(draco::FaceIndex(i))[k].value();
            if (corner >= out.mesh.positions.size())
                fail(where, "Draco face " + std::to_string(i) + " names point " +
                                std::to_string(corner) + " of " +
                                std::to_string(out.mesh.positions.size()));
            out.mesh.triangles[i][k] = corner;
        }
    return out;
}

TriMesh decode_draco(std::string_view bytes, const std::string& where) {
    return decode_draco_mesh(bytes, where).mesh;
}

namespace {

/// The bits of the coarsest grid of 0..1 that all texture points lie on.
int texture_bits(const TexturedMesh& textured) {
    const TriMesh& mesh = textured.mesh;
    const auto refuse = [](const std::string& what) {
        throw Error(Fault::bad_argument, "encode_draco: " + what);
    };
    if (textured.texture.size() != mesh.positions.size() ||
        textured.tangents.size() != mesh.positions.size())
        refuse("give a texture point and a tangent for each position");
    int bits = 1;
    for (std::size_t i = 0; i < textured.texture.size(); ++i)
        for (const double t : {textured.texture[i].u, 1 - textured.texture[i].v}) {
            const auto off = [&] { return std::ldexp(t, bits) != std::floor(std::ldexp(t, bits)); };
            while (bits <= kMostTextureBits && off())
                ++bits;
            if (bits > kMostTextureBits || !(t >= 0 && t < 1))
                refuse("texture[" + std::to_string(i) +
                       "] is on no grid of 18 bits within 0..1; make it by chart_atlas()");
        }
    return bits;
}

/// Faces with their texture points, for sorted_faces().
using TexturedFace = std::array<std::array<double, 5>, 3>;

std::vector<TexturedFace> sorted_faces(const TexturedMesh& textured) {
    std::vector<TexturedFace> faces;
    for (const Triangle& t : textured.mesh.triangles) {
        TexturedFace face;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3& p = textured.mesh.positions[t[k]];
            const TexturePoint& at = textured.texture[t[k]];
            face[k] = {p.x, p.y, p.z, at.u, at.v};
        }
        std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
        faces.push_back(face);
    }
    std::sort(faces.begin(), faces.end());
    return faces;
}

/// \param textured  the same mesh with its texture, or null.
EncodedLevel encode(const TriMesh& mesh, const TexturedMesh* textured, const PositionGrid& grid,
                    std::span<const VertexValues> values, const std::string& recipe) {
    check_writable(mesh, "encode_draco");
    const int exponent = check_on_grid(mesh, grid);
    const int bits = textured ? texture_bits(*textured) : 0;
    const auto source = to_draco(mesh, textured, values, recipe);
    draco::ExpertEncoder encoder(*source);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetSpeedOptions(kSpeed, kSpeed);
    encoder.SetTrackEncodedProperties(true);
    encoder.options().SetAttributeOptions(kDracoPositionId, quantization(grid, exponent));
    if (!mesh.normals.empty())
        encoder.SetAttributeQuantization(kDracoNormalId, kNormalBits);
    if (textured) {
        draco::Options exact; // a step of 2^-bits, as in quantization()
        exact.SetInt("quantization_bits", bits);
        exact.SetString("quantization_origin", "0 0");
        exact.SetString("quantization_range", hex_float(std::ldexp(1.0, bits) - 1, -bits));
        encoder.options().SetAttributeOptions(static_cast<int>(draco_texture_id(mesh)), exact);
        encoder.SetAttributeQuantization(static_cast<int>(draco_tangent_id(mesh)), kTangentBits);
    }
    for (std::size_t i = 0; i < values.size(); ++i)
        encoder.SetAttributeQuantization(static_cast<int>(draco_values_id(mesh) + i), kValueBits);
    const auto give_up = [](const std::string& what) {
        throw Error(Fault::numeric, "encode_draco: " + what +
                                        "; give a closed 2-manifold whose vertices are all used");
    };
    draco::EncoderBuffer buffer;
    if (const draco::Status status = encoder.EncodeToBuffer(&buffer); !status.ok())
        give_up("Draco says '" + printable(status.error_msg(), 80) + "'");

    EncodedLevel level;
    level.draco.assign(buffer.data(), buffer.size());
    DracoMesh decoded = decode_draco_mesh(level.draco, "encode_draco");
    level.decoded = std::move(decoded.mesh);
    const std::size_t n_points = level.decoded.positions.size();
    const std::size_t n_faces = level.decoded.triangles.size();
    // Where a chart touches itself in a vertex, Draco makes two points of it.
    const bool lost =
        textured ? n_points < mesh.positions.size() : n_points != mesh.positions.size();
    if (lost || n_faces != mesh.triangles.size() || n_points != encoder.num_encoded_points() ||
        n_faces != encoder.num_encoded_faces())
        give_up(std::to_string(mesh.positions.size()) + " points and " +
                std::to_string(mesh.triangles.size()) + " faces came back as " +
                std::to_string(n_points) + " and " + std::to_string(n_faces));
    const auto id = [](bool there, std::uint32_t number) {
        return there ? std::optional(number) : std::nullopt;
    };
    if (decoded.position_id != kDracoPositionId ||
        decoded.normal_id != id(!mesh.normals.empty(), kDracoNormalId) ||
        decoded.colour_id != id(!mesh.openness.empty(), draco_colour_id(mesh)))
        give_up("Draco numbered the attributes in another way");
    if (sorted_faces(level.decoded) != sorted_faces(mesh))
        give_up("a face came back with other positions");
    return level;
}

} // namespace

EncodedLevel encode_draco(const TriMesh& mesh, const PositionGrid& grid,
                          const std::string& recipe) {
    return encode(mesh, nullptr, grid, {}, recipe);
}

EncodedLevel encode_draco(const TexturedMesh& textured, const PositionGrid& grid,
                          std::span<const VertexValues> values) {
    for (const VertexValues& v : values)
        if (v.values.size() != textured.mesh.positions.size() ||
            !std::all_of(v.values.begin(), v.values.end(),
                         [](float x) { return std::isfinite(x); }))
            throw Error(Fault::bad_argument,
                        "encode_draco: give " + v.name + " one finite value for each position");
    EncodedLevel level = encode(textured.mesh, &textured, grid, values, {});
    TexturedMesh decoded = decode_textured_draco(level.draco, "encode_draco");
    if (sorted_faces(decoded) != sorted_faces(textured))
        throw Error(Fault::numeric, "encode_draco: a face came back with other texture points; "
                                    "give a closed 2-manifold whose vertices are all used");
    level.texture = std::move(decoded.texture);
    level.tangents = std::move(decoded.tangents);
    for (const VertexValues& v : values)
        level.values.push_back(v.name);
    return level;
}

} // namespace taihu
