#include "tests/bench/fractal_rows.h"

#include <gtest/gtest.h>

namespace taihu {
namespace {

TEST(SeedRow, D16TheNineRowsAreTimedBesideThePapers) {
    const auto rows = time_fractal_rows(1);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const FractalRow& row = rows[i];
        EXPECT_EQ(row.process, i < 3 ? "Midpoint" : i < 6 ? "Subdivision" : "Dyn.Bump.");
        EXPECT_EQ(row.n_triangles, i % 3 == 0 ? 20u : i % 3 == 1 ? 320u : 5120u);
        // His two numbers are one: three vertices a triangle, in four digits.
        EXPECT_NEAR(row.paper_ms * row.paper_per_ms / row.n_vertices(), 1, 5e-4) << i;
        EXPECT_GT(row.ms, 0) << i;
    }
}

TEST(SeedRow, D16TheOrderOfThePaperIsToldFromAnother) {
    auto rows = time_fractal_rows(1);
    for (FractalRow& row : rows)
        row.ms = row.paper_ms;
    EXPECT_TRUE(same_order(rows));
    std::swap(rows[2].ms, rows[5].ms);
    EXPECT_FALSE(same_order(rows));
}

} // namespace
} // namespace taihu
