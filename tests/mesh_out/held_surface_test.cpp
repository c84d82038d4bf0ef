#include "mesh_out/held_surface_detail.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "mesh_out/extract.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

TriMesh surface_of(const Field& field, double bound_vox) {
    const LabelledMesh mesh =
        extract(*rasterize(field, Lattice{1, {}, 3}), &field, {.bound_vox = bound_vox});
    return {mesh.positions, mesh.triangles, {}};
}

/// A ball of radius 20 with a hole of radius 3 bored into its top; the coarse one has none.
struct Bored {
    std::shared_ptr<const Field> ball =
        std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 20}});
    Sphere hole{{0, 19, 0}, 3};
    TriMesh fine = surface_of(
        DifferenceField(ball, std::make_shared<BallsField>(std::vector<Sphere>{hole})), 1);
    TriMesh coarse = surface_of(*ball, 0.5);
    std::unique_ptr<FieldProbe> grown = ball->probe({{-30, -30, -30}, {30, 30, 30}}, 30);
};

TEST(HeldSurface, NamesAllOfAHoleThatWasShut) {
    const Bored rock;
    const HeldSurface held = held_surface(rock.fine, rock.coarse, *rock.grown, {}, 1, 1);
    for (const Vec3& p : held.mesh.positions)
        EXPECT_LT(20 - length(p), 1.5); // deeper than 1, by what the coarse faces are off
    std::vector<bool> is_corner(held.mesh.positions.size());
    for (const Triangle& t : held.mesh.triangles)
        for (const std::uint32_t v : t)
            is_corner[v] = true;
    // Faces that reach into the hole are held to where they are outside.
    EXPECT_GT(std::count(is_corner.begin(), is_corner.end(), false), 0);
    for (const Vec3& p : held.shut)
        EXPECT_NEAR(length(p - rock.hole.center), 3, 0.5); // within half a bound of its wall
    // Whatever lies between the corners of large faces is named, too: every point of the deep wall
    // has a named one within a bound.
    for (int i = 0; i < 24; ++i)
        for (int j = 1; j < 12; ++j) {
            const double u = 0.2618 * i, v = 0.2618 * j; // parts of a circle, of a half one
            const Vec3 wall =
                rock.hole.center +
                Vec3{std::sin(v) * std::cos(u), -std::cos(v), std::sin(v) * std::sin(u)} * 3.0;
            if (20 - length(wall) < 1.3)
                continue;
            double least = 1e9;
            for (const Vec3& p : held.shut)
                least = std::min(least, length(p - wall));
            EXPECT_LT(least, 1);
        }
}

TEST(HeldSurface, SaysNothingMoreOfHolesThatWereFilled) {
    const Bored rock;
    const HeldSurface held =
        held_surface(rock.fine, rock.coarse, *rock.grown, {&rock.hole, 1}, 1, 1);
    EXPECT_TRUE(held.shut.empty());
    EXPECT_LT(held.mesh.triangles.size(), rock.fine.triangles.size());
}

TEST(HeldSurface, KeepsAllOfASurfaceThatWasNotShut) {
    const Bored rock;
    const HeldSurface held = held_surface(rock.coarse, rock.coarse, *rock.grown, {}, 1, 1);
    EXPECT_EQ(held.mesh.triangles, rock.coarse.triangles);
    EXPECT_TRUE(held.shut.empty());
}

} // namespace
} // namespace taihu
