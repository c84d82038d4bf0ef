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

/// A ball in voxels, relative to the first voxel of a block.
struct LeafBall {
    float x, y, z, r;
};

/// values[512] = max(values, r - |x - c|) over the balls [begin, end) of `balls`: takes them away
/// from the leaf that begins at voxel `leaf` of the block. Values are right down to `least`, which
/// none of them is below.
void subtract_balls(const LeafBall* balls, const std::uint32_t* begin, const std::uint32_t* end,
                    const int* leaf, float least, float* values);

/// A triangle in voxel coordinates. Corners and normal are doubles: what a leaf needs of them is
/// small, but comes out of differences of large numbers.
struct LeafTriangle {
    double corner[3][3];
    double n[3];         ///< unit normal, or 0 for a needle
    float e[3][3];       ///< edge k, from corner k to k + 1
    float en[3][3];      ///< its normal in the plane, inwards
    float inverse_e2[3]; ///< 1 / |e|^2, 0 for no length
    float lo[3], hi[3];  ///< box grown by the half width
    std::uint32_t shell;
    int n_edges; ///< distances to the first 1..3 edges are its business, to the others a
                 ///< neighbour's
};

/// squared[512] = min(squared, squared distance to the triangles), leaf at `origin`; rows farther
/// than `half_width` from a triangle's box are skipped. With `winding` (one count per voxel) a
/// voxel sees only faces that turn the right side to it, with all their edges: for shells that
/// overlap themselves.
void min_triangles(const LeafTriangle* all, const std::uint32_t* begin, const std::uint32_t* end,
                   const int* origin, float half_width, const std::int8_t* winding, float* squared);

/// out = the roots of squared distances, negative where the winding number is not 0. Within 1e-5
/// voxels of the surface they are 0.
void signed_roots(const float* squared, const std::int8_t* winding, float* out);

/// One bit for each voxel of a leaf.
struct LeafBits {
    std::uint64_t word[8];
    bool operator==(const LeafBits&) const = default;
};

/// out = max(a, -b) over 512 values: a minus b.
void subtract_values(const float* a, const float* b, float* out);

/// Distances of a leaf [voxels] to those of a level set [m]: out = values * voxel, held to
/// +-background. Returns the bits of |values| < half_width and |out| < background: fields may hold
/// values to the half width, and the product with a voxel is rounded.
LeafBits to_band(const float* values, float half_width, float voxel, float background, float* out);

/// The same from values [m] of which only the `active` ones count beyond their sign.
LeafBits copy_band(const float* values, const LeafBits& active, float background, float* out);

/// out = values * inverse_voxel, held to +-half_width, which inactive values are set to by sign.
void take_values(const float* values, const LeafBits& active, float half_width, float inverse_voxel,
                 float* out);

/// How many voxels of a leaf lie inside, by volume_m3()'s share of each.
double inside_voxels(const float* values, float inverse_voxel);

} // namespace taihu
