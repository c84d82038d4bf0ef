// The peers are compiled here, with the flags of this project: what the library's package holds was
// built with others.
#include <openvdb/version.h>
#undef OPENVDB_USE_EXPLICIT_INSTANTIATION

#include "tests/bench/peers.h"

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/ParticlesToLevelSet.h>

namespace taihu {
namespace {

/// What ParticlesToLevelSet wants to see of a list of balls.
struct ParticleList {
    using PosType = openvdb::Vec3R;
    std::span<const Sphere> balls;

    std::size_t size() const { return balls.size(); }
    void getPos(std::size_t n, PosType& at) const {
        at = {balls[n].center.x, balls[n].center.y, balls[n].center.z};
    }
    void getPosRad(std::size_t n, PosType& at, openvdb::Real& radius) const {
        getPos(n, at);
        radius = balls[n].radius_m;
    }
};

} // namespace

openvdb::FloatGrid::Ptr peer_voxelize(const TriMesh& mesh, double voxel_m) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    for (const Vec3& p : mesh.positions)
        points.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y),
                            static_cast<float>(p.z));
    for (const Triangle& t : mesh.triangles)
        triangles.emplace_back(t[0], t[1], t[2]);
    return openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(
        *openvdb::math::Transform::createLinearTransform(voxel_m), points, triangles, 3.f);
}

openvdb::FloatGrid::Ptr peer_carve(const openvdb::FloatGrid& base, std::span<const Sphere> holes) {
    auto all = openvdb::createLevelSet<openvdb::FloatGrid>(base.voxelSize().x(), 3);
    openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid> raster(*all);
    raster.setRmin(0); // it leaves out radii below 1.5 and above 100 voxels otherwise
    raster.setRmax(1e9);
    raster.rasterizeSpheres(ParticleList{holes});
    raster.finalize(true);
    auto result = base.deepCopy();
    openvdb::tools::csgDifference(*result, *all);
    return result;
}

} // namespace taihu
