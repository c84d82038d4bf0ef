#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "stats/core/vec3.h"
#include "vdb_ops/field.h"

namespace taihu {

/// A ball in voxel coordinates.
struct VoxelBall {
    Vec3 center;
    double r;
};

/// Which balls come near which cubes of a lattice of them: cube (i, j, k) holds the voxels from
/// (i, j, k) * size on, size along each edge. First find() for every ball, then sort().
class CubeLists {
public:
    /// A ball near a cube.
    struct Hit {
        std::uint32_t cube, ball;
    };

    /// A list of them, whose new places are not filled before they are written.
    class Hits {
    public:
        std::size_t size() const { return size_; }
        const Hit* begin() const { return hits_.get(); }
        const Hit* end() const { return hits_.get() + size_; }

    private:
        friend CubeLists;
        /// Where up to n more may be written.
        Hit* room_for(std::size_t n);
        std::unique_ptr<Hit[]> hits_;
        std::size_t size_ = 0, room_ = 0;
    };

    /// \param n  cubes along each axis; their product is below 2^32.
    CubeLists(int size, const openvdb::Coord& n, double half_width)
        : size_(size), inverse_size_(1.0 / size), n_(n), half_width_(half_width),
          covered_(index(n.x(), 0, 0), 0) {}

    /// Appends the cubes that ball number `number` comes near, but for those that turned out to be
    /// covered by now: they lie deep inside a ball. Thread-safe.
    void find(const VoxelBall& ball, std::uint32_t number, Hits& hits);
    /// At most how many cubes find() looks at.
    double n_looked_at(const VoxelBall& ball) const;
    /// Sorts all hits by cube, without those in covered ones; within a cube they keep their order.
    void sort(std::span<const Hits> hits);

    Cover cover(std::size_t cube) const {
        if (covered_[cube])
            return Cover::inside;
        return first_[cube] == first_[cube + 1] ? Cover::outside : Cover::surface;
    }
    /// The balls near a cube; empty where one covers it.
    std::span<const std::uint32_t> balls(std::size_t cube) const {
        return {balls_.data() + first_[cube], balls_.data() + first_[cube + 1]};
    }
    std::size_t index(int i, int j, int k) const {
        return (static_cast<std::size_t>(i) * static_cast<std::size_t>(n_.y()) +
                static_cast<std::size_t>(j)) *
                   static_cast<std::size_t>(n_.z()) +
               static_cast<std::size_t>(k);
    }

private:
    /// The cubes that a ball's box meets; false for none.
    bool box_of(const VoxelBall& ball, openvdb::Coord& lo, openvdb::Coord& hi) const;

    double size_, inverse_size_;
    openvdb::Coord n_;
    double half_width_;
    std::vector<std::size_t> first_; ///< balls of cube i: balls_[first_[i] .. first_[i + 1])
    std::vector<std::uint32_t> balls_;
    std::vector<char> covered_;
};

} // namespace taihu
