#include <utility>
#include <vector>

#include "mesh_out/cell_loops_detail.h"

namespace taihu {
namespace {

FaceRing make_ring(int face) {
    const int a = face / 2, side = face % 2, b = (a + 1) % 3, c = (a + 2) % 3;
    const auto corner = [&](int along_b, int along_c) {
        return side << (2 - a) | along_b << (2 - b) | along_c << (2 - c);
    };
    return {{corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)},
            {4 * b + side, 4 * c + 2 * side + 1, 4 * b + 2 + side, 4 * c + 2 * side}};
}

bool has(unsigned bits, int i) {
    return (bits >> i & 1) != 0;
}

bool alternates(unsigned inside, const FaceRing& ring) {
    const bool first = has(inside, ring.corners[0]);
    return has(inside, ring.corners[1]) != first && has(inside, ring.corners[2]) == first &&
           has(inside, ring.corners[3]) != first;
}

CellLoops trace(unsigned inside, unsigned joined) {
    std::array<std::array<int, 2>, 12> partner;
    for (auto& p : partner)
        p = {-1, -1};
    const auto link = [&](int e, int f) {
        partner[static_cast<std::size_t>(e)][partner[static_cast<std::size_t>(e)][0] >= 0] = f;
        partner[static_cast<std::size_t>(f)][partner[static_cast<std::size_t>(f)][0] >= 0] = e;
    };
    for (int face = 0; face < 6; ++face) {
        const FaceRing& ring = face_ring(face);
        const auto& e = ring.edges;
        if (alternates(inside, ring)) {
            // Arcs cut off the corners that are not joined.
            const bool cut_first = has(inside, ring.corners[0]) != has(joined, face);
            link(cut_first ? e[3] : e[0], cut_first ? e[0] : e[1]);
            link(cut_first ? e[1] : e[2], cut_first ? e[2] : e[3]);
            continue;
        }
        int one = -1;
        for (std::size_t k = 0; k < 4; ++k)
            if (has(inside, ring.corners[k]) != has(inside, ring.corners[(k + 1) % 4])) {
                if (one >= 0)
                    link(one, e[k]);
                one = e[k];
            }
    }
    CellLoops loops;
    loops.of_edge.fill(-1);
    for (std::size_t start = 0; start < 12; ++start) {
        if (partner[start][0] < 0 || loops.of_edge[start] >= 0)
            continue;
        std::size_t e = start;
        for (;;) {
            loops.of_edge[e] = static_cast<std::int8_t>(loops.n);
            const auto a = static_cast<std::size_t>(partner[e][0]),
                       b = static_cast<std::size_t>(partner[e][1]);
            if (loops.of_edge[a] < 0)
                e = a;
            else if (loops.of_edge[b] < 0)
                e = b;
            else
                break;
        }
        ++loops.n;
    }
    return loops;
}

} // namespace

const FaceRing& face_ring(int face) {
    static const std::array<FaceRing, 6> rings = {make_ring(0), make_ring(1), make_ring(2),
                                                  make_ring(3), make_ring(4), make_ring(5)};
    return rings[static_cast<std::size_t>(face)];
}

unsigned alternating_faces(unsigned inside) {
    static const std::array<std::uint8_t, 256> table = [] {
        std::array<std::uint8_t, 256> all{};
        for (unsigned i = 0; i < 256; ++i)
            for (int f = 0; f < 6; ++f)
                all[i] =
                    static_cast<std::uint8_t>(all[i] | unsigned{alternates(i, face_ring(f))} << f);
        return all;
    }();
    return table[inside];
}

const CellLoops& cell_loops(unsigned inside, unsigned joined) {
    static const std::vector<CellLoops> table = [] {
        std::vector<CellLoops> all;
        for (unsigned i = 0; i < 256; ++i)
            for (unsigned j = 0; j < 64; ++j)
                all.push_back(trace(i, j));
        return all;
    }();
    return table[inside * 64 + joined];
}

} // namespace taihu
