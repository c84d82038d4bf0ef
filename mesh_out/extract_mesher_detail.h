#pragma once
#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/cell_sizes_detail.h"
#include "mesh_out/dual_surface_detail.h"
#include "mesh_out/extract_certainty_detail.h"
#include "mesh_out/labelled_mesh.h"
#include "mesh_out/surface_points_detail.h"
#include "stats/core/progress.h"

namespace taihu {

/// Places the vertices of a dual surface, joins those that took one place, splits its polygons, and
/// moves vertices until no triangles cross. What becomes of a place depends on what is around it
/// and on nothing else: where vertices are troubled, they and those around may move, and no others
/// do; rounds that find nothing to do there change nothing; ties are broken by the order of
/// vertices, which is that of their cells in space.
class Mesher {
public:
    /// \param apart  cells whose vertices are joined to no others.
    Mesher(const CellBlocks& blocks, const DualSurface& surface, const SurfacePoints& points,
           const SmallCells& apart, Certainty& certainty, Progress* progress)
        : blocks_(blocks), surface_(surface), points_(points), apart_(apart), certainty_(certainty),
          progress_(progress), polygons_(surface.polygons()) {}

    /// \return the vertices of what crosses to the last.
    std::vector<std::uint32_t> run();
    /// The mesh, without vertices that became others.
    LabelledMesh take();
    /// Which of its triangles stand across edges that begin in a box.
    std::vector<std::uint8_t> owned_by(const openvdb::CoordBBox& box) const;

private:
    static constexpr double kSlack_vox = 2;    ///< so far from their cells the edges of fins may be
    static constexpr double kFarthest_vox = 3; ///< so far from their cells vertices may move
    static constexpr double kTwins_vox = 0.35; ///< rim vertices so near each other are one
    static constexpr std::uint32_t kNone = 0xffffffff;
    static constexpr std::uint8_t kOutside = 7, kLastStage = 9;
    using Vertices = std::vector<std::uint32_t>;

    template <class Fn>
    void each(std::size_t n, const Fn& fn) const;

    // extract_mesher.cpp
    void find_crossings();
    void list_polygons();
    void place();
    void split_all();
    void split(const SurfacePoints& points, std::size_t i);
    bool along_first(const SurfacePoints& points, const std::array<std::uint32_t, 4>& v,
                     const Vec3& normal) const;
    std::span<const Crossing> crossings_of(std::size_t v) const;
    std::span<const std::uint32_t> around(std::size_t v) const {
        return {around_.data() + first_[v], around_.data() + first_[v + 1]};
    }
    Box cell_box(std::size_t v) const;
    bool in_cell(std::size_t v) const { return cell_box(v).contains(mesh_.positions[v]); }

    // extract_joins.cpp
    struct Near {
        std::uint64_t order;
        std::uint32_t v, w;
        friend auto operator<=>(const Near&, const Near&) = default;
    };
    bool join_near(std::span<const std::uint32_t> polygons, double near_m,
                   std::size_t least_labels);
    std::vector<Near> near_pairs(std::span<const std::uint32_t> polygons, double near_m,
                                 std::size_t least_labels) const;
    std::uint64_t cell_key(std::uint32_t v) const;
    std::uint32_t now(std::uint32_t v) const;
    Vertices around_both(std::uint32_t v, std::uint32_t w) const;
    bool join(std::uint32_t v, std::uint32_t w, const Vertices& all);
    bool are_near(std::uint32_t& v, std::uint32_t& w, double near_m,
                  std::size_t least_labels) const;

    // extract_retreat.cpp
    Vertices retreat();
    void hold_others(std::span<const std::uint32_t> hit);
    Vertices relax(Vertices hit);
    bool may_move(std::uint32_t v) const { return movable_.empty() || movable_[v] != 0; }
    bool is_tame(std::size_t polygon) const;
    std::vector<std::uint8_t> untamed() const;
    Vertices polygons_around(std::span<const std::uint32_t> vertices) const;
    Vertices vertices_of(std::span<const std::uint32_t> polygons) const;
    Box reach(std::span<const std::uint32_t> vertices) const;
    std::vector<std::uint8_t> flags_of(std::span<const std::uint32_t> polygons) const;
    std::vector<std::uint8_t> split_around(std::span<const std::uint32_t> vertices);
    Vec3 relaxed(const SurfacePoints& points, std::uint32_t v) const;
    void step_back(const SurfacePoints& points, std::uint32_t v);
    Vertices in_trouble(const std::vector<std::uint8_t>& picked, bool all) const;
    Vertices near_to(const std::vector<std::uint8_t>& picked) const;
    void add_movable(std::span<const Triangle> triangles, bool all, Vertices& hit) const;
    bool is_needle(const Triangle& t) const;
    bool has_own_cell(std::uint32_t v) const;
    bool is_alone(std::uint32_t v) const;
    Vertices all_not_alone() const;
    void add_in_one_place(Vertices among, Vertices& hit) const;
    bool share_polygon(std::uint32_t v, std::uint32_t w) const;

    const CellBlocks& blocks_;
    const DualSurface& surface_;
    const SurfacePoints& points_;
    const SmallCells& apart_;
    Certainty& certainty_;
    Progress* progress_;
    std::vector<DualPolygon> polygons_; ///< those of less than 3 vertices are no more
    std::vector<Crossing> crossings_;   ///< one for each polygon
    Vertices first_, around_;           ///< polygons of vertex v
    Vertices first_triangle_;           ///< of each polygon
    Vertices next_;                     ///< of the vertices that became one, from that one on
    std::unordered_map<std::uint32_t, std::uint32_t> became_;
    std::vector<std::uint8_t> stage_;   ///< of retreat
    std::vector<std::uint8_t> movable_; ///< once it is known what is troubled
    Vertices crowded_;                  ///< around those, what may come to one place
    LabelledMesh mesh_;
};

/// Calls fn(points, i) for i below n, in parallel, with points for one thread.
template <class Fn>
void Mesher::each(std::size_t n, const Fn& fn) const {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 1024), [&](const auto& range) {
        check_cancelled(progress_);
        const SurfacePoints own = points_;
        for (std::size_t i = range.begin(); i < range.end(); ++i)
            fn(own, i);
    });
}

} // namespace taihu
