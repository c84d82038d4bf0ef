#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <tuple>
#include <unordered_set>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "mesh_out/cell_sizes_detail.h"
#include "mesh_out/crossings_detail.h"
#include "mesh_out/dual_surface_detail.h"
#include "mesh_out/extract.h"
#include "mesh_out/level_set_check_detail.h"
#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/level_set_probe_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr double kReach_vox = 1.25; // a level set of half width 3 tells that much between voxels
constexpr double kSlack_vox = 2;    // so far from their cells the edges of fins may be

/// Calls fn(points, i) for i below n, in parallel, with points for one thread.
template <class Fn>
void each(std::size_t n, const SurfacePoints& points, Progress* progress, const Fn& fn) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 1024), [&](const auto& range) {
        check_cancelled(progress);
        const SurfacePoints own = points;
        for (std::size_t i = range.begin(); i < range.end(); ++i)
            fn(own, i);
    });
}

/// Places the vertices of a dual surface and splits its polygons.
class Mesher {
public:
    Mesher(const CellBlocks& blocks, const DualSurface& surface, const SurfacePoints& points,
           Progress* progress)
        : blocks_(blocks), surface_(surface), points_(points), progress_(progress) {}

    LabelledMesh& mesh() { return mesh_; }

    void find_crossings() {
        const auto& edges = surface_.edges();
        crossings_.resize(edges.size());
        each(edges.size(), points_, progress_, [&](const SurfacePoints& points, std::size_t i) {
            crossings_[i] = points.on_edge(blocks_[edges[i].block].origin +
                                               CellBlocks::local(edges[i].key % 512),
                                           edges[i].key / 512);
        });
        const auto& polygons = surface_.polygons();
        first_.assign(surface_.n_vertices() + 1, 0);
        for (const DualPolygon& p : polygons)
            for (std::size_t k = 0; k < p.n; ++k)
                ++first_[p.vertices[k] + 1];
        std::partial_sum(first_.begin(), first_.end(), first_.begin());
        around_.resize(first_.back());
        std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
        for (std::uint32_t i = 0; i < polygons.size(); ++i)
            for (std::size_t k = 0; k < polygons[i].n; ++k)
                around_[next[polygons[i].vertices[k]]++] = i;
    }

    void place() {
        mesh_.positions.resize(surface_.n_vertices());
        mesh_.labels.resize(surface_.n_vertices());
        stage_.assign(surface_.n_vertices(), 0);
        each(surface_.n_vertices(), points_, progress_,
             [&](const SurfacePoints& points, std::size_t v) {
                 const auto placed =
                     points.place(crossings_of(v), cell_box(v), kSlack_vox * points.voxel_m());
                 mesh_.positions[v] = placed.point;
                 mesh_.labels[v] = placed.labels;
             });
    }

    void split_all() {
        first_triangle_.resize(surface_.polygons().size() + 1);
        for (std::size_t i = 0; i < surface_.polygons().size(); ++i)
            first_triangle_[i + 1] = first_triangle_[i] + surface_.polygons()[i].n - 2u;
        mesh_.triangles.resize(first_triangle_.back());
        each(surface_.polygons().size(), points_, progress_,
             [&](const SurfacePoints& points, std::size_t i) { split(points, i); });
    }

    /// Vertices go back towards the middle of their cells until no triangles cross. Those of cells
    /// that cannot be helped so are returned.
    std::vector<std::uint32_t> retreat() {
        constexpr int kMostRounds = 16;
        std::vector<std::uint8_t> picked = risky();
        std::vector<std::uint32_t> hit;
        bool all_tested = false;
        for (int round = 0; round < kMostRounds; ++round) {
            hit = in_trouble(picked);
            if (hit.empty() && !all_tested) { // those that are not risky cross others seldom
                all_tested = true;
                std::fill(picked.begin(), picked.end(), 1);
                hit = in_trouble(picked);
            }
            if (std::all_of(hit.begin(), hit.end(),
                            [&](std::uint32_t v) { return stage_[v] >= kLastStage; }))
                break;
            each(hit.size(), points_, progress_,
                 [&](const SurfacePoints& points, std::size_t i) { step_back(points, hit[i]); });
            std::vector<std::uint32_t> polygons; // that change
            for (const std::uint32_t v : hit)
                polygons.insert(polygons.end(), around_.begin() + first_[v],
                                around_.begin() + first_[v + 1]);
            std::sort(polygons.begin(), polygons.end());
            polygons.erase(std::unique(polygons.begin(), polygons.end()), polygons.end());
            each(polygons.size(), points_, progress_,
                 [&](const SurfacePoints& points, std::size_t i) { split(points, polygons[i]); });
            std::fill(picked.begin(), picked.end(), 0);
            for (const std::uint32_t p : polygons)
                for (auto t = first_triangle_[p]; t < first_triangle_[p + 1]; ++t)
                    picked[t] = 1;
        }
        return hit;
    }

private:
    static constexpr std::uint8_t kOutside = 7, kLastStage = 9;
    /// Vertices of two sheets; so that rounding does not bring them together.
    static constexpr double kLeastApart_vox = 0.02;

    /// Triangles that may cross others: those with corners that left their cells or on edges within
    /// one primitive, and those round
    /// a triangle that is not of one primitive with its edge, does not face as that does, or has
    /// all corners on one rim.
    std::vector<std::uint8_t> risky() const {
        constexpr double kUpright = 0.5; // cosine of 60 degrees
        std::vector<std::uint8_t> astray(mesh_.positions.size()), risk(mesh_.triangles.size());
        tbb::parallel_for(std::size_t{0}, astray.size(), [&](std::size_t v) {
            astray[v] = !cell_box(v).contains(mesh_.positions[v]) || !is_smooth(crossings_of(v));
        });
        tbb::parallel_for(std::size_t{0}, crossings_.size(), [&](std::size_t i) {
            const Crossing& c = crossings_[i];
            for (auto t = first_triangle_[i]; t < first_triangle_[i + 1]; ++t) {
                const Triangle& corners = mesh_.triangles[t];
                const auto label = [&](std::size_t k) { return mesh_.labels[corners[k]]; };
                const Vec3 a = mesh_.positions[corners[0]], b = mesh_.positions[corners[1]],
                           d = mesh_.positions[corners[2]], n = cross(b - a, d - a);
                risk[t] = !c.known || is_needle(corners) ||
                          !(dot(n, c.normal) > kUpright * length(n)) ||
                          label(0).common(label(1)).common(label(2)).size() > 1;
                for (const std::uint32_t v : corners)
                    risk[t] = risk[t] || !mesh_.labels[v].has(c.primitive);
            }
        });
        for (std::size_t t = 0; t < risk.size(); ++t)
            if (risk[t])
                for (const std::uint32_t v : mesh_.triangles[t])
                    astray[v] = 1;
        tbb::parallel_for(std::size_t{0}, risk.size(), [&](std::size_t t) {
            for (const std::uint32_t v : mesh_.triangles[t])
                risk[t] = risk[t] || astray[v];
        });
        return risk;
    }

    /// Good until the same thread asks again.
    std::span<const Crossing> crossings_of(std::size_t v) const {
        thread_local std::vector<Crossing> all;
        all.clear();
        for (std::size_t k = first_[v]; k < first_[v + 1]; ++k)
            all.push_back(crossings_[around_[k]]);
        return all;
    }
    Box cell_box(std::size_t v) const {
        const CellRef& cell = surface_.cell(v);
        const auto at = blocks_[cell.block].origin + CellBlocks::local(cell.first);
        Box box;
        box.include(points_.voxel(at));
        box.include(points_.voxel(at.offsetBy(cell.size)));
        return box;
    }

    /// Aside of a rim, first: where a solid is a fin, cells on both sides of its edge take the same
    /// stretch of that, and a little is enough to part them. Then into the cell, if it is outside;
    /// off the rim; to the middle of the crossings.
    void step_back(const SurfacePoints& points, std::uint32_t v) {
        static constexpr std::array<double, 3> kAside = {0.05, 0.2,
                                                         0.6}; // of the way to the crossings
        const Box cell = cell_box(v);
        const auto crossings = crossings_of(v);
        const LabelledPoint start = points.place(crossings, cell, kSlack_vox * points.voxel_m());
        std::optional<LabelledPoint> to;
        while (!to) {
            const std::uint8_t stage = stage_[v]++;
            if (stage < kOutside - 1)
                to = points.aside(start, crossings, stage % 2, kAside[stage / 2]);
            else if (stage == kOutside - 1 && !cell.contains(start.point))
                to = points.back_in(start, cell);
            else if (stage == kOutside && start.labels.size() > 1)
                to = points.on_face(mean_of(crossings), cell);
            else if (stage > kOutside) {
                stage_[v] = kLastStage;
                to = LabelledPoint{mean_of(crossings), points.label(mean_of(crossings))};
            }
        }
        mesh_.positions[v] = to->point;
        mesh_.labels[v] = to->labels;
    }

    void split(const SurfacePoints& points, std::size_t i) {
        const auto& [v, n] = surface_.polygons()[i];
        const bool first = n == 3 || along_first(points, v, crossings_[i].normal);
        Triangle* out = &mesh_.triangles[first_triangle_[i]];
        out[0] = first ? Triangle{v[0], v[1], v[2]} : Triangle{v[1], v[2], v[3]};
        if (n == 4)
            out[1] = first ? Triangle{v[0], v[2], v[3]} : Triangle{v[1], v[3], v[0]};
    }

    /// Whether to split a quad from its first corner to the third: along a rim, or so that its
    /// triangles face as the surface does; none of them may turn over.
    /// \param normal  of the surface where the quad stands across an edge, or 0.
    bool along_first(const SurfacePoints& points, const std::array<std::uint32_t, 4>& v,
                     const Vec3& normal) const {
        const auto& l = mesh_.labels;
        const Vec3 a = mesh_.positions[v[0]], b = mesh_.positions[v[1]], c = mesh_.positions[v[2]],
                   d = mesh_.positions[v[3]];
        // The smaller cosine to `n` of the triangles pqr and prs.
        const auto least = [](const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s,
                              const Vec3& n) {
            const Vec3 x = cross(q - p, r - p), y = cross(r - p, s - p);
            return std::min(dot(x, n) / std::max(length(x), 1e-300),
                            dot(y, n) / std::max(length(y), 1e-300));
        };
        // Three corners along one rim make no triangle worth the name.
        const auto flatness = [](const Vec3& p, const Vec3& q, const Vec3& r) {
            return length(cross(q - p, r - p)) /
                   std::max({length_squared(q - p), length_squared(r - q), length_squared(p - r),
                             1e-300});
        };
        const double wide = std::min(flatness(a, b, c), flatness(a, c, d)),
                     wide_across = std::min(flatness(b, c, d), flatness(b, d, a));
        constexpr double kWide = 0.05, kUpright = 0.1;
        if (std::min(wide, wide_across) < kWide && wide != wide_across)
            return wide > wide_across;
        const Vec3 whole = normalized(cross(c - a, d - b));
        const double first = least(a, b, c, d, whole), second = least(b, c, d, a, whole);
        if (std::min(first, second) < kUpright && first != second)
            return first > second;
        const bool on_rim = l[v[0]].size() != 1 ||
                            !(l[v[0]] == l[v[1]] && l[v[1]] == l[v[2]] && l[v[2]] == l[v[3]]);
        if (on_rim) {
            const double voxel = points.voxel_m();
            const auto off = [&](const Vec3& p, const Vec3& q, const PrimitiveSet& common) {
                const double favour = common.size() > 1 ? -0.05 : common.empty() ? 10 : 0;
                return std::fabs(points.field().at((p + q) * 0.5).value_m) + 1e-3 * length(p - q) +
                       favour * voxel;
            };
            return off(a, c, l[v[0]].common(l[v[2]])) <= off(b, d, l[v[1]].common(l[v[3]]));
        }
        const double along = least(a, b, c, d, normal), across = least(b, c, d, a, normal);
        constexpr double kAlike = 1e-6; // of cosines
        return std::fabs(along - across) > kAlike ? along > across : length(c - a) <= length(d - b);
    }

    /// The vertices to move of triangles that cross, have no area, or two vertices in one place.
    std::vector<std::uint32_t> in_trouble(const std::vector<std::uint8_t>& picked) const {
        std::vector<std::uint32_t> hit;
        for (std::size_t t = 0; t < picked.size(); ++t)
            if (picked[t] && is_needle(mesh_.triangles[t]))
                add_movable({&mesh_.triangles[t], 1}, hit);
        const std::vector<std::uint32_t> near = near_to(picked);
        std::vector<Triangle> faces;
        std::vector<std::uint8_t> of_picked;
        for (const std::uint32_t t : near) {
            faces.push_back(mesh_.triangles[t]);
            of_picked.push_back(picked[t]);
        }
        for (const auto& pair : crossing_pairs(mesh_.positions, faces, of_picked))
            add_movable(std::array{faces[pair.first], faces[pair.second]}, hit);
        if (hit.empty())
            hit = in_one_place();
        std::sort(hit.begin(), hit.end());
        hit.erase(std::unique(hit.begin(), hit.end()), hit.end());
        return hit;
    }
    /// The triangles that may reach picked ones: they and these are within 6 voxels of their edges.
    std::vector<std::uint32_t> near_to(const std::vector<std::uint8_t>& picked) const {
        const auto coarse = [&](std::size_t polygon) {
            const openvdb::Coord& c = blocks_[surface_.edges()[polygon].block].origin;
            return openvdb::Coord(c.x() >> 4, c.y() >> 4, c.z() >> 4);
        };
        std::unordered_set<openvdb::Coord> close;
        std::uint32_t last = ~0u; // polygons come block by block
        for (std::size_t i = 0; i < crossings_.size(); ++i)
            if (surface_.edges()[i].block != last &&
                std::any_of(picked.begin() + first_triangle_[i],
                            picked.begin() + first_triangle_[i + 1],
                            [](std::uint8_t flag) { return flag != 0; })) {
                last = surface_.edges()[i].block;
                for (int k = 0; k < 27; ++k)
                    close.insert(coarse(i).offsetBy(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1));
            }
        std::vector<std::uint32_t> near;
        last = ~0u;
        bool is_close = false;
        for (std::size_t i = 0; i < crossings_.size(); ++i) {
            if (surface_.edges()[i].block != last) {
                last = surface_.edges()[i].block;
                is_close = close.contains(coarse(i));
            }
            if (is_close)
                for (auto t = first_triangle_[i]; t < first_triangle_[i + 1]; ++t)
                    near.push_back(t);
        }
        return near;
    }
    /// Those outside of their cells, or else all.
    void add_movable(std::span<const Triangle> triangles, std::vector<std::uint32_t>& hit) const {
        const auto add = [&](bool all) {
            const std::size_t before = hit.size();
            for (const Triangle& t : triangles)
                for (const std::uint32_t v : t)
                    if (all || (stage_[v] < kOutside && !cell_box(v).contains(mesh_.positions[v])))
                        hit.push_back(v);
            return hit.size() > before;
        };
        if (!add(false))
            add(true);
    }
    bool is_needle(const Triangle& t) const {
        constexpr double kThin = 1e-5; // height over length
        const Vec3 ab = mesh_.positions[t[1]] - mesh_.positions[t[0]],
                   ac = mesh_.positions[t[2]] - mesh_.positions[t[0]], bc = ac - ab;
        return length(cross(ab, ac)) <=
               kThin * std::max({length_squared(ab), length_squared(ac), length_squared(bc)});
    }
    std::vector<std::uint32_t> in_one_place() const {
        std::vector<std::uint32_t> order(mesh_.positions.size());
        std::iota(order.begin(), order.end(), 0u);
        const auto key = [&](std::uint32_t v) {
            const Vec3& p = mesh_.positions[v];
            return std::tuple(p.x, p.y, p.z, v);
        };
        tbb::parallel_sort(order.begin(), order.end(),
                           [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
        const double least = kLeastApart_vox * points_.voxel_m();
        std::vector<std::uint32_t> hit;
        for (std::size_t i = 0; i < order.size(); ++i) {
            const Vec3& p = mesh_.positions[order[i]];
            for (std::size_t k = i + 1; k < order.size(); ++k) {
                const Vec3& q = mesh_.positions[order[k]];
                if (q.x - p.x > least)
                    break;
                if (p == q ||
                    (length_squared(q - p) < least * least && !share_polygon(order[i], order[k])))
                    hit.insert(hit.end(), {order[i], order[k]});
            }
        }
        return hit;
    }
    bool share_polygon(std::uint32_t v, std::uint32_t w) const {
        const auto begin = around_.begin();
        return std::any_of(begin + first_[v], begin + first_[v + 1], [&](std::uint32_t polygon) {
            return std::find(begin + first_[w], begin + first_[w + 1], polygon) !=
                   begin + first_[w + 1];
        });
    }

    const CellBlocks& blocks_;
    const DualSurface& surface_;
    const SurfacePoints& points_;
    Progress* progress_;
    std::vector<Crossing> crossings_;           ///< one for each polygon
    std::vector<std::uint32_t> first_, around_; ///< polygons of vertex v
    std::vector<std::uint32_t> first_triangle_; ///< of each polygon
    std::vector<std::uint8_t> stage_;           ///< of retreat
    LabelledMesh mesh_;
};

void check_settings(const ExtractSettings& settings) {
    if (!(settings.bound_vox > 0) || !std::isfinite(settings.bound_vox))
        throw Error(Fault::bad_argument, "extract: bound_vox is " + shortest(settings.bound_vox) +
                                             ", must be finite and > 0; 0.1 is usual");
    if (settings.most_spacing != 1 && settings.most_spacing != 2 && settings.most_spacing != 4)
        throw Error(Fault::bad_argument, "extract: most_spacing is " +
                                             std::to_string(settings.most_spacing) +
                                             ", must be 1, 2 or 4; 4 is usual");
}

/// All blocks and what vertices may reach from them.
Box region_of(const CellBlocks& blocks, const Lattice& lattice) {
    Box box;
    for (std::size_t b = 0; b < blocks.size(); ++b)
        for (const int end : {0, 8}) {
            const auto c = blocks[b].origin.offsetBy(end);
            box.include(lattice.origin +
                        Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice.voxel_m);
        }
    return box.dilated(4 * lattice.voxel_m);
}

/// Whether all edges that the surface passes have values at both ends.
bool in_band(const CellBlocks& blocks, const DualSurface& surface,
             const openvdb::FloatGrid& solid) {
    auto accessor = solid.getConstAccessor();
    return std::all_of(surface.edges().begin(), surface.edges().end(), [&](const auto& e) {
        openvdb::Coord c = blocks[e.block].origin + CellBlocks::local(e.key % 512);
        const float one = accessor.getValue(c);
        ++c[e.key / 512];
        const float other = accessor.getValue(c);
        return std::fabs(one) < solid.background() && std::fabs(other) < solid.background();
    });
}

} // namespace

LabelledMesh extract(const openvdb::FloatGrid& solid, const Field* field,
                     const ExtractSettings& settings, Progress* progress) {
    constexpr int kMostAttempts = 4;
    check_settings(settings);
    require_level_set(solid);
    const Lattice lattice = lattice_of(solid);
    CellBlocks blocks(solid, progress);
    if (blocks.size() == 0)
        refuse_empty(solid);
    const auto probe = field
                           ? field->probe(region_of(blocks, lattice), kReach_vox * lattice.voxel_m)
                           : level_set_probe({openvdb::FloatGrid::ConstPtr(), &solid});
    const SurfacePoints points(solid, *probe, lattice);
    SmallCells small;
    for (int attempt = 0;; ++attempt) {
        choose_cell_sizes(blocks, solid, {settings.most_spacing, settings.bound_vox}, small,
                          progress);
        const DualSurface surface(blocks, points);
        if (!in_band(blocks, surface, solid))
            refuse_clipped(solid);
        Mesher mesher(blocks, surface, points, progress);
        mesher.find_crossings();
        mesher.place();
        mesher.split_all();
        const std::vector<std::uint32_t> stuck = mesher.retreat();
        // Some cross to the last in solids that the voxels hardly resolve; the certificate counts.
        if (stuck.empty() || attempt + 1 == kMostAttempts)
            return std::move(mesher.mesh());
        for (const std::uint32_t v : stuck) {
            const CellRef& cell = surface.cell(v);
            const auto c = CellBlocks::local(cell.first);
            for (const int size : {2, 4})
                small.insert((std::uint64_t{cell.block} * 512 +
                              CellBlocks::number({c.x() & -size, c.y() & -size, c.z() & -size})) *
                                 8 +
                             static_cast<unsigned>(size));
        }
    }
}

std::vector<Vec3> surface_normals(const LabelledMesh& mesh, const FieldProbe& field) {
    std::vector<Vec3> normals(mesh.positions.size());
    tbb::parallel_for(std::size_t{0}, normals.size(), [&](std::size_t v) {
        PrimitiveSet labels = mesh.labels[v];
        if (labels.empty())
            labels.add(field.at(mesh.positions[v]).primitive);
        for (const Primitive p : labels.all())
            normals[v] += normalized(field.of(p, mesh.positions[v]).gradient);
        normals[v] = length(normals[v]) > 0 ? normalized(normals[v]) : Vec3{0, 1, 0};
    });
    return normals;
}

} // namespace taihu
