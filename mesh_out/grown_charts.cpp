#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "mesh_out/chart_plane_detail.h"
#include "mesh_out/charts_detail.h"

namespace taihu {
namespace {

constexpr double kLeastFacing = 1 / std::numbers::sqrt3;
constexpr std::size_t kMostFaces = 1024; ///< of a chart: larger ones wind about what they leave out
constexpr int kAimings = 3, kMostPasses = 4;

using Neighbours = std::span<const std::array<std::uint32_t, 3>>;

ChartPlane::Corners projected(const TriMesh& mesh, std::uint32_t face, const Projection& to) {
    ChartPlane::Corners out{};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = mesh.positions[mesh.triangles[face][k]];
        out[k] = {dot(p, to.u_axis), dot(p, to.v_axis)};
    }
    return out;
}

class Grower {
public:
    Grower(std::span<const Vec3> normals, std::span<const double> areas, Neighbours neighbours,
           const TriMesh& mesh)
        : normals_(normals), areas_(areas), neighbours_(neighbours), mesh_(mesh),
          seen_(normals.size(), kNoFace), place_(normals.size()) {
        charts_.of_face.assign(normals.size(), kNoFace);
    }

    /// A chart about a face that is in none.
    void grow(std::uint32_t first) {
        Vec3 direction = normals_[first];
        std::vector<std::uint32_t> near;
        for (int i = 0; i < kAimings; ++i) {
            near = reached(first, direction);
            Vec3 sum;
            for (const std::uint32_t f : near)
                sum += normals_[f] * areas_[f];
            // The face it began with has to stay in it.
            if (dot(normalized(sum), normals_[first]) < kLeastFacing)
                break;
            direction = normalized(sum);
        }
        near = reached(first, direction);
        const Projection to = projection(direction);
        std::vector<ChartPlane::Corners> corners;
        for (std::uint32_t i = 0; i < near.size(); ++i) {
            place_[near[i]] = i;
            corners.push_back(projected(mesh_, near[i], to));
        }
        ChartPlane plane(corners);
        const auto chart = static_cast<std::uint32_t>(charts_.directions.size());
        charts_.directions.push_back(direction);
        std::vector<std::uint32_t> added = {first};
        plane.add(place_[first]);
        charts_.of_face[first] = chart;
        for (std::size_t i = 0; i < added.size(); ++i)
            for (const std::uint32_t g : neighbours_[added[i]])
                if (g != kNoFace && charts_.of_face[g] == kNoFace && seen_[g] == mark_ &&
                    plane.add(place_[g])) {
                    charts_.of_face[g] = chart;
                    added.push_back(g);
                }
    }
    bool is_free(std::uint32_t face) const { return charts_.of_face[face] == kNoFace; }
    GrownCharts& charts() { return charts_; }

private:
    /// Free faces round about that face the direction, nearest first; they are marked.
    std::vector<std::uint32_t> reached(std::uint32_t first, const Vec3& direction) {
        ++mark_;
        std::vector<std::uint32_t> out = {first};
        seen_[first] = mark_;
        for (std::size_t i = 0; i < out.size() && out.size() < kMostFaces; ++i)
            for (const std::uint32_t g : neighbours_[out[i]])
                if (g != kNoFace && seen_[g] != mark_ && is_free(g) &&
                    dot(normals_[g], direction) >= kLeastFacing) {
                    seen_[g] = mark_;
                    out.push_back(g);
                }
        return out;
    }

    std::span<const Vec3> normals_;
    std::span<const double> areas_;
    Neighbours neighbours_;
    const TriMesh& mesh_;
    GrownCharts charts_;
    std::vector<std::uint32_t> seen_, place_;
    std::uint32_t mark_ = 0;
};

/// Tiny charts into those beside them.
class Joiner {
public:
    Joiner(GrownCharts& charts, std::span<const Vec3> normals, Neighbours neighbours,
           const TriMesh& mesh, double least_facing)
        : charts_(charts), normals_(normals), neighbours_(neighbours), mesh_(mesh),
          least_facing_(least_facing), faces_(charts.directions.size()) {
        for (std::uint32_t f = 0; f < charts.of_face.size(); ++f)
            faces_[charts.of_face[f]].push_back(f);
    }

    /// Whether any joined.
    bool join(std::span<const double> areas, double tiny_m2) {
        std::vector<std::vector<std::uint32_t>> wishes(faces_.size()); // of each, who would join it
        std::vector<std::pair<double, std::uint32_t>> tiny;
        for (std::uint32_t c = 0; c < faces_.size(); ++c) {
            double area = 0;
            for (const std::uint32_t f : faces_[c])
                area += areas[f];
            if (!faces_[c].empty() && area < tiny_m2)
                tiny.emplace_back(area, c);
        }
        std::sort(tiny.begin(), tiny.end());
        for (const auto& [area, c] : tiny)
            if (const std::uint32_t host = host_of(c); host != kNoFace)
                wishes[host].push_back(c);
        bool changed = false;
        for (std::uint32_t host = 0; host < wishes.size(); ++host)
            if (!wishes[host].empty() && !faces_[host].empty())
                changed |= take(host, wishes[host]);
        return changed;
    }

private:
    /// Across the longest part of its border, of those that none of its faces minds.
    std::uint32_t host_of(std::uint32_t c) const {
        std::vector<std::pair<std::uint32_t, double>> borders;
        for (const std::uint32_t f : faces_[c])
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t g = neighbours_[f][k];
                if (g == kNoFace || charts_.of_face[g] == c)
                    continue;
                const double l = length(mesh_.positions[mesh_.triangles[f][k]] -
                                        mesh_.positions[mesh_.triangles[f][(k + 1) % 3]]);
                const auto known = std::find_if(borders.begin(), borders.end(), [&](const auto& b) {
                    return b.first == charts_.of_face[g];
                });
                if (known == borders.end())
                    borders.emplace_back(charts_.of_face[g], l);
                else
                    known->second += l;
            }
        std::uint32_t best = kNoFace;
        double most = 0;
        for (const auto& [host, l] : borders) {
            const Vec3 facing = charts_.directions[host];
            if (l > most && std::all_of(faces_[c].begin(), faces_[c].end(), [&](std::uint32_t f) {
                    return dot(normals_[f], facing) >= least_facing_;
                })) {
                best = host;
                most = l;
            }
        }
        return best;
    }
    /// Those of `guests` that overlap nothing there.
    bool take(std::uint32_t host, const std::vector<std::uint32_t>& guests) {
        const Projection to = projection(charts_.directions[host]);
        std::vector<std::uint32_t> all = faces_[host];
        for (const std::uint32_t c : guests)
            all.insert(all.end(), faces_[c].begin(), faces_[c].end());
        std::vector<ChartPlane::Corners> corners;
        for (const std::uint32_t f : all)
            corners.push_back(projected(mesh_, f, to));
        ChartPlane plane(corners);
        std::uint32_t at = 0;
        for (const auto end = static_cast<std::uint32_t>(faces_[host].size()); at < end; ++at)
            plane.add(at);
        bool changed = false;
        for (const std::uint32_t c : guests) {
            const auto end = at + static_cast<std::uint32_t>(faces_[c].size());
            std::uint32_t i = at; // one that others joined may mind more than it did
            while (i < end && dot(normals_[all[i]], charts_.directions[host]) >= least_facing_ &&
                   plane.add(i))
                ++i;
            if (i == end && end > at) {
                for (const std::uint32_t f : faces_[c])
                    charts_.of_face[f] = host;
                faces_[host].insert(faces_[host].end(), faces_[c].begin(), faces_[c].end());
                faces_[c].clear();
                changed = true;
            } else {
                while (i > at)
                    plane.remove(--i);
            }
            at = end;
        }
        return changed;
    }

    GrownCharts& charts_;
    std::span<const Vec3> normals_;
    Neighbours neighbours_;
    const TriMesh& mesh_;
    double least_facing_;
    std::vector<std::vector<std::uint32_t>> faces_;
};

/// Numbers without those that nothing is left of.
void renumber(GrownCharts& charts) {
    std::vector<std::uint32_t> number(charts.directions.size(), kNoFace);
    std::vector<Vec3> directions;
    for (std::uint32_t& c : charts.of_face) {
        if (number[c] == kNoFace) {
            number[c] = static_cast<std::uint32_t>(directions.size());
            directions.push_back(charts.directions[c]);
        }
        c = number[c];
    }
    charts.directions = std::move(directions);
}

} // namespace

GrownCharts grow_charts(std::span<const Vec3> normals, std::span<const double> areas,
                        Neighbours neighbours, const TriMesh& mesh, const AtlasSettings& settings,
                        Progress* progress) {
    Grower grower(normals, areas, neighbours, mesh);
    std::vector<std::uint32_t> order(
        normals.size()); // large faces first: they lie where it is flat
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return areas[a] != areas[b] ? areas[a] > areas[b] : a < b;
    });
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i % 4096 == 0)
            check_cancelled(progress);
        if (grower.is_free(order[i]))
            grower.grow(order[i]);
    }
    GrownCharts& charts = grower.charts();
    const double whole_m2 = std::accumulate(areas.begin(), areas.end(), 0.0);
    Joiner joiner(charts, normals, neighbours, mesh, 1 / settings.merge_stretch);
    for (int pass = 0; pass < kMostPasses; ++pass)
        if (!joiner.join(areas, settings.tiny_area_rel * whole_m2))
            break;
    renumber(charts);
    return std::move(charts);
}

} // namespace taihu
