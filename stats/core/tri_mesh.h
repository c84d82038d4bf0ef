#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/vec3.h"

namespace taihu {

/// Three indices into TriMesh::positions, counter-clockwise seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// An indexed triangle mesh. Nothing is promised of it until somebody checked it.
struct TriMesh {
    std::vector<Vec3> positions; ///< [m]
    std::vector<Triangle> triangles;
    std::vector<Vec3> normals; ///< unit, one per position, or empty
    /// How much of the sky each position sees, 0..1 (ambient occlusion), or empty.
    std::vector<float> openness = {};
};

/// The box of the positions that triangles use; empty for a mesh without triangles.
Box bounds(const TriMesh& mesh);

/// Volume enclosed by the mesh [m^3], positive when faces point outwards; meaningful for a closed
/// mesh only. Summed in a fixed order, about the first vertex.
double signed_volume_m3(const TriMesh& mesh);

/// Sum of the areas of the triangles [m^2].
double area_m2(const TriMesh& mesh);

} // namespace taihu
