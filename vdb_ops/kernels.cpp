#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "vdb_ops/kernels_detail.h"

// Vectors go between functions that are always inlined: no call for an ABI to differ in.
#pragma GCC diagnostic ignored "-Wpsabi"
#define TAIHU_INLINE __attribute__((always_inline)) inline

namespace taihu {

constexpr float kOnSurface = 1e-5f; // voxels; distances carry errors of about 2e-6
constexpr float kMargin = 1e-3f;    // voxels; distances are right to a fifth of that

// Eight voxels along z at a time; compilers split them where registers are shorter.
typedef float V8 __attribute__((vector_size(32)));
typedef float V4 __attribute__((vector_size(16)));
typedef std::int32_t Lanes __attribute__((vector_size(32)));
typedef float V16 __attribute__((vector_size(64))); // two rows, y and y + 1
typedef std::int32_t PairLanes __attribute__((vector_size(64)));
typedef double D8 __attribute__((vector_size(64)));

namespace {

constexpr V8 kZ = {0, 1, 2, 3, 4, 5, 6, 7}, kZero = {}, kOne = kZero + 1.f;
constexpr V8 kPieceY = {0, 0, 2, 2, 4, 4, 6, 6}, kPieceZ = {0, 4, 0, 4, 0, 4, 0, 4};
constexpr Lanes kSecond = {0, 0, 0, 0, -1, -1, -1, -1};
constexpr V16 kPairZ = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7},
              kPairY = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1}, kNone16 = {};

TAIHU_INLINE V8 load(const float* p) {
    V8 v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

TAIHU_INLINE void store(float* p, const V8& v) {
    std::memcpy(p, &v, sizeof v);
}

TAIHU_INLINE V16 load_pair(const float* p) {
    V16 v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

TAIHU_INLINE void store_pair(float* p, const V16& v) {
    std::memcpy(p, &v, sizeof v);
}

/// Half a row each of two rows, one below the other.
TAIHU_INLINE V8 load_halves(const float* p) {
    V4 a, b;
    std::memcpy(&a, p, sizeof a);
    std::memcpy(&b, p + 8, sizeof b);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}

TAIHU_INLINE void store_halves(float* p, const V8& v) {
    const V4 a = __builtin_shufflevector(v, v, 0, 1, 2, 3),
             b = __builtin_shufflevector(v, v, 4, 5, 6, 7);
    std::memcpy(p, &a, sizeof a);
    std::memcpy(p + 8, &b, sizeof b);
}

/// How far c lies outside of [lo, hi].
TAIHU_INLINE V8 outside(const V8& lo, const V8& hi, float c) {
    const V8 below = lo - c, above = c - hi, out = below > above ? below : above;
    return out > kZero ? out : kZero;
}

/// How far v lies outside of [lo, hi].
TAIHU_INLINE V16 beyond(const V16& v, float lo, float hi) {
    const V16 below = lo - v, above = v - hi, out = below > above ? below : above;
    return out > kNone16 ? out : kNone16;
}

TAIHU_INLINE bool any(const PairLanes& lanes) {
    typedef signed char Bytes __attribute__((vector_size(16)));
    const Bytes bytes = __builtin_convertvector(lanes, Bytes);
    std::uint64_t words[2];
    std::memcpy(words, &bytes, sizeof words);
    return (words[0] | words[1]) != 0;
}

/// The lowest byte of each lane.
TAIHU_INLINE std::uint64_t bytes_of(const Lanes& lanes) {
    typedef signed char Bytes __attribute__((vector_size(8)));
    const Bytes bytes = __builtin_convertvector(lanes, Bytes);
    std::uint64_t word;
    std::memcpy(&word, &bytes, sizeof word);
    return word;
}

/// Bit k is set where lane k is.
TAIHU_INLINE std::uint64_t bits_of(const Lanes& lanes) {
    return (bytes_of(lanes) & 0x8040201008040201u) * 0x0101010101010101u >> 56;
}

/// Lane k is set where bit k of row `i` of the leaf is.
TAIHU_INLINE Lanes lanes_of(const LeafBits& bits, int i) {
    constexpr Lanes kBit = {1, 2, 4, 8, 16, 32, 64, 128};
    return (kBit & static_cast<std::int32_t>(bits.word[i / 8] >> i % 8 * 8 & 255)) != 0;
}

TAIHU_INLINE Lanes below(const V8& v, float limit) {
    return (v < limit) & (v > -limit);
}

/// v in the band, +-limit elsewhere.
TAIHU_INLINE V8 hold(const V8& v, const Lanes& band, float limit) {
    const V8 side = v < kZero ? kZero - limit : kZero + limit;
    return band ? v : side;
}

/// A ball's squared distances from the voxels of a leaf: those along x, and along y and z together.
struct BallLeaf {
    float r;
    V8 dx2, dy2, z2;
};

/// values = max(values, r - distance) over the leaf.
TAIHU_INLINE void subtract_everywhere(const BallLeaf& ball, float* values) {
    float yz2[64];
    for (int y = 0; y < 8; ++y)
        store(yz2 + 8 * y, ball.z2 + ball.dy2[y]);
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; y += 2) {
            float* pair = values + 64 * x + 8 * y;
            const V16 old = load_pair(pair);
            V16 d = load_pair(yz2 + 8 * y) + ball.dx2[x];
            for (int k = 0; k < 16; ++k)
                d[k] = std::sqrt(d[k]);
            d = ball.r - d;
            store_pair(pair, d > old ? d : old);
        }
}

/// The same in the pieces of the leaf whose bit is set: 8 * piece + x. A piece is the lower or the
/// upper half of two rows, as in kPieceY and kPieceZ.
TAIHU_INLINE void subtract_in(std::uint64_t pieces, const BallLeaf& ball, float* values) {
    float yz2[64];
    for (int i = 0; i < 4; ++i) {
        const V8 first = kZero + ball.dy2[2 * i], second = kZero + ball.dy2[2 * i + 1],
                 y2 = kSecond ? second : first;
        const V8 &z2 = ball.z2, lower = __builtin_shufflevector(z2, z2, 0, 1, 2, 3, 0, 1, 2, 3),
                 upper = __builtin_shufflevector(z2, z2, 4, 5, 6, 7, 4, 5, 6, 7);
        store(yz2 + 16 * i, lower + y2);
        store(yz2 + 16 * i + 8, upper + y2);
    }
    for (; pieces != 0; pieces &= pieces - 1) {
        const int i = std::countr_zero(pieces), piece = i / 8, x = i % 8;
        float* at = values + 64 * x + piece / 2 * 16 + piece % 2 * 4;
        const V8 old = load_halves(at);
        V8 d = load(yz2 + 8 * piece) + ball.dx2[x];
        for (int k = 0; k < 8; ++k)
            d[k] = std::sqrt(d[k]);
        d = ball.r - d;
        store_halves(at, d > old ? d : old);
    }
}

} // namespace

TAIHU_CLONES
void subtract_balls(const LeafBall* balls, const std::uint32_t* begin, const std::uint32_t* end,
                    const int* leaf, float least, float* values) {
    for (; begin != end; ++begin) {
        const LeafBall& ball = balls[*begin];
        const float cx = ball.x - static_cast<float>(leaf[0]),
                    cy = ball.y - static_cast<float>(leaf[1]),
                    cz = ball.z - static_cast<float>(leaf[2]), r = ball.r;
        const V8 dx = kZ - cx, dy = kZ - cy, dz = kZ - cz;
        const BallLeaf in_leaf{r, dx * dx, dy * dy, dz * dz};
        // Small balls reach little of a leaf. A piece counts if its voxel nearest to the ball may
        // gain by it; the margin is beyond what rounding does: leaving one out changes no bit.
        const float reach = r - least + kMargin, reach2 = reach > 0 ? reach * reach : 0;
        const V8 off_y = outside(kPieceY, kPieceY + 1.f, cy),
                 off_z = outside(kPieceZ, kPieceZ + 3.f, cz), near2 = off_y * off_y + off_z * off_z;
        Lanes bits = {};
        for (int x = 0; x < 8; ++x)
            bits |= (near2 + in_leaf.dx2[x] < reach2) & 1 << x;
        const std::uint64_t pieces = bytes_of(bits);
        if (~pieces == 0)
            subtract_everywhere(in_leaf, values);
        else
            subtract_in(pieces, in_leaf, values);
    }
}

TAIHU_CLONES
void min_triangles(const LeafTriangle* all, const std::uint32_t* begin, const std::uint32_t* end,
                   const int* origin, float half_width, const std::int8_t* winding,
                   float* squared) {
    for (; begin != end; ++begin) {
        const LeafTriangle& t = all[*begin];
        // Everything below is relative to the leaf's first voxel. Feet of that voxel on the edges
        // are found in double, so that floats only hold what is small: no error grows with the
        // triangle.
        double q[3][3]; // corner k to the first voxel
        float lo[3], hi[3], foot[3][3], u_foot[3], u_first[3], side0[3];
        const int n_edges = winding ? 3 : t.n_edges;
        for (int k = 0; k < 3; ++k)
            for (int c = 0; c < 3; ++c)
                q[k][c] = origin[c] - t.corner[k][c];
        for (int c = 0; c < 3; ++c) {
            lo[c] = static_cast<float>(-std::max(std::max(q[0][c], q[1][c]), q[2][c]));
            hi[c] = static_cast<float>(-std::min(std::min(q[0][c], q[1][c]), q[2][c]));
        }
        for (int k = 0; k < 3; ++k)
            side0[k] = static_cast<float>(t.en[k][0] * q[k][0] + t.en[k][1] * q[k][1] +
                                          t.en[k][2] * q[k][2]);
        for (int k = 0; k < n_edges; ++k) {
            double along = 0, e2 = 0, e[3];
            for (int c = 0; c < 3; ++c) {
                e[c] = q[k][c] - q[(k + 1) % 3][c];
                e2 += e[c] * e[c];
                along += e[c] * q[k][c];
            }
            const double u = e2 > 0 ? along / e2 : 0, clamped = std::min(std::max(u, 0.0), 1.0);
            for (int c = 0; c < 3; ++c)
                foot[k][c] = static_cast<float>(e[c] * clamped - q[k][c]);
            u_foot[k] = static_cast<float>(clamped);
            u_first[k] = static_cast<float>(u - clamped);
        }
        const auto plane0 =
            static_cast<float>(t.n[0] * q[0][0] + t.n[1] * q[0][1] + t.n[2] * q[0][2]);
        const float n[3] = {static_cast<float>(t.n[0]), static_cast<float>(t.n[1]),
                            static_cast<float>(t.n[2])};
        const V16 box_z = beyond(kPairZ, lo[2], hi[2]), box_z2 = box_z * box_z;
        // What is linear over a pair of rows: a number for its first voxel, and these.
        const V16 plane_yz = n[1] * kPairY + n[2] * kPairZ;
        V16 side_yz[3], u_yz[3];
        for (int k = 0; k < 3; ++k)
            side_yz[k] = t.en[k][1] * kPairY + t.en[k][2] * kPairZ;
        for (int k = 0; k < n_edges; ++k)
            u_yz[k] = (t.e[k][1] * kPairY + t.e[k][2] * kPairZ) * t.inverse_e2[k];
        const int x0 = static_cast<int>(std::ceil(std::clamp(lo[0] - half_width, 0.f, 8.f)));
        const int x1 = static_cast<int>(std::floor(std::clamp(hi[0] + half_width, -1.f, 7.f)));
        const int y0 = static_cast<int>(std::clamp(lo[1] - half_width, 0.f, 8.f));
        const int y1 = static_cast<int>(std::floor(std::clamp(hi[1] + half_width, -1.f, 7.f)));
        for (int x = x0; x <= x1; ++x) {
            const auto fx = static_cast<float>(x);
            const float dx = std::max({lo[0] - fx, fx - hi[0], 0.f});
            for (int y = y0 & ~1; y <= y1; y += 2) {
                const auto fy = static_cast<float>(y);
                float* pair = squared + x * 64 + y * 8;
                const V16 old = load_pair(pair);
                // A pair that the box and the plane of the face already rule out costs no more.
                const V16 plane = (plane0 + n[0] * fx + n[1] * fy) + plane_yz;
                const V16 plane2 = plane * plane, dy = beyond(fy + kPairY, lo[1], hi[1]);
                V16 bound = (dx * dx + dy * dy) + box_z2;
                bound = bound > plane2 ? bound : plane2;
                if (!any(bound < old))
                    continue;
                V16 best = kNone16 + 1e30f, inside = best;
                for (int k = 0; k < 3; ++k) {
                    const V16 side = (side0[k] + t.en[k][0] * fx + t.en[k][1] * fy) + side_yz[k];
                    inside = side < inside ? side : inside;
                }
                for (int k = 0; k < n_edges; ++k) {
                    // How far along the edge from the first voxel's foot, in lengths of the edge.
                    V16 u = (u_first[k] + (t.e[k][0] * fx + t.e[k][1] * fy) * t.inverse_e2[k]) +
                            u_yz[k];
                    const float from = -u_foot[k], to = 1 - u_foot[k];
                    u = u < from ? kNone16 + from : u;
                    u = u > to ? kNone16 + to : u;
                    const V16 ex = t.e[k][0] * u + (foot[k][0] - fx),
                              ey = t.e[k][1] * u + ((foot[k][1] - fy) - kPairY),
                              ez = t.e[k][2] * u + (foot[k][2] - kPairZ);
                    const V16 d = ex * ex + ey * ey + ez * ez;
                    best = d < best ? d : best;
                }
                best = inside > kNone16 ? plane2 : best;
                if (winding)
                    for (int i = 0; i < 16; ++i) {
                        const int w = winding[x * 64 + y * 8 + i];
                        if ((w > 0 && plane[i] > 0) || (w < 0 && plane[i] < 0) || std::abs(w) > 1)
                            best[i] = 1e30f;
                    }
                store_pair(pair, best < old ? best : old);
            }
        }
    }
}

TAIHU_CLONES
void subtract_values(const float* a, const float* b, float* out) {
    for (int i = 0; i < 512; ++i)
        out[i] = a[i] > -b[i] ? a[i] : -b[i];
}

TAIHU_CLONES
void signed_roots(const float* squared, const std::int8_t* winding, float* out) {
    for (int i = 0; i < 512; ++i) {
        // Voxels on the surface all take one side, whatever the last bit says: crumbs otherwise.
        const float d = std::sqrt(squared[i]), held = d < kOnSurface ? 0 : d;
        out[i] = winding[i] != 0 ? 0 - held : held;
    }
}

TAIHU_CLONES
LeafBits to_band(const float* values, float half_width, float voxel, float background, float* out) {
    LeafBits bits{};
    for (int i = 0; i < 64; ++i) {
        const V8 in = load(values + 8 * i), v = in * voxel;
        const Lanes band = below(in, half_width) & below(v, background);
        store(out + 8 * i, hold(v, band, background));
        bits.word[i / 8] |= bits_of(band) << i % 8 * 8;
    }
    return bits;
}

TAIHU_CLONES
LeafBits copy_band(const float* values, const LeafBits& active, float background, float* out) {
    LeafBits bits{};
    for (int i = 0; i < 64; ++i) {
        const V8 v = load(values + 8 * i);
        const Lanes band = lanes_of(active, i) & below(v, background);
        store(out + 8 * i, hold(v, band, background));
        bits.word[i / 8] |= bits_of(band) << i % 8 * 8;
    }
    return bits;
}

TAIHU_CLONES
void take_values(const float* values, const LeafBits& active, float half_width, float inverse_voxel,
                 float* out) {
    for (int i = 0; i < 64; ++i) {
        const V8 v = load(values + 8 * i) * inverse_voxel;
        store(out + 8 * i, hold(v, lanes_of(active, i) & below(v, half_width), half_width));
    }
}

namespace {

/// Share of a tent of half width 1 about `d` that lies below 0.
TAIHU_INLINE V8 inside_share(const V8& d) {
    V8 rest = d < kZero ? kOne + d : kOne - d;
    rest = rest > kZero ? rest : kZero;
    const V8 half = 0.5f * rest * rest;
    return d > kZero ? half : kOne - half;
}

} // namespace

TAIHU_CLONES
double inside_voxels(const float* values, float inverse_voxel) {
    D8 sum = {};
    for (int i = 0; i < 64; ++i) {
        const V8 d = load(values + 8 * i) * inverse_voxel;
        sum += __builtin_convertvector(4 * inside_share(d) - inside_share(0.5f * d), D8);
    }
    return (((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]))) / 3;
}

} // namespace taihu
