#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "mesh_out/collapse_detail.h"
#include "stats/core/box.h"

namespace taihu {
namespace {

constexpr std::uint32_t kNone = CornerTable::kNone;
constexpr std::size_t kMostValence = 24;
constexpr float kLengthWeight = 1e-3f; ///< on what is flat, short edges go first
constexpr float kAtOnce = 1e-20f, kNever = 1e30f;
constexpr double kHope = 1.25;   ///< how far over its estimate an error may still turn out to fit
constexpr double kNoDoubt = 0.8; ///< how far below the bound an estimate is taken for the error
constexpr double kMostBlocks = 1 << 22;

} // namespace

void Collapser::Quadric::add(const Quadric& other, const Vec3& d) {
    // q(x) about other is q(x + s) about this, s = this - other.
    const auto x = static_cast<float>(-d.x), y = static_cast<float>(-d.y),
               z = static_cast<float>(-d.z);
    c += std::max(0.f, other.at(-d));
    b[0] += other.b[0] + other.a[0] * x + other.a[1] * y + other.a[2] * z;
    b[1] += other.b[1] + other.a[1] * x + other.a[3] * y + other.a[4] * z;
    b[2] += other.b[2] + other.a[2] * x + other.a[4] * y + other.a[5] * z;
    for (std::size_t i = 0; i < 6; ++i)
        a[i] += other.a[i];
}

void Collapser::Buckets::push(float cost, const Entry& entry) {
    const auto bucket = static_cast<std::size_t>(std::bit_cast<std::uint32_t>(cost) >> 21);
    entries_[bucket].push_back(entry);
    lowest_ = std::min(lowest_, bucket);
    ++n_;
}

Collapser::Entry Collapser::Buckets::pop() {
    while (entries_[lowest_].empty())
        ++lowest_;
    const Entry entry = entries_[lowest_].back();
    entries_[lowest_].pop_back();
    if (--n_ == 0)
        lowest_ = kBuckets;
    return entry;
}

Collapser::Collapser(CornerTable& table, std::span<const Vec3> positions,
                     std::span<const std::uint8_t> frozen, const FaceErrors& errors,
                     const Rules& rules)
    : table_(table), positions_(positions), errors_(errors), rules_(rules),
      nodes_(positions.size()), owners_(positions.size(), 0), inner_(positions.size(), 0),
      open_(positions.size(), 1), rooms_(positions.size()), slopes_(positions.size()) {
    tbb::parallel_for(
        tbb::blocked_range<std::uint32_t>(0, static_cast<std::uint32_t>(positions.size()), 1024),
        [&](const auto& range) {
            for (std::uint32_t v = range.begin(); v < range.end(); ++v) {
                if (!table_.has_vertex(v))
                    continue;
                Node& node = nodes_[v];
                auto& a = node.quadric.a;
                const Vec3& p = positions_[v];
                std::uint32_t c = table_.corner(v);
                do {
                    const Vec3 n = cross(positions_[table_.vertex(CornerTable::next(c))] - p,
                                         positions_[table_.vertex(CornerTable::previous(c))] - p);
                    if (const double w = length(n); w > 0) {
                        const auto x = static_cast<float>(n.x), y = static_cast<float>(n.y),
                                   z = static_cast<float>(n.z), s = static_cast<float>(1 / w);
                        const std::array<float, 6> add = {x * x, x * y, x * z, y * y, y * z, z * z};
                        for (std::size_t i = 0; i < 6; ++i)
                            a[i] += add[i] * s;
                    }
                    c = table_.swing(c);
                } while (c != table_.corner(v));
                node.label = errors_.labels()[v];
                const auto shapes = errors_.shapes(node.label);
                node.stays = frozen[v] != 0;
                node.fixed = shapes.size() == PrimitiveSet::kMost;
                node.off = shapes.empty();
                for (const std::uint32_t shape : shapes) {
                    const FieldProbe::Value at = errors_.of(shape, p);
                    node.off = node.off || std::abs(at.value_m) > rules_.off_m;
                    if (slopes_[v].shape == FaceErrors::kNone && !errors_.has_closed_form(shape))
                        slopes_[v] = {shape,
                                      {static_cast<float>(at.gradient.x),
                                       static_cast<float>(at.gradient.y),
                                       static_cast<float>(at.gradient.z)}};
                }
            }
        });
}

double Collapser::mean_edge_m() const {
    double sum = 0;
    std::size_t n = 0;
    for (std::size_t t = 0; t < table_.n_triangles(); ++t) {
        if (!table_.has_triangle(t))
            continue;
        const Triangle v = table_.triangle(t);
        for (std::size_t k = 0; k < 3; ++k, ++n)
            sum += length(positions_[v[k]] - positions_[v[(k + 1) % 3]]);
    }
    return n == 0 ? 0 : sum / static_cast<double>(n);
}

Collapser::Blocks Collapser::divide(double block_m, double shift_m) {
    Box box;
    for (std::uint32_t v = 0; v < positions_.size(); ++v)
        if (table_.has_vertex(v))
            box.include(positions_[v]);
    const Vec3 size = box.size() + Vec3{1, 1, 1} * shift_m;
    const double side = std::max(block_m, std::cbrt(size.x * size.y * size.z / kMostBlocks));
    const auto count = [&](double x) { return static_cast<std::uint32_t>(x / side) + 1; };
    const std::uint32_t ny = count(size.y), nz = count(size.z), n = count(size.x) * ny * nz;
    Blocks blocks;
    blocks.first.assign(n + 1, 0);
    std::size_t n_left = 0;
    for (std::uint32_t v = 0; v < positions_.size(); ++v) {
        if (!table_.has_vertex(v))
            continue;
        const Vec3 p = positions_[v] - box.lo + Vec3{1, 1, 1} * shift_m;
        const auto at = [&](double x) { return static_cast<std::uint32_t>(x / side); };
        owners_[v] = (at(p.x) * ny + at(p.y)) * nz + at(p.z);
        ++blocks.first[owners_[v] + 1];
        ++n_left;
    }
    for (std::uint32_t b = 0; b < n; ++b)
        blocks.first[b + 1] += blocks.first[b];
    std::vector<std::uint32_t> at(blocks.first.begin(), blocks.first.end() - 1);
    blocks.vertices.resize(n_left);
    for (std::uint32_t v = 0; v < positions_.size(); ++v)
        if (table_.has_vertex(v))
            blocks.vertices[at[owners_[v]]++] = v;
    return blocks;
}

/// A collapse takes place among inner vertices and leaves them inner, so this is known once a pass.
void Collapser::find_inner() {
    std::fill(inner_.begin(), inner_.end(), std::uint8_t{1});
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, table_.n_triangles(), 4096), [&](const auto& range) {
            for (std::size_t t = range.begin(); t < range.end(); ++t) {
                if (!table_.has_triangle(t))
                    continue;
                const Triangle v = table_.triangle(t);
                if (owners_[v[0]] == owners_[v[1]] && owners_[v[1]] == owners_[v[2]])
                    continue;
                for (std::size_t k = 0; k < 3; ++k)
                    if (owners_[v[k]] != owners_[v[(k + 1) % 3]])
                        for (const std::uint32_t end : {v[k], v[(k + 1) % 3]})
                            std::atomic_ref(inner_[end]).store(0, std::memory_order_relaxed);
            }
        });
}

void Collapser::pass(double block_m, double shift_m, Progress* progress) {
    const Blocks blocks = divide(block_m, shift_m);
    find_inner();
    tbb::enumerable_thread_specific<Buckets> queues;
    std::atomic<std::size_t> n_done{0};
    const std::size_t n = blocks.first.size() - 1, step = std::max<std::size_t>(1, n / 100);
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t b) {
        if (progress && progress->cancelled())
            return;
        run(std::span(blocks.vertices)
                .subspan(blocks.first[b], blocks.first[b + 1] - blocks.first[b]),
            queues.local());
        if (const std::size_t done = ++n_done; done % step == 0)
            report_fraction(progress, static_cast<double>(done) / static_cast<double>(n));
    });
    check_cancelled(progress);
}

void Collapser::run(std::span<const std::uint32_t> vertices, Buckets& queue) {
    const auto each_neighbour = [&](std::uint32_t v, auto&& visit) {
        std::uint32_t c = table_.corner(v);
        do {
            visit(table_.vertex(CornerTable::next(c)));
            c = table_.swing(c);
        } while (c != table_.corner(v));
    };
    for (const std::uint32_t v : vertices)
        if (inner_[v])
            each_neighbour(v, [&](std::uint32_t u) {
                if (v < u && inner_[u] && (open_[u] || open_[v]))
                    push(v, u, queue);
            });
    while (!queue.empty()) {
        const Entry e = queue.pop();
        if (nodes_[e.a].stamp != e.stamp_a || nodes_[e.b].stamp != e.stamp_b)
            continue;
        std::uint32_t kept = e.b;
        if (!try_collapse(e.a, e.b)) {
            if (!try_collapse(e.b, e.a))
                continue;
            kept = e.a;
        }
        ++nodes_[e.a].stamp;
        ++nodes_[e.b].stamp;
        each_neighbour(kept, [&](std::uint32_t u) {
            if (inner_[u])
                push(kept, u, queue);
        });
    }
    for (const std::uint32_t v : vertices) {
        if (!table_.has_vertex(v))
            continue;
        bool open = !inner_[v];
        each_neighbour(
            v, [&](std::uint32_t u) { open = open || owners_[u] != owners_[v] || !inner_[u]; });
        open_[v] = open;
    }
}

bool Collapser::may_move(const Node& a, const Node& b) const {
    return !b.off && !a.stays &&
           (a.off || (!a.fixed && (a.label == b.label || errors_.within(a.label, b.label))));
}

void Collapser::push(std::uint32_t a, std::uint32_t b, Buckets& queue) const {
    const Node &s = nodes_[a], &t = nodes_[b];
    const bool there = may_move(s, t), back = may_move(t, s);
    if (!there && !back)
        return;
    const Vec3 d = positions_[b] - positions_[a];
    const float along = kLengthWeight * static_cast<float>(length_squared(d));
    const auto cost = [&](const Node& from, const Node& to, const Vec3& by) {
        return from.off ? kAtOnce : std::max(0.f, from.quadric.at(by)) + to.quadric.c + along;
    };
    const float to_b = there ? cost(s, t, d) : kNever, to_a = back ? cost(t, s, -d) : kNever;
    if (to_a < to_b)
        queue.push(to_a, {b, a, t.stamp, s.stamp});
    else
        queue.push(to_b, {a, b, s.stamp, t.stamp});
}

bool Collapser::try_collapse(std::uint32_t a, std::uint32_t b) {
    if (!may_move(nodes_[a], nodes_[b]))
        return false;
    Ring ring_a, ring_b;
    if (!table_.ring(a, ring_a) || !table_.ring(b, ring_b) ||
        ring_a.n + ring_b.n > kMostValence + 4)
        return false;
    const std::uint32_t c = table_.collapsible(a, b, ring_a, ring_b);
    if (c == kNone || !shapely(a, b, ring_a) || !legal(b, ring_a))
        return false;
    table_.collapse(c, ring_a);
    nodes_[b].quadric.add(nodes_[a].quadric, positions_[a] - positions_[b]);
    return true;
}

/// Whether the cubic through the values and gradients at both ends of an edge leaves hope that its
/// middle is near enough; spares most of the samples that would say no.
bool Collapser::may_fit(std::uint32_t a, std::uint32_t b) const {
    const FaceSlope &s = slopes_[a], &t = slopes_[b];
    if (s.shape == FaceErrors::kNone || s.shape != t.shape ||
        errors_.n_primitives(nodes_[a].label) > 1 || errors_.n_primitives(nodes_[b].label) > 1)
        return true;
    const double at_middle = dot(s.at() - t.at(), positions_[b] - positions_[a]) / 8;
    return std::abs(at_middle) <= kHope * (rules_.face.centred ? 2 : 1) * rules_.face.face_m;
}

/// Whether no face turns over, or becomes a sliver.
bool Collapser::shapely(std::uint32_t a, std::uint32_t b, const Ring& ring) const {
    const Vec3 &from = positions_[a], &to = positions_[b];
    return ring.each([&](std::uint32_t v, std::uint32_t w) {
        if (v == b || w == b)
            return true;
        if (!may_fit(b, v))
            return false;
        const Vec3 &p = positions_[v], &q = positions_[w];
        const Vec3 before = cross(p - from, q - from), after = cross(p - to, q - to);
        const double area_before = length(before), area = length(after), e = length_squared(q - p),
                     edge = std::max({e, length_squared(p - to), length_squared(q - to)});
        if (dot(before, after) <= rules_.least_turn * area_before * area)
            return false;
        return area >= rules_.least_quality * edge ||
               area * std::max({e, length_squared(p - from), length_squared(q - from)}) >=
                   area_before * edge;
    });
}

const Collapser::Room& Collapser::room(std::uint32_t v) {
    Room& room = rooms_[v];
    if (room.any_m < 0) {
        const auto clear = errors_.clearance(positions_[v], nodes_[v].label);
        const auto down = [](double x) { return static_cast<float>(std::max(0., 0.999 * x)); };
        room = {down(clear.sampled), down(clear.any)};
    }
    return room;
}

/// Whether a face keeps the rules. \param clear_m  from its first corner, to other primitives.
bool Collapser::fits(const Triangle& face, double clear_m, FaceErrors::Rules rules) const {
    const FaceErrors::Labels l = {nodes_[face[0]].label, nodes_[face[1]].label,
                                  nodes_[face[2]].label};
    const FaceErrors::Corners p = {positions_[face[0]], positions_[face[1]], positions_[face[2]]};
    const std::array<FaceSlope, 3> slopes = {slopes_[face[0]], slopes_[face[1]], slopes_[face[2]]};
    rules.slopes = &slopes;
    constexpr double kBroken = std::numeric_limits<double>::infinity();
    const auto asked = [&] { return errors_.bound(p, l, rules) < kBroken; };
    const PrimitiveSet shared = errors_.shared(l);
    if (shared.size() != 1 || !rules.exact_corners)
        return asked();
    const bool alone = clear_m > 0 && std::max(length_squared(p[1] - p[0]),
                                               length_squared(p[2] - p[0])) < clear_m * clear_m;
    const std::uint32_t shape = shared[0];
    const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
    if (errors_.has_closed_form(shape))
        return (alone && errors_.fits_ball(shape, p[0], n, rules)) || asked();
    if (slopes[0].shape != shape || slopes[1].shape != shape || slopes[2].shape != shape)
        return asked();
    // The parabolas at its corners leave no doubt about most faces, and spare their samples.
    const auto [range, skew, is_smooth] =
        parabolas(p, {}, {slopes[0].at(), slopes[1].at(), slopes[2].at()});
    const double error = rules.centred ? (range.hi - range.lo) / 2 : range.most();
    if (error > kHope * rules.face_m)
        return false;
    if (!is_smooth || error + skew > kNoDoubt * rules.face_m)
        return asked();
    return dot(n, range.gradient) >= rules.turn_cosine * length(n) * length(range.gradient) &&
           (alone || errors_.bound_beside(shape, range, p, l, rules) < kBroken);
}

bool Collapser::legal(std::uint32_t b, const Ring& ring) {
    FaceErrors::Rules rules = rules_.face;
    const Room& room_b = room(b);
    rules.clear_m = static_cast<double>(room_b.sampled_m);
    const double clear = errors_.n_primitives(nodes_[b].label) == 1
                             ? static_cast<double>(room_b.any_m) - errors_.reach_m(rules)
                             : 0;
    return ring.each([&](std::uint32_t v, std::uint32_t w) {
        rules.exact_corners = !nodes_[v].off && !nodes_[w].off;
        return v == b || w == b || fits({b, v, w}, clear, rules);
    });
}

} // namespace taihu
