#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/tri_mesh.h"
#include "vdb_ops/kernels_detail.h"
#include "vdb_ops/rounding_detail.h"

namespace taihu {

/// Face `face` of a closed mesh. Each edge is passed as often from its lower vertex to its higher
/// one as back, so one direction is enough to measure the distance to it; with the lowest vertex
/// first these are the first edge, and the second one or not.
LeafTriangle leaf_triangle(Triangle face, const std::vector<Vec3>& points, std::uint32_t shell,
                           float half_width);

/// Calls fn(i, j, k) for the cells of `size` voxels, numbered from `first` over n cells each way,
/// that may hold a voxel within the half width of the face: its box, and the slab round its plane.
template <class Fn>
void each_cell(const LeafTriangle& t, int size, const openvdb::Coord& first,
               const openvdb::Coord& n, float half_width, Fn&& fn) {
    int lo[3], hi[3];
    for (int c = 0; c < 3; ++c) {
        lo[c] = std::max(0, floor_int(ceil_int(t.lo[c]) / double(size)) - first[c]);
        hi[c] = std::min(n[c] - 1, floor_int(floor_int(t.hi[c]) / double(size)) - first[c]);
    }
    // Linear in the middle of a cell, and small enough where the cell may come near the face: the
    // distance to its plane, both ways, and that beyond each edge in the plane (long thin faces
    // would fill their box otherwise).
    const double half = 0.5 * (size - 1);
    const double reach =
        half * (std::fabs(t.n[0]) + std::fabs(t.n[1]) + std::fabs(t.n[2])) + half_width + 1e-3;
    // Normals of edges are floats: off by 1e-7 of the face's extent.
    const double extent = std::max({t.hi[0] - t.lo[0], t.hi[1] - t.lo[1], t.hi[2] - t.lo[2]});
    const double edge_reach = std::sqrt(3.0) * half + half_width + 0.01 + 1e-6 * extent;
    double edge_limit[3], from[3][3]; // corners from the middle of the first cell
    for (std::size_t e = 0; e < 3; ++e) {
        edge_limit[e] = -edge_reach / std::sqrt(static_cast<double>(t.inverse_e2[e]));
        for (int c = 0; c < 3; ++c)
            from[e][c] = first[c] * static_cast<double>(size) + half - t.corner[e][c];
    }
    const auto near = [&](double x, double y, double z) {
        if (std::fabs(t.n[0] * (x + from[0][0]) + t.n[1] * (y + from[0][1]) +
                      t.n[2] * (z + from[0][2])) > reach)
            return false;
        for (std::size_t e = 0; e < 3; ++e)
            if (t.en[e][0] * (x + from[e][0]) + t.en[e][1] * (y + from[e][1]) +
                    t.en[e][2] * (z + from[e][2]) <
                edge_limit[e])
                return false;
        return true;
    };
    for (int i = lo[0]; i <= hi[0]; ++i)
        for (int j = lo[1]; j <= hi[1]; ++j)
            for (int k = lo[2]; k <= hi[2]; ++k)
                if (near(i * size, j * size, k * size))
                    fn(i, j, k);
}

} // namespace taihu
