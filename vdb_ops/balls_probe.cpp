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

class BallsProbe final : public FieldProbe {
public:
    BallsProbe(const std::vector<Sphere>& balls, const Box& region, double reach_m)
        : balls_(balls), origin_(region.lo), reach_m_(reach_m), grid_(region, reach_m),
          // Lists are of lattice points: those between are within sqrt(3) of one.
          cells_(kCell, grid_.n, reach_m / grid_.unit_m + 1.8) {
        CubeLists::Hits hits;
        for (std::size_t i = 0; i < balls.size(); ++i)
            cells_.find(
                {(balls[i].center - origin_) / grid_.unit_m, balls[i].radius_m / grid_.unit_m},
                static_cast<std::uint32_t>(i), hits);
        cells_.sort({&hits, 1});
    }

    Nearest at(const Vec3& p) const override {
        const std::size_t c = cell(p);
        if (cells_.cover(c) == Cover::inside)
            return {-reach_m_, 0};
        Nearest best{reach_m_, 0};
        for (const std::uint32_t i : cells_.balls(c))
            if (const double d = distance(i, p); d < best.value_m)
                best = {d, i};
        return best;
    }
    Value of(Primitive i, const Vec3& p) const override {
        const Vec3 d = p - balls_[i].center;
        const double away = length(d);
        return {away - balls_[i].radius_m, away > 0 ? d / away : d};
    }
    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override {
        for (const std::uint32_t i : cells_.balls(cell(p)))
            if (std::fabs(distance(i, p)) <= reach_m)
                out.push_back(i);
    }
    std::optional<Sphere> ball(Primitive i) const override { return balls_[i]; }

private:
    double distance(std::uint32_t i, const Vec3& p) const {
        return length(p - balls_[i].center) - balls_[i].radius_m;
    }
    std::size_t cell(const Vec3& p) const {
        openvdb::Coord c;
        for (int axis = 0; axis < 3; ++axis) {
            const double along = (p[axis] - origin_[axis]) / (grid_.unit_m * kCell);
            c[axis] = static_cast<int>(std::clamp(along, 0.0, grid_.n[axis] - 1.0));
        }
        return cells_.index(c.x(), c.y(), c.z());
    }

    const std::vector<Sphere>& balls_;
    Vec3 origin_;
    double reach_m_;
    Grid grid_;
    CubeLists cells_;
};

} // namespace

std::unique_ptr<FieldProbe> BallsField::probe(const Box& region_m, double reach_m) const {
    return std::make_unique<BallsProbe>(balls_, region_m, reach_m);
}

} // namespace taihu
