#include <algorithm>
#include <cmath>

#include "vdb_ops/kernels_detail.h"
#include "vdb_ops/solid_kernels_detail.h"

namespace taihu {
namespace {

constexpr int kRow = 8;
constexpr int kBatch = 4 * kRow; // lanes at a time: divisions and roots then overlap

// Kept in line, so that each of the versions compiled below gets its own.
#define TAIHU_INLINE inline __attribute__((always_inline))

/// d[i] = distance(x[i], y[i], z[i]), without branches, so that it runs on all lanes at once.
template <int kLanes, class Distance>
TAIHU_INLINE void each(const double* x, const double* y, const double* z, double* d,
                       Distance&& distance) {
    for (int i = 0; i < kLanes; ++i)
        d[i] = distance(x[i], y[i], z[i]);
}

/// The nearest point is y_i = a_i^2 q_i / (t + a_i^2), where t, the multiplier of Lagrange, solves
/// sum (a_i q_i / (t + a_i^2))^2 = 1, and the distance is t sqrt(sum (q_i / (t + a_i^2))^2).
/// Newton's method on 1 / sqrt(sum) = 1, which is concave in t: from anywhere it steps to the left
/// of the root, from there it climbs and never passes it (as the trust region step of More and
/// Sorensen, from memory, unchecked). `least` is on the left: one term alone makes the sum 1.
/// With t = `shifted` - 1 and shortest axis 1, nothing cancels at the end of the range.
template <int kLanes>
TAIHU_INLINE void ellipsoid_distances(const double* a, const double* x, const double* y,
                                      const double* z, double* d) {
    constexpr int kMostSteps = 40; // axes 1 : 1e5 took at most 20
    constexpr double kLeast = 1e-12;
    const double k0 = (a[0] - 1) * (a[0] + 1), k1 = (a[1] - 1) * (a[1] + 1),
                 k2 = (a[2] - 1) * (a[2] + 1);
    const double scale = 1 / a[3];
    // In the middle plane of the shortest axis the root may be at the end of the range; a point
    // beside the plane leads to the same distance.
    const double lift0 = a[0] == 1 ? kLeast : 0, lift1 = a[1] == 1 ? kLeast : 0,
                 lift2 = a[2] == 1 ? kLeast : 0;
    double q0[kLanes], q1[kLanes], q2[kLanes], least[kLanes], shifted[kLanes], rest[kLanes];
    for (int i = 0; i < kLanes; ++i) {
        q0[i] = std::max(std::fabs(x[i]) * scale, lift0);
        q1[i] = std::max(std::fabs(y[i]) * scale, lift1);
        q2[i] = std::max(std::fabs(z[i]) * scale, lift2);
        least[i] = std::max(std::max(a[0] * q0[i] - k0, a[1] * q1[i] - k1), a[2] * q2[i] - k2);
        shifted[i] = std::max(least[i], 1.0); // near the surface t is small
    }
    for (int step = 0; step < kMostSteps; ++step) {
        for (int i = 0; i < kLanes; ++i) {
            const double d0 = shifted[i] + k0, d1 = shifted[i] + k1, d2 = shifted[i] + k2;
            const double all = 1 / (d0 * d1 * d2);
            const double r0 = d1 * d2 * all, r1 = d0 * d2 * all, r2 = d0 * d1 * all;
            const double v0 = a[0] * q0[i] * r0, v1 = a[1] * q1[i] * r1, v2 = a[2] * q2[i] * r2;
            const double w0 = v0 * v0, w1 = v1 * v1, w2 = v2 * v2, s = w0 + w1 + w2;
            const double to = shifted[i] + s * (std::sqrt(s) - 1) / (w0 * r0 + w1 * r1 + w2 * r2);
            const double next = std::max(to, least[i]);
            rest[i] = std::fabs(next - shifted[i]) - 1e-4 * next; // it converges quadratically
            shifted[i] = next;
        }
        if (std::none_of(rest, rest + kLanes, [](double r) { return r > 0; }))
            break;
    }
    for (int i = 0; i < kLanes; ++i) {
        const double v0 = q0[i] / (shifted[i] + k0), v1 = q1[i] / (shifted[i] + k1),
                     v2 = q2[i] / (shifted[i] + k2);
        d[i] = (shifted[i] - 1) * std::sqrt(v0 * v0 + v1 * v1 + v2 * v2) * a[3];
    }
}

/// To the slant and to the cap on the point's own side of the middle: the other cap is never
/// nearer than the slant.
TAIHU_INLINE double cone_distance(double rho, double y, double bottom, double top, double half) {
    const double out = rho - std::min(rho, y < 0 ? bottom : top), up = std::fabs(y) - half;
    const double run = top - bottom, rise = 2 * half;
    const double along =
        std::clamp(((top - rho) * run + (half - y) * rise) / (run * run + rise * rise), 0.0, 1.0);
    const double sx = rho - top + run * along, sy = y - half + rise * along;
    const double d = std::sqrt(std::min(out * out + up * up, sx * sx + sy * sy));
    return sx < 0 && up < 0 ? -d : d;
}

/// At points in the solid's own frame.
template <int kLanes>
TAIHU_INLINE void distances(const VoxelSolid& s, const double* x, const double* y, const double* z,
                            double* d) {
    using Kind = VoxelSolid::Kind;
    const double *a = s.size, round = s.round;
    switch (s.kind) {
    case Kind::ball:
        each<kLanes>(x, y, z, d, [a](double px, double py, double pz) {
            return std::sqrt(px * px + py * py + pz * pz) - a[0];
        });
        return;
    case Kind::ellipsoid:
        ellipsoid_distances<kLanes>(a, x, y, z, d);
        return;
    case Kind::box:
        each<kLanes>(x, y, z, d, [a, round](double px, double py, double pz) {
            const double qx = std::fabs(px) - a[0], qy = std::fabs(py) - a[1],
                         qz = std::fabs(pz) - a[2];
            const double ox = std::max(qx, 0.0), oy = std::max(qy, 0.0), oz = std::max(qz, 0.0);
            return std::sqrt(ox * ox + oy * oy + oz * oz) +
                   std::min(std::max(std::max(qx, qy), qz), 0.0) - round;
        });
        return;
    case Kind::cylinder:
        each<kLanes>(x, y, z, d, [a, round](double px, double py, double pz) {
            const double side = std::sqrt(px * px + pz * pz) - a[0], cap = std::fabs(py) - a[1];
            const double os = std::max(side, 0.0), oc = std::max(cap, 0.0);
            return std::sqrt(os * os + oc * oc) + std::min(std::max(side, cap), 0.0) - round;
        });
        return;
    case Kind::cone:
        each<kLanes>(x, y, z, d, [a](double px, double py, double pz) {
            return cone_distance(std::sqrt(px * px + pz * pz), py, a[0], a[1], a[2]);
        });
        return;
    case Kind::capsule:
        each<kLanes>(x, y, z, d, [a](double px, double py, double pz) {
            const double up = std::max(std::fabs(py) - a[1], 0.0);
            return std::sqrt(px * px + up * up + pz * pz) - a[0];
        });
        return;
    case Kind::torus:
        each<kLanes>(x, y, z, d, [a](double px, double py, double pz) {
            const double out = std::sqrt(px * px + pz * pz) - a[0];
            return std::sqrt(out * out + py * py) - a[1];
        });
        return;
    case Kind::half_space:
        break;
    }
    std::copy(y, y + kLanes, d);
}

/// The points at `first` [voxels], then `step` apart along z, in the solid's own frame.
template <int kLanes>
TAIHU_INLINE void make_row(const VoxelSolid& s, const double* first, double step, double* x,
                           double* y, double* z) {
    const double q[3] = {first[0] - s.center[0], first[1] - s.center[1], first[2] - s.center[2]};
    double* const to[3] = {x, y, z};
    for (int k = 0; k < 3; ++k) {
        const double* t = s.turn[k];
        const double begin = t[0] * q[0] + t[1] * q[1] + t[2] * q[2], by = t[2] * step;
        for (int i = 0; i < kLanes; ++i)
            to[k][i] = begin + by * i;
    }
}

/// Rows of a leaf that are near a solid, taken several at a time.
struct Batch {
    double x[kBatch] = {}, y[kBatch] = {}, z[kBatch] = {};
    float* row[kBatch / kRow];
    int n = 0;
};

TAIHU_INLINE void flush(const VoxelSolid& solid, Batch& batch) {
    double d[kBatch];
    distances<kBatch>(solid, batch.x, batch.y, batch.z, d);
    for (int r = 0; r < batch.n; ++r)
        for (int k = 0; k < kRow; ++k)
            batch.row[r][k] = std::min(batch.row[r][k], static_cast<float>(d[r * kRow + k]));
    batch.n = 0;
}

} // namespace

TAIHU_CLONES
void solid_row(const VoxelSolid& solid, const double* first, double step, double* out) {
    double x[kRow], y[kRow], z[kRow];
    make_row<kRow>(solid, first, step, x, y, z);
    distances<kRow>(solid, x, y, z, out);
}

double solid_distance(const VoxelSolid& solid, const double* point) {
    double x, y, z, d;
    make_row<1>(solid, point, 0, &x, &y, &z);
    distances<1>(solid, &x, &y, &z, &d);
    return d;
}

TAIHU_CLONES
void min_solid(const VoxelSolid& solid, const int* leaf, double half_width, float* values) {
    int lo[2], hi[2];
    for (int c = 0; c < 2; ++c) {
        const double from = solid.lo[c] - half_width - leaf[c],
                     to = solid.hi[c] + half_width - leaf[c];
        lo[c] = static_cast<int>(std::ceil(std::clamp(from, 0.0, 8.0)));
        hi[c] = static_cast<int>(std::floor(std::clamp(to, -1.0, 7.0)));
    }
    // An ellipsoid with its band lies in one of semi axes^2 (1 + w / m) a^2 + (1 + m / w) w^2, for
    // any m: most rows of the box miss it.
    const bool is_ellipsoid = solid.kind == VoxelSolid::Kind::ellipsoid;
    double inverse2[3] = {};
    if (is_ellipsoid) {
        const double m = solid.size[3] * std::cbrt(solid.size[0] * solid.size[1] * solid.size[2]);
        for (int k = 0; k < 3; ++k) {
            const double a = solid.size[k] * solid.size[3];
            inverse2[k] = 1 / ((1 + half_width / m) * a * a + (half_width + m) * half_width);
        }
    }
    Batch batch;
    for (int i = lo[0]; i <= hi[0]; ++i)
        for (int j = lo[1]; j <= hi[1]; ++j) {
            const double first[3] = {leaf[0] + double(i), leaf[1] + double(j), double(leaf[2])};
            double *x = batch.x + batch.n * kRow, *y = batch.y + batch.n * kRow,
                   *z = batch.z + batch.n * kRow;
            make_row<kRow>(solid, first, 1, x, y, z);
            double nearest = 0;
            for (int k = 0; k < kRow && is_ellipsoid; ++k) {
                const double level = x[k] * x[k] * inverse2[0] + y[k] * y[k] * inverse2[1] +
                                     z[k] * z[k] * inverse2[2];
                nearest = k == 0 ? level : std::min(nearest, level);
            }
            if (nearest > 1)
                continue;
            batch.row[batch.n++] = values + i * 64 + j * 8;
            if (batch.n == kBatch / kRow)
                flush(solid, batch);
        }
    if (batch.n > 0)
        flush(solid, batch);
}

} // namespace taihu
