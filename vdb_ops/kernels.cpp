#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "vdb_ops/kernels_detail.h"

// Vectors go between functions that are always inlined: no call for an ABI to differ in.
#pragma GCC diagnostic ignored "-Wpsabi"
#define TAIHU_INLINE __attribute__((always_inline)) inline

namespace taihu {

constexpr float kMargin = 1e-3f; // voxels; distances are right to a fifth of that

// Eight voxels along z at a time; compilers split them where registers are shorter.
typedef float V8 __attribute__((vector_size(32)));
typedef std::int32_t Lanes __attribute__((vector_size(32)));
typedef float V16 __attribute__((vector_size(64)));
typedef double D8 __attribute__((vector_size(64)));

namespace {

constexpr V8 kZ = {0, 1, 2, 3, 4, 5, 6, 7}, kZero = {}, kOne = kZero + 1.f,
             kLast = kZero + 7.f;

TAIHU_INLINE V8 load(const float* p) {
    V8 v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

TAIHU_INLINE void store(float* p, const V8& v) {
    std::memcpy(p, &v, sizeof v);
}

/// Bit k is set where lane k is.
TAIHU_INLINE std::uint64_t bits_of(const Lanes& lanes) {
    typedef signed char Bytes __attribute__((vector_size(8)));
    const Bytes bytes = __builtin_convertvector(lanes, Bytes);
    std::uint64_t word;
    std::memcpy(&word, &bytes, sizeof word);
    return (word & 0x8040201008040201u) * 0x0101010101010101u >> 56;
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

} // namespace

TAIHU_CLONES
void subtract_balls(const LeafBall* balls, const std::uint32_t* begin, const std::uint32_t* end,
                    const int* leaf, float least, float* values) {
    for (; begin != end; ++begin) {
        const LeafBall& ball = balls[*begin];
        const float cx = ball.x - static_cast<float>(leaf[0]),
                    cy = ball.y - static_cast<float>(leaf[1]),
                    cz = ball.z - static_cast<float>(leaf[2]), r = ball.r;
        const V8 dx = kZ - cx, dy = kZ - cy, dz = kZ - cz, dx2 = dx * dx, dy2 = dy * dy,
                 z2 = dz * dz;
        float yz2[64];
        for (int y = 0; y < 8; ++y)
            store(yz2 + 8 * y, z2 + dy2[y]);
        // Only rows that can gain by it. The margin is beyond what rounding does: leaving a row out
        // changes no bit.
        const float reach = r - least + kMargin;
        V8 rest = reach * reach - dx2, reach_y;
        const Lanes empty = rest < kZero;
        rest = empty ? kZero : rest;
        for (int x = 0; x < 8; ++x)
            reach_y[x] = std::sqrt(rest[x]);
        V8 from = cy - reach_y, to = cy + reach_y;
        from = from < kZero ? kZero : from;
        to = to > kLast ? kLast : to;
        Lanes y0 = __builtin_convertvector(from, Lanes), y1 = __builtin_convertvector(to, Lanes);
        y0 -= __builtin_convertvector(y0, V8) < from; // rounded up
        y1 = empty ? Lanes{} - 1 : y1;
        for (int x = 0; x < 8; ++x) {
            float* slab = values + x * 64;
            for (int y = y0[x] & ~1; y <= y1[x]; y += 2) { // two rows at a time
                V16 d, old;
                std::memcpy(&d, yz2 + 8 * y, sizeof d);
                std::memcpy(&old, slab + 8 * y, sizeof old);
                d += dx2[x];
                for (int i = 0; i < 16; ++i)
                    d[i] = std::sqrt(d[i]);
                d = r - d;
                d = d > old ? d : old;
                std::memcpy(slab + 8 * y, &d, sizeof d);
            }
        }
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
        for (int k = 0; k < 3; ++k)
            for (int c = 0; c < 3; ++c)
                q[k][c] = origin[c] - t.corner[k][c];
        for (int c = 0; c < 3; ++c) {
            lo[c] = static_cast<float>(-std::max({q[0][c], q[1][c], q[2][c]}));
            hi[c] = static_cast<float>(-std::min({q[0][c], q[1][c], q[2][c]}));
        }
        for (int k = 0; k < 3; ++k) {
            double along = 0, side = 0, e2 = 0, e[3];
            for (int c = 0; c < 3; ++c) {
                e[c] = q[k][c] - q[(k + 1) % 3][c];
                e2 += e[c] * e[c];
                along += e[c] * q[k][c];
                side += t.en[k][c] * q[k][c];
            }
            const double u = e2 > 0 ? along / e2 : 0, clamped = std::clamp(u, 0.0, 1.0);
            for (int c = 0; c < 3; ++c)
                foot[k][c] = static_cast<float>(e[c] * clamped - q[k][c]);
            u_foot[k] = static_cast<float>(clamped);
            u_first[k] = static_cast<float>(u - clamped);
            side0[k] = static_cast<float>(side);
        }
        const auto plane0 =
            static_cast<float>(t.n[0] * q[0][0] + t.n[1] * q[0][1] + t.n[2] * q[0][2]);
        const float n[3] = {static_cast<float>(t.n[0]), static_cast<float>(t.n[1]),
                            static_cast<float>(t.n[2])};
        const V8 below = lo[2] - kZ, above = kZ - hi[2];
        V8 box_z = below > above ? below : above;
        box_z = box_z > kZero ? box_z : kZero;
        const V8 box_z2 = box_z * box_z;
        const int x0 = static_cast<int>(std::ceil(std::clamp(lo[0] - half_width, 0.f, 8.f)));
        const int x1 = static_cast<int>(std::floor(std::clamp(hi[0] + half_width, -1.f, 7.f)));
        const int y0 = static_cast<int>(std::ceil(std::clamp(lo[1] - half_width, 0.f, 8.f)));
        const int y1 = static_cast<int>(std::floor(std::clamp(hi[1] + half_width, -1.f, 7.f)));
        for (int x = x0; x <= x1; ++x) {
            const auto fx = static_cast<float>(x);
            const float dx = std::max({lo[0] - fx, fx - hi[0], 0.f});
            for (int y = y0; y <= y1; ++y) {
                const auto fy = static_cast<float>(y);
                const float dy = std::max({lo[1] - fy, fy - hi[1], 0.f});
                float* row = squared + x * 64 + y * 8;
                V8 old;
                std::memcpy(&old, row, sizeof old);
                // A row that the box and the plane of the face already rule out costs no more.
                const V8 plane = (plane0 + n[0] * fx + n[1] * fy) + n[2] * kZ;
                const V8 plane2 = plane * plane;
                V8 bound = (dx * dx + dy * dy) + box_z2;
                bound = bound > plane2 ? bound : plane2;
                typedef std::int64_t Quads __attribute__((vector_size(32)));
                const Quads nearer = (Quads)(bound < old);
                if ((nearer[0] | nearer[1] | nearer[2] | nearer[3]) == 0)
                    continue;
                V8 best = kZero + 1e30f, inside = best;
                for (int k = 0; k < 3; ++k) {
                    const V8 side =
                        (side0[k] + t.en[k][0] * fx + t.en[k][1] * fy) + t.en[k][2] * kZ;
                    inside = side < inside ? side : inside;
                    // How far along the edge from the first voxel's foot, in lengths of the edge.
                    const float ie2 = t.inverse_e2[k];
                    V8 u = (u_first[k] + (t.e[k][0] * fx + t.e[k][1] * fy) * ie2) +
                           (t.e[k][2] * ie2) * kZ;
                    const V8 from = kZero - u_foot[k], to = kOne - u_foot[k];
                    u = u < from ? from : u;
                    u = u > to ? to : u;
                    const V8 ex = t.e[k][0] * u + (foot[k][0] - fx),
                             ey = t.e[k][1] * u + (foot[k][1] - fy),
                             ez = t.e[k][2] * u + (foot[k][2] - kZ);
                    const V8 d = ex * ex + ey * ey + ez * ez;
                    best = d < best ? d : best;
                }
                best = inside > kZero ? plane2 : best;
                if (winding)
                    for (int z = 0; z < 8; ++z) {
                        const int w = winding[x * 64 + y * 8 + z];
                        if ((w > 0 && plane[z] > 0) || (w < 0 && plane[z] < 0) || std::abs(w) > 1)
                            best[z] = 1e30f;
                    }
                best = best < old ? best : old;
                std::memcpy(row, &best, sizeof best);
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
LeafBits to_band(const float* values, float voxel, float background, float* out) {
    LeafBits bits{};
    for (int i = 0; i < 64; ++i) {
        const V8 v = load(values + 8 * i) * voxel;
        const Lanes band = below(v, background);
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
