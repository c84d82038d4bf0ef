#include <algorithm>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/bounded_surface_detail.h"

namespace taihu {
namespace {

constexpr int kSweeps = 8;
constexpr double kStep = 0.8;        ///< of the way, or neighbours overshoot together
constexpr double kFaceShare = 0.9;   ///< of the bound, that a vertex on a face may move
constexpr double kRimShare = 0.5;    ///< and one on a rim, off each of its faces
constexpr double kLeastSine2 = 0.05; ///< flatter rims stay

struct FaceState {
    std::uint32_t shape = FaceErrors::kNone;
    double shift = 0; ///< of its values, that is wanted
    double weight = 0;
};

FaceState state_of(const BoundedSurface& s, std::size_t face) {
    FaceState state;
    FaceErrors::Range range;
    const FaceErrors::Corners corners = s.corners(face);
    state.shape = s.errors.own(corners, s.labels_of(face), false, range);
    if (state.shape == FaceErrors::kNone)
        return state;
    state.shift = -(range.lo + range.hi) / 2;
    state.weight = length(cross(corners[1] - corners[0], corners[2] - corners[0]));
    // Those that break the bound count for more.
    const double over = range.most() / s.bound_m;
    if (over > 0.9)
        state.weight *= 1 + 40 * (over - 0.9);
    return state;
}

Vec3 moved(const BoundedSurface& s, std::uint32_t v, const std::vector<FaceState>& faces) {
    const Vec3& p = s.positions[v];
    const auto shapes = s.errors.shapes(s.labels[v]);
    if (shapes.size() > 2 || s.kept[v])
        return p;
    std::array<Vec3, 2> normal;
    std::array<double, 2> by{};
    const double most = (shapes.size() == 1 ? kFaceShare : kRimShare) * s.bound_m;
    for (std::size_t k = 0; k < shapes.size(); ++k) {
        double sum = 0, weight = 0;
        std::uint32_t c = s.table.corner(v);
        do {
            const FaceState& f = faces[c / 3];
            if (f.shape == shapes[k]) {
                sum += f.shift * f.weight;
                weight += f.weight;
            }
            c = s.table.swing(c);
        } while (c != s.table.corner(v));
        const FieldProbe::Value at = s.errors.of(shapes[k], p);
        const double slope = length(at.gradient);
        if (!(slope > 0) || !(weight > 0))
            return p;
        normal[k] = at.gradient / slope;
        const double value = at.value_m / slope;
        by[k] = std::clamp(value + kStep * sum / weight, -most, most) - value;
    }
    Vec3 step = normal[0] * by[0];
    if (shapes.size() == 2) {
        const double cosine = dot(normal[0], normal[1]), sine2 = 1 - cosine * cosine;
        if (sine2 < kLeastSine2)
            return p;
        step = normal[0] * ((by[0] - cosine * by[1]) / sine2) +
               normal[1] * ((by[1] - cosine * by[0]) / sine2);
    }
    const Vec3 to = p + step;
    return length(to - s.exact[v]) <= s.bound_m ? to : p;
}

} // namespace

void balance(BoundedSurface& s) {
    std::vector<FaceState> faces(s.table.n_triangles());
    std::vector<Vec3> next = s.positions;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, faces.size(), 256),
                          [&](const auto& range) {
                              for (std::size_t f = range.begin(); f < range.end(); ++f)
                                  faces[f] = state_of(s, f);
                          });
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, next.size(), 256),
                          [&](const auto& range) {
                              for (std::size_t v = range.begin(); v < range.end(); ++v)
                                  next[v] = moved(s, static_cast<std::uint32_t>(v), faces);
                          });
        s.positions.swap(next);
    }
}

} // namespace taihu
