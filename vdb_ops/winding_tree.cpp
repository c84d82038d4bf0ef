#include "vdb_ops/winding_tree_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "stats/core/box.h"

namespace taihu {
namespace {

constexpr std::uint32_t kLeafTriangles = 2;
constexpr double kFar = 4;   // radii
constexpr int kDeepest = 64; // halving 2^32 triangles takes half as many

Vec3 area_vector(const Vec3& a, const Vec3& b, const Vec3& c) {
    return cross(b - a, c - a) * 0.5;
}

} // namespace

WindingTree::WindingTree(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
    triangles_.reserve(triangles.size());
    for (const Triangle& t : triangles)
        triangles_.push_back({points[t[0]], points[t[1]], points[t[2]]});
    if (!triangles_.empty())
        build(0, static_cast<std::uint32_t>(triangles_.size()));
}

void WindingTree::build(std::uint32_t begin, std::uint32_t end) {
    const std::size_t at = nodes_.size();
    Node node;
    node.begin = begin;
    node.end = end;
    Box box;
    for (std::uint32_t i = begin; i < end; ++i) {
        const Corners& t = triangles_[i];
        const Vec3 area = area_vector(t.a, t.b, t.c);
        node.area += area;
        node.area_sum += length(area);
        node.center += (t.a + t.b + t.c) * (length(area) / 3);
        for (const Vec3& p : {t.a, t.b, t.c})
            box.include(p);
    }
    node.center = node.area_sum > 0 ? node.center / node.area_sum : box.center();
    for (std::uint32_t i = begin; i < end; ++i)
        for (const Vec3& p : {triangles_[i].a, triangles_[i].b, triangles_[i].c})
            node.radius = std::max(node.radius, length(p - node.center));
    nodes_.push_back(node);
    if (end - begin <= kLeafTriangles)
        return;
    const Vec3 size = box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto key = [axis](const Corners& t) { return t.a[axis] + t.b[axis] + t.c[axis]; };
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(triangles_.begin() + begin, triangles_.begin() + middle,
                     triangles_.begin() + end,
                     [&](const Corners& a, const Corners& b) { return key(a) < key(b); });
    build(begin, middle);
    nodes_[at].second = static_cast<std::uint32_t>(nodes_.size());
    build(middle, end);
}

double WindingTree::at(const Vec3& p, bool* on_face) const {
    if (nodes_.empty())
        return 0;
    std::array<std::uint32_t, kDeepest> todo{};
    std::size_t n = 1;
    double sum = 0;
    while (n > 0) {
        const std::uint32_t i = todo[--n];
        const Node& node = nodes_[i];
        const Vec3 d = node.center - p;
        const double d2 = length_squared(d);
        if (d2 > kFar * kFar * node.radius * node.radius) {
            sum += dot(d, node.area) / (d2 * std::sqrt(d2));
        } else if (node.second != 0) {
            todo[n++] = node.second;
            todo[n++] = i + 1;
        } else {
            for (std::uint32_t k = node.begin; k < node.end; ++k) {
                const Vec3 a = triangles_[k].a - p, b = triangles_[k].b - p,
                           c = triangles_[k].c - p;
                const double la = length(a), lb = length(b), lc = length(c);
                const double volume = dot(a, cross(b, c));
                const double cosines =
                    la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
                if (std::fabs(volume) <= 1e-9 * la * lb * lc && cosines <= 0) {
                    if (on_face)
                        *on_face = true;
                    continue;
                }
                sum += 2 * std::atan2(volume, cosines); // Van Oosterom & Strackee 1983
            }
        }
    }
    return sum / (4 * std::numbers::pi);
}

bool WindingTree::near(const Vec3& p, double radius) const {
    std::array<std::uint32_t, kDeepest> todo{};
    std::size_t n = nodes_.empty() ? 0 : 1;
    while (n > 0) {
        const std::uint32_t i = todo[--n];
        const Node& node = nodes_[i];
        if (length(node.center - p) > node.radius + radius)
            continue;
        if (node.second == 0)
            return true;
        todo[n++] = node.second;
        todo[n++] = i + 1;
    }
    return false;
}

double WindingTree::bound(const Vec3& p, double radius) const {
    if (nodes_.empty())
        return 0;
    std::array<std::uint32_t, kDeepest> todo{};
    std::size_t n = 1;
    double sum = 0;
    while (n > 0 && sum < 1) {
        const std::uint32_t i = todo[--n];
        const Node& node = nodes_[i];
        const double nearest = length(node.center - p) - node.radius - radius;
        const bool leaf = node.second == 0;
        if (nearest > (leaf ? 0 : node.radius)) {
            sum += node.area_sum / (4 * std::numbers::pi * nearest * nearest);
        } else if (leaf) {
            return 1;
        } else {
            todo[n++] = node.second;
            todo[n++] = i + 1;
        }
    }
    return sum;
}

} // namespace taihu
