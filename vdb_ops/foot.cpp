#include "vdb_ops/foot.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/solids_field.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

constexpr double kMostTilt_deg = 60;

struct Point {
    double x = 0, z = 0;
};

double turn(const Point& a, const Point& b, const Point& c) {
    return (b.x - a.x) * (c.z - a.z) - (b.z - a.z) * (c.x - a.x);
}

/// The voxels inside of one layer, y = const.
struct Layer {
    double n = 0, sum_x = 0, sum_z = 0;
    std::vector<std::pair<int, int>> rows; ///< least and greatest z, by x

    void add(int row, int x, int z0, int z1) {
        const double count = z1 - z0 + 1;
        n += count;
        sum_x += count * x;
        sum_z += count * (z0 + z1) / 2;
        auto& [least, greatest] = rows[static_cast<std::size_t>(row)];
        least = std::min(least, z0);
        greatest = std::max(greatest, z1);
    }
};

/// The layers of a solid, lowest first.
class Layers {
public:
    Layers(const openvdb::FloatGrid& solid, const CoordBBox& box) : box_(box) {
        layers_.resize(static_cast<std::size_t>(box.dim().y()));
        for (Layer& layer : layers_)
            layer.rows.assign(static_cast<std::size_t>(box.dim().x()), none());
        for (auto leaf = solid.tree().cbeginLeaf(); leaf; ++leaf)
            for (openvdb::Index v = 0; v < 512; ++v)
                if (leaf->getValue(v) < 0) {
                    const Coord c = leaf->offsetToGlobalCoord(v);
                    add(CoordBBox(c, c));
                }
        auto tile = solid.tree().cbeginValueAll();
        for (tile.setMaxDepth(tile.getLeafDepth() - 1); tile; ++tile)
            if (*tile < 0) {
                CoordBBox region;
                tile.getBoundingBox(region);
                add(region);
            }
    }

    std::size_t size() const { return layers_.size(); }
    const Layer& operator[](std::size_t j) const { return layers_[j]; }
    int y(std::size_t j) const { return box_.min().y() + static_cast<int>(j); }

    /// What of a layer is within a tenth of a voxel of its lowest point, which is `low_m` beside
    /// the layer's own height.
    Layer contact(const openvdb::FloatGrid& solid, std::size_t j, double& low_m) const {
        const auto values = solid.getConstAccessor();
        const auto each_inside = [&](auto&& visit) {
            for (std::size_t i = 0; i < layers_[j].rows.size(); ++i)
                for (int z = layers_[j].rows[i].first; z <= layers_[j].rows[i].second; ++z) {
                    const Coord c(box_.min().x() + static_cast<int>(i), y(j), z);
                    if (const float v = values.getValue(c); v < 0)
                        visit(c, v);
                }
        };
        float low = 0;
        each_inside([&](const Coord&, float v) { low = std::min(low, v); });
        low_m = low;
        Layer flat;
        flat.rows.assign(layers_[j].rows.size(), none());
        const auto tenth = static_cast<float>(0.1 * solid.voxelSize().x());
        each_inside([&](const Coord& c, float v) {
            if (v <= low + tenth)
                flat.add(c.x() - box_.min().x(), c.x(), c.z(), c.z());
        });
        return flat;
    }

    /// The convex hull of the voxels' corners, counter-clockwise seen against +Y.
    std::vector<Point> outline(const Layer& layer) const {
        std::vector<Point> points; // by x, then z
        for (std::size_t i = 0; i < layer.rows.size(); ++i) {
            const auto [z0, z1] = layer.rows[i];
            if (z0 > z1)
                continue;
            const double x = box_.min().x() + static_cast<double>(i);
            for (const double side : {-0.5, 0.5})
                for (const double z : {z0 - 0.5, z1 + 0.5})
                    points.push_back({x + side, z});
        }
        std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
            return a.x != b.x ? a.x < b.x : a.z < b.z;
        });
        // Andrew's two chains.
        std::vector<Point> hull;
        const auto chain = [&hull](auto begin, auto end) {
            const std::size_t first = hull.size();
            for (auto p = begin; p != end; ++p) {
                while (hull.size() >= first + 2 &&
                       turn(hull[hull.size() - 2], hull.back(), *p) <= 0)
                    hull.pop_back();
                hull.push_back(*p);
            }
            hull.pop_back(); // the first of the other chain
        };
        if (!points.empty()) {
            chain(points.begin(), points.end());
            chain(points.rbegin(), points.rend());
        }
        return hull;
    }

private:
    std::pair<int, int> none() const { return {box_.max().z() + 1, box_.min().z() - 1}; }
    void add(const CoordBBox& region) {
        for (int y = region.min().y(); y <= region.max().y(); ++y)
            for (int x = region.min().x(); x <= region.max().x(); ++x)
                layers_[static_cast<std::size_t>(y - box_.min().y())].add(
                    x - box_.min().x(), x, region.min().z(), region.max().z());
    }

    CoordBBox box_;
    std::vector<Layer> layers_;
};

double area(const std::vector<Point>& hull) {
    double twice = 0;
    for (std::size_t i = 0; i < hull.size(); ++i)
        twice += turn({}, hull[i], hull[(i + 1) % hull.size()]);
    return twice / 2;
}

/// How far a point is inside of a hull; negative outside.
double margin(const std::vector<Point>& hull, const Point& p) {
    double least = hull.empty() ? -1 : INFINITY;
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const Point &a = hull[i], &b = hull[(i + 1) % hull.size()];
        least = std::min(least, turn(a, b, p) / std::hypot(b.x - a.x, b.z - a.z));
    }
    return least;
}

} // namespace

std::optional<Foot> find_foot(const openvdb::FloatGrid& solid, double tilt_deg) {
    const Lattice lattice = lattice_of(solid);
    if (!(tilt_deg > 0 && tilt_deg <= kMostTilt_deg))
        throw Error(Fault::bad_argument,
                    "foot: the tilt is " + shortest(tilt_deg) + " degrees, must be > 0 and <= 60");
    CoordBBox box;
    if (!solid.tree().evalLeafBoundingBox(box))
        return std::nullopt;
    const Layers layers(solid, box);
    std::size_t lowest = 0, highest = layers.size();
    while (lowest < highest && layers[lowest].n == 0)
        ++lowest;
    while (highest > lowest && layers[highest - 1].n == 0)
        --highest;
    double n = 0, sum_x = 0, sum_y = 0, sum_z = 0; // of all layers from here up
    for (std::size_t j = lowest; j < highest; ++j) {
        n += layers[j].n;
        sum_x += layers[j].sum_x;
        sum_y += layers[j].n * layers.y(j);
        sum_z += layers[j].sum_z;
    }
    double low_m = 0;
    const Layer contact = layers.contact(solid, lowest, low_m);
    const double h = lattice.voxel_m, bottom_m = layers.y(lowest) * h + low_m;
    for (std::size_t j = lowest; j <= (lowest + highest) / 2 && j < highest; ++j) {
        const Vec3 center{sum_x / n, sum_y / n, sum_z / n};
        const double plane_m = j == lowest ? bottom_m : (layers.y(j) - 0.5) * h;
        const Layer& on = j == lowest ? contact : layers[j];
        const std::vector<Point> hull = layers.outline(on);
        double inside = margin(hull, {center.x, center.z});
        if (j > lowest)
            inside = std::min(inside, margin(layers.outline(layers[j - 1]), {center.x, center.z}));
        const double tilt = std::atan2(inside * h, center.y * h - plane_m) * 180 / std::numbers::pi;
        if (tilt >= tilt_deg) {
            Foot foot;
            foot.y_m = lattice.origin.y + plane_m;
            foot.cut_m = plane_m - bottom_m;
            foot.contact_m2 = on.n * h * h;
            foot.outline_m2 = area(hull) * h * h;
            foot.tilt_deg = tilt;
            foot.center_of_mass = lattice.origin + center * h;
            return foot;
        }
        n -= layers[j].n;
        sum_x -= layers[j].sum_x;
        sum_y -= layers[j].n * layers.y(j);
        sum_z -= layers[j].sum_z;
    }
    return std::nullopt;
}

openvdb::FloatGrid::Ptr cut_below(const openvdb::FloatGrid& solid, double y_m) {
    const AnalyticSolid below{HalfSpaceSolid{}, Similarity::translation({0, y_m, 0})};
    auto cut =
        rasterize(DifferenceField(std::make_shared<LevelSetField>(solid.copy()),
                                  std::make_shared<SolidsField>(std::vector<AnalyticSolid>{below})),
                  lattice_of(solid));
    cut->setName(solid.getName());
    return cut;
}

} // namespace taihu
