#include "stats/core/tri_mesh.h"

#include <gtest/gtest.h>

namespace taihu {
namespace {

TriMesh corner_tetrahedron(const Vec3& at) {
    return {{at, at + Vec3{1, 0, 0}, at + Vec3{0, 1, 0}, at + Vec3{0, 0, 1}},
            {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
            {}};
}

TEST(TriMesh, TetrahedronHasItsAnalyticVolumeAndArea) {
    const TriMesh mesh = corner_tetrahedron({5, -3, 2});
    EXPECT_NEAR(signed_volume_m3(mesh), 1.0 / 6, 1e-14);
    EXPECT_NEAR(area_m2(mesh), 1.5 + std::sqrt(3.0) / 2, 1e-14);
}

TEST(TriMesh, FlippedFacesChangeTheSignOfTheVolume) {
    TriMesh mesh = corner_tetrahedron({});
    for (Triangle& t : mesh.triangles)
        std::swap(t[0], t[1]);
    EXPECT_NEAR(signed_volume_m3(mesh), -1.0 / 6, 1e-14);
}

TEST(TriMesh, BoundsIgnorePositionsThatNoTriangleUses) {
    TriMesh mesh = corner_tetrahedron({});
    mesh.positions.push_back({100, 100, 100});
    EXPECT_EQ(bounds(mesh), (Box{{0, 0, 0}, {1, 1, 1}}));
    EXPECT_TRUE(bounds(TriMesh{}).empty());
}

} // namespace
} // namespace taihu
