#include "mesh_out/charts_detail.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include "mesh_out/chart_plane_detail.h"

namespace taihu {
namespace {

using Neighbours = std::span<const std::array<std::uint32_t, 3>>;

constexpr int kSmoothings = 2, kMostPasses = 8;
constexpr std::uint32_t kNone = kNoFace;

int dominant_direction(const Vec3& n) {
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (std::fabs(n[a]) > std::fabs(n[axis]))
            axis = a;
    return 2 * axis + (n[axis] < 0);
}

/// Connected faces of one direction, numbered in the order of their first face.
struct Patches {
    std::vector<std::uint32_t> of_face;
    std::vector<std::vector<std::uint32_t>> faces;
};

Patches find_patches(std::span<const std::uint8_t> directions, Neighbours neighbours) {
    Patches out;
    out.of_face.assign(directions.size(), kNone);
    for (std::uint32_t first = 0; first < directions.size(); ++first) {
        if (out.of_face[first] != kNone)
            continue;
        const auto patch = static_cast<std::uint32_t>(out.faces.size());
        std::vector<std::uint32_t> faces = {first};
        out.of_face[first] = patch;
        for (std::size_t i = 0; i < faces.size(); ++i)
            for (const std::uint32_t g : neighbours[faces[i]])
                if (g != kNone && out.of_face[g] == kNone && directions[g] == directions[first]) {
                    out.of_face[g] = patch;
                    faces.push_back(g);
                }
        out.faces.push_back(std::move(faces));
    }
    return out;
}

/// The direction across the longest part of a patch's border that no face of it minds, or none.
std::optional<std::uint8_t> joined_direction(std::span<const std::uint32_t> patch,
                                             std::span<const std::uint8_t> directions,
                                             Neighbours neighbours, std::span<const Vec3> normals,
                                             const TriMesh& mesh, double least_facing) {
    std::array<double, 6> border{};
    for (const std::uint32_t f : patch)
        for (std::size_t k = 0; k < 3; ++k)
            if (const std::uint32_t g = neighbours[f][k];
                g != kNone && directions[g] != directions[f])
                border[directions[g]] += length(mesh.positions[mesh.triangles[f][k]] -
                                                mesh.positions[mesh.triangles[f][(k + 1) % 3]]);
    for (const std::uint32_t f : patch)
        for (int d = 0; d < 6; ++d)
            if (dot(normals[f], direction_vector(d)) < least_facing)
                border[static_cast<std::size_t>(d)] = 0;
    const auto best = std::max_element(border.begin(), border.end());
    if (*best == 0)
        return std::nullopt;
    return static_cast<std::uint8_t>(best - border.begin());
}

/// Normals of faces, mixed with those of their neighbours.
std::vector<Vec3> smoothed(std::span<const Vec3> normals, std::span<const double> areas,
                           Neighbours neighbours) {
    std::vector<Vec3> now(normals.begin(), normals.end());
    for (int i = 0; i < kSmoothings; ++i) {
        const std::vector<Vec3> before = now;
        for (std::size_t f = 0; f < now.size(); ++f) {
            Vec3 sum = before[f] * areas[f];
            for (const std::uint32_t g : neighbours[f])
                if (g != kNone)
                    sum += before[g] * areas[g];
            now[f] = normalized(sum);
        }
    }
    return now;
}

} // namespace

Vec3 direction_vector(int direction) {
    Vec3 d;
    d[direction / 2] = direction % 2 == 0 ? 1 : -1;
    return d;
}

Projection projection(const Vec3& direction) {
    const bool level = std::fabs(direction.y) < 1 - 1e-12;
    Vec3 v = level ? Vec3{0, 1, 0} : Vec3{0, 0, direction.y > 0 ? -1.0 : 1.0};
    v = normalized(v - direction * dot(v, direction));
    return {cross(v, direction), v};
}

std::vector<std::array<std::uint32_t, 3>> face_neighbours(std::span<const Triangle> triangles) {
    struct Side {
        std::uint32_t a, b, face, k;
    };
    std::vector<Side> sides;
    sides.reserve(3 * triangles.size());
    for (std::uint32_t f = 0; f < triangles.size(); ++f)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(triangles[f][k], triangles[f][(k + 1) % 3]);
            sides.push_back({a, b, f, k});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.a, x.b, x.face, x.k) < std::tie(y.a, y.b, y.face, y.k);
    });
    std::vector<std::array<std::uint32_t, 3>> out(triangles.size(), {kNone, kNone, kNone});
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i + 1;
        while (end < sides.size() && sides[end].a == sides[i].a && sides[end].b == sides[i].b)
            ++end;
        if (end == i + 2) {
            out[sides[i].face][sides[i].k] = sides[i + 1].face;
            out[sides[i + 1].face][sides[i + 1].k] = sides[i].face;
        }
        i = end;
    }
    return out;
}

std::vector<std::uint8_t> chart_directions(std::span<const Vec3> normals,
                                           std::span<const double> areas, Neighbours neighbours,
                                           const TriMesh& mesh, const AtlasSettings& settings) {
    const std::vector<Vec3> smooth = smoothed(normals, areas, neighbours);
    std::vector<std::uint8_t> out(normals.size());
    for (std::size_t f = 0; f < out.size(); ++f) {
        int d = dominant_direction(smooth[f]);
        if (dot(normals[f], direction_vector(d)) < 1 / std::numbers::sqrt3)
            d = dominant_direction(normals[f]);
        out[f] = static_cast<std::uint8_t>(d);
    }
    const double whole_m2 = std::accumulate(areas.begin(), areas.end(), 0.0);
    for (int pass = 0; pass < kMostPasses; ++pass) {
        const Patches patches = find_patches(out, neighbours);
        std::vector<std::pair<double, std::uint32_t>> tiny; // area, patch
        for (std::uint32_t p = 0; p < patches.faces.size(); ++p) {
            double area = 0;
            for (const std::uint32_t f : patches.faces[p])
                area += areas[f];
            if (area < settings.tiny_area_rel * whole_m2)
                tiny.emplace_back(area, p);
        }
        std::sort(tiny.begin(), tiny.end());
        bool changed = false;
        for (const auto& [area, p] : tiny)
            if (const auto d = joined_direction(patches.faces[p], out, neighbours, normals, mesh,
                                                1 / settings.merge_stretch)) {
                for (const std::uint32_t f : patches.faces[p])
                    out[f] = *d;
                changed = true;
            }
        if (!changed)
            break;
    }
    return out;
}

std::vector<std::uint32_t> split_charts(const TriMesh& mesh,
                                        std::span<const std::uint8_t> directions,
                                        Neighbours neighbours, Progress* progress) {
    const Patches patches = find_patches(directions, neighbours);
    std::vector<std::uint32_t> chart(directions.size(), kNone), place(directions.size());
    std::uint32_t n_charts = 0;
    for (std::size_t patch = 0; patch < patches.faces.size(); ++patch) {
        if (patch % 256 == 0)
            check_cancelled(progress);
        const std::vector<std::uint32_t>& faces = patches.faces[patch];
        const auto [u, v] = projection(direction_vector(directions[faces.front()]));
        std::vector<ChartPlane::Corners> projected;
        for (std::uint32_t i = 0; i < faces.size(); ++i) {
            place[faces[i]] = i;
            ChartPlane::Corners& c = projected.emplace_back();
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3& p = mesh.positions[mesh.triangles[faces[i]][k]];
                c[k] = {dot(p, u), dot(p, v)};
            }
        }
        ChartPlane plane(projected);
        for (std::uint32_t first = 0; first < faces.size(); ++first) {
            if (chart[faces[first]] != kNone)
                continue;
            std::vector<std::uint32_t> added = {first}; // places in the patch
            plane.add(first);
            chart[faces[first]] = n_charts;
            for (std::size_t i = 0; i < added.size(); ++i)
                for (const std::uint32_t g : neighbours[faces[added[i]]])
                    if (g != kNone && chart[g] == kNone && patches.of_face[g] == patch &&
                        plane.add(place[g])) {
                        chart[g] = n_charts;
                        added.push_back(place[g]);
                    }
            plane.clear(added);
            ++n_charts;
        }
    }
    return chart;
}

std::optional<Shelves> pack_shelves(std::span<const ChartSize> charts, int side_px, int gutter_px) {
    double area_m2 = 0, longest_m = 0;
    for (const ChartSize& c : charts) {
        area_m2 += c.width_m * c.height_m;
        longest_m = std::max({longest_m, c.width_m, c.height_m});
    }
    const auto pack = [&](double texel_m) -> std::optional<Shelves> {
        Shelves out{texel_m, std::vector<std::array<int, 4>>(charts.size())};
        // An eighth more, since texture points are rounded.
        const auto texels = [&](double m) { return int(std::ceil(m / texel_m + 0.125)); };
        if (longest_m / texel_m > side_px)
            return std::nullopt;
        std::vector<std::size_t> order(charts.size());
        for (std::size_t c = 0; c < charts.size(); ++c) {
            out.places[c] = {0, 0, texels(charts[c].width_m), texels(charts[c].height_m)};
            order[c] = c;
        }
        std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
            const auto key = [&](std::size_t c) {
                return std::array{-out.places[c][3], -out.places[c][2], static_cast<int>(c)};
            };
            return key(a) < key(b);
        });
        int x = 0, y = 0, shelf = 0;
        for (const std::size_t c : order) {
            auto& [left, top, width, height] = out.places[c];
            const int w = width + 2 * gutter_px, h = height + 2 * gutter_px;
            if (x + w > side_px) {
                x = 0;
                y += shelf;
                shelf = 0;
            }
            shelf = std::max(shelf, h);
            if (w > side_px || y + shelf > side_px)
                return std::nullopt;
            left = x + gutter_px;
            top = y + gutter_px;
            x += w;
        }
        return out;
    };
    double too_small = std::sqrt(area_m2) / side_px, fits = longest_m;
    auto best = pack(fits);
    for (int i = 0; best && i < 32; ++i) {
        const double middle = std::sqrt(too_small * fits);
        if (auto tried = pack(middle)) {
            best = std::move(tried);
            fits = middle;
        } else {
            too_small = middle;
        }
    }
    return best;
}

} // namespace taihu
