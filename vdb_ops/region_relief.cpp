#include "vdb_ops/region_relief.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"
#include "vdb_ops/relief_math_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kCenterStream = 0x63656e74; // "cent"
constexpr double kPointsPerCell = 2;

void require(bool ok, const std::string& what) {
    if (!ok)
        throw Error(Fault::bad_argument, "relief: " + what);
}

void check(const RegionSettings& s) {
    require(s.radius_m >= 0 && s.radius_m <= 1e9,
            "radius_m is " + shortest(s.radius_m) + ", must be 0..1e9");
    require(s.height_m >= 0 && s.height_m <= 1e6,
            "height_m is " + shortest(s.height_m) + ", must be 0..1e6");
    require(s.arms >= -64 && s.arms <= 64,
            "arms is " + std::to_string(s.arms) + ", must be -64..64");
    require(std::abs(s.phase_turns) <= 1e6,
            "phase_turns is " + shortest(s.phase_turns) + ", must be within 1e6 of 0");
    if (s.law == RegionLaw::sinusoid || s.law == RegionLaw::damped_wave)
        require(s.wavelength_m >= 1e-9 && s.wavelength_m <= 1e9,
                "wavelength_m is " + shortest(s.wavelength_m) + ", must be 1e-9..1e9");
}

/// A point's nearest centre and how far the second is.
struct Nearest {
    std::uint32_t id = 0;
    double dx = 0, dy = 0; ///< from the centre to the point
    double d2 = std::numeric_limits<double>::infinity(), second_d2 = d2;
};

/// Centres, and on a torus their images all round, in the cells of a grid.
class CenterGrid {
public:
    explicit CenterGrid(const RegionPlane& plane) {
        const auto centers = region_centers(plane);
        const double side = plane.side_m();
        const int reach = plane.tileable ? 1 : 0;
        n_cells_ = std::max(
            1, static_cast<int>((1 + 2 * reach) * std::sqrt(plane.n_regions / kPointsPerCell)));
        origin_ = -reach * side;
        cell_ = (1 + 2 * reach) * side / n_cells_;
        std::vector<Entry> all;
        for (int sy = -reach; sy <= reach; ++sy)
            for (int sx = -reach; sx <= reach; ++sx)
                for (std::size_t i = 0; i < centers.size(); ++i)
                    all.push_back({centers[i].x_m + sx * side, centers[i].y_m + sy * side,
                                   static_cast<std::uint32_t>(i)});
        first_.assign(static_cast<std::size_t>(n_cells_) * static_cast<std::size_t>(n_cells_) + 1,
                      0);
        for (const Entry& e : all)
            ++first_[cell_of(e) + 1];
        for (std::size_t i = 1; i < first_.size(); ++i)
            first_[i] += first_[i - 1];
        entries_.resize(all.size());
        std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
        for (const Entry& e : all)
            entries_[next[cell_of(e)]++] = e;
    }

    Nearest nearest(double x, double y) const {
        Nearest out;
        const int cx = index(x), cy = index(y);
        for (int ring = 0; ring <= n_cells_; ++ring) {
            if (const double seen = (ring - 1) * cell_; ring > 0 && out.second_d2 < seen * seen)
                break; // what lies outside of the rings so far is farther
            for (int j = std::max(cy - ring, 0); j <= std::min(cy + ring, n_cells_ - 1); ++j) {
                const bool whole_row = std::abs(j - cy) == ring;
                for (int i = cx - ring; i <= cx + ring; i += whole_row || ring == 0 ? 1 : 2 * ring)
                    if (i >= 0 && i < n_cells_)
                        visit(i, j, x, y, out);
            }
        }
        return out;
    }

private:
    struct Entry {
        double x, y;
        std::uint32_t id;
    };

    int index(double x) const {
        return std::clamp(static_cast<int>((x - origin_) / cell_), 0, n_cells_ - 1);
    }
    std::size_t cell(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(n_cells_) +
               static_cast<std::size_t>(i);
    }
    std::size_t cell_of(const Entry& e) const { return cell(index(e.x), index(e.y)); }

    void visit(int i, int j, double x, double y, Nearest& out) const {
        const std::size_t c = cell(i, j);
        for (std::uint32_t k = first_[c]; k < first_[c + 1]; ++k) {
            const Entry& e = entries_[k];
            const double dx = x - e.x, dy = y - e.y, d2 = dx * dx + dy * dy;
            if (d2 < out.d2 || (d2 == out.d2 && e.id < out.id)) {
                out.second_d2 = out.d2;
                out.d2 = d2;
                out.dx = dx;
                out.dy = dy;
                out.id = e.id;
            } else {
                out.second_d2 = std::min(out.second_d2, d2);
            }
        }
    }

    int n_cells_ = 1;
    double origin_ = 0, cell_ = 1;
    std::vector<std::uint32_t> first_;
    std::vector<Entry> entries_;
};

/// Calls `use(x, y, nearest)` for every point of the plane, rows in any order.
template <class Use>
void for_each_point(const RegionPlane& plane, const Use& use) {
    const CenterGrid centers(plane);
    tbb::parallel_for(0, plane.size_px, [&](int y) {
        for (int x = 0; x < plane.size_px; ++x)
            use(x, y, centers.nearest(x * plane.pixel_m, y * plane.pixel_m));
    });
}

/// sin(2 pi r / wavelength + arms theta + phase): the powers of a unit vector turn it by multiples
/// of its angle.
double wave(const Nearest& p, const RegionSettings& s) {
    const double r = std::sqrt(p.d2);
    const auto [c, i] = cos_sin_turns(r / s.wavelength_m + s.phase_turns);
    double cos_arms = 1, sin_arms = 0;
    for (int k = 0; k < std::abs(s.arms) && r > 0; ++k) {
        const double a = p.dx / r, b = (s.arms < 0 ? p.dy : -p.dy) / r; // theta upwards, +Y is up
        const double turned = cos_arms * a - sin_arms * b;
        sin_arms = cos_arms * b + sin_arms * a;
        cos_arms = turned;
    }
    return i * cos_arms + c * sin_arms;
}

} // namespace

void check_plane(const RegionPlane& p) {
    require(p.size_px >= 2 && p.size_px <= 8193,
            "size_px is " + std::to_string(p.size_px) + ", must be 2..8193");
    require(p.pixel_m >= 1e-9 && p.pixel_m <= 1e6,
            "pixel_m is " + shortest(p.pixel_m) + ", must be 1e-9..1e6");
    require(p.n_regions >= 1 && p.n_regions <= 100'000,
            "n_regions is " + std::to_string(p.n_regions) + ", must be 1..100000");
}

std::vector<RegionCenter> region_centers(const RegionPlane& plane) {
    check_plane(plane);
    const Rng rng{plane.seed, kCenterStream};
    std::vector<RegionCenter> centers;
    for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(plane.n_regions); ++i)
        centers.push_back({plane.side_m() * rng.uniform(i, 0), plane.side_m() * rng.uniform(i, 1)});
    return centers;
}

Image region_ids(const RegionPlane& plane) {
    check_plane(plane);
    Image ids(plane.size_px, plane.size_px, 1);
    for_each_point(
        plane, [&](int x, int y, const Nearest& n) { *ids.at(x, y) = static_cast<float>(n.id); });
    return ids;
}

RegionRelief region_relief(const RegionPlane& plane, const RegionSettings& settings) {
    check_plane(plane);
    check(settings);
    RegionRelief out{Image(plane.size_px, plane.size_px, 1),
                     Image(plane.size_px, plane.size_px, 1)};
    const bool waves =
        settings.law == RegionLaw::sinusoid || settings.law == RegionLaw::damped_wave;
    std::vector<double> d2(out.heights.pixels.size()); // of the nearest centre
    for_each_point(plane, [&](int x, int y, const Nearest& n) {
        *out.ids.at(x, y) = static_cast<float>(n.id);
        d2[static_cast<std::size_t>(out.heights.at(x, y) - out.heights.pixels.data())] = n.d2;
        if (waves) {
            const double damping = settings.law == RegionLaw::damped_wave && n.second_d2 > 0
                                       ? 1 - n.d2 / n.second_d2
                                       : 1;
            *out.heights.at(x, y) =
                static_cast<float>(settings.height_m * damping * wave(n, settings));
        }
    });
    if (waves)
        return out;
    const double farthest2 = *std::max_element(d2.begin(), d2.end());
    out.radius_m = settings.radius_m > 0 ? settings.radius_m : std::sqrt(farthest2);
    if (!(out.radius_m > 0))
        throw Error(Fault::bad_argument, "relief: every point is a centre; use fewer regions");
    const double height = settings.height_m > 0 ? settings.height_m : out.radius_m;
    const double sign = settings.law == RegionLaw::convex ? 1 : -1;
    for (std::size_t i = 0; i < d2.size(); ++i) {
        const double rest = out.radius_m * out.radius_m - d2[i];
        out.heights.pixels[i] =
            static_cast<float>(rest > 0 ? sign * height * std::sqrt(rest) / out.radius_m : 0.0);
    }
    return out;
}

} // namespace taihu
