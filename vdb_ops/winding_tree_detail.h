#pragma once
#include <cstdint>
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// The generalised winding number of any set of triangles: the sum of the solid angles that they
/// fill, over 4 pi (Jacobson et al. 2013). Far clusters count as one area vector each (the dipole
/// of Barill et al. 2018, "Fast winding numbers for soups and clouds", Sec. 3): where the point is
/// farther from one than four of its radii. Measured on half a boulder: off by 0.01 at most, 0.001
/// as a rule.
class WindingTree {
public:
    /// O(n log n). \param triangles  kept by value, with their corners.
    WindingTree(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles);

    /// Winding number about `p`, to which a triangle that `p` lies on gives nothing.
    /// \param on_face  set when `p` lies on a triangle, within rounding.
    double at(const Vec3& p, bool* on_face = nullptr) const;

    /// Whether a triangle may lie within `radius` of `p`; false is certain.
    bool near(const Vec3& p, double radius) const;

    /// More than |winding number| anywhere within `radius` of `p`; 1 or more where a triangle may
    /// be as near as that.
    double bound(const Vec3& p, double radius) const;

private:
    struct Node {
        Vec3 center, area; ///< of its triangles: middle by area, half the sum of cross products
        double radius = 0, area_sum = 0;
        std::uint32_t begin = 0, end = 0; ///< its triangles
        std::uint32_t second = 0;         ///< second child; the first follows the node; 0: a leaf
    };
    struct Corners {
        Vec3 a, b, c;
    };
    void build(std::uint32_t begin, std::uint32_t end);

    std::vector<Corners> triangles_;
    std::vector<Node> nodes_; ///< depth first
};

} // namespace taihu
