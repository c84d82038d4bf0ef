#include "vdb_ops/topology_detail.h"

#include <gtest/gtest.h>

#include "tests/support/dense.h"

namespace taihu {
namespace {

/// Samples drawn as planes of rows; `#` is marked.
struct Drawing {
    DenseLattice lattice;
    std::vector<std::uint8_t> marked;
    explicit Drawing(const std::vector<std::vector<const char*>>& planes) {
        lattice.n[0] = static_cast<int>(planes.size()) + 2;
        lattice.n[1] = static_cast<int>(planes[0].size()) + 2;
        lattice.n[2] = static_cast<int>(std::string(planes[0][0]).size()) + 2;
        lattice.voxel_m = 1;
        marked.assign(lattice.size(), 0);
        for (int x = 0; x < lattice.n[0] - 2; ++x)
            for (int y = 0; y < lattice.n[1] - 2; ++y)
                for (int z = 0; z < lattice.n[2] - 2; ++z)
                    marked[lattice.at(x + 1, y + 1, z + 1)] =
                        planes[static_cast<std::size_t>(x)][static_cast<std::size_t>(y)][z] == '#';
    }
    std::size_t n_pieces(Adjacency a) const { return Pieces(lattice, marked, a).size(); }
};

const Drawing kRing({{"###", "#.#", "###"}});
const Drawing kShell({{"###", "###", "###"}, {"###", "#.#", "###"}, {"###", "###", "###"}});
const Drawing kDiagonal({{"#..", ".#.", "..#"}});

TEST(Topology, ARingHasAHandle) {
    const EulerNumbers euler = euler_numbers(kRing.lattice, kRing.marked);
    EXPECT_EQ(euler.faces, 0);
    EXPECT_EQ(euler.corners, 0);
    EXPECT_EQ(n_handles(kRing.lattice, kRing.marked), 1);
}

TEST(Topology, AShellHasACavityAndNoHandle) {
    EXPECT_EQ(euler_numbers(kShell.lattice, kShell.marked).faces, 2);
    EXPECT_EQ(euler_numbers(kShell.lattice, kShell.marked).corners, 2);
    EXPECT_EQ(n_handles(kShell.lattice, kShell.marked), 0);
}

TEST(Topology, ADiagonalHangsTogetherOverCornersOnly) {
    EXPECT_EQ(kDiagonal.n_pieces(Adjacency::faces), 3u);
    EXPECT_EQ(kDiagonal.n_pieces(Adjacency::corners), 1u);
    EXPECT_EQ(euler_numbers(kDiagonal.lattice, kDiagonal.marked).faces, 3);
    EXPECT_EQ(euler_numbers(kDiagonal.lattice, kDiagonal.marked).corners, 1);
    EXPECT_EQ(n_handles(kDiagonal.lattice, kDiagonal.marked), 0);
}

TEST(Topology, EulerNumbersCountPiecesWhereNothingElseIs) {
    // Balls apart on a lattice: both connectivities agree.
    const DenseLattice lattice = cube_lattice(30);
    std::vector<std::uint8_t> marked(lattice.size(), 0);
    for (int x = 1; x < 29; ++x)
        for (int y = 1; y < 29; ++y)
            for (int z = 1; z < 29; ++z) {
                const int a = x % 10 - 5, b = y % 10 - 5, c = z % 10 - 5;
                marked[lattice.at(x, y, z)] = a * a + b * b + c * c <= 9;
            }
    const EulerNumbers euler = euler_numbers(lattice, marked);
    EXPECT_EQ(euler.faces, 27);
    EXPECT_EQ(euler.corners, 27);
    const Pieces pieces(lattice, marked, Adjacency::faces);
    EXPECT_EQ(pieces.size(), 27u);
    EXPECT_EQ(pieces.n_samples(13), 123u); // lattice points in a ball of radius 3
    EXPECT_EQ(pieces.at(15, 15, 15), 13u);
    EXPECT_EQ(pieces.at(25, 25, 27), 26u);
}

} // namespace
} // namespace taihu
