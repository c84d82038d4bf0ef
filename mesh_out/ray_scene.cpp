#include "mesh_out/ray_scene_detail.h"

#include <algorithm>
#include <limits>
#include <string>

#include "stats/core/error.h"

namespace taihu {
namespace {

struct Nearest {
    RTCIntersectContext base{};
    float t = std::numeric_limits<float>::infinity();
    std::uint32_t face = 0;
    double u = 0, v = 0;
};

void keep_nearest(const RTCFilterFunctionNArguments* args) {
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

RTCRay ray(const Vec3& from, const Vec3& to, double reach) {
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

} // namespace

RayScene::RayScene(const TriMesh& mesh, const ScenePlacement& place) : mesh_(mesh), place_(place) {
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
    rtcSetSceneFlags(scene_, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST |
                                                        RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.positions.size()));
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

void RayScene::release() {
    if (scene_)
        rtcReleaseScene(scene_);
    if (device_)
        rtcReleaseDevice(device_);
}

bool RayScene::nearest(const Vec3& from, const Vec3& to, Hit& hit) const {
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

bool RayScene::blocked(const Vec3& from, const Vec3& to, double reach) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay query = ray(from, to, reach);
    rtcOccluded1(scene_, &context, &query);
    return query.tfar < 0;
}

} // namespace taihu
