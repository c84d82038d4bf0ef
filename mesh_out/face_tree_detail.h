#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// A box in single precision that holds another: relative to some origin, rounded outwards.
struct RoundedBox {
    static constexpr float kInfinity = std::numeric_limits<float>::infinity();
    std::array<float, 3> lo{kInfinity, kInfinity, kInfinity};
    std::array<float, 3> hi{-kInfinity, -kInfinity, -kInfinity};

    RoundedBox() = default;
    RoundedBox(const Box& box, const Vec3& origin);
    void include(const RoundedBox& other) {
        for (std::size_t i = 0; i < 3; ++i) {
            lo[i] = std::min(lo[i], other.lo[i]);
            hi[i] = std::max(hi[i], other.hi[i]);
        }
    }
    bool meets(const RoundedBox& b) const {
        return lo[0] <= b.hi[0] && b.lo[0] <= hi[0] && lo[1] <= b.hi[1] && b.lo[1] <= hi[1] &&
               lo[2] <= b.hi[2] && b.lo[2] <= hi[2];
    }
};

inline Box box_of(std::span<const Vec3> positions, const Triangle& face) {
    Box box;
    for (const std::uint32_t v : face)
        box.include(positions[v]);
    return box;
}

/// Faces in groups of neighbours along a curve that fills space, and a binary tree of the boxes of
/// these: node i has the children 2i + 1 and 2i + 2.
class FaceTree {
public:
    struct Face {
        RoundedBox box;
        Triangle vertices{};
        std::uint32_t index = 0; ///< in the order that they were given in
    };

    FaceTree(std::span<const Vec3> positions, std::span<const Triangle> faces);

    const Box& bounds() const { return all_; }
    RoundedBox box(const Box& b) const { return {b, all_.lo}; }
    std::size_t n_groups() const { return (faces_.size() + kGroup - 1) / kGroup; }

    /// Calls visit(face) for the faces whose boxes meet `box`.
    template <class Visit>
    void visit(const RoundedBox& box, const Visit& visit) const {
        descend(0, 0, n_leaves_, 0, box, [&](std::size_t g) {
            for (std::size_t k = g * kGroup; k < end_of(g); ++k)
                if (faces_[k].box.meets(box))
                    visit(faces_[k]);
        });
    }

    /// Calls visit(face, face) for the pairs whose boxes meet, once each, of which the first is in
    /// a group.
    template <class Visit>
    void visit_pairs(std::size_t group, const Visit& visit) const {
        const RoundedBox& own = nodes_[n_leaves_ - 1 + group];
        descend(0, 0, n_leaves_, group, own, [&](std::size_t other) {
            for (std::size_t i = group * kGroup; i < end_of(group); ++i)
                for (std::size_t k = other == group ? i + 1 : other * kGroup; k < end_of(other);
                     ++k)
                    if (faces_[i].box.meets(faces_[k].box))
                        visit(faces_[i], faces_[k]);
        });
    }

private:
    static constexpr std::size_t kGroup = 4;

    std::size_t end_of(std::size_t group) const {
        return std::min((group + 1) * kGroup, faces_.size());
    }
    /// fn(group) for the groups from `first` on whose box meets `box`.
    template <class Fn>
    void descend(std::size_t node, std::size_t begin, std::size_t n, std::size_t first,
                 const RoundedBox& box, const Fn& fn) const {
        if (begin + n <= first || !nodes_[node].meets(box))
            return;
        if (n == 1) {
            fn(begin);
            return;
        }
        descend(2 * node + 1, begin, n / 2, first, box, fn);
        descend(2 * node + 2, begin + n / 2, n / 2, first, box, fn);
    }

    Box all_;
    std::vector<Face> faces_;
    std::size_t n_leaves_;
    std::vector<RoundedBox> nodes_;
};

} // namespace taihu
