#include "mesh_out/io/glb_document_detail.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "mesh_out/io/binary_detail.h"
#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/io/json_detail.h"

namespace taihu {
namespace {

constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
constexpr std::size_t kMaxJsonBytes = std::size_t{1} << 26; ///< parsed, it takes some 20 times more
/// Larger numbers could overflow in sums and products; no file here comes near.
constexpr std::uint64_t kMaxWhole = std::uint64_t{1} << 32;

[[noreturn]] void fail_at(const std::string& where, std::size_t byte, const std::string& what,
                          const std::string& remedy) {
    throw Error(Fault::bad_input,
                where + ":byte " + std::to_string(byte) + ": " + what + "; " + remedy);
}

std::size_t size_of(std::uint64_t component_type) {
    switch (component_type) {
    case kGltfByte:
    case kGltfUbyte:
        return 1;
    case kGltfShort:
    case kGltfUshort:
        return 2;
    case kGltfUint:
    case kGltfFloat:
        return 4;
    default:
        return 0;
    }
}

} // namespace

int json_depth(std::string_view json) {
    int depth = 0, deepest = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (in_string) {
            if (c == '\\')
                ++i;
            else if (c == '"')
                in_string = false;
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            deepest = std::max(deepest, ++depth);
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return deepest;
}

double GltfArray::value(std::size_t i, std::size_t c) const {
    const char* from = first + i * stride + c * size_of(accessor.component_type);
    const auto scaled = [&](double value, double largest) {
        return accessor.normalized ? std::max(value / largest, -1.0) : value;
    };
    switch (accessor.component_type) {
    case kGltfByte:
        return scaled(load_number<std::int8_t>(from), 127);
    case kGltfUbyte:
        return scaled(load_number<std::uint8_t>(from), 255);
    case kGltfShort:
        return scaled(load_number<std::int16_t>(from), 32767);
    case kGltfUshort:
        return scaled(load_number<std::uint16_t>(from), 65535);
    case kGltfUint:
        return load_number<std::uint32_t>(from);
    default:
        return load_number<float>(from);
    }
}

GlbDocument::GlbDocument(std::string_view bytes, const std::string& where)
    : bytes_(bytes), where_(where) {
    read_chunks();
}

void GlbDocument::fail(const std::string& what, const std::string& remedy) const {
    fail_at(where_, kHeaderBytes + kChunkHeaderBytes, what, remedy);
}

void GlbDocument::refuse(const std::string& what, const std::string& remedy) const {
    throw Error(Fault::unsupported, where_ + ":byte " +
                                        std::to_string(kHeaderBytes + kChunkHeaderBytes) + ": " +
                                        what + "; " + remedy);
}

void GlbDocument::read_chunks() {
    const auto word = [&](std::size_t at) {
        return load_number<std::uint32_t>(bytes_.data() + at);
    };
    if (bytes_.size() < kHeaderBytes)
        fail_at(where_, bytes_.size(), "the file ends within the GLB header",
                "copy or export it again");
    if (word(0) != kGlbMagic)
        fail_at(where_, 0, "the file does not begin with glTF",
                bytes_.starts_with('{') ? "save the .gltf as one binary .glb" : "give a GLB file");
    if (word(4) != 2)
        throw Error(Fault::unsupported, where_ + ":byte 4: glTF version " +
                                            std::to_string(word(4)) +
                                            ", version 2 is read; export it again");
    if (word(8) != bytes_.size())
        fail_at(where_, 8,
                "the header says " + std::to_string(word(8)) + " bytes, the file has " +
                    std::to_string(bytes_.size()),
                "copy or export it again");
    bool has_json = false;
    for (std::size_t at = kHeaderBytes; at < bytes_.size();) {
        const std::size_t left = bytes_.size() - at;
        if (left < kChunkHeaderBytes || word(at) > left - kChunkHeaderBytes)
            fail_at(where_, at, "a chunk reaches past the end of the file",
                    "copy or export it again");
        const std::string_view chunk = bytes_.substr(at + kChunkHeaderBytes, word(at));
        const std::uint32_t type = word(at + 4);
        if (!has_json && type != kGlbJson)
            fail_at(where_, at, "the first chunk is not JSON", "export it again");
        if (type == kGlbJson) {
            if (has_json)
                fail_at(where_, at, "a second JSON chunk", "export it again");
            has_json = true;
            parse_json(chunk);
        } else if (type == kGlbBin) {
            if (has_bin_)
                fail_at(where_, at, "a second BIN chunk", "export it again");
            has_bin_ = true;
            bin_ = chunk;
        }
        at += kChunkHeaderBytes + chunk.size();
    }
    if (!has_json)
        fail_at(where_, kHeaderBytes, "there is no JSON chunk", "copy or export it again");
}

void GlbDocument::parse_json(std::string_view text) {
    root_ = taihu::parse_json(text, where_ + ":JSON", kMaxJsonBytes, kMaxJsonDepth);
    if (!root_.is_object())
        fail("the JSON is not an object", "export it again");
}

const GlbDocument::Json* GlbDocument::find(const Json& object, const std::string& key) const {
    if (!object.is_object())
        return nullptr;
    const auto found = object.find(key);
    return found == object.end() ? nullptr : &*found;
}

const GlbDocument::Json& GlbDocument::item(const char* list, std::uint64_t index) const {
    const Json* items = find(root_, list);
    const std::size_t n = items && items->is_array() ? items->size() : 0;
    if (index >= n)
        fail(std::string(list) + '[' + std::to_string(index) + "] is named, but there are " +
                 std::to_string(n),
             "export it again");
    const Json& found = (*items)[index];
    if (!found.is_object())
        fail(std::string(list) + '[' + std::to_string(index) + "] is not an object",
             "export it again");
    return found;
}

std::optional<std::uint64_t> GlbDocument::whole(const Json& object, const std::string& key,
                                                const std::string& path) const {
    const Json* value = find(object, key);
    if (!value)
        return std::nullopt;
    if (!value->is_number_unsigned() || value->get<std::uint64_t>() > kMaxWhole)
        fail(path + '.' + printable(key) + " is " + printable(value->dump(-1, ' ', true)) +
                 ", must be a whole number from 0 to 2^32",
             "export it again");
    return value->get<std::uint64_t>();
}

std::uint64_t GlbDocument::needed_whole(const Json& object, const std::string& key,
                                        const std::string& path) const {
    const auto value = whole(object, key, path);
    if (!value)
        fail(path + " has no " + printable(key), "export it again");
    return *value;
}

std::optional<std::vector<double>> GlbDocument::numbers(const Json& object, const std::string& key,
                                                        std::size_t n,
                                                        const std::string& path) const {
    const Json* values = find(object, key);
    if (!values)
        return std::nullopt;
    std::vector<double> out;
    if (values->is_array() && values->size() == n)
        for (const Json& value : *values)
            if (value.is_number() && std::isfinite(value.get<double>()))
                out.push_back(value.get<double>());
    if (out.size() != n)
        fail(path + '.' + key + " is not " + std::to_string(n) + " finite numbers",
             "export it again");
    return out;
}

std::string_view GlbDocument::buffer(std::uint64_t index) const {
    const std::string path = "buffers[" + std::to_string(index) + ']';
    const Json& json = item("buffers", index);
    if (const Json* uri = find(json, "uri")) {
        const std::string name = uri->is_string() ? uri->get<std::string>() : std::string();
        refuse(path + " is the " + (name.starts_with("data:") ? "data: URI " : "external file ") +
                   '\'' + printable(name) + '\'',
               "pack everything into the binary chunk of one GLB");
    }
    if (index != 0 || !has_bin_)
        fail(path + " has no data", "export it again");
    const std::uint64_t size = needed_whole(json, "byteLength", path);
    if (size > bin_.size())
        fail(path + " has " + std::to_string(size) + " bytes, the BIN chunk " +
                 std::to_string(bin_.size()),
             "copy or export it again");
    return bin_.substr(0, size);
}

std::string_view GlbDocument::view(std::uint64_t index) const {
    const std::string path = "bufferViews[" + std::to_string(index) + ']';
    const Json& json = item("bufferViews", index);
    if (const Json* extensions = find(json, "extensions"))
        if (find(*extensions, "EXT_meshopt_compression"))
            refuse(path + " is compressed by EXT_meshopt_compression",
                   "export it plain or with Draco");
    const std::string_view data = buffer(needed_whole(json, "buffer", path));
    const std::uint64_t first = whole(json, "byteOffset", path).value_or(0);
    const std::uint64_t size = needed_whole(json, "byteLength", path);
    if (first + size > data.size()) // each at most 2^32
        fail(path + " reaches to byte " + std::to_string(first + size) + " of a buffer of " +
                 std::to_string(data.size()),
             "export it again");
    return data.substr(first, size);
}

std::vector<std::uint64_t> GlbDocument::draco_views() const {
    std::set<std::uint64_t> views;
    const Json* meshes = find(root_, "meshes");
    for (std::size_t m = 0; meshes && m < meshes->size(); ++m) {
        const Json* primitives = find(item("meshes", m), "primitives");
        for (std::size_t i = 0; primitives && primitives->is_array() && i < primitives->size(); ++i)
            if (const Json* extensions = find((*primitives)[i], "extensions"))
                if (const Json* draco = find(*extensions, kGltfDraco))
                    views.insert(
                        needed_whole(*draco, "bufferView", "meshes[" + std::to_string(m) + ']'));
    }
    return {views.begin(), views.end()};
}

GltfAccessor GlbDocument::accessor(std::uint64_t index) const {
    const std::string path = "accessors[" + std::to_string(index) + ']';
    GltfAccessor out;
    out.index = index;
    out.json = &item("accessors", index);
    out.count = needed_whole(*out.json, "count", path);
    out.component_type = needed_whole(*out.json, "componentType", path);
    if (size_of(out.component_type) == 0)
        fail(path + ".componentType is " + std::to_string(out.component_type), "export it again");
    const Json* type = find(*out.json, "type");
    if (type && *type == "SCALAR")
        out.n_components = 1;
    else if (type && *type == "VEC3")
        out.n_components = 3;
    else
        fail(path + ".type is neither SCALAR nor VEC3", "export it again");
    const Json* normalized = find(*out.json, "normalized");
    out.normalized = normalized && *normalized == true;
    return out;
}

GltfArray GlbDocument::array(std::uint64_t accessor_index) const {
    const std::string path = "accessors[" + std::to_string(accessor_index) + ']';
    GltfArray out;
    out.accessor = accessor(accessor_index);
    const Json& json = *out.accessor.json;
    if (find(json, "sparse"))
        refuse(path + " is sparse", "export it with dense accessors");
    const std::uint64_t view_index = needed_whole(json, "bufferView", path);
    const std::string_view data = view(view_index);
    const std::size_t size = out.accessor.n_components * size_of(out.accessor.component_type);
    const std::string view_path = "bufferViews[" + std::to_string(view_index) + ']';
    out.stride = whole(item("bufferViews", view_index), "byteStride", view_path).value_or(size);
    if (out.stride < size || out.stride > 252)
        fail(view_path + ".byteStride is " + std::to_string(out.stride) + ", must be " +
                 std::to_string(size) + " to 252",
             "export it again");
    const std::uint64_t first = whole(json, "byteOffset", path).value_or(0);
    // Nothing overflows: count and offset are at most 2^32, the stride 252.
    if (out.accessor.count == 0 ||
        first + out.stride * (out.accessor.count - 1) + size > data.size())
        fail(path + " with " + std::to_string(out.accessor.count) + " elements does not fit its " +
                 std::to_string(data.size()) + " bytes",
             "export it again");
    out.first = data.data() + first;
    return out;
}

} // namespace taihu
