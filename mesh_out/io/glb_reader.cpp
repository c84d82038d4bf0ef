#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "mesh_out/io/draco_codec_detail.h"
#include "mesh_out/io/glb_document_detail.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "mesh_out/io/polygons_detail.h"
#include "stats/core/box.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

using Json = nlohmann::json;

constexpr int kMaxNodeDepth = 64;
constexpr std::size_t kMaxLevels = 16;
/// Small files may place a mesh many times, but not without end.
constexpr std::size_t kFreeItems = std::size_t{1} << 24;
constexpr std::uint64_t kPrimitiveItems = 16; ///< what one costs that has no vertex
/// Encoders that state the bounds of their input are off by half a step of their quantisation;
/// 1/256 of the largest side is that of 7 bits, coarser than any in use.
constexpr double kBoundsTolerance = 1.0 / 256;

enum Mode : std::uint64_t { kTriangles = 4, kStrip = 5, kFan = 6 };

/// x, y and z axes and the translation of a node.
struct Placement {
    std::array<Vec3, 3> axes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    Vec3 at;

    Vec3 turned(const Vec3& v) const { return axes[0] * v.x + axes[1] * v.y + axes[2] * v.z; }
    Vec3 operator()(const Vec3& p) const { return turned(p) + at; }
    Placement operator*(const Placement& inner) const {
        return {{turned(inner.axes[0]), turned(inner.axes[1]), turned(inner.axes[2])},
                (*this)(inner.at)};
    }
    bool mirrors() const { return dot(cross(axes[0], axes[1]), axes[2]) < 0; }
    /// Normals turn by the cofactors: they stay at right angles to a stretched surface.
    Vec3 normal(const Vec3& n) const {
        return normalized((cross(axes[1], axes[2]) * n.x + cross(axes[2], axes[0]) * n.y +
                           cross(axes[0], axes[1]) * n.z) *
                          (mirrors() ? -1.0 : 1.0));
    }
};

std::string path_of(const char* list, std::uint64_t index) {
    return std::string(list) + '[' + std::to_string(index) + ']';
}

class GlbReader {
public:
    GlbReader(std::string_view bytes, const std::string& where, bool is_own, Progress* progress)
        : document_(bytes, where), where_(where), is_own_(is_own), progress_(progress) {}

    MeshFile read();

private:
    void check_extensions() const;
    void read_asset();
    std::vector<std::uint64_t> root_nodes() const;
    void find_levels(std::uint64_t node, int depth);
    std::vector<std::uint64_t> lower_levels(std::uint64_t node) const;
    void read_node(std::uint64_t node, const Placement& parent, int depth, std::size_t level);
    Placement placement(const Json& node, const std::string& path) const;
    std::vector<std::uint64_t> node_list(const Json& object, const char* key,
                                         const std::string& path) const;
    void visit(std::uint64_t node, int depth);
    void read_mesh(std::uint64_t mesh, const Placement& placement, TriMesh& level);
    void read_primitive(const Json& primitive, const std::string& path, const Placement& placement,
                        TriMesh& level);
    void read_draco(const Json& primitive, const Json& extension, const std::string& path,
                    const Placement& placement, TriMesh& level);
    void decode_streams();
    void check_draco(const DracoMesh& decoded, const Json& primitive, const Json& extension,
                     const std::string& path) const;
    void check_bounds(const TriMesh& mesh, const GltfAccessor& position) const;
    void add_vertices(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals,
                      const Placement& placement, TriMesh& level);
    std::vector<Vec3> read_vectors(const GltfArray& array) const;
    std::vector<Vec3> read_normals(const Json& attributes, const std::string& path,
                                   std::uint64_t n_vertices) const;
    void add_triangle_at(const Triangle& corners, std::size_t first, bool mirrored, bool face,
                         TriMesh& level);
    void spend(std::uint64_t n_items, const std::string& path);

    GlbDocument document_;
    const std::string& where_;
    bool is_own_;
    Progress* progress_;
    MeshFile file_;
    std::vector<char> visited_;
    std::uint64_t n_items_ = 0;
    std::map<std::uint64_t, DracoMesh> draco_; ///< by their buffer views
};

void GlbReader::check_extensions() const {
    const Json* required = document_.find(document_.root(), "extensionsRequired");
    if (!required)
        return;
    static constexpr std::array<std::string_view, 3> kKnown = {kGltfDraco, "KHR_mesh_quantization",
                                                               "MSFT_lod"};
    static constexpr std::array<std::string_view, 3> kLooksOnly = {"KHR_materials_", "KHR_texture_",
                                                                   "EXT_texture_"};
    if (!required->is_array())
        document_.fail("extensionsRequired is not a list", "export it again");
    for (const Json& json : *required) {
        const std::string name = json.is_string() ? json.get<std::string>() : std::string();
        const bool fine =
            std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end() ||
            std::any_of(kLooksOnly.begin(), kLooksOnly.end(),
                        [&](std::string_view prefix) { return name.starts_with(prefix); });
        if (!fine)
            document_.refuse("the file requires the extension '" + printable(name) + "'",
                             "export it without");
    }
}

void GlbReader::read_asset() {
    const Json* asset = document_.find(document_.root(), "asset");
    if (!asset || !asset->is_object())
        document_.fail("there is no asset", "export it again");
    if (const Json* generator = document_.find(*asset, "generator"))
        if (generator->is_string())
            file_.generator = generator->get<std::string>();
    if (const Json* extras = document_.find(*asset, "extras"))
        if (const Json* recipe = document_.find(*extras, "taihu_recipe"))
            file_.recipe = recipe->is_string() ? recipe->get<std::string>() : recipe->dump();
}

std::vector<std::uint64_t> GlbReader::node_list(const Json& object, const char* key,
                                                const std::string& path) const {
    std::vector<std::uint64_t> out;
    const Json* list = document_.find(object, key);
    if (!list)
        return out;
    if (!list->is_array())
        document_.fail(path + '.' + key + " is not a list", "export it again");
    for (const Json& json : *list) {
        if (!json.is_number_unsigned())
            document_.fail(path + '.' + key + " does not hold node numbers", "export it again");
        document_.item("nodes", json.get<std::uint64_t>());
        out.push_back(json.get<std::uint64_t>());
    }
    return out;
}

std::vector<std::uint64_t> GlbReader::root_nodes() const {
    const std::uint64_t scene = document_.whole(document_.root(), "scene", "glTF").value_or(0);
    return node_list(document_.item("scenes", scene), "nodes", path_of("scenes", scene));
}

/// Each node may be reached once: a second way to it would be a loop, or a tree that grows without
/// bound.
void GlbReader::visit(std::uint64_t node, int depth) {
    if (depth > kMaxNodeDepth)
        document_.fail("nodes are nested deeper than " + std::to_string(kMaxNodeDepth),
                       "flatten the scene");
    if (visited_[node])
        document_.fail(path_of("nodes", node) + " is reached twice", "export it again");
    visited_[node] = 1;
}

std::vector<std::uint64_t> GlbReader::lower_levels(std::uint64_t node) const {
    const Json* extensions = document_.find(document_.item("nodes", node), "extensions");
    const Json* lod = extensions ? document_.find(*extensions, "MSFT_lod") : nullptr;
    return lod ? node_list(*lod, "ids", path_of("nodes", node) + ".MSFT_lod")
               : std::vector<std::uint64_t>();
}

/// How many levels the tree under `node` has, and when to use them.
void GlbReader::find_levels(std::uint64_t node, int depth) {
    visit(node, depth);
    const Json& json = document_.item("nodes", node);
    const std::string path = path_of("nodes", node);
    const std::size_t n_levels = 1 + lower_levels(node).size();
    if (n_levels > kMaxLevels)
        document_.refuse(path + " has " + std::to_string(n_levels) + " levels",
                         "give at most " + std::to_string(kMaxLevels));
    if (n_levels > file_.levels.size())
        file_.levels.resize(n_levels);
    if (const Json* extras = document_.find(json, "extras"); extras && file_.coverages.empty())
        if (const Json* list = document_.find(*extras, "MSFT_screencoverage"); list)
            file_.coverages =
                *document_.numbers(*extras, "MSFT_screencoverage", list->size(), path + ".extras");
    for (const std::uint64_t child : node_list(json, "children", path))
        find_levels(child, depth + 1);
}

Placement GlbReader::placement(const Json& node, const std::string& path) const {
    if (const auto m = document_.numbers(node, "matrix", 16, path)) {
        const auto& a = *m;
        if (a[3] != 0 || a[7] != 0 || a[11] != 0 || a[15] != 1)
            document_.fail(path + ".matrix is not affine", "export it again");
        return {{Vec3{a[0], a[1], a[2]}, Vec3{a[4], a[5], a[6]}, Vec3{a[8], a[9], a[10]}},
                {a[12], a[13], a[14]}};
    }
    Placement out;
    if (const auto q = document_.numbers(node, "rotation", 4, path)) {
        const double x = (*q)[0], y = (*q)[1], z = (*q)[2], w = (*q)[3];
        if (!(std::abs(x * x + y * y + z * z + w * w - 1) <
              1e-3)) // written as floats, often rounded
            document_.fail(path + ".rotation is not a unit quaternion", "export it again");
        out.axes = {Vec3{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
                    Vec3{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
                    Vec3{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}};
    }
    if (const auto scale = document_.numbers(node, "scale", 3, path))
        for (std::size_t axis = 0; axis < 3; ++axis)
            out.axes[axis] *= (*scale)[axis];
    if (const auto t = document_.numbers(node, "translation", 3, path))
        out.at = {(*t)[0], (*t)[1], (*t)[2]};
    return out;
}

void GlbReader::read_node(std::uint64_t node, const Placement& parent, int depth,
                          std::size_t level) {
    // A lower level stands in for its node, children included; its own transform counts.
    if (const auto lower = lower_levels(node); level > 0 && !lower.empty())
        node = lower[std::min(level, lower.size()) - 1];
    visit(node, depth);
    check_cancelled(progress_);
    const Json& json = document_.item("nodes", node);
    const std::string path = path_of("nodes", node);
    if (const Json* extensions = document_.find(json, "extensions"))
        if (document_.find(*extensions, "EXT_mesh_gpu_instancing"))
            document_.refuse(path + " has instances by EXT_mesh_gpu_instancing",
                             "export them as nodes");
    const Placement here = parent * placement(json, path);
    if (const auto mesh = document_.whole(json, "mesh", path))
        read_mesh(*mesh, here, file_.levels[level]);
    for (const std::uint64_t child : node_list(json, "children", path))
        read_node(child, here, depth + 1, level);
}

void GlbReader::read_mesh(std::uint64_t mesh, const Placement& placement, TriMesh& level) {
    const std::string path = path_of("meshes", mesh);
    const Json* primitives = document_.find(document_.item("meshes", mesh), "primitives");
    if (!primitives || !primitives->is_array())
        document_.fail(path + " has no primitives", "export it again");
    for (std::size_t i = 0; i < primitives->size(); ++i)
        read_primitive((*primitives)[i], path + '.' + path_of("primitives", i), placement, level);
}

/// Counts what the file unfolds into.
void GlbReader::spend(std::uint64_t n_items, const std::string& path) {
    n_items_ += n_items; // each at most 2^32
    if (n_items_ > std::max(kFreeItems, document_.n_bytes()))
        document_.fail(path + " unfolds into over " +
                           std::to_string(std::max(kFreeItems, document_.n_bytes())) +
                           " vertices and triangles",
                       "place the mesh less often or split the file");
}

void GlbReader::add_vertices(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals,
                             const Placement& placement, TriMesh& level) {
    if (level.normals.size() == level.positions.size()) // all so far have normals
        for (const Vec3& n : normals)
            level.normals.push_back(placement.normal(n));
    for (const Vec3& p : positions) {
        level.positions.push_back(placement(p));
        if (!is_finite(level.positions.back()))
            document_.fail("a placed position is not finite", "export it again");
    }
}

std::vector<Vec3> GlbReader::read_vectors(const GltfArray& array) const {
    std::vector<Vec3> out(array.accessor.count);
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = {array.value(i, 0), array.value(i, 1), array.value(i, 2)};
        if (!is_finite(out[i]))
            document_.fail("element " + std::to_string(i) + " of " +
                               path_of("accessors", array.accessor.index) + " is not finite",
                           "mend the file or export it again");
    }
    return out;
}

std::vector<Vec3> GlbReader::read_normals(const Json& attributes, const std::string& path,
                                          std::uint64_t n_vertices) const {
    const auto index = document_.whole(attributes, "NORMAL", path + ".attributes");
    if (!index)
        return {};
    const GltfArray normal = document_.array(*index);
    if (normal.accessor.n_components != 3 || normal.accessor.count != n_vertices)
        document_.fail(path_of("accessors", *index) + " is no array of a normal for each vertex",
                       "export it again");
    return read_vectors(normal);
}

/// \param face  false within strips and fans, where a repeated corner only carries the strip on.
void GlbReader::add_triangle_at(const Triangle& corners, std::size_t first, bool mirrored,
                                bool face, TriMesh& level) {
    const auto shift = static_cast<std::uint32_t>(first);
    Triangle out = {corners[0] + shift, corners[1] + shift, corners[2] + shift};
    if (mirrored)
        std::swap(out[1], out[2]);
    const std::size_t n_degenerate = file_.n_degenerate_faces;
    add_triangle(file_, level, out);
    if (!face)
        file_.n_degenerate_faces = n_degenerate;
}

void GlbReader::read_primitive(const Json& primitive, const std::string& path,
                               const Placement& placement, TriMesh& level) {
    spend(kPrimitiveItems, path);
    const std::uint64_t mode = document_.whole(primitive, "mode", path).value_or(kTriangles);
    if (mode < kTriangles)
        return; // points and lines
    if (mode > kFan)
        document_.fail(path + ".mode is " + std::to_string(mode), "export it again");
    if (const Json* extensions = document_.find(primitive, "extensions"))
        if (const Json* draco = document_.find(*extensions, kGltfDraco)) {
            if (mode != kTriangles)
                document_.refuse(path + " is a Draco strip", "export triangles");
            read_draco(primitive, *draco, path, placement, level);
            return;
        }
    const Json* attributes = document_.find(primitive, "attributes");
    if (!attributes)
        document_.fail(path + " has no attributes", "export it again");
    const GltfArray position =
        document_.array(document_.needed_whole(*attributes, "POSITION", path + ".attributes"));
    if (position.accessor.n_components != 3 || position.accessor.component_type == kGltfUint)
        document_.fail(path_of("accessors", position.accessor.index) + " is no array of positions",
                       "export it again");
    std::optional<GltfArray> indices;
    if (const auto index = document_.whole(primitive, "indices", path)) {
        indices = document_.array(*index);
        const std::uint64_t type = indices->accessor.component_type;
        if (indices->accessor.n_components != 1 ||
            (type != kGltfUbyte && type != kGltfUshort && type != kGltfUint))
            document_.fail(path_of("accessors", *index) + " is no array of indices",
                           "export it again");
        indices->accessor.normalized = false;
    }
    const std::uint64_t n_vertices = position.accessor.count;
    const std::uint64_t n = indices ? indices->accessor.count : n_vertices;
    if (n < 3 || (mode == kTriangles && n % 3 != 0))
        document_.fail(path + " has " + std::to_string(n) + " corners, no number of triangles",
                       "export it again");
    spend(n_vertices + (mode == kTriangles ? n / 3 : n - 2), path);

    const std::size_t first = level.positions.size();
    add_vertices(read_vectors(position), read_normals(*attributes, path, n_vertices), placement,
                 level);
    const bool mirrored = placement.mirrors();
    const auto corner = [&](std::size_t i) {
        if (!indices)
            return static_cast<std::uint32_t>(i);
        const auto index = static_cast<std::uint32_t>(indices->value(i, 0));
        if (index >= n_vertices)
            document_.fail("index " + std::to_string(i) + " of " +
                               path_of("accessors", indices->accessor.index) + " is " +
                               std::to_string(index) + ", but there are " +
                               std::to_string(n_vertices) + " vertices",
                           "mend the file or export it again");
        return index;
    };
    if (mode == kTriangles) {
        for (std::size_t i = 0; i < n; i += 3)
            add_triangle_at({corner(i), corner(i + 1), corner(i + 2)}, first, mirrored, true,
                            level);
        return;
    }
    for (std::size_t i = 2; i < n; ++i) {
        const bool turned = mode == kStrip && i % 2 == 1;
        add_triangle_at({mode == kFan ? corner(0) : corner(i - 2), corner(i - 1), corner(i)}, first,
                        mirrored != turned, false, level);
    }
}

void GlbReader::check_bounds(const TriMesh& mesh, const GltfAccessor& position) const {
    const std::string path = path_of("accessors", position.index);
    const auto lo = document_.numbers(*position.json, "min", 3, path);
    const auto hi = document_.numbers(*position.json, "max", 3, path);
    if (!lo || !hi)
        document_.fail(path + " has no min and max", "export it again");
    Box box;
    for (const Vec3& p : mesh.positions)
        box.include(p);
    const double tolerance = kBoundsTolerance * box.longest();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const int a = static_cast<int>(axis);
        if (std::abs((*lo)[axis] - box.lo[a]) > tolerance ||
            std::abs((*hi)[axis] - box.hi[a]) > tolerance)
            document_.fail(path + ": min and max are not those of the Draco positions",
                           "export it again");
    }
}

void GlbReader::check_draco(const DracoMesh& decoded, const Json& primitive, const Json& extension,
                            const std::string& path) const {
    const Json* attributes = document_.find(primitive, "attributes");
    const Json* ids = document_.find(extension, "attributes");
    if (!attributes || !ids || !ids->is_object())
        document_.fail(path + " has no attributes", "export it again");
    for (const auto& [name, json] : ids->items()) {
        const std::string label = path + " attribute " + printable(name);
        const std::uint64_t id = document_.needed_whole(*ids, name, path + ".attributes");
        const bool right = name == "POSITION" ? id == decoded.position_id
                           : name == "NORMAL" ? decoded.normal_id && id == *decoded.normal_id
                                              : std::find(decoded.ids.begin(), decoded.ids.end(),
                                                          id) != decoded.ids.end();
        if (!right)
            document_.fail(label + " is Draco attribute " + std::to_string(id) +
                               ", which is not that",
                           "export it again");
    }
    if (!document_.find(*ids, "POSITION"))
        document_.fail(path + " has no Draco POSITION", "export it again");
    const auto check_count = [&](std::uint64_t accessor, std::size_t n, const char* what) {
        const Json& json = document_.item("accessors", accessor);
        const std::string name = path_of("accessors", accessor);
        if (const auto count = document_.needed_whole(json, "count", name); count != n)
            document_.fail(name + ".count is " + std::to_string(count) + ", but Draco holds " +
                               std::to_string(n) + ' ' + what,
                           "export it again");
    };
    check_count(document_.needed_whole(primitive, "indices", path),
                3 * decoded.mesh.triangles.size(), "indices");
    for (const auto& [name, json] : ids->items())
        check_count(document_.needed_whole(*attributes, name, path + ".attributes"),
                    decoded.mesh.positions.size(), "points");
    check_bounds(decoded.mesh, document_.accessor(document_.needed_whole(*attributes, "POSITION",
                                                                         path + ".attributes")));
}

/// Those of all meshes at once: a file may have hundreds, and each call starts a program.
void GlbReader::decode_streams() {
    const std::vector<std::uint64_t> views = document_.draco_views();
    std::vector<DracoStream> streams;
    std::size_t n_bytes = 0;
    for (const std::uint64_t view : views) {
        const std::string_view bytes = document_.view(view);
        n_bytes += bytes.size();
        if (n_bytes > document_.n_bytes())
            document_.fail("its Draco streams overlap", "export it again");
        streams.push_back({bytes, where_ + ":byte " + std::to_string(document_.offset(bytes))});
    }
    std::vector<DracoMesh> meshes = taihu::read_draco(
        streams, where_, is_own_, std::max(kFreeItems, document_.n_bytes()), progress_);
    for (std::size_t i = 0; i < views.size(); ++i)
        draco_[views[i]] = std::move(meshes[i]);
}

void GlbReader::read_draco(const Json& primitive, const Json& extension, const std::string& path,
                           const Placement& placement, TriMesh& level) {
    if (draco_.empty())
        decode_streams();
    const DracoMesh& decoded = draco_.at(document_.needed_whole(extension, "bufferView", path));
    check_draco(decoded, primitive, extension, path);
    spend(decoded.mesh.positions.size() + decoded.mesh.triangles.size(), path);
    file_.draco = true;
    const std::size_t first = level.positions.size();
    add_vertices(decoded.mesh.positions, decoded.mesh.normals, placement, level);
    for (const Triangle& t : decoded.mesh.triangles)
        add_triangle_at(t, first, placement.mirrors(), true, level);
}

MeshFile GlbReader::read() {
    check_extensions();
    read_asset();
    const Json* nodes = document_.find(document_.root(), "nodes");
    const std::size_t n_nodes = nodes && nodes->is_array() ? nodes->size() : 0;
    const auto roots = root_nodes();
    file_.levels.resize(1);
    visited_.assign(n_nodes, 0);
    for (const std::uint64_t node : roots)
        find_levels(node, 0);
    for (std::size_t level = 0; level < file_.levels.size(); ++level) {
        visited_.assign(n_nodes, 0);
        for (const std::uint64_t node : roots)
            read_node(node, {}, 0, level);
        report_fraction(progress_,
                        static_cast<double>(level + 1) / static_cast<double>(file_.levels.size()));
    }
    for (TriMesh& level : file_.levels)
        if (level.normals.size() != level.positions.size())
            level.normals.clear(); // some primitive had none
    return std::move(file_);
}

} // namespace

MeshFile parse_glb(std::string_view bytes, const std::string& where, bool is_own,
                   Progress* progress) {
    return GlbReader(bytes, where, is_own, progress).read();
}

} // namespace taihu
