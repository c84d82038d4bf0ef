#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh_out/corner_table_detail.h"
#include "mesh_out/face_error_detail.h"
#include "stats/core/progress.h"

namespace taihu {

/// Half-edge collapses in the order of quadrics: vertices stay where they are, so what lies on the
/// surface stays on it, and rims only thin along themselves. A vertex belongs to the block of its
/// position; one block is one task, and works only where the rings of both ends lie in it: no
/// locks, and the same mesh on any number of threads.
class Collapser {
public:
    struct Rules {
        FaceErrors::Rules face;
        double least_quality = 0.06; ///< area over squared edge; a worse face may not get worse
        double least_turn = 0.3;     ///< cosine of how far one collapse may turn a face
        double off_m = 0;            ///< vertices farther from their primitives go first
    };

    /// \param frozen  per vertex: stays.
    Collapser(CornerTable& table, std::span<const Vec3> positions,
              std::span<const std::uint8_t> frozen, const FaceErrors& errors, const Rules& rules);
    /// One pass over all blocks of one lattice. \throws Error cancelled.
    void pass(double block_m, double shift_m, Progress* progress);
    /// The mean length of the edges that are left.
    double mean_edge_m() const;

private:
    using Ring = CornerTable::Ring;
    struct Quadric { ///< of squared distances to planes, about the vertex itself
        std::array<float, 6> a{};
        std::array<float, 3> b{};
        float c = 0;
        float at(const Vec3& d) const {
            const auto x = static_cast<float>(d.x), y = static_cast<float>(d.y),
                       z = static_cast<float>(d.z);
            return x * (a[0] * x + 2 * (a[1] * y + a[2] * z + b[0])) +
                   y * (a[3] * y + 2 * (a[4] * z + b[1])) + z * (a[5] * z + 2 * b[2]) + c;
        }
        /// Adds `other`, whose vertex lies at `d` from this one.
        void add(const Quadric& other, const Vec3& d);
    };
    struct alignas(64) Node { ///< what the queue asks of a vertex
        Quadric quadric;
        std::uint32_t stamp = 0; ///< of its last change; what the queue has of before is stale
        std::uint32_t label = 0;
        bool stays = false; ///< frozen
        bool off = false;   ///< off its primitives, or without any
        bool fixed = false; ///< a corner of the solid
    };
    struct Entry {
        std::uint32_t a, b, stamp_a, stamp_b;
    };
    /// A queue by the leading bits of the cost, last in first out among equals.
    class Buckets {
    public:
        void push(float cost, const Entry& entry);
        bool empty() const { return n_ == 0; }
        Entry pop();

    private:
        static constexpr std::size_t kBuckets = 1024;
        std::vector<std::vector<Entry>> entries_{kBuckets};
        std::size_t lowest_ = kBuckets, n_ = 0;
    };
    struct Room { ///< FaceErrors::clearance(), rounded down; not yet known below 0
        float sampled_m = -1, any_m = -1;
    };
    struct Blocks {
        std::vector<std::uint32_t> first, vertices;
    };

    Blocks divide(double block_m, double shift_m);
    void find_inner();
    void run(std::span<const std::uint32_t> vertices, Buckets& queue);
    void push(std::uint32_t a, std::uint32_t b, Buckets& queue) const;
    bool may_move(const Node& a, const Node& b) const;
    bool try_collapse(std::uint32_t a, std::uint32_t b);
    bool legal(std::uint32_t b, const Ring& ring);
    const Room& room(std::uint32_t v);
    bool fits(const Triangle& face, double clear_m, FaceErrors::Rules rules) const;
    bool may_fit(std::uint32_t a, std::uint32_t b) const;
    bool shapely(std::uint32_t a, std::uint32_t b, const Ring& ring) const;

    CornerTable& table_;
    std::span<const Vec3> positions_;
    const FaceErrors& errors_;
    Rules rules_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> owners_;
    std::vector<std::uint8_t> inner_; ///< the ring lies in the block of the vertex
    std::vector<std::uint8_t> open_;  ///< not yet tried with its whole ring in one block
    std::vector<Room> rooms_;
    /// Of the first primitive without a closed form at a vertex.
    std::vector<FaceSlope> slopes_;
};

} // namespace taihu
