#include "mesh_out/extract_certainty_detail.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "mesh_out/partition_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
constexpr int kCube = 8;

CoordBBox cubes_of(const CoordBBox& voxels) {
    const auto cube = [](const Coord& c) { return Coord(c.x() >> 3, c.y() >> 3, c.z() >> 3); };
    return {cube(voxels.min()), cube(voxels.max())};
}

CoordBBox cubes_of(const Box& box, const Lattice& lattice) {
    CoordBBox cubes;
    for (int axis = 0; axis < 3; ++axis) {
        const auto cube = [&](double x) {
            return static_cast<int>(
                std::floor((x - lattice.origin[axis]) / (kCube * lattice.voxel_m)));
        };
        cubes.min()[axis] = cube(box.lo[axis]);
        cubes.max()[axis] = cube(box.hi[axis]);
    }
    return cubes;
}

} // namespace

Certainty::Certainty(const CoordBBox& given, const Lattice& lattice)
    : known_(Known{lattice, cubes_of(given)}) {
    known_->cubes.expand(-(kVoxels_vox + kTogether_vox) / kCube);
}

bool Certainty::are_certain(const CoordBBox& cubes) const {
    if (!known_->cubes.isInside(cubes))
        return false;
    if (uncertain_.empty())
        return true;
    for (const Coord& c : cubes)
        if (uncertain_.contains(c))
            return false;
    return true;
}

void Certainty::decided(const std::vector<Box>& boxes) {
    if (!known_)
        return;
    std::vector<std::uint32_t> order(boxes.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(boxes[a].lo.x, a) < std::pair(boxes[b].lo.x, b);
    });
    Partition groups(boxes.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t k = i + 1;
             k < order.size() && boxes[order[k]].lo.x <= boxes[order[i]].hi.x; ++k)
            if (const Box both{max(boxes[order[i]].lo, boxes[order[k]].lo),
                               min(boxes[order[i]].hi, boxes[order[k]].hi)};
                !both.empty())
                groups.join(order[i], order[k]);
    std::vector<Group> found(boxes.size());
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
        found[groups.find(i)].push_back(cubes_of(boxes[i], known_->lattice));
    std::erase_if(found, [](const auto& group) { return group.empty(); });
    together_.insert(together_.end(), found.begin(), found.end());
    touch();
}

void Certainty::lose(const std::vector<Box>& boxes) {
    for (std::size_t i = 0; known_ && i < boxes.size(); ++i)
        lose(cubes_of(boxes[i], known_->lattice));
}

void Certainty::lose(const CoordBBox& cubes) {
    for (const Coord& c : cubes)
        if (known_->cubes.isInside(c))
            uncertain_.insert(c);
}

/// Groups that overlap the uncertain are so, too; they do not overlap each other.
void Certainty::touch() {
    const auto lost = std::partition(together_.begin(), together_.end(), [&](const Group& group) {
        return std::all_of(group.begin(), group.end(),
                           [&](const CoordBBox& cubes) { return are_certain(cubes); });
    });
    for (auto group = lost; group != together_.end(); ++group)
        for (const CoordBBox& cubes : *group)
            lose(cubes);
    together_.erase(lost, together_.end());
}

void Certainty::spread(int by_vox) {
    if (!known_)
        return;
    const int by = by_vox / kCube;
    known_->cubes.expand(-by);
    std::unordered_set<Coord> wider;
    for (const Coord& c : uncertain_)
        for (const Coord& around : CoordBBox(c.offsetBy(-by), c.offsetBy(by)))
            wider.insert(around);
    uncertain_ = std::move(wider);
    touch();
}

bool Certainty::holds(const CoordBBox& voxels) const {
    return !known_ || are_certain(cubes_of(voxels));
}

bool Certainty::holds(const Box& box) const {
    return !known_ || are_certain(cubes_of(box, known_->lattice));
}

} // namespace taihu
