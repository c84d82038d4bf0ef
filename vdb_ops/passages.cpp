#include "vdb_ops/passages_detail.h"

#include <tbb/parallel_for.h>

#include "vdb_ops/distance_map_detail.h"
#include "vdb_ops/thickness_detail.h"
#include "vdb_ops/topology_detail.h"

namespace taihu {
namespace {

// Samples this near to a ball belong to it: where its centre can be is known only so well.
constexpr float kCover = 0.25f;

} // namespace

Passages::Passages(const DenseLattice& lattice, std::span<const float> distances,
                   float outline_radius, const Progress* progress)
    : lattice_(lattice), distances_(distances),
      depth_(beyond(centres(outline_radius), outline_radius, progress)), y_low_(lattice.n[1]) {
    for (int x = 0; x < lattice.n[0]; ++x)
        for (int y = 0; y < lattice.n[1]; ++y)
            for (int z = 0; z < lattice.n[2]; ++z) {
                const std::size_t i = lattice.at(x, y, z);
                const bool solid = distances[i] < 0;
                n_outline_ += solid || depth_[i] > 0;
                if (solid) {
                    y_low_ = std::min(y_low_, y);
                    y_high_ = std::max(y_high_, y);
                }
            }
}

std::vector<std::uint8_t> Passages::centres(float radius) const {
    std::vector<std::uint8_t> free(lattice_.size());
    for (std::size_t i = 0; i < free.size(); ++i)
        free[i] = distances_[i] >= radius;
    if (free.empty() || !free[0]) // no room for it
        return std::vector<std::uint8_t>(lattice_.size(), 0);
    const Pieces pieces(lattice_, free, Adjacency::faces);
    const std::uint32_t outside = pieces.at(0, 0, 0);
    for (int x = 0; x < lattice_.n[0]; ++x)
        for (int y = 0; y < lattice_.n[1]; ++y)
            for (const Pieces::Run& run : pieces.row(x, y))
                if (run.piece != outside)
                    std::fill_n(free.begin() +
                                    static_cast<std::ptrdiff_t>(lattice_.at(x, y, run.begin)),
                                run.end - run.begin, std::uint8_t{0});
    return free;
}

/// How far beyond the reach of a ball a sample is.
std::vector<float> Passages::beyond(const std::vector<std::uint8_t>& centres, float radius,
                                    const Progress* progress) const {
    std::vector<float> d(lattice_.size());
    for (std::size_t i = 0; i < d.size(); ++i)
        d[i] = centres[i] ? std::min(radius - distances_[i], -1e-6f)
                          : std::max(radius - distances_[i], 1e-6f);
    d = signed_distances(lattice_, d, 0, progress);
    for (float& value : d)
        value -= radius + kCover;
    return d;
}

Passages::Opened Passages::opened(float radius, const Progress* progress) const {
    std::vector<std::uint8_t> mask = centres(radius);
    std::vector<float> out_of_reach;
    if (radius > 0)
        out_of_reach = beyond(mask, radius, progress);
    double n_open = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        const bool open = radius > 0 ? out_of_reach[i] < 0 : mask[i] != 0;
        n_open += open && depth_[i] > 0 && !(distances_[i] < 0);
        mask[i] = !mask[i];
    }
    Opened result;
    result.open_share = n_outline_ > 0 ? n_open / n_outline_ : 0;
    result.n_ways = n_handles(lattice_, mask); // a handle for each way
    return result;
}

Passages::Sealed Passages::sealed() const {
    std::vector<std::uint8_t> voids(lattice_.size());
    for (std::size_t i = 0; i < voids.size(); ++i)
        voids[i] = !(distances_[i] < 0);
    const Pieces pieces(lattice_, voids, Adjacency::faces);
    Sealed result;
    result.n = pieces.size() - 1;
    for (std::uint32_t p = 0; p < pieces.size(); ++p)
        if (p != pieces.at(0, 0, 0))
            result.share += static_cast<double>(pieces.n_samples(p)) / n_outline_;
    return result;
}

bool Passages::leads_through(std::span<const std::uint8_t> wide, float radius) const {
    // Between corners lie 0.87 samples each way: nothing solid for a ball that large.
    const Pieces pieces(lattice_, wide, radius >= 0.87f ? Adjacency::corners : Adjacency::faces);
    const float quarter = 0.25f * static_cast<float>(y_high_ - y_low_ + 1);
    std::vector<std::uint8_t> ends(pieces.size(), 0); // 1: a mouth above, 2: one below
    for (int x = 0; x < lattice_.n[0]; ++x)
        for (int y = y_low_; y <= y_high_; ++y) {
            const auto above = static_cast<float>(y_high_ - y),
                       below = static_cast<float>(y - y_low_);
            const int end = (above - radius < quarter) | (below - radius < quarter) << 1;
            if (end == 0)
                continue;
            for (const Pieces::Run& run : pieces.row(x, y))
                for (int z = run.begin; z < run.end; ++z)
                    if (depth_[lattice_.at(x, y, z)] < radius + 1) // the ball touches the outline
                        ends[run.piece] |= static_cast<std::uint8_t>(end);
        }
    return std::find(ends.begin(), ends.end(), 3) != ends.end();
}

double Passages::channel(const Progress* progress) const {
    // Balls inside the void and the outline; centres lie on ridges between samples.
    std::vector<float> inside(lattice_.size()), width(lattice_.size(), 0);
    for (std::size_t i = 0; i < inside.size(); ++i)
        inside[i] = std::min(distances_[i], depth_[i]);
    tbb::parallel_for(0, lattice_.n[0], [&](int x) {
        for (int y = 0; y < lattice_.n[1]; ++y)
            for (int z = 0; z < lattice_.n[2]; ++z)
                if (const std::size_t i = lattice_.at(x, y, z); inside[i] > 0)
                    width[i] = ridge_ball(lattice_, inside, x, y, z).radius;
    });
    std::vector<std::uint8_t> wide(width.size());
    const auto passes = [&](float radius) {
        check_cancelled(progress);
        for (std::size_t i = 0; i < wide.size(); ++i)
            wide[i] = width[i] >= radius;
        return leads_through(wide, radius);
    };
    float low = 1, high = 1;
    for (const float w : width)
        high = std::max(high, w);
    if (!passes(low))
        return 0;
    while (high - low > 0.05f) {
        const float middle = 0.5f * (low + high);
        (passes(middle) ? low : high) = middle;
    }
    return 2 * static_cast<double>(low);
}

} // namespace taihu
