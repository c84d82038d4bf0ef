#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace taihu {

inline constexpr std::uint32_t kGlbMagic = 0x46546c67, kGlbJson = 0x4e4f534a, kGlbBin = 0x004e4942;

inline constexpr const char* kGltfDraco = "KHR_draco_mesh_compression";

/// glTF's names of number types.
enum GltfType : std::uint64_t {
    kGltfByte = 5120,
    kGltfUbyte = 5121,
    kGltfShort = 5122,
    kGltfUshort = 5123,
    kGltfUint = 5125,
    kGltfFloat = 5126
};

/// What an accessor says, before any look at its data.
struct GltfAccessor {
    std::uint64_t index = 0, count = 0, component_type = 0;
    std::size_t n_components = 0; ///< 1 or 3; other types are of no use here
    bool normalized = false;
    const nlohmann::json* json = nullptr;
};

/// The data of an accessor: every element lies within the file.
struct GltfArray {
    GltfAccessor accessor;
    const char* first = nullptr;
    std::size_t stride = 0;

    /// Component `c` of element `i` as a number, after normalisation.
    double value(std::size_t i, std::size_t c) const;
};

/// How deep arrays and objects stand in each other; deeper JSON than kMaxJsonDepth is not read.
int json_depth(std::string_view json);
inline constexpr int kMaxJsonDepth = 512;

/// A GLB whose container and JSON have been read; each access checks what it touches.
class GlbDocument {
public:
    using Json = nlohmann::json;

    /// Both must outlive the document.
    GlbDocument(std::string_view bytes, const std::string& where);

    const Json& root() const { return root_; }
    std::size_t n_bytes() const { return bytes_.size(); }

    [[noreturn]] void fail(const std::string& what, const std::string& remedy) const;
    [[noreturn]] void refuse(const std::string& what, const std::string& remedy) const;

    /// `object[key]`, or null when there is none.
    const Json* find(const Json& object, const std::string& key) const;
    /// root[list][index], an object.
    const Json& item(const char* list, std::uint64_t index) const;
    /// A whole number >= 0; `path` names the object in messages.
    std::optional<std::uint64_t> whole(const Json& object, const std::string& key,
                                       const std::string& path) const;
    std::uint64_t needed_whole(const Json& object, const std::string& key,
                               const std::string& path) const;
    /// `n` finite numbers.
    std::optional<std::vector<double>> numbers(const Json& object, const std::string& key,
                                               std::size_t n, const std::string& path) const;

    /// The bytes of a buffer view, and where in the file they begin.
    std::string_view view(std::uint64_t index) const;
    std::size_t offset(std::string_view part) const {
        return static_cast<std::size_t>(part.data() - bytes_.data());
    }

    /// The buffer views of all Draco streams, each once.
    std::vector<std::uint64_t> draco_views() const;

    GltfAccessor accessor(std::uint64_t index) const;
    GltfArray array(std::uint64_t accessor_index) const;

private:
    void read_chunks();
    void parse_json(std::string_view text);
    std::string_view buffer(std::uint64_t index) const;

    std::string_view bytes_, bin_;
    bool has_bin_ = false;
    const std::string& where_;
    Json root_;
};

} // namespace taihu
