// The functions that Blender's glTF importer looks for in its Draco library, which Debian's Blender
// comes without, on top of Debian's own libdraco. For tests: it shows that the container around the
// Draco streams is sound; decode_glb.mjs and three_pixels.mjs decode with another build.
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <vector>

#include <draco/compression/decode.h>

namespace {

/// glTF's names of number types.
enum : std::size_t {
    kByte = 5120,
    kUbyte = 5121,
    kShort = 5122,
    kUshort = 5123,
    kUint = 5125,
    kFloat = 5126
};

struct Decoded {
    std::unique_ptr<draco::Mesh> mesh;
    std::vector<char> indices;
    std::map<std::uint32_t, std::vector<char>> attributes;
};

Decoded& of(void* handle) {
    return *static_cast<Decoded*>(handle);
}

template <class T>
void append(std::vector<char>& out, const T* values, std::size_t n) {
    const auto* bytes = reinterpret_cast<const char*>(values);
    out.insert(out.end(), bytes, bytes + n * sizeof(T));
}

template <class T>
bool read(const draco::Mesh& mesh, const draco::PointAttribute& attribute, std::size_t n,
          std::vector<char>& out) {
    out.clear();
    for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
        T values[16] = {};
        if (!attribute.ConvertValue<T>(attribute.mapped_index(draco::PointIndex(i)),
                                       static_cast<std::int8_t>(n), values))
            return false;
        append(out, values, n);
    }
    return true;
}

template <class T>
void read_indices(const draco::Mesh& mesh, std::vector<char>& out) {
    out.clear();
    for (std::uint32_t i = 0; i < mesh.num_faces(); ++i)
        for (const draco::PointIndex& corner : mesh.face(draco::FaceIndex(i))) {
            const auto index = static_cast<T>(corner.value());
            append(out, &index, 1);
        }
}

} // namespace

extern "C" {

void* decoderCreate() {
    return new Decoded;
}

void decoderRelease(void* handle) {
    delete static_cast<Decoded*>(handle);
}

bool decoderDecode(void* handle, void* bytes, std::size_t n_bytes) {
    draco::DecoderBuffer buffer;
    buffer.Init(static_cast<const char*>(bytes), n_bytes);
    auto result = draco::Decoder().DecodeMeshFromBuffer(&buffer);
    if (!result.ok())
        return false;
    of(handle).mesh = std::move(result).value();
    return true;
}

std::uint32_t decoderGetVertexCount(void* handle) {
    return of(handle).mesh->num_points();
}

std::uint32_t decoderGetIndexCount(void* handle) {
    return 3 * of(handle).mesh->num_faces();
}

bool decoderAttributeIsNormalized(void* handle, std::uint32_t id) {
    const auto* attribute = of(handle).mesh->GetAttributeByUniqueId(id);
    return attribute && attribute->normalized();
}

/// \param type  "SCALAR" or "VEC2" to "VEC4".
bool decoderReadAttribute(void* handle, std::uint32_t id, std::size_t number, const char* type) {
    const draco::Mesh& mesh = *of(handle).mesh;
    const auto* attribute = mesh.GetAttributeByUniqueId(id);
    if (!attribute)
        return false;
    const std::size_t n = std::strncmp(type, "VEC", 3) == 0 ? std::size_t(type[3] - '0') : 1;
    std::vector<char>& out = of(handle).attributes[id];
    switch (number) {
    case kByte:
        return read<std::int8_t>(mesh, *attribute, n, out);
    case kUbyte:
        return read<std::uint8_t>(mesh, *attribute, n, out);
    case kShort:
        return read<std::int16_t>(mesh, *attribute, n, out);
    case kUshort:
        return read<std::uint16_t>(mesh, *attribute, n, out);
    case kUint:
        return read<std::uint32_t>(mesh, *attribute, n, out);
    case kFloat:
        return read<float>(mesh, *attribute, n, out);
    default:
        return false;
    }
}

std::size_t decoderGetAttributeByteLength(void* handle, std::uint32_t id) {
    return of(handle).attributes[id].size();
}

void decoderCopyAttribute(void* handle, std::uint32_t id, void* out) {
    const std::vector<char>& bytes = of(handle).attributes[id];
    std::memcpy(out, bytes.data(), bytes.size());
}

bool decoderReadIndices(void* handle, std::size_t number) {
    Decoded& decoded = of(handle);
    switch (number) {
    case kUbyte:
        read_indices<std::uint8_t>(*decoded.mesh, decoded.indices);
        return true;
    case kUshort:
        read_indices<std::uint16_t>(*decoded.mesh, decoded.indices);
        return true;
    case kUint:
        read_indices<std::uint32_t>(*decoded.mesh, decoded.indices);
        return true;
    default:
        return false;
    }
}

std::size_t decoderGetIndicesByteLength(void* handle) {
    return of(handle).indices.size();
}

void decoderCopyIndices(void* handle, void* out) {
    std::memcpy(out, of(handle).indices.data(), of(handle).indices.size());
}
}
