#pragma once
#include <cstddef>
#include <cstdint>

// Hot loops, compiled for several instruction sets and chosen when the program starts. All versions
// use the same IEEE operations without contraction, so they give the same bits.
// Sanitizers start after the choice is made and crash on it: one version only there.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(TAIHU_SANITIZED)
#define TAIHU_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define TAIHU_CLONES
#endif

namespace taihu {

/// A ball in the voxel coordinates of a leaf: the leaf's first voxel is (0, 0, 0).
struct LeafBall {
    float x, y, z, r;
};

/// values[512] = min(values, distance to the balls' union), for voxels within `half_width` of one.
void min_balls(const LeafBall* balls, std::size_t n, float half_width, float* values);

/// A triangle in voxel coordinates. Corners and normal are doubles: what a leaf needs of them is
/// small, but comes out of differences of large numbers.
struct LeafTriangle {
    double corner[3][3];
    double n[3];         ///< unit normal, or 0 for a needle
    float e[3][3];       ///< edge k, from corner k to k + 1
    float en[3][3];      ///< its normal in the plane, inwards
    float inverse_e2[3]; ///< 1 / |e|^2, 0 for no length
    std::uint32_t shell;
    float lo[3], hi[3]; ///< box grown by the half width
};

/// squared[512] = min(squared, squared distance to the triangles), leaf at `origin`; rows farther
/// than `half_width` from a triangle's box are skipped. With `winding` (one count per voxel) a
/// voxel sees only faces that turn the right side to it: for shells that overlap themselves.
void min_triangles(const LeafTriangle* all, const std::uint32_t* begin, const std::uint32_t* end,
                   const int* origin, float half_width, const std::int8_t* winding, float* squared);

/// out = max(a, -b) over 512 values: a minus b.
void subtract_values(const float* a, const float* b, float* out);

/// Bit k is set where |values[k]| < half_width, k < 64.
std::uint64_t band_bits(const float* values, float half_width);

/// out = values * scale over 512 values.
void scale_values(const float* values, float scale, float* out);

} // namespace taihu
