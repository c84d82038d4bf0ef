#include "vdb_ops/dense_detail.h"

#include <array>
#include <string>

#include <openvdb/tools/Interpolation.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
constexpr double kMostSamples = 1 << 25;
constexpr int kCoarsest = 16;

/// Marks what is enclosed in one plane: all of it that a flood from the frame does not reach.
class PlaneFlood {
public:
    PlaneFlood(const DenseLattice& lattice, std::span<const float> values, int normal)
        : values_(values), u_(normal == 0 ? 1 : 0), v_(normal == 2 ? 1 : 2), nu_(lattice.n[u_]),
          nv_(lattice.n[v_]), stride_u_(lattice.stride(u_)), stride_v_(lattice.stride(v_)),
          reached_(static_cast<std::size_t>(nu_) * static_cast<std::size_t>(nv_)) {}

    void mark(std::size_t first, std::vector<std::uint8_t>& enclosed) {
        std::fill(reached_.begin(), reached_.end(), std::uint8_t{0});
        for (int u = 0; u < nu_; ++u)
            for (int v = 0; v < nv_; v += u == 0 || u == nu_ - 1 ? 1 : std::max(nv_ - 1, 1))
                visit(first, u, v);
        while (!open_.empty()) {
            const auto [u, v] = open_.back();
            open_.pop_back();
            visit(first, u - 1, v);
            visit(first, u + 1, v);
            visit(first, u, v - 1);
            visit(first, u, v + 1);
        }
        for (int u = 0; u < nu_; ++u)
            for (int v = 0; v < nv_; ++v)
                if (const std::size_t i = at(first, u, v); !(values_[i] < 0) && !reached(u, v))
                    enclosed[i] = 1;
    }

private:
    std::size_t at(std::size_t first, int u, int v) const {
        return first + static_cast<std::size_t>(u) * stride_u_ +
               static_cast<std::size_t>(v) * stride_v_;
    }
    std::uint8_t& reached(int u, int v) {
        return reached_[static_cast<std::size_t>(u) * static_cast<std::size_t>(nv_) +
                        static_cast<std::size_t>(v)];
    }
    void visit(std::size_t first, int u, int v) {
        if (u < 0 || v < 0 || u >= nu_ || v >= nv_ || reached(u, v) || values_[at(first, u, v)] < 0)
            return;
        reached(u, v) = 1;
        open_.push_back({u, v});
    }

    std::span<const float> values_;
    int u_, v_, nu_, nv_;
    std::size_t stride_u_, stride_v_;
    std::vector<std::uint8_t> reached_;
    std::vector<std::array<int, 2>> open_;
};

} // namespace

openvdb::CoordBBox inside_voxels(const openvdb::FloatGrid& solid, const char* who) {
    lattice_of(solid);
    openvdb::CoordBBox box;
    for (auto leaf = solid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto v = leaf->cbeginValueOn(); v; ++v)
            if (*v < 0)
                box.expand(v.getCoord());
    if (box.empty())
        throw Error(Fault::bad_input, std::string(who) + ": grid '" + solid.getName() +
                                          "' is empty; give a solid that is not");
    return box;
}

DenseLattice dense_lattice(const openvdb::FloatGrid& solid, const openvdb::CoordBBox& box,
                           double margin, int coarser, const char* who) {
    const auto around = [&](int step) { return 3 + std::ceil(margin / step); };
    const auto samples = [&](int step) {
        double n = 1;
        for (int a = 0; a < 3; ++a)
            n *= std::floor((double(box.max()[a]) - box.min()[a]) / step) + 2 + 2 * around(step);
        return n;
    };
    while (samples(coarser) > kMostSamples)
        if (++coarser > kCoarsest)
            throw Error(Fault::bad_input,
                        std::string(who) + ": the box of grid '" + solid.getName() + "' holds " +
                            shortest(samples(1)) +
                            " voxels, too many to measure even on every 16th; use a larger voxel");
    const Lattice own = lattice_of(solid);
    const int more = static_cast<int>(around(coarser));
    DenseLattice lattice;
    lattice.coarser = coarser;
    lattice.voxel_m = own.voxel_m * coarser;
    for (int a = 0; a < 3; ++a) {
        lattice.n[a] = (box.max()[a] - box.min()[a]) / coarser + 2 + 2 * more;
        lattice.origin[a] =
            own.origin[a] + (double(box.min()[a]) - double(more) * coarser) * own.voxel_m;
    }
    return lattice;
}

std::vector<float> dense_values(const openvdb::FloatGrid& grid, const DenseLattice& lattice,
                                const Progress* progress) {
    const Lattice own = lattice_of(grid);
    const Vec3 first = (lattice.origin - own.origin) / own.voxel_m;
    const double step = lattice.voxel_m / own.voxel_m;
    // On the grid's own voxels nothing is interpolated; 1e-6 voxels are rounding.
    const auto whole = [](double x) { return std::abs(x - std::round(x)) < 1e-6; };
    const bool same = whole(first.x) && whole(first.y) && whole(first.z) && whole(step);
    const auto scale = static_cast<float>(1 / lattice.voxel_m);
    std::vector<float> values(lattice.size());
    tbb::parallel_for(0, lattice.n[0], [&](int x) {
        check_cancelled(progress);
        const auto accessor = grid.getConstAccessor();
        for (int y = 0; y < lattice.n[1]; ++y)
            for (int z = 0; z < lattice.n[2]; ++z) {
                const openvdb::Vec3d at(first.x + step * x, first.y + step * y, first.z + step * z);
                values[lattice.at(x, y, z)] =
                    scale * (same ? accessor.getValue(Coord::round(at))
                                  : openvdb::tools::BoxSampler::sample(accessor, at));
            }
    });
    return values;
}

std::vector<std::uint8_t> enclosed_voids(const DenseLattice& lattice, std::span<const float> values,
                                         const Progress* progress) {
    std::vector<std::uint8_t> enclosed(lattice.size(), 0);
    for (int normal = 0; normal < 3; ++normal)
        tbb::parallel_for(tbb::blocked_range<int>(0, lattice.n[normal], 4), [&](const auto& range) {
            check_cancelled(progress);
            PlaneFlood flood(lattice, values, normal);
            for (int i = range.begin(); i < range.end(); ++i)
                flood.mark(static_cast<std::size_t>(i) * lattice.stride(normal), enclosed);
        });
    return enclosed;
}

} // namespace taihu
