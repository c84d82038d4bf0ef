#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/cell_sizes_detail.h"
#include "mesh_out/dual_surface_detail.h"
#include "mesh_out/labelled_mesh.h"
#include "mesh_out/surface_points_detail.h"
#include "stats/core/progress.h"

namespace taihu {

/// Places the vertices of a dual surface, joins those that took one place, splits its polygons, and
/// moves vertices until no triangles cross.
class Mesher {
public:
    /// \param apart  cells whose vertices are joined to no others.
    Mesher(const CellBlocks& blocks, const DualSurface& surface, const SurfacePoints& points,
           const SmallCells& apart, Progress* progress)
        : blocks_(blocks), surface_(surface), points_(points), apart_(apart), progress_(progress),
          polygons_(surface.polygons()) {}

    /// \return the vertices of what crosses to the last.
    std::vector<std::uint32_t> run();
    /// The mesh, without vertices that became others.
    LabelledMesh take();

private:
    static constexpr double kSlack_vox = 2; ///< so far from their cells the edges of fins may be
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
    bool join_near(std::span<const std::uint32_t> polygons, double near_m,
                   std::size_t least_labels);
    bool join(std::uint32_t v, std::uint32_t w);

    // extract_retreat.cpp
    Vertices retreat();
    bool relax(std::vector<std::uint8_t>& picked);
    bool is_tame(std::size_t polygon) const;
    std::vector<std::uint8_t> untamed() const;
    Vertices polygons_around(std::span<const std::uint32_t> vertices) const;
    std::vector<std::uint8_t> split_around(std::span<const std::uint32_t> vertices);
    Vec3 relaxed(const SurfacePoints& points, std::uint32_t v) const;
    void step_back(const SurfacePoints& points, std::uint32_t v);
    Vertices in_trouble(const std::vector<std::uint8_t>& picked, bool all) const;
    Vertices near_to(const std::vector<std::uint8_t>& picked) const;
    void add_movable(std::span<const Triangle> triangles, bool all, Vertices& hit) const;
    bool is_needle(const Triangle& t) const;
    Vertices in_one_place() const;
    bool share_polygon(std::uint32_t v, std::uint32_t w) const;

    const CellBlocks& blocks_;
    const DualSurface& surface_;
    const SurfacePoints& points_;
    const SmallCells& apart_;
    Progress* progress_;
    std::vector<DualPolygon> polygons_; ///< those of less than 3 vertices are no more
    std::vector<Crossing> crossings_;   ///< one for each polygon
    Vertices first_, around_;           ///< polygons of vertex v
    Vertices first_triangle_;           ///< of each polygon
    Vertices next_;                     ///< of the vertices that became one, from that one on
    std::vector<std::uint8_t> stage_;   ///< of retreat
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
