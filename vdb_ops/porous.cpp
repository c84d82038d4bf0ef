#include "vdb_ops/porous.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <openvdb/tools/Interpolation.h>

#include "stats/core/error.h"
#include "vdb_ops/distance_map_detail.h"
#include "vdb_ops/random_lines_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/thickness_detail.h"
#include "vdb_ops/topology_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kLineStream = 0x6c696e65;
constexpr std::uint64_t kFewestLines = 100, kMostLines = 10'000'000;
constexpr double kLeastChord = 0.1; // voxels
constexpr double kFewestBlocks = 8;

/// Where holes are looked for: negative deeper than the margin below the surface of the base.
struct Region {
    const openvdb::FloatGrid* base = nullptr;
    double margin_m = 0;
    Box box;
    double trusted_m = 0;       ///< smaller distances of the base are exact
    std::vector<float> samples; ///< on the dense lattice, in its voxels
};

/// The box of the voxels inside the base and the solid, in voxels of the solid.
openvdb::CoordBBox common_box(const openvdb::FloatGrid& solid, const openvdb::FloatGrid* base) {
    openvdb::CoordBBox box = inside_voxels(solid, "pores");
    if (!base)
        return box;
    const Lattice to = lattice_of(solid), from = lattice_of(*base);
    const openvdb::CoordBBox inside = inside_voxels(*base, "pores");
    for (const openvdb::Coord& c : {inside.min(), inside.max()}) {
        const Vec3 p = from.origin + Vec3{1. * c.x(), 1. * c.y(), 1. * c.z()} * from.voxel_m;
        const Vec3 i = (p - to.origin) / to.voxel_m;
        if (!(std::max({std::abs(i.x), std::abs(i.y), std::abs(i.z)}) < 1e9))
            throw Error(Fault::bad_input,
                        "pores: the base lies far from the solid, or is very much "
                        "larger; check their units");
        box.expand(openvdb::Coord::floor(openvdb::Vec3d(i.x, i.y, i.z)));
        box.expand(openvdb::Coord::ceil(openvdb::Vec3d(i.x, i.y, i.z)));
    }
    return box;
}

Region make_region(const openvdb::FloatGrid& solid, const openvdb::FloatGrid* base,
                   const DenseLattice& lattice, std::span<const float> rock, Progress* progress) {
    Region region;
    region.base = base;
    region.margin_m = lattice_of(solid).voxel_m;
    if (base) {
        const double band_m = lattice_of(*base).voxel_m * lattice_of(*base).half_width_vox;
        region.margin_m = std::min(region.margin_m, 0.5 * band_m);
        region.trusted_m = band_m - region.margin_m;
        region.samples = dense_values(*base, lattice, progress);
    } else {
        region.samples.assign(rock.begin(), rock.end());
        const std::vector<std::uint8_t> enclosed = enclosed_voids(lattice, rock, progress);
        for (std::size_t i = 0; i < enclosed.size(); ++i)
            if (enclosed[i])
                region.samples[i] = -0.5f; // a mouth ends about half way to the air
        region.samples = signed_distances(lattice, region.samples, 0, progress);
    }
    const auto margin = static_cast<float>(region.margin_m / lattice.voxel_m);
    for (int x = 0; x < lattice.n[0]; ++x)
        for (int y = 0; y < lattice.n[1]; ++y)
            for (int z = 0; z < lattice.n[2]; ++z) {
                float& value = region.samples[lattice.at(x, y, z)];
                value += margin;
                if (value < 0)
                    region.box.include(lattice.place(x, y, z));
            }
    if (region.box.empty())
        throw Error(Fault::bad_input, "pores: nothing is deeper than a voxel below the surface of "
                                      "the base; use smaller voxels or another base");
    region.box = region.box.dilated(lattice.voxel_m);
    return region;
}

/// Answers where a point lies in the solid or its holes.
std::function<Probe()> probe_maker(const openvdb::FloatGrid& solid, const Region& region,
                                   const DenseLattice& lattice) {
    return [&]() -> Probe {
        using Accessor = openvdb::FloatGrid::ConstAccessor;
        const auto sampled = [](const Lattice& own, const Accessor& accessor, const Vec3& p) {
            const Vec3 i = (p - own.origin) / own.voxel_m;
            return static_cast<double>(
                openvdb::tools::BoxSampler::sample(accessor, openvdb::Vec3d(i.x, i.y, i.z)));
        };
        const openvdb::FloatGrid& base = region.base ? *region.base : solid;
        return [&region, &lattice, sampled, rock_lattice = lattice_of(solid),
                base_lattice = lattice_of(base), rock = solid.getConstAccessor(),
                whole = base.getConstAccessor()](const Vec3& p) -> Spot {
            const double deep =
                region.base
                    ? sampled(base_lattice, whole, p) + region.margin_m
                    : lattice.voxel_m * static_cast<double>(trilinear(
                                            lattice, region.samples.data(), lattice.index(p)));
            if (deep >= 0)
                return {Phase::outside, deep};
            const double value = sampled(rock_lattice, rock, p);
            return {value < 0 ? Phase::solid : Phase::hole, std::min(-deep, std::abs(value))};
        };
    };
}

/// Sum of `part` over sum of `whole`. What the blocks have may be more than the sum (pairs with
/// ends in two of them); its error is that of leaving out one block after the other.
template <class Part, class Whole>
std::optional<Estimate> ratio(const std::vector<LineSums::Block>& blocks, double part_sum,
                              double whole_sum, const Part& part, const Whole& whole) {
    if (!(whole_sum > 0))
        return std::nullopt;
    Estimate estimate{part_sum / whole_sum, std::nullopt};
    double squares = 0, n = 0;
    for (const LineSums::Block& block : blocks) {
        squares += std::pow(part(block) - estimate.value * whole(block), 2);
        n += whole(block) > 0;
    }
    if (n >= kFewestBlocks)
        estimate.se = std::sqrt(squares * n / (n - 1)) / whole_sum;
    return estimate;
}

template <class Part, class Whole>
std::optional<Estimate> ratio(const std::vector<LineSums::Block>& blocks, const Part& part,
                              const Whole& whole) {
    double parts = 0, wholes = 0;
    for (const LineSums::Block& block : blocks) {
        parts += part(block);
        wholes += whole(block);
    }
    return ratio(blocks, parts, wholes, part, whole);
}

ChordLengths chord_lengths(const LineSums& sums, const LineSums::Chords& chords, Phase phase) {
    ChordLengths result;
    result.mean_m = ratio(
        sums.blocks,
        [&](const LineSums::Block& b) {
            return 2 * (phase == Phase::hole ? b.hole_m : b.length_m - b.hole_m);
        },
        [](const LineSums::Block& b) { return b.n_crossings; });
    // Survival at the bins' ends. A chord that is cut off within a bin was watched for half of it.
    double at_risk = 0;
    for (std::size_t i = 0; i < chords.whole.size(); ++i) {
        at_risk += static_cast<double>(chords.whole[i] + chords.cut[i]);
        result.n += chords.whole[i] / 2; // each is seen from both ends
    }
    std::vector<double> survival = {1};
    for (std::size_t i = 0; i < chords.whole.size() && at_risk > 0; ++i) {
        const auto whole = static_cast<double>(chords.whole[i]),
                   cut = static_cast<double>(chords.cut[i]);
        const double watched = at_risk - 0.5 * cut;
        survival.push_back(survival.back() * (watched > 0 ? 1 - std::min(whole / watched, 1.) : 1));
        at_risk -= whole + cut;
    }
    const auto length_at = [&](double share) -> std::optional<double> {
        for (std::size_t i = 1; i < survival.size(); ++i)
            if (survival[i] <= 1 - share) {
                const double inside =
                    (survival[i - 1] - (1 - share)) / (survival[i - 1] - survival[i]);
                return (static_cast<double>(i - 1) + inside) * sums.bin_m;
            }
        return std::nullopt;
    };
    for (std::size_t q = 0; q < kQuantiles.size(); ++q)
        result.quantiles_m[q] = length_at(kQuantiles[q]);
    const double last = static_cast<double>(survival.size() - 1);
    const double longest = length_at(0.99).value_or(last * sums.bin_m) / sums.bin_m;
    result.bin_m = longest * sums.bin_m / static_cast<double>(result.shares.size());
    const auto survival_at = [&](double at) {
        const double i = std::min(std::floor(at), last);
        const auto low = static_cast<std::size_t>(i), high = std::min(low + 1, survival.size() - 1);
        return survival[low] + std::min(at - i, 1.) * (survival[high] - survival[low]);
    };
    const double step = longest / static_cast<double>(result.shares.size());
    for (std::size_t b = 0; b < result.shares.size(); ++b)
        result.shares[b] = survival_at(step * static_cast<double>(b)) -
                           survival_at(step * static_cast<double>(b + 1));
    return result;
}

void measure_by_lines(const LineSums& sums, double distance_m, PoreMeasures& m) {
    using Block = LineSums::Block;
    const auto length = [](const Block& b) { return b.length_m; };
    const auto porosity = ratio(
        sums.blocks, [](const Block& b) { return b.hole_m; }, length);
    if (!porosity)
        throw Error(Fault::bad_input, "pores: no random line meets the base, which is thinner than "
                                      "its voxels show; use smaller voxels or more lines");
    m.porosity = *porosity;
    m.s_v_m1 = *ratio(
        sums.blocks, [](const Block& b) { return 2 * b.n_crossings; }, length);
    double total = 0;
    for (const Block& block : sums.blocks)
        total += block.length_m;
    const double r = m.s_v_m1.value / 2;
    m.s_v_line_se_m1 =
        2 * std::sqrt(std::max(sums.nn - 2 * r * sums.nl + r * r * sums.ll, 0.)) / total;
    m.solid_chords = chord_lengths(sums, sums.solid, Phase::solid);
    m.hole_chords = chord_lengths(sums, sums.hole, Phase::hole);
    for (std::size_t k = 0; k < LineSums::kDistances; ++k)
        m.correlation.push_back({distance_m * static_cast<double>(k + 1),
                                 ratio(
                                     sums.blocks, sums.pairs[k].holes_m, sums.pairs[k].all_m,
                                     [k](const Block& b) { return b.pairs[k].holes_m; },
                                     [k](const Block& b) { return b.pairs[k].all_m; })});
}

std::optional<BallDiameters> diameters(const SizeCounts& counts, double voxel_m) {
    if (counts.empty())
        return std::nullopt;
    BallDiameters result;
    double n = 0, sum = 0;
    for (const auto& [diameter, count] : counts) {
        n += static_cast<double>(count);
        sum += static_cast<double>(count) * static_cast<double>(diameter);
    }
    result.mean_m = sum / n * voxel_m;
    result.greatest_m = static_cast<double>(counts.back().first) * voxel_m;
    double below = 0;
    std::size_t q = 0;
    for (const auto& [diameter, count] : counts) {
        below += static_cast<double>(count);
        for (; q < kQuantiles.size() && below >= kQuantiles[q] * n; ++q)
            result.quantiles_m[q] = static_cast<double>(diameter) * voxel_m;
    }
    return result;
}

void check(const PoreSettings& settings) {
    if (settings.n_lines < kFewestLines || settings.n_lines > kMostLines)
        throw Error(Fault::bad_argument, "pores: n_lines is " + std::to_string(settings.n_lines) +
                                             "; must be in 100..10000000");
}

} // namespace

PoreMeasures measure_pores(const openvdb::FloatGrid& solid, const openvdb::FloatGrid* base,
                           const PoreSettings& settings, Progress* progress) {
    check(settings);
    report_stage(progress, "sampling");
    const Lattice own = lattice_of(solid);
    const DenseLattice lattice = dense_lattice(solid, common_box(solid, base), 0, 1, "pores");
    std::vector<float> rock = dense_values(solid, lattice, progress);
    Region region = make_region(solid, base, lattice, rock, progress);
    PoreMeasures m;
    m.voxel_m = lattice.voxel_m;
    m.coarser = lattice.coarser;
    m.margin_m = region.margin_m;

    report_stage(progress, "random lines");
    const Vec3 size = region.box.size();
    const double distance_m =
        0.5 * std::min({size.x, size.y, size.z}) / static_cast<double>(LineSums::kDistances);
    measure_by_lines(measure_lines({region.box, settings.n_lines, kLeastChord * own.voxel_m,
                                    distance_m, Rng{settings.seed, kLineStream}},
                                   probe_maker(solid, region, lattice), progress),
                     distance_m, m);

    report_stage(progress, "walls");
    std::vector<std::uint8_t> inside(rock.size());
    for (std::size_t i = 0; i < rock.size(); ++i)
        inside[i] = rock[i] < 0;
    const EulerNumbers euler = euler_numbers(lattice, inside);
    m.euler_faces = euler.faces;
    m.euler_corners = euler.corners;
    // Values at the half width itself are clamped.
    const auto band = static_cast<float>(0.99 * own.half_width_vox * own.voxel_m / lattice.voxel_m);
    m.walls = diameters(
        local_thickness(lattice, signed_distances(lattice, rock, band, progress), progress),
        m.voxel_m);

    report_stage(progress, "pores");
    for (std::size_t i = 0; i < rock.size(); ++i)
        rock[i] = std::max(region.samples[i], -rock[i]);
    const auto trusted =
        std::min(band, static_cast<float>(0.99 * region.trusted_m / lattice.voxel_m));
    std::vector<float>().swap(region.samples);
    m.pores = diameters(
        local_thickness(lattice, signed_distances(lattice, rock, trusted, progress), progress),
        m.voxel_m);
    return m;
}

} // namespace taihu
