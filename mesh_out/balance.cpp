#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/bounded_surface_detail.h"

namespace taihu {
namespace {

constexpr int kSweeps = 6;
constexpr double kStep = 0.8;        ///< of the way, or neighbours overshoot together
constexpr double kFaceShare = 0.9;   ///< of the bound, that a vertex on a face may move
constexpr double kRimShare = 0.5;    ///< and one on a rim, off each of its faces
constexpr double kLeastSine2 = 0.05; ///< flatter rims stay

/// Primitives without a closed form are sampled once, before anything moves: then a face's values
/// change by those of its corners, to first order in steps below the bound.
class Balance {
public:
    explicit Balance(BoundedSurface& surface);
    void sweep();

private:
    struct Face {
        std::uint32_t shape = FaceErrors::kNone;
        double shift = 0; ///< of its values, that is wanted
        double weight = 0;
        std::size_t n_steps = 0; ///< of samples along an edge; none when there is a closed form
        std::size_t first = 0;   ///< of these
    };
    struct Vertex {
        bool moves = false;
        std::array<Vec3, 2> normals;
        std::array<double, 2> start{}; ///< values of its primitives
        std::array<double, 2> moved{}; ///< how far it is from there, along each
    };

    void prepare(std::size_t face);
    void prepare_vertex(std::uint32_t v);
    void judge(std::size_t face);
    void move(std::uint32_t v);
    FaceErrors::Range range(const Face& face, const Triangle& corners) const;

    BoundedSurface& s_;
    std::vector<Face> faces_;
    std::vector<float> samples_;
    std::vector<Vertex> vertices_, next_;
    std::vector<Vec3> next_positions_;
};

template <class Visit>
void each(std::size_t n, Visit&& visit) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 256), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
            visit(i);
    });
}

Balance::Balance(BoundedSurface& surface)
    : s_(surface), faces_(s_.table.n_triangles()), vertices_(s_.positions.size()) {
    each(faces_.size(), [&](std::size_t f) { prepare(f); });
    std::size_t n = 0;
    for (Face& f : faces_) {
        f.first = n;
        n += f.n_steps == 0 ? 0 : (f.n_steps + 1) * (f.n_steps + 2) / 2;
    }
    samples_.resize(n);
    each(faces_.size(), [&](std::size_t f) {
        if (faces_[f].n_steps > 0)
            s_.errors.samples(faces_[f].shape, s_.corners(f), faces_[f].n_steps,
                              samples_.data() + faces_[f].first);
    });
    each(vertices_.size(), [&](std::size_t v) { prepare_vertex(static_cast<std::uint32_t>(v)); });
    next_ = vertices_;
    next_positions_ = s_.positions;
}

void Balance::prepare(std::size_t face) {
    Face& f = faces_[face];
    const PrimitiveSet shared = s_.errors.shared(s_.labels_of(face));
    FaceErrors::Range range;
    f.shape = shared.size() == 1
                  ? shared[0]
                  : s_.errors.own(s_.corners(face), s_.labels_of(face), false, range);
    if (f.shape != FaceErrors::kNone && !s_.errors.has_closed_form(f.shape))
        f.n_steps = s_.errors.n_steps(s_.corners(face));
}

void Balance::prepare_vertex(std::uint32_t v) {
    Vertex& vertex = vertices_[v];
    const auto shapes = s_.errors.shapes(s_.labels[v]);
    vertex.moves = !shapes.empty() && shapes.size() <= 2 && !s_.kept[v];
    for (std::size_t k = 0; vertex.moves && k < shapes.size(); ++k) {
        const FieldProbe::Value at = s_.errors.of(shapes[k], s_.positions[v]);
        const double slope = length(at.gradient);
        vertex.moves = slope > 0;
        vertex.normals[k] = at.gradient / slope;
        vertex.start[k] = at.value_m / slope;
    }
}

FaceErrors::Range Balance::range(const Face& face, const Triangle& corners) const {
    std::array<double, 3> by{};
    for (std::size_t c = 0; c < 3; ++c) {
        const auto shapes = s_.errors.shapes(s_.labels[corners[c]]);
        for (std::size_t k = 0; k < std::min<std::size_t>(shapes.size(), 2); ++k)
            if (shapes[k] == face.shape)
                by[c] = vertices_[corners[c]].moved[k];
    }
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    FaceErrors::Range range{kInfinity, -kInfinity, {}};
    const float* sample = samples_.data() + face.first;
    const double step = 1 / static_cast<double>(face.n_steps);
    for (std::size_t u = 0; u <= face.n_steps; ++u)
        for (std::size_t v = 0; u + v <= face.n_steps; ++v) {
            const double x = static_cast<double>(u) * step, y = static_cast<double>(v) * step;
            const double d = *sample++ + by[1] * x + by[2] * y + by[0] * (1 - x - y);
            range.lo = std::min(range.lo, d);
            range.hi = std::max(range.hi, d);
        }
    return range;
}

void Balance::judge(std::size_t face) {
    Face& f = faces_[face];
    if (f.shape == FaceErrors::kNone)
        return;
    const FaceErrors::Corners corners = s_.corners(face);
    const FaceErrors::Range r =
        f.n_steps > 0 ? range(f, s_.table.triangle(face)) : s_.errors.range(f.shape, corners);
    f.shift = -(r.lo + r.hi) / 2;
    f.weight = length(cross(corners[1] - corners[0], corners[2] - corners[0]));
    // Those that break the bound count for more.
    const double over = r.most() / s_.bound_m;
    if (over > 0.9)
        f.weight *= 1 + 40 * (over - 0.9);
}

void Balance::move(std::uint32_t v) {
    const Vertex& vertex = vertices_[v];
    if (!vertex.moves)
        return;
    const auto shapes = s_.errors.shapes(s_.labels[v]);
    std::array<double, 2> by{};
    const double most = (shapes.size() == 1 ? kFaceShare : kRimShare) * s_.bound_m;
    for (std::size_t k = 0; k < shapes.size(); ++k) {
        double sum = 0, weight = 0;
        std::uint32_t c = s_.table.corner(v);
        do {
            const Face& f = faces_[c / 3];
            if (f.shape == shapes[k]) {
                sum += f.shift * f.weight;
                weight += f.weight;
            }
            c = s_.table.swing(c);
        } while (c != s_.table.corner(v));
        if (!(weight > 0))
            return;
        const double value = vertex.start[k] + vertex.moved[k];
        by[k] = std::clamp(value + kStep * sum / weight, -most, most) - value;
    }
    Vec3 step = vertex.normals[0] * by[0];
    if (shapes.size() == 2) {
        const double cosine = dot(vertex.normals[0], vertex.normals[1]),
                     sine2 = 1 - cosine * cosine;
        if (sine2 < kLeastSine2)
            return;
        step = vertex.normals[0] * ((by[0] - cosine * by[1]) / sine2) +
               vertex.normals[1] * ((by[1] - cosine * by[0]) / sine2);
    }
    const Vec3 to = s_.positions[v] + step;
    if (length(to - s_.exact[v]) > s_.bound_m)
        return;
    next_positions_[v] = to;
    for (std::size_t k = 0; k < 2; ++k)
        next_[v].moved[k] = vertex.moved[k] + by[k];
}

void Balance::sweep() {
    each(faces_.size(), [&](std::size_t f) { judge(f); });
    each(vertices_.size(), [&](std::size_t v) { move(static_cast<std::uint32_t>(v)); });
    s_.positions = next_positions_;
    vertices_ = next_;
}

} // namespace

void balance(BoundedSurface& s) {
    Balance work(s);
    for (int i = 0; i < kSweeps; ++i)
        work.sweep();
}

} // namespace taihu
