#pragma once
#include <algorithm>
#include <vector>

#include "vdb_ops/distance_map_detail.h"

namespace taihu {

/// A cube of n^3 samples, one metre apart, the first at the origin.
inline DenseLattice cube_lattice(int n) {
    DenseLattice lattice;
    lattice.n[0] = lattice.n[1] = lattice.n[2] = n;
    lattice.voxel_m = 1;
    return lattice;
}

/// A function of the place at every sample, clamped as in a level set of half width 3.
template <class Distance>
std::vector<float> sampled(const DenseLattice& lattice, const Distance& distance) {
    std::vector<float> values(lattice.size());
    for (int x = 0; x < lattice.n[0]; ++x)
        for (int y = 0; y < lattice.n[1]; ++y)
            for (int z = 0; z < lattice.n[2]; ++z)
                values[lattice.at(x, y, z)] =
                    std::clamp(static_cast<float>(distance(lattice.place(x, y, z))), -3.f, 3.f);
    return values;
}

template <class Distance>
std::vector<float> distances(const DenseLattice& lattice, const Distance& distance) {
    return signed_distances(lattice, sampled(lattice, distance), 2.9f, nullptr);
}

} // namespace taihu
