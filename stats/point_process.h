#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "stats/core/vec3.h"
#include "stats/law.h"

namespace taihu {

/// An endless list of hole centres about a box, addressed by number: center(i) depends on the seed
/// and i alone, so the first N are the first N of any longer list, on any thread. The same bytes on
/// every machine. The first Poisson(mean_count(density)) of them are the process itself.
class CenterStream {
public:
    /// \throws Error bad_argument: the box has no volume or is not finite.
    CenterStream(const Box& box, std::uint64_t seed);
    virtual ~CenterStream() = default;

    /// \param i  below 2^40. \throws Error numeric: the pattern has no room in the box.
    virtual Vec3 center(std::uint64_t i) const = 0;
    /// How many belong to a process with this many centres per volume inside the box on average.
    virtual double mean_count(double density_m3) const;

    const Box& box() const { return box_; }
    std::uint64_t seed() const { return seed_; }

private:
    Box box_;
    std::uint64_t seed_;
};

/// No pattern: the centres of a HoleStream of the same box and seed, bit for bit.
class UniformCenters final : public CenterStream {
public:
    using CenterStream::CenterStream;
    Vec3 center(std::uint64_t i) const override;
};

struct ClusterSettings {
    enum class Shape {
        thomas, ///< normal about the parent; spread_m is the standard deviation along each axis
        matern  ///< uniform in a ball about the parent; spread_m is its radius
    };
    Shape shape = Shape::thomas;
    double parents_m3 = 1; ///< clusters per volume, > 0
    double spread_m = 0.1; ///< > 0
};

/// Clusters about the points of a Poisson process. Parents lie in the box and so far round it that
/// the pattern is the same at its faces; so do some centres lie outside. Each centre picks its
/// parent, which gives clusters of Poisson sizes, density / parents_m3 on average.
class ClusterCenters final : public CenterStream {
public:
    /// \throws Error bad_argument: a setting, or more than 1e8 parents.
    ClusterCenters(const Box& box, const ClusterSettings& settings, std::uint64_t seed);
    Vec3 center(std::uint64_t i) const override;
    double mean_count(double density_m3) const override;
    std::uint64_t n_parents() const { return n_parents_; }

private:
    ClusterSettings settings_;
    Box parents_box_;
    std::uint64_t n_parents_;
};

/// A plane of weakness, along which holes open.
struct JointPlane {
    Vec3 point, normal; ///< [m]; a direction of any length
};

/// n planes of random directions through random points of the box.
/// \throws Error bad_argument: a box without volume.
std::vector<JointPlane> random_joints(const Box& box, std::size_t n, std::uint64_t seed);

/// Centres in the box, as many on each square metre of each plane, scattered off it normally.
class JointCenters final : public CenterStream {
public:
    /// \param sd_m  of the distance to the plane, > 0.
    /// \throws Error bad_argument: no planes, one that is not finite or passes the box, or sd_m.
    JointCenters(const Box& box, std::vector<JointPlane> planes, double sd_m, std::uint64_t seed);
    Vec3 center(std::uint64_t i) const override;

private:
    struct Frame {
        Vec3 foot, u, v, normal; ///< the point nearest to the middle of the box, and axes
    };
    std::vector<Frame> frames_;
    double reach_m_, sd_m_;
};

/// Density that depends on the place, as on the height: whether the i-th of a list of centres stays
/// where only this share of them does. The same coin for the same i and seed.
/// \param share  0..1. \throws Error bad_argument: another share.
bool center_stays(std::uint64_t i, double share, std::uint64_t seed);

/// The nodes of a cubic lattice of this spacing that fit into the box, in its middle.
/// \throws Error bad_argument: the box, the spacing, or more than 1e8 nodes.
std::vector<Vec3> lattice_centers(const Box& box, double spacing_m);

/// Centres for balls that do not touch (random sequential addition): ball by ball, candidates of
/// the stream are tried until one is farther than r_i + r_j + gap from all before. No ball is given
/// up, so the sizes keep their law, and a longer list begins with the shorter one. Equal radii give
/// a hard core of 2 r + gap, up to 38 % of the volume; of unequal ones, more find room when the
/// largest come first.
/// \param radii_m  each > 0; \param gap_m  >= 0.
/// \throws Error bad_argument: radii_m[i] or gap_m; numeric: a ball finds no room in 10^5 tries;
///         cancelled: within 1000 tries.
/// Cost: a few grid cells for each try.
std::vector<Vec3> hard_core_centers(const CenterStream& candidates, std::span<const double> radii_m,
                                    double gap_m, Progress* progress = nullptr);

/// Radii of the first n holes by number: those of a HoleStream of the same law, scale and seed.
/// \throws Error bad_argument: scale_m not finite and > 0.
std::vector<double> hole_radii(const Law& law, double scale_m, std::uint64_t seed, std::size_t n);

} // namespace taihu
