#include "vdb_ops/redistance.h"

#include <array>
#include <bitset>
#include <cmath>
#include <unordered_map>
#include <vector>

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/core/vec3.h"
#include "stats/number_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using Leaf = openvdb::FloatTree::LeafNodeType;
constexpr std::size_t kMostLeaves = std::size_t{1} << 22;
constexpr float kEnough = 1e-5f; // voxels: smaller improvements are not passed on
constexpr float kChord = 0.06f;  // voxels: 3 / 8r, at a radius of curvature of 6

/// A leaf and one voxel around it.
constexpr int kSide = 10;
constexpr std::array<int, 3> kStep = {kSide * kSide, kSide, 1};
using Halo = std::array<float, kSide * kSide * kSide>;

constexpr std::size_t halo_index(int x, int y, int z) { // of the leaf's voxels, from -1 to 8
    return static_cast<std::size_t>((x + 1) * kStep[0] + (y + 1) * kStep[1] + z + 1);
}

/// Unsigned distances of a leaf in voxels, and which of them are given.
struct BandLeaf {
    Coord origin;
    std::array<float, 512> d;
    std::bitset<512> given, negative;
    std::array<std::int32_t, 6> beside; // leaves across the faces -x +x -y +y -z +z, or -1
};

double squared_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 e = b - a, q = p - a;
    const double e2 = length_squared(e);
    const double t = e2 > 0 ? std::clamp(dot(e, q) / e2, 0.0, 1.0) : 0.0;
    return length_squared(q - e * t);
}

double squared_to_triangle(const Vec3& p, const std::array<Vec3, 3>& t) {
    const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
    bool over = length_squared(n) > 1e-18; // else a needle: its edges are all of it
    for (std::size_t k = 0; k < 3 && over; ++k)
        over = dot(cross(n, t[(k + 1) % 3] - t[k]), p - t[k]) >= 0;
    if (over) {
        const double h = dot(n, p - t[0]);
        return h * h / length_squared(n);
    }
    return std::min({squared_to_segment(p, t[0], t[1]), squared_to_segment(p, t[1], t[2]),
                     squared_to_segment(p, t[2], t[0])});
}

/// Calls fn for each triangle of the linear surface in the cell whose first voxel is `at` of the
/// halo: six tetrahedra along the cell's diagonal, which fit those of the cells beside it.
template <class Fn>
void each_triangle(const Halo& d, std::size_t at, const Vec3& first, Fn&& fn) {
    static constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                          {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (const auto& order : kOrders) {
        std::array<Vec3, 4> in, out;
        std::array<double, 4> d_in{}, d_out{};
        std::size_t n_in = 0, n_out = 0, i = at;
        Vec3 p = first;
        for (int corner = 0; corner < 4; ++corner) {
            if (d[i] < 0)
                in[n_in] = p, d_in[n_in++] = static_cast<double>(d[i]);
            else
                out[n_out] = p, d_out[n_out++] = static_cast<double>(d[i]);
            if (corner < 3) {
                i += static_cast<std::size_t>(kStep[static_cast<std::size_t>(order[corner])]);
                p[order[corner]] += 1;
            }
        }
        const auto crossing = [&](std::size_t a, std::size_t b) {
            return in[a] + (out[b] - in[a]) * (d_in[a] / (d_in[a] - d_out[b]));
        };
        if (n_in == 1) {
            fn({crossing(0, 0), crossing(0, 1), crossing(0, 2)});
        } else if (n_out == 1) {
            fn({crossing(0, 0), crossing(1, 0), crossing(2, 0)});
        } else if (n_in == 2) {
            const Vec3 a = crossing(0, 0), b = crossing(1, 1);
            fn({a, crossing(0, 1), b});
            fn({a, crossing(1, 0), b});
        }
    }
}

/// Distances of a leaf's voxels to the linear surface in the cells that they are corners of: right
/// up to 1, where no other cell can hold the nearest point.
void near_surface(const Halo& halo, BandLeaf& leaf) {
    for (int x = -1; x < 8; ++x)
        for (int y = -1; y < 8; ++y)
            for (int z = -1; z < 8; ++z) {
                const std::size_t at = halo_index(x, y, z);
                int n_in = 0;
                for (std::size_t k = 0; k < 8; ++k)
                    n_in += halo[at + (k >> 2) * kStep[0] + (k >> 1 & 1) * kStep[1] + (k & 1)] < 0;
                if (n_in == 0 || n_in == 8)
                    continue;
                std::array<double, 8> d2;
                d2.fill(1e9);
                each_triangle(halo, at, {}, [&](const std::array<Vec3, 3>& t) {
                    for (std::size_t k = 0; k < 8; ++k)
                        d2[k] =
                            std::min(d2[k], squared_to_triangle({static_cast<double>(k >> 2),
                                                                 static_cast<double>(k >> 1 & 1),
                                                                 static_cast<double>(k & 1)},
                                                                t));
                });
                for (int k = 0; k < 8; ++k) {
                    const int cx = x + (k >> 2), cy = y + (k >> 1 & 1), cz = z + (k & 1);
                    if (cx < 0 || cy < 0 || cz < 0 || cx > 7 || cy > 7 || cz > 7)
                        continue;
                    const auto voxel = static_cast<std::size_t>(cx * 64 + cy * 8 + cz);
                    const auto d = static_cast<float>(std::sqrt(d2[static_cast<std::size_t>(k)]));
                    leaf.d[voxel] = std::min(leaf.d[voxel], d);
                }
            }
    for (std::size_t i = 0; i < 512; ++i) {
        leaf.given[i] = leaf.d[i] <= 1;
        if (!leaf.given[i])
            continue;
        // Chords cut curved surfaces; value over gradient does not, but fails at edges. Where both
        // agree within what chords can do, it is the better one.
        const float* p = &halo[halo_index(static_cast<int>(i / 64), static_cast<int>(i / 8 % 8),
                                          static_cast<int>(i % 8))];
        const float gx = p[kStep[0]] - p[-kStep[0]], gy = p[kStep[1]] - p[-kStep[1]],
                    gz = p[1] - p[-1];
        const float d = 2 * std::fabs(*p) / std::sqrt(gx * gx + gy * gy + gz * gz);
        if (std::fabs(d - leaf.d[i]) <= kChord)
            leaf.d[i] = d;
    }
}

/// The first order upwind solution of |grad d| = 1 from the least neighbours along each axis.
float upwind(float a, float b, float c) {
    if (a > b)
        std::swap(a, b);
    if (b > c)
        std::swap(b, c);
    if (a > b)
        std::swap(a, b);
    b -= a; // relative to the least: nothing large is squared
    c -= a;
    if (b >= 1)
        return a + 1;
    const float two = 0.5f * (b + std::sqrt(2 - b * b));
    if (c >= two)
        return a + two;
    const float s = b + c;
    return a + (s + std::sqrt(std::max(0.f, s * s - 3 * (b * b + c * c - 1)))) / 3;
}

/// Which voxels of a halo are given.
using Given = std::array<bool, kSide * kSide * kSide>;

/// One pass over the leaf's voxels, in the direction that the bits of `order` say.
bool sweep(Halo& d, const Given& given, unsigned order) {
    const auto from = [order](unsigned bit) { return order & bit ? 7 : 0; };
    const auto step = [order](unsigned bit, int by) { return order & bit ? -by : by; };
    const int dx = step(4, kStep[0]), dy = step(2, kStep[1]), dz = step(1, 1);
    auto at_x = static_cast<int>(halo_index(from(4), from(2), from(1)));
    bool changed = false;
    for (int i = 0; i < 8; ++i, at_x += dx)
        for (int j = 0, at_y = at_x; j < 8; ++j, at_y += dy)
            for (int k = 0, at = at_y; k < 8; ++k, at += dz) {
                float* p = d.data() + at;
                const float a = std::min(p[-kStep[0]], p[kStep[0]]),
                            b = std::min(p[-kStep[1]], p[kStep[1]]), c = std::min(p[-1], p[1]);
                const float least = std::min(std::min(a, b), c);
                if (least + 0.5f >= *p)
                    continue; // an update adds 1 / sqrt(3) at least
                const float u = given[static_cast<std::size_t>(at)] ? least + 1 : upwind(a, b, c);
                if (u < *p - kEnough) {
                    *p = u;
                    changed = true;
                }
            }
    return changed;
}

/// The band as leaves that grow outwards: each round solves those that something changed beside.
class Band {
public:
    Band(const FloatGrid& grid, float half_width) : grid_(grid), cap_(half_width + 1) {}

    void add(std::vector<BandLeaf> leaves) {
        for (const BandLeaf& leaf : leaves)
            link(leaf);
        leaves_ = std::move(leaves);
        for (std::size_t i = 0; i < leaves_.size(); ++i)
            for (int face = 0; face < 6; ++face)
                leaves_[i].beside[static_cast<std::size_t>(face)] = find(across(i, face));
    }

    void solve(Progress* progress) {
        std::vector<std::int32_t> now(leaves_.size());
        for (std::size_t i = 0; i < now.size(); ++i)
            now[i] = static_cast<std::int32_t>(i);
        for (bool first = true; !now.empty(); first = false) {
            check_cancelled(progress);
            now = next(now, round(now, first));
        }
    }

    const std::vector<BandLeaf>& leaves() const { return leaves_; }

private:
    struct Hash {
        std::size_t operator()(const Coord& c) const { return c.hash<20>(); }
    };

    Coord across(std::size_t leaf, int face) const {
        Coord c = leaves_[leaf].origin;
        c[face / 2] += face % 2 ? 8 : -8;
        return c;
    }
    std::int32_t find(const Coord& origin) const {
        const auto it = index_.find(origin);
        return it == index_.end() ? -1 : it->second;
    }
    void link(const BandLeaf& leaf) {
        index_.emplace(leaf.origin, static_cast<std::int32_t>(index_.size()));
    }

    /// Voxel (i, j) of the layer of a halo on one face, `out` voxels beyond the leaf's own.
    static std::size_t layer(int face, int out, int i, int j) {
        const int at = face % 2 ? 7 + out : -out;
        return face / 2 == 0   ? halo_index(at, i, j)
               : face / 2 == 1 ? halo_index(i, at, j)
                               : halo_index(i, j, at);
    }

    Halo gather(const BandLeaf& leaf) const {
        Halo halo;
        halo.fill(cap_);
        for (int i = 0; i < 512; ++i)
            halo[halo_index(i / 64, i / 8 % 8, i % 8)] = leaf.d[static_cast<std::size_t>(i)];
        for (int face = 0; face < 6; ++face) {
            const std::int32_t b = leaf.beside[static_cast<std::size_t>(face)];
            if (b < 0)
                continue;
            const auto& d = leaves_[static_cast<std::size_t>(b)].d;
            const int at = face % 2 ? 0 : 7;
            for (int i = 0; i < 8; ++i)
                for (int j = 0; j < 8; ++j) {
                    const int voxel = face / 2 == 0   ? at * 64 + i * 8 + j
                                      : face / 2 == 1 ? i * 64 + at * 8 + j
                                                      : i * 64 + j * 8 + at;
                    halo[layer(face, 1, i, j)] = d[static_cast<std::size_t>(voxel)];
                }
        }
        return halo;
    }

    /// Solve these leaves; for each, bit f says that a leaf across face f may follow. In chunks of
    /// one size, so that halos need little memory and threads make no difference.
    std::vector<unsigned> round(const std::vector<std::int32_t>& now, bool first) {
        constexpr std::size_t kChunk = 2048;
        std::vector<Halo> halos(std::min(kChunk, now.size()));
        std::vector<unsigned> passed(now.size());
        for (std::size_t begin = 0; begin < now.size(); begin += kChunk) {
            const auto parallel = [&](auto&& fn) {
                tbb::parallel_for(tbb::blocked_range<std::size_t>(
                                      begin, std::min(begin + kChunk, now.size()), 16),
                                  [&](const auto& range) {
                                      for (std::size_t i = range.begin(); i < range.end(); ++i)
                                          fn(leaves_[static_cast<std::size_t>(now[i])],
                                             halos[i - begin], passed[i]);
                                  });
            };
            parallel([&](const BandLeaf& leaf, Halo& halo, unsigned&) { halo = gather(leaf); });
            parallel([&](BandLeaf& leaf, Halo& halo, unsigned& faces) {
                faces = solve(leaf, halo, first);
            });
        }
        return passed;
    }

    unsigned solve(BandLeaf& leaf, Halo& d, bool first) const {
        const Halo before = d;
        Given given{};
        for (int i = 0; i < 512; ++i)
            given[halo_index(i / 64, i / 8 % 8, i % 8)] = leaf.given[static_cast<std::size_t>(i)];
        unsigned order = 0, faces = 0;
        while (sweep(d, given, order)) // one without a change has seen that all is solved
            order = (order + 3) & 7;
        for (int i = 0; i < 512; ++i)
            leaf.d[static_cast<std::size_t>(i)] = d[halo_index(i / 64, i / 8 % 8, i % 8)];
        for (int face = 0; face < 6; ++face)
            for (int k = 0; k < 64; ++k) {
                const std::size_t at = layer(face, 0, k / 8, k % 8);
                const bool unknown = first && leaf.beside[static_cast<std::size_t>(face)] < 0;
                const bool news = (unknown || d[at] < before[at]) && d[at] + 0.5f < cap_;
                faces |= static_cast<unsigned>(news) << face;
            }
        return faces;
    }

    /// The leaves that the next round solves, new ones at the end.
    std::vector<std::int32_t> next(const std::vector<std::int32_t>& now,
                                   const std::vector<unsigned>& passed) {
        std::vector<std::int32_t> then;
        for (std::size_t i = 0; i < now.size(); ++i)
            for (int face = 0; face < 6; ++face)
                if (passed[i] >> face & 1)
                    then.push_back(beside(static_cast<std::size_t>(now[i]), face));
        std::sort(then.begin(), then.end());
        then.erase(std::unique(then.begin(), then.end()), then.end());
        return then;
    }

    std::int32_t beside(std::size_t from, int face) {
        const std::int32_t known = leaves_[from].beside[static_cast<std::size_t>(face)];
        if (known >= 0)
            return known;
        if (leaves_.size() == kMostLeaves)
            throw Error(Fault::unsupported,
                        "redistance: a band of " + rounded(static_cast<double>(cap_ - 1)) +
                            " voxels holds more than 2^22 leaves; use a larger voxel, or less "
                            "offset and blend");
        const auto made = static_cast<std::int32_t>(leaves_.size());
        BandLeaf leaf;
        leaf.origin = across(from, face);
        leaf.d.fill(cap_);
        const auto accessor = grid_.getConstAccessor();
        const Leaf* in = accessor.probeConstLeaf(leaf.origin);
        const bool all = accessor.getValue(leaf.origin) < 0;
        for (openvdb::Index i = 0; i < 512; ++i)
            leaf.negative[i] = in ? in->getValue(i) < 0 : all;
        link(leaf);
        leaves_.push_back(leaf);
        for (int f = 0; f < 6; ++f) {
            const std::int32_t b = find(across(leaves_.size() - 1, f));
            leaves_.back().beside[static_cast<std::size_t>(f)] = b;
            if (b >= 0)
                leaves_[static_cast<std::size_t>(b)].beside[static_cast<std::size_t>(f ^ 1)] = made;
        }
        return made;
    }

    const FloatGrid& grid_;
    float cap_;
    std::vector<BandLeaf> leaves_;
    std::unordered_map<Coord, std::int32_t, Hash> index_; // looked up only
};

/// The leaves that the band grows from. `widen` gives active voxels as they are, else those near
/// the surface are given.
std::vector<BandLeaf> sources(const FloatGrid& grid, double voxel_m, float cap, bool widen) {
    std::vector<const Leaf*> in;
    grid.tree().getNodes(in);
    std::vector<BandLeaf> all(in.size());
    const auto inverse = static_cast<float>(1 / voxel_m);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, in.size(), 16), [&](const auto& range) {
        const auto accessor = grid.getConstAccessor();
        for (std::size_t l = range.begin(); l < range.end(); ++l) {
            BandLeaf& leaf = all[l];
            leaf.origin = in[l]->origin();
            leaf.d.fill(cap);
            for (openvdb::Index i = 0; i < 512; ++i) {
                leaf.negative[i] = in[l]->getValue(i) < 0;
                if (widen && in[l]->isValueOn(i)) {
                    leaf.d[i] = std::fabs(in[l]->getValue(i) * inverse);
                    leaf.given[i] = true;
                }
            }
            if (widen)
                continue;
            Halo halo;
            for (int x = -1; x < 9; ++x)
                for (int y = -1; y < 9; ++y)
                    for (int z = -1; z < 9; ++z)
                        halo[halo_index(x, y, z)] =
                            accessor.getValue(leaf.origin.offsetBy(x, y, z)) * inverse;
            near_surface(halo, leaf);
        }
    });
    std::erase_if(all, [](const BandLeaf& leaf) { return leaf.given.none(); });
    return all;
}

FloatGrid::Ptr solved(const FloatGrid& grid, float half_width, bool widen, Progress* progress) {
    const Lattice lattice = lattice_of(grid);
    const float least = widen ? lattice.half_width_vox : 2;
    if (!(half_width >= least * 0.999f && half_width <= kWidestBand_vox))
        throw Error(Fault::bad_argument, "redistance: half_width_vox is " +
                                             rounded(static_cast<double>(half_width)) +
                                             ", must be " + rounded(static_cast<double>(least)) +
                                             "..1000; choose one in that range");
    openvdb::CoordBBox box;
    const Coord most(1 << 30);
    if (grid.tree().evalLeafBoundingBox(box) && !openvdb::CoordBBox(-most, most).isInside(box))
        throw Error(Fault::bad_argument, "grid '" + grid.getName() +
                                             "': it reaches beyond voxel 2^30; use a larger voxel, "
                                             "or move the solid nearer to the origin");
    Band band(grid, half_width);
    band.add(sources(grid, lattice.voxel_m, half_width + 1, widen));
    band.solve(progress);

    const auto voxel = static_cast<float>(lattice.voxel_m);
    auto out = FloatGrid::create(half_width * voxel);
    out->setTransform(grid.transform().copy());
    out->setGridClass(openvdb::GRID_LEVEL_SET);
    out->setName(grid.getName());
    const auto& leaves = band.leaves();
    std::vector<std::unique_ptr<Leaf>> made(leaves.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, made.size(), 64), [&](const auto& range) {
        const auto accessor = grid.getConstAccessor();
        for (std::size_t l = range.begin(); l < range.end(); ++l) {
            const BandLeaf& leaf = leaves[l];
            const Leaf* in = accessor.probeConstLeaf(leaf.origin);
            auto node = std::make_unique<Leaf>(leaf.origin, half_width * voxel, false);
            for (openvdb::Index i = 0; i < 512; ++i) {
                const float d = std::min(leaf.d[i], half_width) * voxel;
                const bool kept = widen && leaf.given[i]; // to the bit
                const float value = kept ? in->getValue(i) : leaf.negative[i] ? -d : d;
                if (leaf.d[i] < half_width)
                    node->setValueOn(i, value);
                else
                    node->setValueOff(i, value);
            }
            if (!node->getValueMask().isOff())
                made[l] = std::move(node);
        }
    });
    auto accessor = out->getAccessor();
    for (auto& node : made)
        if (node)
            accessor.addLeaf(node.release());
    openvdb::tools::signedFloodFill(out->tree(), true, 1, 1); // tiles: the side of what is beside
    return out;
}

} // namespace

FloatGrid::Ptr redistance(const FloatGrid& solid, float half_width_vox, Progress* progress) {
    return solved(solid, half_width_vox, false, progress);
}

FloatGrid::Ptr widen_band(const FloatGrid& solid, float half_width_vox, Progress* progress) {
    return solved(solid, half_width_vox, true, progress);
}

} // namespace taihu
