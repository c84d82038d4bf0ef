#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "vdb_ops/kernels_detail.h"

namespace taihu {

TAIHU_CLONES
void min_balls(const LeafBall* balls, std::size_t n, float half_width, float* values) {
    for (std::size_t i = 0; i < n; ++i) {
        const LeafBall ball = balls[i];
        const float reach = ball.r + half_width, reach2 = reach * reach;
        float z2[8];
        for (int z = 0; z < 8; ++z) {
            const float dz = static_cast<float>(z) - ball.z;
            z2[z] = dz * dz;
        }
        // Only rows that the ball's band meets: ranges instead of a branch per row.
        const int x0 = static_cast<int>(std::ceil(std::max(0.f, ball.x - reach)));
        const int x1 = static_cast<int>(std::floor(std::min(7.f, ball.x + reach)));
        for (int x = x0; x <= x1; ++x) {
            const float dx = static_cast<float>(x) - ball.x, dx2 = dx * dx;
            const float reach_y = std::sqrt(std::max(0.f, reach2 - dx2));
            const int y0 = static_cast<int>(std::ceil(std::max(0.f, ball.y - reach_y)));
            const int y1 = static_cast<int>(std::floor(std::min(7.f, ball.y + reach_y)));
            for (int y = y0; y <= y1; ++y) {
                const float dy = static_cast<float>(y) - ball.y, xy2 = dx2 + dy * dy;
                float* __restrict row = values + x * 64 + y * 8;
                for (int z = 0; z < 8; ++z) {
                    const float d = std::sqrt(xy2 + z2[z]) - ball.r;
                    row[z] = d < row[z] ? d : row[z];
                }
            }
        }
    }
}

// Eight voxels along z at a time; compilers split them where registers are shorter.
typedef float V8 __attribute__((vector_size(32)));
typedef std::int64_t Lanes __attribute__((vector_size(32)));

TAIHU_CLONES
void min_triangles(const LeafTriangle* all, const std::uint32_t* begin, const std::uint32_t* end,
                   const int* origin, float half_width, const std::int8_t* winding,
                   float* squared) {
    constexpr V8 kZ = {0, 1, 2, 3, 4, 5, 6, 7}, kZero = {}, kOne = kZero + 1.f;
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
                const Lanes nearer = (Lanes)(bound < old);
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
std::uint64_t band_bits(const float* values, float half_width) {
    std::uint64_t bits = 0;
    for (int i = 0; i < 64; ++i)
        bits |= std::uint64_t{std::fabs(values[i]) < half_width} << i;
    return bits;
}

TAIHU_CLONES
void scale_values(const float* values, float scale, float* out) {
    for (int i = 0; i < 512; ++i)
        out[i] = values[i] * scale;
}

} // namespace taihu
