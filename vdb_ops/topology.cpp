#include "vdb_ops/topology_detail.h"

#include <tbb/parallel_for.h>

namespace taihu {

Pieces::Pieces(const DenseLattice& lattice, std::span<const std::uint8_t> marked,
               Adjacency adjacency)
    : ny_(static_cast<std::size_t>(lattice.n[1])) {
    const int nz = lattice.n[2];
    first_.push_back(0);
    for (int x = 0; x < lattice.n[0]; ++x)
        for (int y = 0; y < lattice.n[1]; ++y) {
            const std::uint8_t* row = marked.data() + lattice.at(x, y, 0);
            for (int z = 0; z < nz; ++z)
                if (row[z]) {
                    const int begin = z;
                    while (z < nz && row[z])
                        ++z;
                    runs_.push_back({begin, z, 0});
                }
            first_.push_back(runs_.size());
        }
    parent_.resize(runs_.size());
    for (std::uint32_t r = 0; r < runs_.size(); ++r)
        parent_[r] = r;
    const int reach = adjacency == Adjacency::corners ? 1 : 0;
    for (std::size_t x = 0; x < static_cast<std::size_t>(lattice.n[0]); ++x)
        for (std::size_t y = 0; y < ny_; ++y) {
            const std::size_t here = x * ny_ + y;
            if (y > 0)
                join_rows(here - 1, here, reach);
            if (x == 0)
                continue;
            join_rows(here - ny_, here, reach);
            if (reach > 0 && y > 0)
                join_rows(here - ny_ - 1, here, reach);
            if (reach > 0 && y + 1 < ny_)
                join_rows(here - ny_ + 1, here, reach);
        }
    for (std::uint32_t r = 0; r < runs_.size(); ++r) { // roots come first: the smallest run
        const std::uint32_t top = root(r);
        if (top == r) {
            runs_[r].piece = static_cast<std::uint32_t>(n_samples_.size());
            n_samples_.push_back(0);
        } else {
            runs_[r].piece = runs_[top].piece;
        }
        n_samples_[runs_[r].piece] += static_cast<std::uint64_t>(runs_[r].end - runs_[r].begin);
    }
    std::vector<std::uint32_t>().swap(parent_);
}

std::uint32_t Pieces::root(std::uint32_t run) {
    while (parent_[run] != run)
        run = parent_[run] = parent_[parent_[run]];
    return run;
}

void Pieces::join_rows(std::size_t a, std::size_t b, int reach) {
    std::size_t i = first_[a], j = first_[b];
    while (i < first_[a + 1] && j < first_[b + 1]) {
        if (runs_[i].begin < runs_[j].end + reach && runs_[j].begin < runs_[i].end + reach) {
            const std::uint32_t p = root(static_cast<std::uint32_t>(i)),
                                q = root(static_cast<std::uint32_t>(j));
            parent_[std::max(p, q)] = std::min(p, q);
        }
        ++(runs_[i].end < runs_[j].end ? i : j);
    }
}

std::uint32_t Pieces::at(int x, int y, int z) const {
    const auto runs = row(x, y);
    const auto after = std::upper_bound(runs.begin(), runs.end(), z,
                                        [](int at, const Run& run) { return at < run.begin; });
    return (after - 1)->piece;
}

EulerNumbers euler_numbers(const DenseLattice& lattice, std::span<const std::uint8_t> marked) {
    std::vector<EulerNumbers> by_plane(static_cast<std::size_t>(lattice.n[0]));
    const std::size_t sx = lattice.stride(0), sy = lattice.stride(1);
    tbb::parallel_for(0, lattice.n[0] - 1, [&](int x) {
        EulerNumbers sum;
        for (int y = 0; y + 1 < lattice.n[1]; ++y) {
            const std::uint8_t* m = marked.data() + lattice.at(x, y, 0);
            for (int z = 0; z + 1 < lattice.n[2]; ++z, ++m) {
                const int a = m[0], b = m[1], c = m[sy], d = m[sy + 1], e = m[sx], f = m[sx + 1],
                          g = m[sx + sy], h = m[sx + sy + 1];
                if (!(a | b | c | d | e | f | g | h))
                    continue;
                // Cells of the lattice whose lowest sample is a, all of whose samples are marked.
                sum.faces += a - (a & b) - (a & c) - (a & e) + (a & b & c & d) + (a & b & e & f) +
                             (a & c & e & g) - (a & b & c & d & e & f & g & h);
                // Cells round the corner between a and h, one of whose cubes is marked.
                sum.corners += 1 - (a | b | c | d) - (a | b | e | f) - (a | c | e | g) + (a | b) +
                               (a | c) + (a | e) - a;
            }
        }
        by_plane[static_cast<std::size_t>(x)] = sum;
    });
    EulerNumbers all;
    for (const EulerNumbers& plane : by_plane) {
        all.faces += plane.faces;
        all.corners += plane.corners;
    }
    return all;
}

std::int64_t n_handles(const DenseLattice& lattice, std::span<const std::uint8_t> marked) {
    const auto n_solid = Pieces(lattice, marked, Adjacency::corners).size();
    std::vector<std::uint8_t> others(marked.size());
    for (std::size_t i = 0; i < others.size(); ++i)
        others[i] = !marked[i];
    const auto n_void = Pieces(lattice, others, Adjacency::faces).size();
    return static_cast<std::int64_t>(n_solid + n_void) - 1 - euler_numbers(lattice, marked).corners;
}

} // namespace taihu
