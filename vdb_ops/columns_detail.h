#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include <openvdb/openvdb.h>

#include "vdb_ops/closed_mesh.h"

namespace taihu {

/// Where the grid columns along z pass through the faces of a closed mesh, in voxel coordinates.
/// A column's 2D test looks at edges alone (exact comparisons in y, one rounding in x that both
/// faces of an edge share), so over balanced faces the signed count is exactly 0 above and below,
/// whatever the geometry; rounding can only shift a crossing along z, onto the same face.
class Columns {
public:
    struct Hit {
        std::int32_t z; ///< first voxel above the crossing
        std::int32_t sign;
        std::uint32_t shell;
    };

    /// \param points  voxel coordinates of mesh.positions; \param box  columns outside it are
    /// empty.
    Columns(const ClosedMesh& mesh, const std::vector<Vec3>& points, const openvdb::CoordBBox& box);

    /// The hits of column (x, y), sorted by shell, then z.
    const Hit* begin(int x, int y) const { return hits_.data() + first_[column(x, y)]; }
    const Hit* end(int x, int y) const { return hits_.data() + first_[column(x, y) + 1]; }
    bool contains(int x, int y) const {
        return x >= x0_ && y >= y0_ && x < x0_ + nx_ && y < y0_ + ny_;
    }
    /// Winding number of `shell` at a voxel.
    int winding(const openvdb::Coord& voxel, std::uint32_t shell) const;
    /// The same for the 8 voxels from `voxel` up along z, held to +-100.
    void winding_row(const openvdb::Coord& voxel, std::uint32_t shell, std::int8_t* out) const;
    /// The shell is passed through twice in the same direction somewhere: it crosses itself.
    bool overlaps_itself(std::uint32_t shell) const { return overlaps_[shell] != 0; }

private:
    std::size_t column(int x, int y) const {
        return static_cast<std::size_t>(x - x0_) * static_cast<std::size_t>(ny_) +
               static_cast<std::size_t>(y - y0_);
    }
    void find_overlaps(const ClosedMesh& mesh);

    int x0_, y0_, nx_, ny_;
    std::vector<std::size_t> first_;
    std::vector<Hit> hits_;
    std::vector<char> overlaps_;
};

} // namespace taihu
