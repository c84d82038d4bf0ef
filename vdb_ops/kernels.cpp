#include <algorithm>
#include <cmath>
#include <cstdlib>

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

TAIHU_CLONES
void min_triangles(const LeafTriangle* all, const std::uint32_t* begin, const std::uint32_t* end,
                   const int* origin, float half_width, const std::int8_t* winding,
                   float* squared) {
    for (; begin != end; ++begin) {
        const LeafTriangle& t = all[*begin];
        // Corner k relative to the leaf, negated: q[k] + voxel is the voxel seen from the corner.
        float q[3][3], lo[3], hi[3], side0[3], along0[3];
        for (int c = 0; c < 3; ++c) {
            q[0][c] = static_cast<float>(origin[c] - t.a[c]);
            q[1][c] = q[0][c] - t.e[0][c];
            q[2][c] = q[0][c] + t.e[2][c];
            lo[c] = -std::max({q[0][c], q[1][c], q[2][c]});
            hi[c] = -std::min({q[0][c], q[1][c], q[2][c]});
        }
        for (int k = 0; k < 3; ++k) {
            side0[k] = t.en[k][0] * q[k][0] + t.en[k][1] * q[k][1] + t.en[k][2] * q[k][2];
            along0[k] = t.e[k][0] * q[k][0] + t.e[k][1] * q[k][1] + t.e[k][2] * q[k][2];
        }
        const float plane0 = t.n[0] * q[0][0] + t.n[1] * q[0][1] + t.n[2] * q[0][2];
        float box_z2[8];
        for (int z = 0; z < 8; ++z) {
            const auto fz = static_cast<float>(z);
            const float d = std::max({lo[2] - fz, fz - hi[2], 0.f});
            box_z2[z] = d * d;
        }
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
                const float box_xy2 = dx * dx + dy * dy;
                const float plane_xy = plane0 + t.n[0] * fx + t.n[1] * fy;
                float* __restrict row = squared + x * 64 + y * 8;
                float plane[8];
                // A row that the box and the plane of the face already rule out costs no more.
                bool nearer = false;
                for (int z = 0; z < 8; ++z) {
                    plane[z] = plane_xy + t.n[2] * static_cast<float>(z);
                    nearer |= std::max(box_xy2 + box_z2[z], plane[z] * plane[z]) < row[z];
                }
                if (!nearer)
                    continue;
                float best[8], inside[8];
                for (int z = 0; z < 8; ++z)
                    inside[z] = best[z] = 1e30f;
                for (int k = 0; k < 3; ++k) {
                    const float s = side0[k] + t.en[k][0] * fx + t.en[k][1] * fy;
                    const float u0 =
                        (along0[k] + t.e[k][0] * fx + t.e[k][1] * fy) * t.inverse_e2[k];
                    const float du = t.e[k][2] * t.inverse_e2[k];
                    const float px = q[k][0] + fx, py = q[k][1] + fy;
                    for (int z = 0; z < 8; ++z) {
                        const auto fz = static_cast<float>(z);
                        float u = u0 + du * fz;
                        u = u < 0 ? 0 : u;
                        u = u > 1 ? 1 : u;
                        const float ex = t.e[k][0] * u - px, ey = t.e[k][1] * u - py,
                                    ez = t.e[k][2] * u - (q[k][2] + fz);
                        const float d = ex * ex + ey * ey + ez * ez;
                        best[z] = d < best[z] ? d : best[z];
                        const float side = s + t.en[k][2] * fz;
                        inside[z] = side < inside[z] ? side : inside[z];
                    }
                }
                for (int z = 0; z < 8; ++z)
                    best[z] = inside[z] > 0 ? plane[z] * plane[z] : best[z];
                if (winding)
                    for (int z = 0; z < 8; ++z) {
                        const int w = winding[x * 64 + y * 8 + z];
                        if ((w > 0 && plane[z] > 0) || (w < 0 && plane[z] < 0) || std::abs(w) > 1)
                            best[z] = 1e30f;
                    }
                for (int z = 0; z < 8; ++z)
                    row[z] = best[z] < row[z] ? best[z] : row[z];
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
