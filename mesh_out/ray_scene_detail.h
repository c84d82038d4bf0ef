#pragma once
#include <array>
#include <cstdint>

#include <embree3/rtcore.h>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// Where the meshes are, and how large: shared by all levels of a sheet.
struct ScenePlacement {
    Vec3 center;
    double scale = 1; ///< 1 / largest extent
    double cos_turn = 1, sin_turn = 0;
    double ground = 0; ///< height of the lowest point, after scaling

    Vec3 turned(const Vec3& v) const {
        return {v.x * cos_turn + v.z * sin_turn, v.y, v.z * cos_turn - v.x * sin_turn};
    }
    Vec3 operator()(const Vec3& p) const { return turned((p - center) * scale); }
    // The other way.
    Vec3 turned_back(const Vec3& v) const {
        return {v.x * cos_turn - v.z * sin_turn, v.y, v.z * cos_turn + v.x * sin_turn};
    }
    Vec3 mesh_point(const Vec3& p) const { return turned_back(p) / scale + center; }
};

/// What a ray meets first.
struct Hit {
    std::uint32_t face = 0;
    double u = 0, v = 0; ///< barycentric weights of the second and the third vertex
};

/// The mesh as Embree sees it. The answers do not depend on how Embree built its tree, which may
/// change with the number of threads: robust traversal, and among all hits of a ray the nearest
/// one, of the smallest face where several are equally near.
class RayScene {
public:
    /// \throws Error unsupported: Embree does not start; numeric: it cannot take the mesh.
    RayScene(const TriMesh& mesh, const ScenePlacement& place);
    RayScene(const RayScene&) = delete;
    RayScene& operator=(const RayScene&) = delete;
    ~RayScene() { release(); }

    /// \param to  the direction; hits are in front of `from`.
    bool nearest(const Vec3& from, const Vec3& to, Hit& hit) const;
    /// \param reach  of the ray, in lengths of `to`.
    bool blocked(const Vec3& from, const Vec3& to, double reach) const;

    std::array<Vec3, 3> corners(std::uint32_t face) const {
        const auto& [a, b, c] = mesh_.triangles[face];
        return {place_(mesh_.positions[a]), place_(mesh_.positions[b]), place_(mesh_.positions[c])};
    }
    /// The mesh's own normal there; zero where it has none.
    Vec3 smooth_normal(const Hit& hit) const {
        if (mesh_.normals.size() != mesh_.positions.size())
            return {};
        const auto& [a, b, c] = mesh_.triangles[hit.face];
        const Vec3 n = place_.turned(mesh_.normals[a] * (1 - hit.u - hit.v) +
                                     mesh_.normals[b] * hit.u + mesh_.normals[c] * hit.v);
        return is_finite(n) ? normalized(n) : Vec3{};
    }

private:
    void release();

    const TriMesh& mesh_;
    ScenePlacement place_;
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
};

} // namespace taihu
