#pragma once
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include "stats/core/box.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/section.h"

namespace taihu {

/// A level set as one thread asks it, between its voxels too.
class SolidSampler {
public:
    explicit SolidSampler(const openvdb::FloatGrid& grid)
        : lattice_(lattice_of(grid)), accessor_(grid.getConstAccessor()) {}
    /// Distance to the surface [m], negative inside; far from it that of the band's edge.
    double distance_m(const Vec3& p) const {
        const Vec3 i = (p - lattice_.origin) / lattice_.voxel_m;
        return openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(i.x, i.y, i.z));
    }
    bool solid(const Vec3& p) const { return distance_m(p) < 0; }
    double voxel_m() const { return lattice_.voxel_m; }

private:
    Lattice lattice_;
    openvdb::FloatGrid::ConstAccessor accessor_;
};

/// The box of the inside of a level set, a voxel larger.
/// \throws Error bad_argument: as lattice_of(), or it is empty; `where` begins the message.
Box solid_box(const openvdb::FloatGrid& grid, const std::string& where);

/// Half the extent of a box along a direction of length 1.
double support(const Box& box, const Vec3& n);

/// The circle in which a plane cuts a ball; no radius where it misses it.
struct Circle {
    double u = 0, v = 0, radius = 0; ///< centre from the plane's origin [m]
};
Circle circle_of(const Sphere& ball, const SectionPlane& plane);

/// What a plane shows: a lattice of pixels.
struct PlaneImage {
    enum Kind : std::uint8_t { air, solid, hole, taken };
    double u_lo = 0, v_lo = 0;     ///< where pixel (0, 0) lies, from the plane's origin [m]
    double step_u = 0, step_v = 0; ///< from a pixel to the next [m]; negative ones run backwards
    int nu = 0, nv = 0;
    std::vector<std::uint8_t> kind; ///< i fastest

    std::size_t at(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nu) +
               static_cast<std::size_t>(i);
    }
    /// Air where there is no pixel.
    std::uint8_t kind_at(double i, double j) const {
        return i >= 0 && j >= 0 && i < nu && j < nv
                   ? kind[at(static_cast<int>(i), static_cast<int>(j))]
                   : std::uint8_t{air};
    }
    /// Of the pixel that a point lies in.
    std::uint8_t kind_near(double u, double v) const {
        return kind_at(std::round((u - u_lo) / step_u), std::round((v - v_lo) / step_v));
    }
    Vec3 point(const SectionPlane& plane, double i, double j) const {
        return plane.origin + plane.u * (u_lo + i * step_u) + plane.v * (v_lo + j * step_v);
    }

    /// Look at every pixel. Without a base, void that reaches the corner (0, 0) is air.
    void sample(const SectionPlane& plane, const openvdb::FloatGrid& rock,
                const openvdb::FloatGrid* base, const Progress* progress = nullptr);
    /// The pixels of one kind that hang together with `first`, which become `to`.
    std::vector<std::size_t> take_region(std::size_t first, std::uint8_t to);
};

/// The ellipse with the second moments of a region, in pixels.
struct RegionEllipse {
    double x = 0, y = 0;         ///< centre
    double major = 0, minor = 0; ///< axes, from end to end
    double dx = 1, dy = 0;       ///< where the major one points
};
RegionEllipse ellipse_of(const PlaneImage& image, std::span<const std::size_t> region);

} // namespace taihu
