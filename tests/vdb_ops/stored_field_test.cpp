#include "vdb_ops/stored_field.h"

#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/level_set_field.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

/// Some of them far below a voxel's last bit from a level set's values.
std::vector<Sphere> holes() {
    std::vector<Sphere> all;
    for (std::uint64_t i = 0; i < 300; ++i) {
        const Rng rng{5, 3};
        all.push_back({{rng.uniform(i, 0) - 0.5, rng.uniform(i, 1) - 0.5, rng.uniform(i, 2) - 0.5},
                       0.02 + 0.05 * rng.uniform(i, 3)});
    }
    return all;
}

TEST(StoredField, IsWhatALevelSetWouldGiveBack) {
    const std::shared_ptr<const Field> shape = shape_field({});
    const Lattice lattice{0.0137, {0.1, 0.2, 0.3}, 3};
    const auto grid = rasterize(*shape, lattice);
    EXPECT_EQ(grid_hash(*rasterize(StoredField(shape), lattice)), grid_hash(*grid));
    const auto balls = std::make_shared<BallsField>(holes());
    const DifferenceField with(std::make_shared<LevelSetField>(grid), balls),
        without(std::make_shared<StoredField>(shape), balls);
    EXPECT_EQ(grid_hash(*rasterize(without, lattice)), grid_hash(*rasterize(with, lattice)));
    // The field itself keeps bits that a level set rounds away, so the claim says something.
    EXPECT_NE(grid_hash(*rasterize(DifferenceField(shape, balls), lattice)),
              grid_hash(*rasterize(with, lattice)));
}

TEST(StoredField, RefusesNothing) {
    expect_error(Fault::bad_argument, "no field", [] { StoredField{nullptr}; });
}

} // namespace
} // namespace taihu
