#include "mesh_out/tile_mesh.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "mesh_out/crossings_detail.h"
#include "mesh_out/partition_detail.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/tiles.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::CoordBBox;
using Leaf = openvdb::FloatTree::LeafNodeType;

/// A file that is written in small pieces.
class Pieces {
public:
    explicit Pieces(const fs::path& path) : file_(path) {}
    template <class T>
    void add(const T& value) {
        const auto* bytes = reinterpret_cast<const char*>(&value);
        buffer_.insert(buffer_.end(), bytes, bytes + sizeof value);
        if (buffer_.size() > kMost)
            flush();
    }
    void add_text(const std::string& text) {
        buffer_.insert(buffer_.end(), text.begin(), text.end());
    }
    void append(Pieces& other) {
        other.flush();
        flush();
        std::vector<char> part(kMost);
        std::uint64_t at = 0;
        while (const std::size_t n = other.file_.read_at(at, part)) {
            file_.write({part.data(), n});
            at += n;
        }
    }
    void replace_start(const std::string& text) {
        flush();
        file_.write_at(0, text);
    }
    std::uint64_t publish() {
        flush();
        file_.publish();
        return file_.size();
    }

private:
    static constexpr std::size_t kMost = std::size_t{1} << 20;
    void flush() {
        file_.write({buffer_.data(), buffer_.size()});
        buffer_.clear();
    }

    OutputFile file_;
    std::vector<char> buffer_;
};

/// All of a fixed length, so that the counts can be put in at the end.
std::string header(std::uint64_t n_vertices, std::uint64_t n_triangles) {
    const auto wide = [](std::uint64_t n) {
        const std::string text = std::to_string(n);
        return std::string(20 - std::min<std::size_t>(20, text.size()), ' ') + text;
    };
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + wide(n_vertices) +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
           wide(n_triangles) + "\nproperty list uchar uint vertex_indices\nend_header\n";
}

struct PositionHash {
    std::size_t operator()(const std::array<float, 3>& p) const {
        std::size_t hash = 0;
        for (const float x : p) {
            std::uint32_t bits;
            std::memcpy(&bits, &x, sizeof bits);
            hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
            hash ^= hash >> 29;
        }
        return hash;
    }
};

/// Tiles as one mesh: what they share is kept until no more of them can have it.
class Welder {
public:
    explicit Welder(const fs::path& out) : vertices_(out), faces_(out) {
        vertices_.add_text(header(0, 0));
    }

    void add(const TileSurface& tile);
    /// Forgets vertices before this plane: no tile that is to come has them.
    void forget_before(double x) {
        std::erase_if(shared_, [x](const auto& v) { return double(v.first[0]) < x; });
    }
    TileMeshResult finish();

private:
    struct Shared {
        std::uint32_t vertex, piece;
    };
    using Position = std::array<float, 3>;

    std::vector<std::uint32_t> number(const TileSurface& tile, const std::vector<Vec3>& positions);
    void count_edges(const TileSurface& tile, const std::vector<std::uint32_t>& numbers);
    void measure(const TileSurface& tile, const std::vector<Vec3>& positions);
    void count_fans(const TileSurface& tile, const std::vector<std::uint8_t>& is_new);

    Pieces vertices_, faces_; ///< the second ends in the first
    std::unordered_map<Position, Shared, PositionHash> shared_;
    std::unordered_set<std::uint64_t> open_; ///< directed edges whose other face is still to come
    std::uint32_t n_pieces_ = 0;             ///< seen in single tiles
    std::vector<std::pair<std::uint32_t, std::uint32_t>> joined_; ///< of those
    std::uint64_t crossings_twice_ = 0;
    TileMeshResult result_;
};

/// The numbers of the vertices of a tile's own triangles, which are written when they are new.
std::vector<std::uint32_t> Welder::number(const TileSurface& tile,
                                          const std::vector<Vec3>& positions) {
    enum : std::uint8_t { kOwn = 1, kAround = 2, kNew = 4 };
    std::vector<std::uint8_t> of(positions.size());
    Partition local(positions.size());
    for (std::size_t i = 0; i < tile.mesh.triangles.size(); ++i) {
        const Triangle& t = tile.mesh.triangles[i];
        for (const std::uint32_t v : t)
            of[v] = static_cast<std::uint8_t>(of[v] | (i < tile.n_owned ? kOwn : kAround));
        if (i < tile.n_owned)
            for (const std::uint32_t v : {t[1], t[2]})
                local.join(t[0], v);
    }
    std::unordered_map<std::uint32_t, std::uint32_t> piece_of;
    std::vector<std::uint32_t> numbers(positions.size());
    std::vector<std::uint8_t> is_new(positions.size());
    std::vector<std::pair<std::uint32_t, std::uint32_t>> joined;
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
        if (!(of[v] & kOwn))
            continue;
        const auto [piece, first] = piece_of.emplace(local.find(v), n_pieces_);
        n_pieces_ += first;
        const Position p{static_cast<float>(positions[v].x), static_cast<float>(positions[v].y),
                         static_cast<float>(positions[v].z)};
        if (of[v] & kAround) {
            const auto at = shared_.find(p);
            if (at != shared_.end()) {
                numbers[v] = at->second.vertex;
                joined.emplace_back(at->second.piece, piece->second);
                continue;
            }
            shared_.emplace(p,
                            Shared{static_cast<std::uint32_t>(result_.n_vertices), piece->second});
        }
        if (result_.n_vertices == std::numeric_limits<std::uint32_t>::max())
            throw Error(Fault::unsupported, "tiles: the mesh would have 2^32 vertices or more; use "
                                            "a larger voxel");
        numbers[v] = static_cast<std::uint32_t>(result_.n_vertices++);
        is_new[v] = 1;
        vertices_.add(p);
    }
    std::sort(joined.begin(), joined.end());
    joined_.insert(joined_.end(), joined.begin(), std::unique(joined.begin(), joined.end()));
    count_fans(tile, is_new);
    return numbers;
}

void Welder::add(const TileSurface& tile) {
    std::vector<Vec3> positions = tile.mesh.positions;
    for (Vec3& p : positions)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = static_cast<double>(static_cast<float>(p[axis]));
    const std::vector<std::uint32_t> numbers = number(tile, positions);
    for (std::size_t i = 0; i < tile.n_owned; ++i) {
        faces_.add(std::uint8_t{3});
        for (const std::uint32_t v : tile.mesh.triangles[i])
            faces_.add(numbers[v]);
    }
    result_.n_triangles += tile.n_owned;
    count_edges(tile, numbers);
    measure(tile, positions);
}

/// An edge is done when it was met the other way; those of a tile's middle cancel at once.
void Welder::count_edges(const TileSurface& tile, const std::vector<std::uint32_t>& numbers) {
    std::vector<std::uint64_t> ahead, back;
    for (std::size_t i = 0; i < tile.n_owned; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint64_t from = numbers[tile.mesh.triangles[i][k]],
                                to = numbers[tile.mesh.triangles[i][(k + 1) % 3]];
            ahead.push_back(from << 32 | to);
            back.push_back(to << 32 | from);
        }
    std::sort(ahead.begin(), ahead.end());
    std::sort(back.begin(), back.end());
    std::vector<std::uint64_t> left;
    std::set_difference(ahead.begin(), ahead.end(), back.begin(), back.end(),
                        std::back_inserter(left));
    for (const std::uint64_t edge : left)
        if (open_.erase(edge << 32 | edge >> 32) == 0 && !open_.insert(edge).second)
            ++result_.n_boundary_edges;
    result_.n_boundary_edges +=
        static_cast<std::uint64_t>(ahead.end() - std::unique(ahead.begin(), ahead.end()));
}

/// Volume, area, faces without area, and pairs that cross: those with a face of another tile are
/// met in both.
void Welder::measure(const TileSurface& tile, const std::vector<Vec3>& positions) {
    const auto& triangles = tile.mesh.triangles;
    double volume6 = 0, area2 = 0;
    std::vector<std::uint8_t> own(triangles.size());
    for (std::size_t i = 0; i < tile.n_owned; ++i) {
        const Vec3 &a = positions[triangles[i][0]], &b = positions[triangles[i][1]],
                   &c = positions[triangles[i][2]];
        own[i] = 1;
        volume6 += dot(a, cross(b, c));
        area2 += length(cross(b - a, c - a));
        result_.n_degenerate_faces += is_flat(a, b, c);
    }
    result_.volume_m3 += volume6 / 6;
    result_.area_m2 += area2 / 2;
    for (const auto& [f, g] : crossing_pairs(positions, triangles, own))
        crossings_twice_ += f < tile.n_owned && g < tile.n_owned ? 2 : 1;
}

/// Vertices whose triangles, of this tile or around it, are not all joined over edges at them.
void Welder::count_fans(const TileSurface& tile, const std::vector<std::uint8_t>& is_new) {
    const auto& triangles = tile.mesh.triangles;
    std::vector<std::uint32_t> first(is_new.size() + 1);
    for (const Triangle& t : triangles)
        for (const std::uint32_t v : t)
            ++first[v + 1];
    for (std::size_t v = 1; v < first.size(); ++v)
        first[v] += first[v - 1];
    std::vector<std::uint32_t> around(first.back()), next(first.begin(), first.end() - 1);
    for (std::uint32_t i = 0; i < triangles.size(); ++i)
        for (const std::uint32_t v : triangles[i])
            around[next[v]++] = i;
    for (std::uint32_t v = 0; v < is_new.size(); ++v) {
        if (!is_new[v])
            continue;
        // From one triangle over its edges at v as far as that goes.
        const auto corner = [&](std::uint32_t i, std::size_t by) {
            const Triangle& t = triangles[i];
            const std::size_t k = t[0] == v ? 0 : t[1] == v ? 1 : 2;
            return t[(k + by) % 3];
        };
        const std::uint32_t start = around[first[v]];
        std::size_t n = 0;
        std::uint32_t at = start;
        for (bool on = true; on && n <= first[v + 1] - first[v];) {
            ++n;
            on = false;
            for (auto i = first[v]; i < first[v + 1] && !on; ++i)
                if (corner(around[i], 1) == corner(at, 2)) {
                    at = around[i];
                    on = at != start;
                    break;
                }
        }
        result_.n_nonmanifold_vertices += n != first[v + 1] - first[v];
    }
}

TileMeshResult Welder::finish() {
    result_.n_boundary_edges += open_.size();
    result_.n_self_intersections = crossings_twice_ / 2;
    Partition pieces(n_pieces_);
    for (const auto& [one, other] : joined_)
        pieces.join(one, other);
    result_.n_components = pieces.n_classes();
    // Every edge of a closed mesh has two triangles: V - E + F = V - F / 2.
    const auto euler = static_cast<std::int64_t>(result_.n_vertices) -
                       static_cast<std::int64_t>(result_.n_triangles / 2);
    result_.genus = static_cast<std::int64_t>(result_.n_components) - euler / 2;
    vertices_.append(faces_);
    vertices_.replace_start(header(result_.n_vertices, result_.n_triangles));
    result_.n_bytes = vertices_.publish();
    return result_;
}

/// Parts of a solid that its tiles hold.
class Parts {
public:
    explicit Parts(const fs::path& set) : folder_(set.parent_path()), set_(read_tile_set(set)) {
        const int edge = set_.tile_voxels;
        if (edge % kLeastTile != 0)
            throw Error(Fault::bad_input, base_name(set) + ": 'tile_voxels' is " +
                                              std::to_string(edge) + ", must be a multiple of 128");
        for (const Tile& t : set_.tiles) {
            bool is_tile = t.box.dim() == Coord(edge);
            for (int axis = 0; axis < 3; ++axis)
                is_tile = is_tile && t.box.min()[axis] % edge == 0;
            if (!is_tile || !at_.emplace(t.box.min(), &t).second)
                throw Error(Fault::bad_input,
                            t.file + ": its box is not one of a tile, or another's; write the "
                                     "tiles again");
            world_.expand(t.box);
        }
    }
    const TileSet& set() const { return set_; }
    bool has(const Coord& first) const { return at_.contains(first); }
    /// All tiles together.
    const CoordBBox& world() const { return world_; }

    /// Its voxels in a box of whole leaves.
    openvdb::FloatGrid::Ptr in(const CoordBBox& box) const {
        const auto part = empty_level_set(set_.lattice);
        const int edge = set_.tile_voxels;
        const auto down = [edge](int x) { return (x >= 0 ? x : x - edge + 1) / edge * edge; };
        for (int x = down(box.min().x()); x <= box.max().x(); x += edge)
            for (int y = down(box.min().y()); y <= box.max().y(); y += edge)
                for (int z = down(box.min().z()); z <= box.max().z(); z += edge)
                    if (const auto tile = at_.find(Coord(x, y, z)); tile != at_.end())
                        add(*tile->second, box, *part);
        return part;
    }

    /// Whether something is inside in the first layer of a tile along an axis.
    bool is_inside_at(const Tile& tile, int axis) const {
        const auto grid = read_tile(folder_, tile, set_.lattice);
        for (auto value = grid->tree().cbeginValueAll(); value; ++value)
            if (value.getValue() < 0 && value.getBoundingBox().min()[axis] <= tile.box.min()[axis])
                return true;
        return false;
    }

private:
    void add(const Tile& tile, const CoordBBox& box, openvdb::FloatGrid& to) const {
        const auto grid = read_tile(folder_, tile, set_.lattice);
        auto& tree = grid->tree();
        auto inside = tree.cbeginValueAll();
        inside.setMaxDepth(inside.getLeafDepth() - 1);
        for (; inside; ++inside) {
            if (!(inside.getValue() < 0))
                continue;
            CoordBBox filled = inside.getBoundingBox();
            filled.intersect(box);
            filled.intersect(tile.box);
            if (!filled.empty())
                to.tree().sparseFill(filled, inside.getValue(), false);
        }
        std::vector<Coord> origins;
        for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
            if (box.isInside(leaf->origin()) && tile.box.isInside(leaf->origin()))
                origins.push_back(leaf->origin());
        for (const Coord& at : origins)
            to.tree().addLeaf(tree.stealNode<Leaf>(at, tree.background(), false));
    }

    fs::path folder_;
    TileSet set_;
    std::unordered_map<Coord, const Tile*> at_;
    CoordBBox world_;
};

/// One box of voxels, with as much around it as it needs.
void add_box(const Parts& parts, const CoordBBox& box, const ExtractSettings& settings,
             Welder& welder, Progress* progress) {
    constexpr int kMostHalo = 3 * kTileHalo_vox, kMore = 64;
    for (int halo = kTileHalo_vox; halo <= kMostHalo; halo += kMore) {
        CoordBBox given = box;
        given.expand(halo);
        const auto solid = parts.in(given);
        // Beyond all tiles there is nothing, as far as one looks.
        for (int axis = 0; axis < 3; ++axis) {
            if (given.min()[axis] <= parts.world().min()[axis])
                given.min()[axis] -= kMostHalo;
            if (given.max()[axis] >= parts.world().max()[axis])
                given.max()[axis] += kMostHalo;
        }
        if (const auto tile = extract_tile(*solid, given, box, nullptr, settings, progress)) {
            welder.add(*tile);
            return;
        }
    }
    const Coord at = box.min();
    throw Error(Fault::numeric, "tiles: faces cross all over the voxels around " +
                                    std::to_string(at.x()) + " " + std::to_string(at.y()) + " " +
                                    std::to_string(at.z()) +
                                    ", which hardly resolve the solid; use a smaller voxel");
}

} // namespace

TileMeshResult write_tile_mesh(const fs::path& set, const fs::path& out,
                               const ExtractSettings& settings, Progress* progress) {
    const Parts parts(set);
    std::vector<CoordBBox> boxes;
    for (const Tile& t : parts.set().tiles) {
        boxes.push_back(t.box);
        // Edges that begin in a tile with nothing inside, and end in this one.
        for (int axis = 0; axis < 3; ++axis) {
            Coord before = t.box.min();
            before[axis] -= parts.set().tile_voxels;
            if (parts.has(before) || !parts.is_inside_at(t, axis))
                continue;
            CoordBBox sheet = t.box;
            sheet.min()[axis] = t.box.min()[axis] - 8;
            sheet.max()[axis] = t.box.min()[axis] - 1;
            boxes.push_back(sheet);
        }
    }
    std::sort(boxes.begin(), boxes.end(),
              [](const CoordBBox& a, const CoordBBox& b) { return a.min() < b.min(); });
    Welder welder(out);
    const Lattice& lattice = parts.set().lattice;
    report_stage(progress, "meshing tiles");
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        check_cancelled(progress);
        report_fraction(progress, double(i) / double(boxes.size()));
        constexpr int kReach_vox = 16; // of triangles out of the voxels of their edges
        if (i > 0 && boxes[i].min().x() > boxes[i - 1].min().x())
            welder.forget_before(lattice.origin.x +
                                 lattice.voxel_m * (boxes[i].min().x() - kReach_vox));
        add_box(parts, boxes[i], settings, welder, progress);
    }
    TileMeshResult result = welder.finish();
    result.n_tiles = parts.set().tiles.size();
    return result;
}

} // namespace taihu
