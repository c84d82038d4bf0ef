#include "mesh_out/texture_coordinates.h"

#include <cmath>
#include <map>
#include <numbers>

#include "tests/support/errors.h"
#include "vdb_ops/fractal_rock.h"
#include "vdb_ops/icosphere.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

/// By edge and by the face that it is seen from: texture places of its two ends.
using Seen = std::map<std::pair<std::uint32_t, std::uint32_t>, std::array<TexturePoint, 2>>;

Seen edges_of(const TriMesh& mesh, const TextureCoordinates& at) {
    Seen seen;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t next = (k + 1) % 3;
            seen[{mesh.triangles[i][k], mesh.triangles[i][next]}] = {at.corners[i][k],
                                                                     at.corners[i][next]};
        }
    return seen;
}

bool on_axis(const Vec3& p) {
    return std::hypot(p.x, p.z) < 1e-9;
}

TEST(SeedRow, D13PlanarHasNoSeam) {
    const TriMesh mesh = fractal_rock({.iterations = 1}, 2);
    const Box frame = bounds(mesh);
    const auto at = texture_coordinates(mesh, TextureMap::planar, frame);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3& p = mesh.positions[mesh.triangles[i][k]];
            EXPECT_EQ(at.corners[i][k].u, (p.x - frame.lo.x) / frame.size().x);
            EXPECT_EQ(at.corners[i][k].v, (p.y - frame.lo.y) / frame.size().y);
            EXPECT_GE(at.corners[i][k].u, 0);
            EXPECT_LE(at.corners[i][k].v, 1);
        }
}

/// Around the axis both sides of an edge see the same texture, whole turns apart where the seam is.
void expect_one_seam(TextureMap map) {
    const TriMesh mesh = icosphere(4); // with a position at each pole
    const auto at = texture_coordinates(mesh, map, bounds(mesh));
    int n_seam = 0;
    const Seen seen = edges_of(mesh, at);
    for (const auto& [edge, ends] : seen) {
        const auto other = seen.at({edge.second, edge.first});
        for (std::size_t k = 0; k < 2; ++k) {
            const Vec3& end = mesh.positions[k == 0 ? edge.first : edge.second];
            EXPECT_NEAR(ends[k].v, other[1 - k].v, 1e-15);
            if (on_axis(end))
                continue; // a pole takes the longitude of its triangle
            const double turns = ends[k].u - other[1 - k].u;
            EXPECT_NEAR(turns, std::round(turns), 1e-15);
            if (std::round(turns) == 0)
                continue;
            ++n_seam; // at -Z, within an edge of it, and nowhere else
            EXPECT_LT(end.z, 0);
            EXPECT_LT(std::fabs(end.x), 0.1);
        }
    }
    EXPECT_GT(n_seam, 0);
    for (const auto& corners : at.corners) {
        const auto [least, most] = std::minmax({corners[0].u, corners[1].u, corners[2].u});
        // Nothing is smeared: an edge of 4.5 degrees spans this much a ring from the pole.
        EXPECT_LT(most - least, 0.26);
    }
}

TEST(SeedRow, D13SphericalHasOneSeam) {
    expect_one_seam(TextureMap::spherical);
}

TEST(SeedRow, D13CylindricalHasOneSeam) {
    expect_one_seam(TextureMap::cylindrical);
}

TEST(SeedRow, D13SphericalAndCylindricalAreLongitudeAndHeight) {
    const TriMesh mesh = icosphere(3);
    const Box frame = bounds(mesh);
    const auto sphere = texture_coordinates(mesh, TextureMap::spherical, frame),
               cylinder = texture_coordinates(mesh, TextureMap::cylindrical, frame);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3& p = mesh.positions[mesh.triangles[i][k]];
            EXPECT_NEAR(std::sin(kPi * (sphere.corners[i][k].v - 0.5)), p.y, 1e-12);
            EXPECT_NEAR(cylinder.corners[i][k].v, 0.5 + 0.5 * p.y, 1e-12);
            if (on_axis(p))
                continue;
            const double turn = 2 * kPi * (sphere.corners[i][k].u - 0.5), r = std::hypot(p.x, p.z);
            EXPECT_NEAR(r * std::sin(turn), p.x, 1e-12);
            EXPECT_NEAR(r * std::cos(turn), p.z, 1e-12);
            EXPECT_EQ(sphere.corners[i][k].u, cylinder.corners[i][k].u);
        }
}

TEST(SeedRow, D13CubicHasSeamsOnlyBetweenSides) {
    const TriMesh mesh = fractal_rock({.iterations = 1}, 5);
    const Box frame = bounds(mesh);
    const auto at = texture_coordinates(mesh, TextureMap::cubic, frame);
    ASSERT_EQ(at.sides.size(), mesh.triangles.size());
    std::map<std::pair<std::uint8_t, std::uint32_t>, TexturePoint> places;
    std::array<int, 6> n{};
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        ++n[at.sides[i]];
        const auto& [a, b, c] = mesh.triangles[i];
        const Vec3 normal =
            cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
        const int axis = at.sides[i] / 2;
        const double toward = at.sides[i] % 2 ? -normal[axis] : normal[axis];
        for (int other = 0; other < 3; ++other)
            EXPECT_GE(toward, std::fabs(normal[other]));
        const auto& t = at.corners[i];
        // Not mirrored: counter-clockwise outside is counter-clockwise in the texture.
        EXPECT_GT((t[1].u - t[0].u) * (t[2].v - t[0].v) - (t[2].u - t[0].u) * (t[1].v - t[0].v), 0);
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_GE(std::min(t[k].u, t[k].v), 0);
            EXPECT_LE(std::max(t[k].u, t[k].v), 1);
            // One place for a position on a side, whichever face asks.
            const auto [it, added] = places.try_emplace({at.sides[i], mesh.triangles[i][k]}, t[k]);
            EXPECT_EQ(it->second.u, t[k].u);
            EXPECT_EQ(it->second.v, t[k].v);
        }
    }
    for (const int count : n)
        EXPECT_GT(count, 0);
}

TEST(TextureCoordinates, RefuseFramesAndMeshesThatAreNone) {
    const TriMesh mesh = icosphere(0);
    expect_error(Fault::bad_argument, "the frame has no finite volume", [&] {
        texture_coordinates(mesh, TextureMap::planar, {{0, 0, 0}, {1, 0, 1}});
    });
    TriMesh bad = mesh;
    bad.triangles[3][1] = 40;
    expect_error(Fault::bad_argument, "triangles[3] has no finite position 40",
                 [&] { texture_coordinates(bad, TextureMap::cubic, bounds(mesh)); });
}

} // namespace
} // namespace taihu
