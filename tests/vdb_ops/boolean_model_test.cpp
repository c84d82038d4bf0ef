// What stats predicts of overlapping holes, against rocks that are made of them.
#include "stats/boolean_model.h"

#include <cmath>

#include <gtest/gtest.h>

#include "vdb_ops/analytic_field.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/place.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr double kVoxel = 1.0 / 48;

openvdb::FloatGrid::Ptr box_rock() {
    const AnalyticField field({{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}}, [](const Vec3& p) {
        return box_distance(p, {0.5, 0.5, 0.5});
    });
    return rasterize(field, {kVoxel, {}, 3});
}

/// Surface per volume in the middle of the box, twice the crossings per length of lines along the
/// axes: what isotropic surfaces have.
double surface_per_volume(const openvdb::FloatGrid& rock) {
    const auto solid = rock.getConstAccessor();
    constexpr int kHalf = 22; // voxels; two from the faces
    double n_crossings = 0, n_steps = 0;
    for (int x = -kHalf; x < kHalf; ++x)
        for (int y = -kHalf; y < kHalf; ++y)
            for (int z = -kHalf; z < kHalf; ++z) {
                const bool here = solid.getValue({x, y, z}) < 0;
                for (const openvdb::Coord& next :
                     {openvdb::Coord(x + 1, y, z), openvdb::Coord(x, y + 1, z),
                      openvdb::Coord(x, y, z + 1)}) {
                    n_crossings += here != (solid.getValue(next) < 0);
                    n_steps += 1;
                }
            }
    return 2 * n_crossings / (n_steps * kVoxel);
}

void expect_predicted(const Law& law, double n_v) {
    const auto base = box_rock();
    const BooleanModel model = boolean_model(law, n_v);
    constexpr int kSeeds = 24;
    double porosity = 0, porosity2 = 0, s_v = 0, s_v2 = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
        Placement placement;
        placement.density_m3 = n_v;
        placement.seed = seed;
        const auto rock = carve(*base, place_holes(law, placement, *base).holes).rock;
        const double p = carved_volume(*base, *rock).porosity(), s = surface_per_volume(*rock);
        porosity += p / kSeeds, porosity2 += p * p / kSeeds;
        s_v += s / kSeeds, s_v2 += s * s / kSeeds;
    }
    // Four standard errors, from the runs themselves.
    const double noise = 4 * std::sqrt((porosity2 - porosity * porosity) / (kSeeds - 1));
    EXPECT_NEAR(porosity, model.porosity, noise);
    EXPECT_LT(noise, 0.06);
    // Two changes of side between neighbouring voxels are seen as none: 4 % of the surface for
    // holes of ten voxels (mean of 300 rocks: 4.0 % equal, 3.0 % exponential), so 5 % are allowed.
    const double s_noise = 4 * std::sqrt((s_v2 - s_v * s_v) / (kSeeds - 1));
    EXPECT_NEAR(s_v, model.s_v, s_noise + 0.05 * model.s_v);
    EXPECT_LT(s_noise, 0.1 * model.s_v);
}

TEST(BooleanModel, PredictsRocksOfEqualHoles) {
    expect_predicted(Law::constant(0.2), 100); // porosity 34 %
}

TEST(BooleanModel, PredictsRocksOfExponentialHoles) {
    expect_predicted(Law::exponential(10), 130); // porosity 34 %
}

} // namespace
} // namespace taihu
