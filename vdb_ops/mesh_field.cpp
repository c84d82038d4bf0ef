#include "vdb_ops/mesh_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "vdb_ops/columns_detail.h"
#include "vdb_ops/kernels_detail.h"
#include "vdb_ops/mesh_cells_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
constexpr int kBlock = BlockSampler::kBlock;
constexpr int kLeaf = BlockSampler::kLeaf;
constexpr int kAcross = kBlock / kLeaf;
constexpr std::size_t kLeaves = std::size_t{kAcross} * kAcross * kAcross;

/// Everything about a mesh on a lattice that blocks share.
struct LatticeMeshData {
    const ClosedMesh& mesh;
    float half_width;
    std::vector<LeafTriangle> triangles;
    CoordBBox box; ///< whole blocks
    std::unique_ptr<Columns> columns;

    /// Which shells hold a voxel that no face is near.
    bool inside(const Coord& voxel) const {
        bool in = false; // from the largest shell to the smallest: what is innermost decides
        for (std::uint32_t s = 0; s < mesh.shells.size(); ++s)
            if (mesh.shells[s].role != Shell::Role::sheet && columns->winding(voxel, s) != 0)
                in = mesh.rule == ShellRule::parity ? !in
                                                    : mesh.shells[s].role == Shell::Role::solid;
        return in;
    }
};

class MeshBlock final : public BlockSampler {
public:
    MeshBlock(const LatticeMeshData& data, const Coord& block, std::vector<std::uint32_t> faces)
        : data_(data), block_(block), first_(kLeaves + 1, 0) {
        const Coord first(block.x() / kLeaf, block.y() / kLeaf, block.z() / kLeaf);
        const auto each = [&](auto&& fn) {
            for (const std::uint32_t f : faces)
                each_cell(data_.triangles[f], kLeaf, first, Coord(kAcross), data_.half_width,
                          [&](int i, int j, int k) {
                              fn(f, static_cast<std::size_t>((i * kAcross + j) * kAcross + k));
                          });
        };
        each([&](std::uint32_t, std::size_t leaf) { ++first_[leaf + 1]; });
        for (std::size_t i = 0; i < kLeaves; ++i)
            first_[i + 1] += first_[i];
        faces_.resize(first_[kLeaves]);
        std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
        each([&](std::uint32_t f, std::size_t leaf) { faces_[next[leaf]++] = f; });
    }

    Cover cover(const Coord& leaf) const override {
        const std::size_t i = index(leaf);
        if (first_[i] != first_[i + 1])
            return Cover::surface;
        return data_.inside(leaf) ? Cover::inside : Cover::outside;
    }

    void values(const Coord& leaf, float* out) override {
        const std::uint32_t* face = faces_.data() + first_[index(leaf)];
        const std::uint32_t* last = faces_.data() + first_[index(leaf) + 1];
        const float w = data_.half_width;
        alignas(64) float shell[512];
        std::fill(out, out + 512, w);
        for (std::uint32_t s = 0; s < data_.mesh.shells.size(); ++s) {
            const Shell::Role role = data_.mesh.shells[s].role;
            if (role == Shell::Role::sheet)
                continue;
            const std::uint32_t* end = face; // lists are sorted by face, so by shell
            while (end != last && data_.triangles[*end].shell == s)
                ++end;
            if (end == face) { // no face near: all on one side
                if (data_.columns->winding(leaf, s) == 0)
                    continue;
                std::fill(shell, shell + 512, -w);
            } else {
                shell_distance(leaf, s, face, end, shell);
                face = end;
            }
            if (data_.mesh.rule == ShellRule::parity)
                for (int i = 0; i < 512; ++i) // in one of both
                    out[i] = std::max(std::min(out[i], shell[i]), -std::max(out[i], shell[i]));
            else if (role == Shell::Role::cavity)
                subtract_values(out, shell, out);
            else
                for (int i = 0; i < 512; ++i)
                    out[i] = std::min(out[i], shell[i]);
        }
    }

private:
    std::size_t index(const Coord& leaf) const {
        return static_cast<std::size_t>(
            ((leaf.x() - block_.x()) / kLeaf * kAcross + (leaf.y() - block_.y()) / kLeaf) *
                kAcross +
            (leaf.z() - block_.z()) / kLeaf);
    }

    void shell_distance(const Coord& leaf, std::uint32_t shell, const std::uint32_t* face,
                        const std::uint32_t* end, float* out) const {
        std::int8_t winding[512];
        for (int x = 0; x < kLeaf; ++x)
            for (int y = 0; y < kLeaf; ++y)
                data_.columns->winding_row(leaf.offsetBy(x, y, 0), shell, winding + x * 64 + y * 8);
        const float w = data_.half_width;
        alignas(64) float squared[512];
        std::fill(squared, squared + 512, w * w);
        min_triangles(data_.triangles.data(), face, end, leaf.data(), w,
                      data_.columns->overlaps_itself(shell) ? winding : nullptr, squared);
        signed_roots(squared, winding, out);
    }

    const LatticeMeshData& data_;
    Coord block_;
    std::vector<std::uint32_t> first_,
        faces_; // faces of leaf i: faces_[first_[i] .. first_[i + 1])
};

class LatticeMesh final : public LatticeField {
public:
    LatticeMesh(const ClosedMesh& mesh, const Lattice& lattice)
        : data_{mesh, lattice.half_width_vox, {}, {}, nullptr} {
        std::vector<Vec3> points(mesh.positions.size());
        for (std::size_t i = 0; i < points.size(); ++i)
            points[i] = (mesh.positions[i] - lattice.origin) / lattice.voxel_m;
        make_triangles(points);
        data_.columns = std::make_unique<Columns>(mesh, points, data_.box);
        list_blocks();
    }

    CoordBBox bounds() const override { return data_.box; }

    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        if (data_.box.isInside(block)) {
            const std::size_t b = block_index(block.x() >> 6, block.y() >> 6, block.z() >> 6);
            if (first_[b] != first_[b + 1]) {
                cover = Cover::surface;
                return std::make_unique<MeshBlock>(
                    data_, block,
                    std::vector<std::uint32_t>(
                        faces_.begin() + static_cast<std::ptrdiff_t>(first_[b]),
                        faces_.begin() + static_cast<std::ptrdiff_t>(first_[b + 1])));
            }
            if (data_.inside(block)) {
                cover = Cover::inside;
                return nullptr;
            }
        }
        cover = Cover::outside;
        return nullptr;
    }

private:
    void make_triangles(const std::vector<Vec3>& points) {
        const ClosedMesh& mesh = data_.mesh;
        Box box;
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t v : t)
                box.include(points[v]);
        const double reach = data_.half_width + 2;
        if (box.dilated(reach).lo.x < -0x1p30 || box.longest() > 0x1p22 ||
            std::max({std::fabs(box.lo.x), std::fabs(box.lo.y), std::fabs(box.lo.z), box.hi.x,
                      box.hi.y, box.hi.z}) > 0x1p29)
            throw Error(
                Fault::bad_argument,
                "voxelize: the mesh would be more than 2^22 voxels long or 2^29 from the origin; "
                "use a larger voxel, or move it");
        Coord lo, hi;
        for (int axis = 0; axis < 3; ++axis) {
            lo[axis] = static_cast<int>(std::floor(box.lo[axis] - reach)) & ~(kBlock - 1);
            hi[axis] = static_cast<int>(std::ceil(box.hi[axis] + reach)) | (kBlock - 1);
        }
        data_.box = CoordBBox(lo, hi);
        data_.triangles.resize(mesh.triangles.size());
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 256), [&](const auto& range) {
                for (std::size_t i = range.begin(); i < range.end(); ++i) {
                    data_.triangles[i] = leaf_triangle(mesh.triangles[i], points, mesh.shell_of[i],
                                                       data_.half_width);
                }
            });
    }

    void list_blocks() {
        lo_ = Coord(data_.box.min().x() >> 6, data_.box.min().y() >> 6, data_.box.min().z() >> 6);
        n_ = Coord(data_.box.dim().x() >> 6, data_.box.dim().y() >> 6, data_.box.dim().z() >> 6);
        const std::size_t n_blocks = static_cast<std::size_t>(n_.x()) *
                                     static_cast<std::size_t>(n_.y()) *
                                     static_cast<std::size_t>(n_.z());
        first_.assign(n_blocks + 1, 0);
        const auto each = [&](auto&& fn) {
            for (std::uint32_t f = 0; f < data_.triangles.size(); ++f)
                each_cell(data_.triangles[f], kBlock, lo_, n_, data_.half_width,
                          [&](int i, int j, int k) {
                              fn(f, block_index(lo_.x() + i, lo_.y() + j, lo_.z() + k));
                          });
        };
        each([&](std::uint32_t, std::size_t b) { ++first_[b + 1]; });
        for (std::size_t b = 0; b < n_blocks; ++b)
            first_[b + 1] += first_[b];
        faces_.resize(first_[n_blocks]);
        std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
        each([&](std::uint32_t f, std::size_t b) { faces_[next[b]++] = f; });
    }

    std::size_t block_index(int x, int y, int z) const {
        return (static_cast<std::size_t>(x - lo_.x()) * static_cast<std::size_t>(n_.y()) +
                static_cast<std::size_t>(y - lo_.y())) *
                   static_cast<std::size_t>(n_.z()) +
               static_cast<std::size_t>(z - lo_.z());
    }

    LatticeMeshData data_;
    Coord lo_, n_;                   // first block and number of blocks
    std::vector<std::size_t> first_; // faces of block b: faces_[first_[b] .. first_[b + 1])
    std::vector<std::uint32_t> faces_;
};

} // namespace

std::unique_ptr<LatticeField> MeshField::on(const Lattice& lattice,
                                            const openvdb::CoordBBox&) const {
    return std::make_unique<LatticeMesh>(mesh_, lattice);
}

} // namespace taihu
