#pragma once
#include <functional>
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// The powers cos^e and sin^e of n + 1 angles from 0 to 90 degrees, exact at both ends.
struct Quarter {
    std::vector<double> cos, sin;
    Quarter(int n, double exponent);
};

/// A closed, outward mesh of eight octants of n x n cells, from a point for each sign pattern
/// (+-1 each), latitude and longitude (0..n each, in quarters). Octants whose edges do not meet are
/// joined by flat faces; equal points are welded, and triangles without area by that left out.
TriMesh octant_mesh(int n, const std::function<Vec3(const Vec3& sign, int lat, int lon)>& point);

} // namespace taihu
