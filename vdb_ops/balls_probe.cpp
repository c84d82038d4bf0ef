#include <algorithm>
#include <cmath>

#include "vdb_ops/balls_field.h"
#include "vdb_ops/cube_lists_detail.h"

namespace taihu {
namespace {

constexpr int kCell = 16; ///< units along the edge of a cell
constexpr double kMostCells = 0x1p22;

/// Cells with the balls that come near them.
struct Grid {
    double unit_m;
    openvdb::Coord n;

    Grid(const Box& region, double reach_m) {
        const Vec3 size = region.size();
        double cell_m = 2 * reach_m;
        const auto cells = [&] {
            double product = 1;
            for (int axis = 0; axis < 3; ++axis)
                product *= std::floor(size[axis] / cell_m) + 1;
            return product;
        };
        while (cells() > kMostCells)
            cell_m *= 2;
        unit_m = cell_m / kCell;
        for (int axis = 0; axis < 3; ++axis)
            n[axis] = static_cast<int>(size[axis] / cell_m) + 1;
    }
};

/// The balls that come within a reach of each cell.
struct Near {
    double reach_m;
    Vec3 origin;
    Grid grid;
    CubeLists cells;

    Near(const std::vector<Sphere>& balls, const Box& region, double reach)
        : reach_m(reach), origin(region.lo), grid(region, reach),
          // Lists are of lattice points: those between are within sqrt(3) of one.
          cells(kCell, grid.n, reach / grid.unit_m + 1.8) {
        CubeLists::Hits hits;
        for (std::size_t i = 0; i < balls.size(); ++i)
            cells.find({(balls[i].center - origin) / grid.unit_m, balls[i].radius_m / grid.unit_m},
                       static_cast<std::uint32_t>(i), hits);
        cells.sort({&hits, 1});
    }
    std::size_t cell(const Vec3& p) const {
        openvdb::Coord c;
        for (int axis = 0; axis < 3; ++axis) {
            const double along = (p[axis] - origin[axis]) / (grid.unit_m * kCell);
            c[axis] = static_cast<int>(std::clamp(along, 0.0, grid.n[axis] - 1.0));
        }
        return cells.index(c.x(), c.y(), c.z());
    }
};

class BallsProbe final : public FieldProbe {
public:
    BallsProbe(const std::vector<Sphere>& balls, const Box& region, double reach_m)
        : balls_(balls), wide_(balls, region, reach_m), close_(balls, region, kClose * reach_m) {}

    /// Most points that are asked for are close to a ball, where short lists do.
    Nearest at(const Vec3& p) const override {
        const std::size_t near = close_.cell(p);
        if (close_.cells.cover(near) != Cover::inside)
            if (const Nearest best = nearest(close_, near, p); best.value_m < close_.reach_m)
                return best;
        const std::size_t c = wide_.cell(p);
        if (wide_.cells.cover(c) == Cover::inside)
            return {-wide_.reach_m, 0};
        return nearest(wide_, c, p);
    }
    Value of(Primitive i, const Vec3& p) const override {
        const Vec3 d = p - balls_[i].center;
        const double away = length(d);
        return {away - balls_[i].radius_m, away > 0 ? d / away : d};
    }
    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override {
        for (const std::uint32_t i : wide_.cells.balls(wide_.cell(p)))
            if (std::fabs(distance(i, p)) <= reach_m)
                out.push_back(i);
    }
    std::optional<Sphere> ball(Primitive i) const override { return balls_[i]; }

private:
    double distance(std::uint32_t i, const Vec3& p) const {
        return length(p - balls_[i].center) - balls_[i].radius_m;
    }
    Nearest nearest(const Near& near, std::size_t cell, const Vec3& p) const {
        Nearest best{near.reach_m, 0};
        for (const std::uint32_t i : near.cells.balls(cell))
            if (const double d = distance(i, p); d < best.value_m)
                best = {d, i};
        return best;
    }

    static constexpr double kClose = 0.125; ///< of the reach

    const std::vector<Sphere>& balls_;
    Near wide_, close_;
};

} // namespace

std::unique_ptr<FieldProbe> BallsField::probe(const Box& region_m, double reach_m) const {
    return std::make_unique<BallsProbe>(balls_, region_m, reach_m);
}

} // namespace taihu
