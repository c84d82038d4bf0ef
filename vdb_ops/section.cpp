#include "vdb_ops/section.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <openvdb/tools/Interpolation.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/box.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr std::uint32_t kSectionStream = 0x73656374, kImageStream = 0x73696d67;
constexpr double kMostSamples = 2000; // along the solid's longest axis
constexpr int kMostPlanes = 10'000;
constexpr std::uint32_t kTries = 1000;

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "section: " + what);
}

/// A level set for one thread.
class Sampler {
public:
    explicit Sampler(const openvdb::FloatGrid& grid)
        : lattice_(lattice_of(grid)), accessor_(grid.getConstAccessor()) {}
    bool solid(const Vec3& p) const {
        const Vec3 i = (p - lattice_.origin) / lattice_.voxel_m;
        return openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(i.x, i.y, i.z)) < 0;
    }

private:
    Lattice lattice_;
    openvdb::FloatGrid::ConstAccessor accessor_;
};

/// The box of the inside of a level set, a voxel larger.
Box solid_box(const openvdb::FloatGrid& grid) {
    const Lattice lattice = lattice_of(grid);
    openvdb::CoordBBox voxels;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto v = leaf->cbeginValueOn(); v; ++v)
            if (*v < 0)
                voxels.expand(v.getCoord());
    if (voxels.empty())
        refuse("grid '" + grid.getName() + "' is empty; give a solid that is not");
    Box box;
    for (const openvdb::Coord& c : {voxels.min(), voxels.max()})
        box.include(lattice.origin +
                    Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice.voxel_m);
    return box.dilated(lattice.voxel_m);
}

/// Half the extent of a box along a direction of length 1.
double support(const Box& box, const Vec3& n) {
    const Vec3 half = box.size() * 0.5;
    return half.x * std::abs(n.x) + half.y * std::abs(n.y) + half.z * std::abs(n.z);
}

SectionPlane plane_at(const Box& box, const Vec3& normal, double offset) {
    const Vec3 a{std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)};
    const Vec3 axis = a.x <= a.y && a.x <= a.z ? Vec3{1, 0, 0}
                      : a.y <= a.z             ? Vec3{0, 1, 0}
                                               : Vec3{0, 0, 1};
    const Vec3 u = normalized(cross(axis, normal));
    return {box.center() + normal * offset, u, cross(normal, u), normal, 0};
}

/// Uniform among the planes that meet the ball round the box.
SectionPlane random_plane(const Box& box, const Rng& rng, std::uint64_t item, std::uint32_t draw) {
    constexpr std::uint32_t kDraws = 1024; // for one plane; a direction takes two tries or so
    Vec3 d;
    for (std::uint32_t i = 1; i + 3 < kDraws; i += 3) {
        const auto next = [&](std::uint32_t k) {
            return 2 * rng.uniform(item, draw * kDraws + i + k) - 1;
        };
        d = {next(0), next(1), next(2)};
        if (length_squared(d) < 1 && length_squared(d) > 1e-6)
            break;
    }
    const double offset = (2 * rng.uniform(item, draw * kDraws) - 1) * 0.5 * length(box.size());
    return plane_at(box, normalized(d), offset);
}

/// What a plane shows: a lattice of pixels.
struct PlaneImage {
    enum Kind : std::uint8_t { air, solid, hole };
    double u_lo = 0, v_lo = 0, step = 0; ///< pixel (i, j) lies at u_lo + i * step, v_lo + j * step
    int nu = 0, nv = 0;
    std::vector<std::uint8_t> kind; ///< i fastest

    std::size_t at(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nu) +
               static_cast<std::size_t>(i);
    }
    /// The pixels of one kind that hang together with `first`, which become `to`.
    std::vector<std::size_t> take_region(std::size_t first, std::uint8_t to) {
        const std::uint8_t from = kind[first];
        std::vector<std::size_t> region = {first};
        kind[first] = to;
        const auto width = static_cast<std::size_t>(nu);
        const auto visit = [&](std::size_t p) {
            if (kind[p] == from) {
                kind[p] = to;
                region.push_back(p);
            }
        };
        for (std::size_t k = 0; k < region.size(); ++k) {
            const std::size_t p = region[k];
            if (p % width > 0)
                visit(p - 1);
            if (p % width + 1 < width)
                visit(p + 1);
            if (p >= width)
                visit(p - width);
            if (p + width < kind.size())
                visit(p + width);
        }
        return region;
    }
};

/// Everything that the planes share.
struct Cut {
    const openvdb::FloatGrid& solid;
    const SectionKnown& known;
    Box box;
    double step;
    double smallest_m; ///< profile that is measured
    Rng lattice;

    PlaneImage image(const SectionPlane& plane, std::uint64_t item, std::uint32_t draw) const;
    void circles(const PlaneImage& image, const SectionPlane& plane,
                 std::vector<Profile>& profiles) const;
    std::uint64_t regions(PlaneImage& image, std::vector<Profile>& profiles) const;
};

PlaneImage Cut::image(const SectionPlane& plane, std::uint64_t item, std::uint32_t draw) const {
    PlaneImage image;
    image.step = step;
    const double u_half = support(box, plane.u), v_half = support(box, plane.v);
    const Vec3 middle = box.center() - plane.origin;
    // A frame of air all round, and a random lattice.
    image.u_lo = dot(middle, plane.u) - u_half - (1 + lattice.uniform(item, 2 * draw)) * step;
    image.v_lo = dot(middle, plane.v) - v_half - (1 + lattice.uniform(item, 2 * draw + 1)) * step;
    image.nu = static_cast<int>(2 * u_half / step) + 4;
    image.nv = static_cast<int>(2 * v_half / step) + 4;
    image.kind.resize(static_cast<std::size_t>(image.nu) * static_cast<std::size_t>(image.nv));
    const Sampler rock(solid), whole(known.base ? *known.base : solid);
    for (int j = 0; j < image.nv; ++j)
        for (int i = 0; i < image.nu; ++i) {
            const Vec3 p = plane.origin + plane.u * (image.u_lo + i * step) +
                           plane.v * (image.v_lo + j * step);
            const bool inside = !known.base || whole.solid(p);
            image.kind[image.at(i, j)] = !inside         ? PlaneImage::air
                                         : rock.solid(p) ? PlaneImage::solid
                                                         : PlaneImage::hole;
        }
    if (!known.base) // void that reaches the frame is the air round the outline
        image.take_region(0, PlaneImage::air);
    return image;
}

void Cut::circles(const PlaneImage& image, const SectionPlane& plane,
                  std::vector<Profile>& profiles) const {
    for (const Sphere& hole : *known.holes) {
        const Vec3 c = hole.center - plane.origin;
        const double height = dot(c, plane.normal);
        if (!(std::abs(height) < hole.radius_m))
            continue;
        const double u = dot(c, plane.u), v = dot(c, plane.v);
        const double i = std::round((u - image.u_lo) / step),
                     j = std::round((v - image.v_lo) / step);
        if (!(i >= 0 && j >= 0 && i < image.nu && j < image.nv) ||
            image.kind[image.at(static_cast<int>(i), static_cast<int>(j))] == PlaneImage::air)
            continue;
        const double d = 2 * std::sqrt((hole.radius_m - height) * (hole.radius_m + height));
        profiles.push_back({0, u, v, d, d, false});
    }
}

/// Returns how many were too small.
std::uint64_t Cut::regions(PlaneImage& image, std::vector<Profile>& profiles) const {
    constexpr std::uint8_t kDone = 3;
    std::uint64_t n_small = 0;
    const auto width = static_cast<std::size_t>(image.nu);
    for (std::size_t first = 0; first < image.kind.size(); ++first) {
        if (image.kind[first] != PlaneImage::hole)
            continue;
        const std::vector<std::size_t> region = image.take_region(first, kDone);
        const auto n = static_cast<double>(region.size());
        Profile profile;
        profile.diameter_m = 2 * step * std::sqrt(n / std::numbers::pi);
        if (profile.diameter_m < smallest_m) {
            ++n_small;
            continue;
        }
        double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
        for (const std::size_t p : region) {
            x += static_cast<double>(p % width) / n;
            y += static_cast<double>(p / width) / n;
            for (const std::size_t q : {p - 1, p + 1, p - width, p + width})
                profile.clipped |= image.kind[q] == PlaneImage::air;
        }
        for (const std::size_t p : region) {
            const double dx = static_cast<double>(p % width) - x;
            const double dy = static_cast<double>(p / width) - y;
            xx += dx * dx / n;
            xy += dx * dy / n;
            yy += dy * dy / n;
        }
        // A quarter of the squared semi-axis; the spread of a pixel itself, 1/12, belongs to it.
        const double variance = 0.5 * (xx + yy) + std::hypot(0.5 * (xx - yy), xy) + 1.0 / 12;
        profile.major_m = 4 * step * std::sqrt(variance);
        profile.u_m = image.u_lo + x * step;
        profile.v_m = image.v_lo + y * step;
        profiles.push_back(profile);
    }
    return n_small;
}

/// What came out of one plane.
struct Page {
    SectionPlane plane;
    std::vector<Profile> profiles;
    std::uint64_t n_small = 0;
};

Page cut_plane(const Cut& cut, const SectionSettings& settings, int index,
               const Progress* progress) {
    const auto item = static_cast<std::uint64_t>(index);
    const Rng rng{settings.seed, kSectionStream};
    Page page;
    PlaneImage image;
    for (std::uint32_t draw = 0;; ++draw) {
        check_cancelled(progress);
        if (draw == kTries)
            throw Error(Fault::numeric, "section: a thousand random planes miss the solid, which "
                                        "is thinner than its voxels show; give a --direction");
        if (settings.direction) {
            const Vec3 n = normalized(*settings.direction);
            const double first = rng.uniform(0), half = support(cut.box, n);
            page.plane = plane_at(cut.box, n, half * (2 * (index + first) / settings.n_planes - 1));
        } else {
            page.plane = random_plane(cut.box, rng, item, draw);
        }
        if (!settings.direction &&
            std::abs(dot(page.plane.origin - cut.box.center(), page.plane.normal)) >=
                support(cut.box, page.plane.normal))
            continue;
        image = cut.image(page.plane, item, draw);
        const auto n_air = std::count(image.kind.begin(), image.kind.end(), PlaneImage::air);
        page.plane.area_m2 =
            static_cast<double>(image.kind.size() - static_cast<std::size_t>(n_air)) * cut.step *
            cut.step;
        if (settings.direction || page.plane.area_m2 > 0)
            break;
    }
    if (cut.known.holes)
        cut.circles(image, page.plane, page.profiles);
    else
        page.n_small = cut.regions(image, page.profiles);
    for (Profile& profile : page.profiles)
        profile.plane = index;
    return page;
}

} // namespace

Section section(const openvdb::FloatGrid& solid, const SectionKnown& known,
                const SectionSettings& settings, Progress* progress) {
    if (settings.n_planes < 1 || settings.n_planes > kMostPlanes)
        refuse("n_planes is " + std::to_string(settings.n_planes) + "; must be in 1..10000");
    if (const auto& d = settings.direction; d && (!is_finite(*d) || !(length(*d) > 0)))
        refuse("the direction is not finite or 0; give a vector that points somewhere");
    const double voxel_m = lattice_of(solid).voxel_m;
    const Box box = solid_box(known.base ? *known.base : solid);
    const double step = std::max(0.5 * voxel_m, box.longest() / kMostSamples);
    const double smallest = known.holes ? 0 : 4 * step;
    const Cut cut{solid, known, box, step, smallest, {settings.seed, kImageStream}};

    report_stage(progress, "cutting");
    std::vector<Page> pages(static_cast<std::size_t>(settings.n_planes));
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pages.size(), 1), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
            pages[i] = cut_plane(cut, settings, static_cast<int>(i), progress);
    });
    Section result;
    result.resolution_m = smallest;
    for (const Page& page : pages) {
        result.planes.push_back(page.plane);
        result.profiles.insert(result.profiles.end(), page.profiles.begin(), page.profiles.end());
        result.area_m2 += page.plane.area_m2;
        result.n_small += page.n_small;
    }
    return result;
}

std::string format_profiles(const Section& section, bool major) {
    std::string text;
    const auto point = [](const Vec3& p) {
        return shortest(p.x) + ' ' + shortest(p.y) + ' ' + shortest(p.z);
    };
    for (std::size_t i = 0; i < section.planes.size(); ++i)
        text += "# plane " + std::to_string(i) + " through " + point(section.planes[i].origin) +
                ", normal " + point(section.planes[i].normal) + ", u along " +
                point(section.planes[i].u) + '\n';
    text += "# area_m2=" + shortest(section.area_m2) + "\nplane,u_m,v_m,diameter_m\n";
    for (const Profile& p : section.profiles)
        text += std::to_string(p.plane) + ',' + shortest(p.u_m) + ',' + shortest(p.v_m) + ',' +
                shortest(major ? p.major_m : p.diameter_m) + '\n';
    return text;
}

} // namespace taihu
