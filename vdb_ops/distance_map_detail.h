#pragma once
#include <span>
#include <vector>

#include "vdb_ops/dense_detail.h"

namespace taihu {

/// Signed distance of every sample to the surface where `values` change sign, in samples, negative
/// where they are; infinite in a lattice without one. The surface is the places where lines between
/// neighbours cross it (found linearly), and each sample's distance to the nearest of them is
/// exact: too long by at most 0.35 / distance samples, as the surface may come nearer between them.
/// Below `trusted` the value itself is taken where the two agree so far. The same bits on any
/// number of threads. Time O(samples), 8 bytes a sample besides the input. \param values distances,
/// or 1-Lipschitz numbers of that sign [samples]; \param trusted  see above; 0 for none Source:
/// lower envelopes of parabolas, Felzenszwalb & Huttenlocher 2012 (from memory); one pass order for
/// the crossings along each axis, so that all stay exact: own derivation.
std::vector<float> signed_distances(const DenseLattice& lattice, std::span<const float> values,
                                    float trusted, const Progress* progress);

} // namespace taihu
