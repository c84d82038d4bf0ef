#include "mesh_out/face_tree_detail.h"

#include <bit>
#include <cmath>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

namespace taihu {
namespace {

constexpr int kPlaceBits = 21;

/// Below x, and what x was before it was rounded as a double.
float below(double x) {
    constexpr float kMost = std::numeric_limits<float>::max();
    return x >= kMost    ? kMost
           : x <= -kMost ? -RoundedBox::kInfinity
                         : std::nextafter(static_cast<float>(x), -RoundedBox::kInfinity);
}

Vec3 places_per_m(const Box& all) {
    Vec3 per_m;
    const Vec3 size = all.size();
    for (int axis = 0; axis < 3; ++axis) // flat, or so large that it overflows: 0
        per_m[axis] =
            size[axis] > 0 && size[axis] < 1e300 ? ((1 << kPlaceBits) - 1) / size[axis] : 0;
    return per_m;
}

/// Of the middle of a box, along Morton's curve.
std::uint64_t place(const Box& box, const Vec3& lo, const Vec3& per_m) {
    std::uint64_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double middle = box.lo[axis] * 0.5 + box.hi[axis] * 0.5; // or it may overflow
        const double steps = (middle - lo[axis]) * per_m[axis];
        auto x = steps > 0 ? static_cast<std::uint64_t>(steps) : 0; // 0 for infinity times 0, too
        x = (x | x << 32) & 0x1f00000000ffff;
        x = (x | x << 16) & 0x1f0000ff0000ff;
        x = (x | x << 8) & 0x100f00f00f00f00f;
        x = (x | x << 4) & 0x10c30c30c30c30c3;
        x = (x | x << 2) & 0x1249249249249249;
        code |= x << axis;
    }
    return code;
}

} // namespace

RoundedBox::RoundedBox(const Box& box, const Vec3& origin) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        lo[i] = below(box.lo[axis] - origin[axis]);
        hi[i] = -below(origin[axis] - box.hi[axis]);
    }
}

FaceTree::FaceTree(std::span<const Vec3> positions, std::span<const Triangle> faces)
    : faces_(faces.size()), n_leaves_(std::bit_ceil(n_groups())), nodes_(2 * n_leaves_ - 1) {
    for (const Triangle& f : faces)
        for (const std::uint32_t v : f)
            all_.include(positions[v]);
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order(faces.size());
    const Vec3 per_m = places_per_m(all_);
    tbb::parallel_for(std::size_t{0}, faces.size(), [&](std::size_t i) {
        order[i] = {place(box_of(positions, faces[i]), all_.lo, per_m),
                    static_cast<std::uint32_t>(i)};
    });
    tbb::parallel_sort(order.begin(), order.end());
    tbb::parallel_for(std::size_t{0}, n_groups(), [&](std::size_t g) {
        for (std::size_t k = g * kGroup; k < end_of(g); ++k) {
            const std::uint32_t i = order[k].second;
            faces_[k] = {box(box_of(positions, faces[i])), faces[i], i};
            nodes_[n_leaves_ - 1 + g].include(faces_[k].box);
        }
    });
    for (std::size_t node = n_leaves_ - 1; node-- > 0;) {
        nodes_[node].include(nodes_[2 * node + 1]);
        nodes_[node].include(nodes_[2 * node + 2]);
    }
}

} // namespace taihu
