#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include <embree3/rtcore.h>

#include "stats/core/error.h"
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
    RayScene(const TriMesh& mesh, const ScenePlacement& place) : mesh_(mesh), place_(place) {
        device_ = rtcNewDevice("verbose=0");
        scene_ = device_ ? rtcNewScene(device_) : nullptr;
        if (!scene_) {
            const RTCError why = rtcGetDeviceError(device_);
            release();
            throw Error(Fault::unsupported,
                        why == RTC_ERROR_UNSUPPORTED_CPU
                            ? "render: embree does not start on this machine; it needs SSE2 or "
                              "better"
                            : "render: embree does not start; free memory or use fewer threads");
        }
        rtcSetSceneFlags(scene_,
                         static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST |
                                                    RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* points = static_cast<float*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                    3 * sizeof(float), mesh.positions.size()));
        auto* faces = static_cast<std::uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                    sizeof(Triangle), mesh.triangles.size()));
        if (points && faces) {
            for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
                const Vec3 p = place(mesh.positions[i]);
                for (int k = 0; k < 3; ++k)
                    points[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(p[k]);
            }
            for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
                std::copy(mesh.triangles[i].begin(), mesh.triangles[i].end(), faces + 3 * i);
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(scene_, geometry);
        }
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
        if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) {
            release();
            throw Error(Fault::numeric, "render: embree cannot take a mesh of " +
                                            std::to_string(mesh.triangles.size()) +
                                            " triangles; simplify it or free memory");
        }
    }
    RayScene(const RayScene&) = delete;
    RayScene& operator=(const RayScene&) = delete;
    ~RayScene() { release(); }

    bool nearest(const Vec3& from, const Vec3& to, Hit& hit) const {
        Nearest context;
        rtcInitIntersectContext(&context.base);
        context.base.filter = keep_nearest;
        RTCRayHit query{};
        query.ray = ray(from, to, std::numeric_limits<double>::infinity());
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene_, &context.base, &query);
        if (!(context.t < std::numeric_limits<float>::infinity()))
            return false;
        hit = {context.face, context.u, context.v};
        return true;
    }

    bool blocked(const Vec3& from, const Vec3& to, double reach) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRay query = ray(from, to, reach);
        rtcOccluded1(scene_, &context, &query);
        return query.tfar < 0;
    }

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
    struct Nearest {
        RTCIntersectContext base{};
        float t = std::numeric_limits<float>::infinity();
        std::uint32_t face = 0;
        double u = 0, v = 0;
    };

    static void keep_nearest(const RTCFilterFunctionNArguments* args) {
        auto* best = reinterpret_cast<Nearest*>(args->context);
        const auto* found = reinterpret_cast<const RTCRay*>(args->ray);
        const auto* hit = reinterpret_cast<const RTCHit*>(args->hit);
        if (found->tfar < best->t || (found->tfar == best->t && hit->primID < best->face)) {
            best->t = found->tfar;
            best->face = hit->primID;
            best->u = hit->u;
            best->v = hit->v;
        }
        args->valid[0] = 0; // or Embree would stop looking at what is nearly as near
    }

    static RTCRay ray(const Vec3& from, const Vec3& to, double reach) {
        RTCRay r{};
        r.org_x = static_cast<float>(from.x);
        r.org_y = static_cast<float>(from.y);
        r.org_z = static_cast<float>(from.z);
        r.dir_x = static_cast<float>(to.x);
        r.dir_y = static_cast<float>(to.y);
        r.dir_z = static_cast<float>(to.z);
        r.tfar = static_cast<float>(reach);
        r.mask = ~0u;
        return r;
    }

    void release() {
        if (scene_)
            rtcReleaseScene(scene_);
        if (device_)
            rtcReleaseDevice(device_);
    }

    const TriMesh& mesh_;
    ScenePlacement place_;
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
};

} // namespace taihu
