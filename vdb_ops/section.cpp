#include "vdb_ops/section.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"
#include "vdb_ops/plane_image_detail.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

constexpr std::uint32_t kSectionStream = 0x73656374, kImageStream = 0x73696d67;
constexpr double kMostSamples = 2000; // along the solid's longest axis
constexpr int kMostPlanes = 10'000;
constexpr std::uint32_t kTries = 1000;

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "section: " + what);
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
    image.step_u = image.step_v = step;
    const double u_half = support(box, plane.u), v_half = support(box, plane.v);
    const Vec3 middle = box.center() - plane.origin;
    // A frame of air all round, and a random lattice.
    image.u_lo = dot(middle, plane.u) - u_half - (1 + lattice.uniform(item, 2 * draw)) * step;
    image.v_lo = dot(middle, plane.v) - v_half - (1 + lattice.uniform(item, 2 * draw + 1)) * step;
    image.nu = static_cast<int>(2 * u_half / step) + 4;
    image.nv = static_cast<int>(2 * v_half / step) + 4;
    image.sample(plane, solid, known.base);
    return image;
}

void Cut::circles(const PlaneImage& image, const SectionPlane& plane,
                  std::vector<Profile>& profiles) const {
    for (const Sphere& hole : *known.holes) {
        const Circle c = circle_of(hole, plane);
        if (c.radius > 0 && image.kind_near(c.u, c.v) != PlaneImage::air)
            profiles.push_back({0, c.u, c.v, 2 * c.radius, 2 * c.radius, false});
    }
}

/// Returns how many were too small.
std::uint64_t Cut::regions(PlaneImage& image, std::vector<Profile>& profiles) const {
    std::uint64_t n_small = 0;
    const auto width = static_cast<std::size_t>(image.nu);
    for (std::size_t first = 0; first < image.kind.size(); ++first) {
        if (image.kind[first] != PlaneImage::hole)
            continue;
        const std::vector<std::size_t> region = image.take_region(first, PlaneImage::taken);
        Profile profile;
        profile.diameter_m =
            2 * step * std::sqrt(static_cast<double>(region.size()) / std::numbers::pi);
        if (profile.diameter_m < smallest_m) {
            ++n_small;
            continue;
        }
        for (const std::size_t p : region)
            for (const std::size_t q : {p - 1, p + 1, p - width, p + width})
                profile.clipped |= image.kind[q] == PlaneImage::air;
        const RegionEllipse ellipse = ellipse_of(image, region);
        profile.major_m = ellipse.major * step;
        profile.u_m = image.u_lo + ellipse.x * step;
        profile.v_m = image.v_lo + ellipse.y * step;
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
    const Box box = solid_box(known.base ? *known.base : solid, "section");
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
    result.volume_m3 = volume_m3(known.base ? *known.base : solid);
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
    text += "# planes=" + std::to_string(section.planes.size()) +
            "\n# volume_m3=" + shortest(section.volume_m3) + '\n';
    text += "# area_m2=" + shortest(section.area_m2) + "\nplane,u_m,v_m,diameter_m\n";
    for (const Profile& p : section.profiles)
        text += std::to_string(p.plane) + ',' + shortest(p.u_m) + ',' + shortest(p.v_m) + ',' +
                shortest(major ? p.major_m : p.diameter_m) + '\n';
    return text;
}

} // namespace taihu
