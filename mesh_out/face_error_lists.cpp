#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/face_error_detail.h"
#include "stats/core/box.h"

namespace taihu {
namespace {

constexpr double kCellSpacings = 8;
constexpr double kMostCells = 1 << 26;

bool before(const PrimitiveSet& a, const PrimitiveSet& b) {
    return std::lexicographical_compare(a.all().begin(), a.all().end(), b.all().begin(),
                                        b.all().end());
}

} // namespace

FaceErrors::FaceErrors(const LabelledMesh& mesh, const FieldProbe& field, double bound_m,
                       double spacing_m)
    : field_(field), spacing_(spacing_m), pad_(spacing_m + 2 * bound_m) {
    Box box;
    for (const Vec3& p : mesh.positions)
        box.include(p);
    box = box.dilated(pad_);
    const Vec3 size = box.size();
    cell_ = std::max(
        {kCellSpacings * spacing_m, 4 * bound_m, std::cbrt(size.x * size.y * size.z / kMostCells)});
    origin_ = box.lo;
    for (int a = 0; a < 3; ++a)
        n_[static_cast<std::size_t>(a)] = static_cast<std::size_t>(size[a] / cell_) + 1;
    std::vector<std::vector<Primitive>> near;
    find_near(mesh, near);
    first_.assign(1, 0);
    for (const auto& list : near) {
        near_.insert(near_.end(), list.begin(), list.end());
        first_.push_back(static_cast<std::uint32_t>(near_.size()));
    }
    find_shapes(mesh);
    find_center_values();
}

int FaceErrors::coordinate(double x, int axis) const {
    return std::clamp(static_cast<int>((x - origin_[axis]) / cell_), 0,
                      static_cast<int>(n_[static_cast<std::size_t>(axis)]) - 1);
}

std::size_t FaceErrors::cell_of(const std::array<int, 3>& c) const {
    return (static_cast<std::size_t>(c[0]) * n_[1] + static_cast<std::size_t>(c[1])) * n_[2] +
           static_cast<std::size_t>(c[2]);
}

void FaceErrors::find_near(const LabelledMesh& mesh, std::vector<std::vector<Primitive>>& near) {
    cells_.assign(n_[0] * n_[1] * n_[2], kNone);
    for (const Vec3& p : mesh.positions) {
        std::array<int, 3> lo{}, hi{}, c{};
        for (int a = 0; a < 3; ++a) {
            lo[a] = coordinate(p[a] - pad_, a);
            hi[a] = coordinate(p[a] + pad_, a);
        }
        for (c[0] = lo[0]; c[0] <= hi[0]; ++c[0])
            for (c[1] = lo[1]; c[1] <= hi[1]; ++c[1])
                for (c[2] = lo[2]; c[2] <= hi[2]; ++c[2])
                    cells_[cell_of(c)] = 0;
    }
    std::vector<std::size_t> listed;
    for (std::size_t c = 0; c < cells_.size(); ++c)
        if (cells_[c] != kNone) {
            cells_[c] = static_cast<std::uint32_t>(listed.size());
            listed.push_back(c);
        }
    near.resize(listed.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, listed.size(), 64), [&](const auto& r) {
        for (std::size_t i = r.begin(); i < r.end(); ++i) {
            field_.near(center_of(coordinates(listed[i])), list_reach(), near[i]);
        }
    });
}

std::array<int, 3> FaceErrors::coordinates(std::size_t cell) const {
    return {static_cast<int>(cell / n_[2] / n_[1]), static_cast<int>(cell / n_[2] % n_[1]),
            static_cast<int>(cell % n_[2])};
}

void FaceErrors::find_center_values() {
    center_values_.assign(near_.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells_.size(), 4096),
                      [&](const auto& range) {
                          for (std::size_t c = range.begin(); c < range.end(); ++c)
                              for (std::uint32_t i = cells_[c] == kNone ? 0 : first_[cells_[c]];
                                   cells_[c] != kNone && i < first_[cells_[c] + 1]; ++i)
                                  if (const Shape& s = shapes_[near_[i]]; !s.is_ball)
                                      center_values_[i] = static_cast<float>(
                                          field_.value_of(s.primitive, center_of(coordinates(c))));
                      });
}

void FaceErrors::find_shapes(const LabelledMesh& mesh) {
    std::vector<Primitive> used = near_;
    std::vector<PrimitiveSet> all; // neighbours mostly share theirs
    std::unique_copy(mesh.labels.begin(), mesh.labels.end(), std::back_inserter(all));
    std::sort(all.begin(), all.end(), before);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    for (const PrimitiveSet& set : all)
        used.insert(used.end(), set.all().begin(), set.all().end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (const Primitive p : used) {
        Shape s;
        s.primitive = p;
        if (const auto ball = field_.ball(p)) {
            const Vec3 beside = ball->center + Vec3{2 * ball->radius_m, 0, 0};
            s = {p, true, field_.value_of(p, beside) > 0 ? 1. : -1., ball->center, ball->radius_m};
        }
        shapes_.push_back(s);
    }
    const auto shape_of = [&](Primitive p) {
        return static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), p) -
                                          used.begin());
    };
    for (std::uint32_t& p : near_)
        p = shape_of(p);
    for (const PrimitiveSet& set : all) {
        PrimitiveSet shapes;
        for (const Primitive p : set.all())
            shapes.add(shape_of(p));
        sets_.push_back(shapes);
    }
    n_sorted_sets_ = sets_.size();
    labels_.resize(mesh.labels.size());
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, labels_.size(), 1024), [&](const auto& range) {
            for (std::size_t v = range.begin(); v < range.end(); ++v)
                labels_[v] =
                    v > range.begin() && mesh.labels[v] == mesh.labels[v - 1]
                        ? labels_[v - 1]
                        : static_cast<std::uint32_t>(
                              std::lower_bound(all.begin(), all.end(), mesh.labels[v], before) -
                              all.begin());
        });
}

/// The number of a primitive's shape; kNone when it comes near nothing.
std::uint32_t FaceErrors::shape_of(Primitive primitive) const {
    const auto at = std::lower_bound(shapes_.begin(), shapes_.end(), primitive,
                                     [](const Shape& s, Primitive p) { return s.primitive < p; });
    return at == shapes_.end() || at->primitive != primitive
               ? kNone
               : static_cast<std::uint32_t>(at - shapes_.begin());
}

std::uint32_t FaceErrors::label_of(const PrimitiveSet& shapes) {
    // The first ones are sorted as their primitives are.
    const auto first_end = sets_.begin() + static_cast<std::ptrdiff_t>(n_sorted_sets_);
    const auto at = std::lower_bound(sets_.begin(), first_end, shapes, before);
    if (at != first_end && *at == shapes)
        return static_cast<std::uint32_t>(at - sets_.begin());
    const auto [known, is_new] = more_sets_.try_emplace({shapes.all().begin(), shapes.all().end()},
                                                        static_cast<std::uint32_t>(sets_.size()));
    if (is_new)
        sets_.push_back(shapes);
    return known->second;
}

PrimitiveSet FaceErrors::primitives(std::uint32_t label) const {
    PrimitiveSet out;
    for (const std::uint32_t s : sets_[label].all())
        out.add(shapes_[s].primitive);
    return out;
}

} // namespace taihu
