#include "vdb_ops/random_lines_detail.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <tbb/parallel_for.h>

namespace taihu {
namespace {

constexpr std::size_t kParts = 64; // summed apart, then in order, whatever the threads

struct Line {
    Vec3 from, along; // `along` of length 1
    double end = 0;   // [m]; from 0
    Vec3 at(double t) const { return from + along * t; }
};

/// A stretch inside the region, of one phase.
struct Piece {
    double begin, end;
    Phase phase;
    bool begins_at_surface, ends_at_surface; // rather than at the border of the region
    int block = 0;
};

Vec3 point_in_ball(const Rng& rng, std::uint64_t item, std::uint32_t first) {
    Vec3 p;
    for (std::uint32_t i = first; i < first + 3000; i += 3) { // half of them hit
        for (int a = 0; a < 3; ++a)
            p[a] = 2 * rng.uniform(item, i + static_cast<std::uint32_t>(a)) - 1;
        if (length_squared(p) < 1 && length_squared(p) > 1e-6)
            break;
    }
    return p;
}

/// The part inside the box of a random line; of no length when it misses.
Line random_line(const Box& box, const Rng& rng, std::uint64_t item) {
    const Vec3 along = normalized(point_in_ball(rng, item, 0));
    const Vec3 side = normalized(
                   cross(std::abs(along.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}, along)),
               up = cross(along, side);
    double u = 0, v = 0;
    for (std::uint32_t i = 3000; i < 5000; i += 2) {
        u = 2 * rng.uniform(item, i) - 1;
        v = 2 * rng.uniform(item, i + 1) - 1;
        if (u * u + v * v < 1)
            break;
    }
    const double radius = 0.5 * length(box.size());
    const Vec3 middle = box.center() + (side * u + up * v) * radius;
    double begin = -radius, end = radius;
    for (int a = 0; a < 3; ++a) {
        if (along[a] == 0) {
            if (middle[a] < box.lo[a] || middle[a] > box.hi[a])
                end = begin;
            continue;
        }
        const double p = (box.lo[a] - middle[a]) / along[a], q = (box.hi[a] - middle[a]) / along[a];
        begin = std::max(begin, std::min(p, q));
        end = std::min(end, std::max(p, q));
    }
    return {middle + along * begin, along, std::max(end - begin, 0.0)};
}

/// Where a line changes from phase to phase.
std::vector<Piece> pieces_of(const Line& line, const Probe& probe, double least_m) {
    std::vector<Piece> pieces;
    if (line.end <= 0)
        return pieces;
    Spot spot = probe(line.at(0));
    double t = 0, begin = 0;
    bool from_surface = false;
    while (t < line.end) {
        // Distances between samples are not quite 1-Lipschitz.
        double next = std::min(t + std::max(0.9 * spot.clear_m, least_m), line.end);
        Spot there = probe(line.at(next));
        if (there.phase != spot.phase) {
            while (next - t > 0.01 * least_m) {
                const double middle = 0.5 * (t + next);
                const Spot found = probe(line.at(middle));
                if (found.phase == spot.phase) {
                    t = middle;
                } else {
                    next = middle;
                    there = found;
                }
            }
            const double crossing = 0.5 * (t + next);
            const bool surface = spot.phase != Phase::outside && there.phase != Phase::outside;
            if (spot.phase != Phase::outside)
                pieces.push_back({begin, crossing, spot.phase, from_surface, surface});
            begin = crossing;
            from_surface = surface;
        }
        t = next;
        spot = there;
    }
    if (spot.phase != Phase::outside)
        pieces.push_back({begin, line.end, spot.phase, from_surface, false});
    return pieces;
}

int block_of(const Box& box, const Vec3& p) {
    int block = 0;
    for (int a = 0; a < 3; ++a) {
        const double share = (p[a] - box.lo[a]) / (box.hi[a] - box.lo[a]);
        block = block * LineSums::kAlong +
                std::clamp(static_cast<int>(share * LineSums::kAlong), 0, LineSums::kAlong - 1);
    }
    return block;
}

/// The pieces cut at the faces of the blocks.
std::vector<Piece> by_block(const std::vector<Piece>& pieces, const Line& line, const Box& box) {
    std::vector<double> cuts;
    for (int a = 0; a < 3; ++a)
        for (int k = 1; k < LineSums::kAlong; ++k) {
            const double plane = box.lo[a] + (box.hi[a] - box.lo[a]) * k / LineSums::kAlong;
            const double t = (plane - line.from[a]) / line.along[a];
            if (t > 0 && t < line.end) // false for a line in the plane
                cuts.push_back(t);
        }
    std::sort(cuts.begin(), cuts.end());
    std::vector<Piece> parts;
    for (Piece piece : pieces) {
        const double end = piece.end;
        for (const double cut : cuts)
            if (cut > piece.begin && cut < end) {
                parts.push_back(piece);
                parts.back().end = piece.begin = cut;
            }
        parts.push_back(piece);
    }
    for (Piece& part : parts)
        part.block = block_of(box, line.at(0.5 * (part.begin + part.end)));
    return parts;
}

void add_pairs(const std::vector<Piece>& parts, double distance_m, LineSums& sums) {
    for (std::size_t k = 0; k < LineSums::kDistances; ++k) {
        const double r = distance_m * static_cast<double>(k + 1);
        std::size_t first = 0;
        for (const Piece& here : parts) {
            while (first < parts.size() && parts[first].end <= here.begin + r)
                ++first;
            for (std::size_t j = first; j < parts.size() && parts[j].begin < here.end + r; ++j) {
                const Piece& there = parts[j];
                const double both =
                    std::min(here.end + r, there.end) - std::max(here.begin + r, there.begin);
                const bool holes = here.phase == Phase::hole && there.phase == Phase::hole;
                const auto count = [&](LineSums::Pairs& pairs) {
                    pairs.all_m += both;
                    pairs.holes_m += holes ? both : 0;
                };
                count(sums.pairs[k]);
                count(sums.blocks[static_cast<std::size_t>(here.block)].pairs[k]);
                if (there.block != here.block)
                    count(sums.blocks[static_cast<std::size_t>(there.block)].pairs[k]);
            }
        }
    }
}

void add_line(const LineSettings& settings, const Line& line, const Probe& probe, LineSums& sums) {
    const std::vector<Piece> pieces = pieces_of(line, probe, settings.least_m);
    if (pieces.empty())
        return;
    double n = 0, inside_m = 0;
    for (const Piece& piece : pieces) {
        inside_m += piece.end - piece.begin;
        LineSums::Chords& chords = piece.phase == Phase::solid ? sums.solid : sums.hole;
        const auto bin = std::min(static_cast<std::size_t>((piece.end - piece.begin) / sums.bin_m),
                                  static_cast<std::size_t>(LineSums::kBins - 1));
        if (piece.begins_at_surface && piece.ends_at_surface)
            chords.whole[bin] += 2;
        else if (piece.begins_at_surface || piece.ends_at_surface)
            ++chords.cut[bin];
        if (piece.ends_at_surface) {
            n += 1;
            const int block = block_of(settings.box, line.at(piece.end));
            sums.blocks[static_cast<std::size_t>(block)].n_crossings += 1;
        }
    }
    sums.nn += n * n;
    sums.nl += n * inside_m;
    sums.ll += inside_m * inside_m;
    const std::vector<Piece> parts = by_block(pieces, line, settings.box);
    for (const Piece& part : parts) {
        LineSums::Block& block = sums.blocks[static_cast<std::size_t>(part.block)];
        block.length_m += part.end - part.begin;
        if (part.phase == Phase::hole)
            block.hole_m += part.end - part.begin;
    }
    add_pairs(parts, settings.distance_m, sums);
}

using AllPairs = std::array<LineSums::Pairs, LineSums::kDistances>;
void add(AllPairs& to, const AllPairs& from) {
    for (std::size_t k = 0; k < to.size(); ++k) {
        to[k].all_m += from[k].all_m;
        to[k].holes_m += from[k].holes_m;
    }
}

void add(LineSums& to, const LineSums& from) {
    for (std::size_t b = 0; b < to.blocks.size(); ++b) {
        LineSums::Block& block = to.blocks[b];
        const LineSums::Block& more = from.blocks[b];
        block.length_m += more.length_m;
        block.hole_m += more.hole_m;
        block.n_crossings += more.n_crossings;
        add(block.pairs, more.pairs);
    }
    add(to.pairs, from.pairs);
    for (std::size_t i = 0; i < LineSums::kBins; ++i) {
        to.solid.whole[i] += from.solid.whole[i];
        to.solid.cut[i] += from.solid.cut[i];
        to.hole.whole[i] += from.hole.whole[i];
        to.hole.cut[i] += from.hole.cut[i];
    }
    to.nn += from.nn;
    to.nl += from.nl;
    to.ll += from.ll;
}

} // namespace

LineSums measure_lines(const LineSettings& settings, const std::function<Probe()>& make_probe,
                       Progress* progress) {
    std::vector<LineSums> parts(kParts);
    std::atomic<std::size_t> n_done{0};
    tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
        const Probe probe = make_probe();
        parts[part].bin_m = length(settings.box.size()) / LineSums::kBins;
        const std::uint64_t first = settings.n_lines * part / kParts,
                            last = settings.n_lines * (part + 1) / kParts;
        for (std::uint64_t i = first; i < last; ++i) {
            if (i % 100 == 0)
                check_cancelled(progress);
            add_line(settings, random_line(settings.box, settings.rng, i), probe, parts[part]);
        }
        report_fraction(progress, static_cast<double>(++n_done) / kParts);
    });
    for (std::size_t part = 1; part < kParts; ++part)
        add(parts[0], parts[part]);
    return std::move(parts[0]);
}

} // namespace taihu
