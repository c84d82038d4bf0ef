#pragma once
#include <cstddef>
#include <memory>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// What CGAL says of a mesh with exact predicates, after welding equal positions.
struct CgalVerdict {
    bool manifold =
        false; ///< edges of two faces that run through it both ways, vertices of one fan
    bool closed = false;
    bool bounds_volume = false; ///< outwards, cavities inwards; asked where nothing crosses
    std::size_t n_degenerate = 0, n_self_intersections = 0;
};
CgalVerdict cgal_verdict(const TriMesh& mesh);

/// Distances to a mesh by CGAL's tree of boxes, in double. Thread-safe to ask.
class CgalDistance {
public:
    explicit CgalDistance(const TriMesh& mesh);
    CgalDistance(CgalDistance&&) noexcept;
    ~CgalDistance();

    double operator()(const Vec3& point) const;

private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

} // namespace taihu
