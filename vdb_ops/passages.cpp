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
                   Progress* progress)
    : lattice_(lattice), distances_(distances),
      enclosed_(enclosed_voids(lattice, distances, progress)), y_low_(lattice.n[1]) {
    for (int x = 0; x < lattice.n[0]; ++x)
        for (int y = 0; y < lattice.n[1]; ++y)
            for (int z = 0; z < lattice.n[2]; ++z) {
                const std::size_t i = lattice.at(x, y, z);
                const bool solid = distances[i] < 0;
                n_outline_ += solid || enclosed_[i];
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

Passages::Opened Passages::opened(float radius, const Progress* progress) const {
    std::vector<std::uint8_t> mask = centres(radius);
    for (std::uint8_t& centre : mask)
        centre = !centre;
    Opened result;
    result.n_ways = n_handles(lattice_, mask); // a handle for each way
    if (radius > 0) {
        // The ball sweeps all that is nearer than its radius to where its centre can be.
        std::vector<float> to_centre(lattice_.size());
        for (std::size_t i = 0; i < mask.size(); ++i)
            to_centre[i] = mask[i] ? std::max(radius - distances_[i], 1e-6f)
                                   : std::min(radius - distances_[i], -1e-6f);
        to_centre = signed_distances(lattice_, to_centre, 0, progress);
        for (std::size_t i = 0; i < mask.size(); ++i)
            mask[i] = to_centre[i] >= radius + kCover;
    }
    double n_open = 0;
    for (std::size_t i = 0; i < mask.size(); ++i)
        n_open += enclosed_[i] && !mask[i];
    result.open_share = n_outline_ > 0 ? n_open / n_outline_ : 0;
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

std::vector<float> Passages::widths() const {
    std::vector<float> widths(lattice_.size(), -1);
    tbb::parallel_for(0, lattice_.n[0], [&](int x) {
        for (int y = 0; y < lattice_.n[1]; ++y)
            for (int z = 0; z < lattice_.n[2]; ++z)
                if (const std::size_t i = lattice_.at(x, y, z); enclosed_[i])
                    widths[i] = ridge_ball(lattice_, distances_, x, y, z).radius;
    });
    return widths;
}

bool Passages::leads_through(std::span<const std::uint8_t> wide, bool over_corners) const {
    const Pieces pieces(lattice_, wide, over_corners ? Adjacency::corners : Adjacency::faces);
    const int quarter = (y_high_ - y_low_ + 1) / 4;
    std::vector<std::uint8_t> ends(pieces.size(), 0); // 1: a mouth above, 2: one below
    for (int x = 0; x < lattice_.n[0]; ++x)
        for (int y = y_low_; y <= y_high_; ++y) {
            const int end = y > y_high_ - quarter ? 1 : y < y_low_ + quarter ? 2 : 0;
            if (end == 0)
                continue;
            for (const Pieces::Run& run : pieces.row(x, y))
                for (int z = run.begin; z < run.end; ++z) {
                    bool mouth = false; // enclosed, with air beside it that is not
                    for (int a = 0; a < 3; ++a)
                        for (const std::size_t i : {lattice_.at(x, y, z) + lattice_.stride(a),
                                                    lattice_.at(x, y, z) - lattice_.stride(a)})
                            mouth |= !enclosed_[i] && !(distances_[i] < 0);
                    if (mouth)
                        ends[run.piece] |= static_cast<std::uint8_t>(end);
                }
        }
    return std::find(ends.begin(), ends.end(), 3) != ends.end();
}

double Passages::channel(const Progress* progress) const {
    const std::vector<float> width = widths();
    std::vector<std::uint8_t> wide(width.size());
    const auto passes = [&](float radius) {
        check_cancelled(progress);
        for (std::size_t i = 0; i < wide.size(); ++i)
            wide[i] = enclosed_[i] && width[i] >= radius;
        // Between corners lie 0.87 samples each way: nothing solid for a ball that large.
        return leads_through(wide, radius >= 0.87f);
    };
    float low = 0, high = 0;
    for (const float w : width)
        high = std::max(high, w);
    if (!passes(0))
        return 0;
    while (high - low > 0.05f) {
        const float middle = 0.5f * (low + high);
        (passes(middle) ? low : high) = middle;
    }
    return 2 * static_cast<double>(low);
}

} // namespace taihu
