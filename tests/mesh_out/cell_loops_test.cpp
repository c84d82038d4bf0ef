#include "mesh_out/cell_loops_detail.h"

#include <array>
#include <bit>

#include <gtest/gtest.h>

namespace taihu {
namespace {

TEST(CellLoops, PassEveryEdgeBetweenInsideAndOutside) {
    for (unsigned inside = 0; inside < 256; ++inside)
        for (unsigned joined = 0; joined < 64; ++joined) {
            const CellLoops& loops = cell_loops(inside, joined);
            std::array<int, 4> n_edges{};
            for (int e = 0; e < 12; ++e) {
                const int axis = e / 4, u = e / 2 % 2, v = e % 2;
                const int from = u << (2 - (axis + 1) % 3) | v << (2 - (axis + 2) % 3),
                          to = from | 1 << (2 - axis);
                const bool passed = ((inside >> from ^ inside >> to) & 1) != 0;
                const int loop = loops.of_edge[static_cast<std::size_t>(e)];
                EXPECT_EQ(loop >= 0, passed);
                ASSERT_LT(loop, loops.n);
                if (loop >= 0)
                    ++n_edges[static_cast<std::size_t>(loop)];
            }
            for (int i = 0; i < loops.n; ++i)
                EXPECT_GE(n_edges[static_cast<std::size_t>(i)], 3);
        }
}

TEST(CellLoops, PartOppositeCornersUnlessTheyAreJoined) {
    EXPECT_EQ(cell_loops(0, 0).n, 0);
    EXPECT_EQ(cell_loops(1, 0).n, 1);
    EXPECT_EQ(cell_loops(0x0f, 0).n, 1);
    EXPECT_EQ(cell_loops(0x81, 0).n, 2);              // opposite corners of the cube
    EXPECT_EQ(cell_loops(0b01101001, 0).n, 4);        // every other corner
    EXPECT_EQ(cell_loops(0b01101001, 0b111111).n, 4); // or those between
    const unsigned face = alternating_faces(0b1001);  // corners 0 and 3, of the face x = 0
    EXPECT_EQ(face, 1u);
    EXPECT_EQ(cell_loops(0b1001, 0).n, 2);
    EXPECT_EQ(cell_loops(0b1001, 1).n, 1);
}

} // namespace
} // namespace taihu
