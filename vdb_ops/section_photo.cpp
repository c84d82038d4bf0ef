#include "vdb_ops/section_photo.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/photo_painter_detail.h"
#include "vdb_ops/plane_image_detail.h"

namespace taihu {
namespace {

constexpr double kMostPixels = 1 << 24;
constexpr double kDefaultSide = 800;                // pixels along the longest axis
constexpr int kFewestPixels = 4, kFewestVoxels = 2; // across the smallest mark
constexpr int kShortestBar = 8;                     // pixels
constexpr double kMostTilt = 80;
constexpr int kMargin = 16; // pixels of background all round

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "section photo: " + what);
}

/// For people: three digits.
std::string rounded(double value) {
    std::array<char, 32> text{};
    const auto written =
        std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 3);
    return {text.data(), written.ptr};
}

/// The settings with what was left open.
struct Sizes {
    double pixel_m, limit_m, bar_m, cosine, sine;
};

/// 1, 2 or 5 times a power of ten, the greatest that is not above `most`.
double round_length(double most) {
    const double power = std::pow(10, std::floor(std::log10(most)));
    return power * (most >= 5 * power ? 5 : most >= 2 * power ? 2 : 1);
}

Sizes sizes_of(const SectionPhotoSettings& s, const Box& box, double voxel_m) {
    const auto check = [](const char* name, const std::optional<double>& length) {
        if (length && !(*length > 0 && std::isfinite(*length)))
            refuse(std::string(name) + " is " + shortest(*length) + "; must be finite and > 0");
    };
    check("pixel_m", s.pixel_m);
    check("detection_limit_m", s.detection_limit_m);
    check("scale_bar_m", s.scale_bar_m);
    if (!(s.tilt_deg >= 0 && s.tilt_deg <= kMostTilt))
        refuse("tilt_deg is " + shortest(s.tilt_deg) + "; must be in 0..80");
    Sizes sizes{};
    sizes.pixel_m = s.pixel_m.value_or(box.longest() / kDefaultSide);
    const double smallest = std::max(kFewestPixels * sizes.pixel_m, kFewestVoxels * voxel_m);
    sizes.limit_m = s.detection_limit_m.value_or(smallest);
    if (sizes.limit_m < smallest)
        refuse("detection_limit_m is " + shortest(sizes.limit_m) + "; with pixels of " +
               shortest(sizes.pixel_m) + " m and voxels of " + shortest(voxel_m) +
               " m holes show from " + shortest(smallest) +
               " m on; make these smaller, or it larger");
    const Vec3 size = box.size();
    sizes.bar_m = s.scale_bar_m.value_or(round_length(0.25 * std::min({size.x, size.y, size.z})));
    if (sizes.bar_m < kShortestBar * sizes.pixel_m)
        refuse("pixel_m is " + shortest(sizes.pixel_m) + ", with which the scale bar of " +
               shortest(sizes.bar_m) +
               " m is less than 8 pixels; choose smaller pixels or a longer bar");
    // The last bits of a cosine depend on the machine; marks and masks shall not.
    const double angle = s.tilt_deg * std::numbers::pi / 180;
    sizes.cosine = std::round(std::cos(angle) * 0x1p40) * 0x1p-40;
    sizes.sine = std::sqrt(1 - sizes.cosine * sizes.cosine);
    return sizes;
}

void check_size(double width, double height, double pixel_m) {
    if (width * height <= kMostPixels)
        return;
    // Some more than needed, as the margin does not shrink with the picture.
    const double enough = 1.05 * pixel_m * std::sqrt(width / kMostPixels) * std::sqrt(height);
    refuse("pixel_m is " + shortest(pixel_m) + ", which makes a picture of " + rounded(width) +
           " x " + rounded(height) +
           " pixels, of which at most 16777216 are drawn; choose pixels from " + rounded(enough) +
           " m on");
}

/// The part of the plane that may show the solid, pixels as the eye sees them.
PlaneImage empty_image(const Box& box, const SectionPlane& plane, const Sizes& sizes) {
    PlaneImage image;
    image.step_u = sizes.pixel_m;
    image.step_v = -sizes.pixel_m / sizes.cosine;
    const double u_half = support(box, plane.u), v_half = support(box, plane.v);
    const double nu = 2 * u_half / image.step_u + 3, nv = -2 * v_half / image.step_v + 3;
    check_size(nu, nv, sizes.pixel_m);
    if (sizes.bar_m > 2 * u_half)
        refuse("scale_bar_m is " + shortest(sizes.bar_m) + ", longer than the picture, which is " +
               rounded(2 * u_half) + " m wide; choose a shorter one");
    image.nu = static_cast<int>(nu);
    image.nv = static_cast<int>(nv);
    const Vec3 middle = box.center() - plane.origin;
    image.u_lo = dot(middle, plane.u) - 0.5 * (image.nu - 1) * image.step_u;
    image.v_lo = dot(middle, plane.v) - 0.5 * (image.nv - 1) * image.step_v;
    return image;
}

/// An ellipse on the picture; pixel (i, j) covers [i, i + 1] x [j, j + 1].
Segment mark_of(const RegionEllipse& e, double pixel_m) {
    Segment s;
    s.label = "hole";
    s.x1 = e.x - 0.5 * e.major * e.dx;
    s.y1 = e.y - 0.5 * e.major * e.dy;
    s.x2 = e.x + 0.5 * e.major * e.dx;
    s.y2 = e.y + 0.5 * e.major * e.dy;
    s.diameter = e.major * pixel_m;
    s.minor_px = e.minor;
    return s;
}

/// Which of the circles, sorted by their left ends, lie wholly inside another. Of equal ones the
/// first is seen.
std::vector<bool> find_inside(const std::vector<Circle>& circles, const Progress* progress) {
    double greatest = 0;
    for (const Circle& c : circles)
        greatest = std::max(greatest, c.radius);
    std::vector<bool> inside(circles.size());
    for (std::size_t i = 0; i < circles.size(); ++i) {
        check_cancelled(progress);
        const Circle& c = circles[i];
        const auto left = [](const Circle& o) { return o.u - o.radius; };
        for (std::size_t k = i;
             k-- > 0 && !inside[i] && left(circles[k]) >= left(c) - 2 * greatest;)
            inside[i] =
                std::hypot(c.u - circles[k].u, c.v - circles[k].v) + c.radius <= circles[k].radius;
    }
    return inside;
}

/// The holes of the list, each as its circle.
void mark_circles(std::span<const Sphere> holes, const openvdb::FloatGrid& solid,
                  const SectionPlane& plane, const PlaneImage& image, const Sizes& sizes,
                  SectionPhoto& photo, const Progress* progress) {
    std::vector<Circle> circles;
    for (const Sphere& hole : holes) {
        const Circle c = circle_of(hole, plane);
        if (!(c.radius > 0))
            continue;
        if (2 * c.radius >= sizes.limit_m)
            circles.push_back(c);
        else
            photo.n_small += image.kind_near(c.u, c.v) != PlaneImage::air;
    }
    std::stable_sort(circles.begin(), circles.end(), [](const Circle& a, const Circle& b) {
        return a.u - a.radius < b.u - b.radius;
    });
    const std::vector<bool> inside = find_inside(circles, progress);
    const SolidSampler rock(solid);
    for (std::size_t i = 0; i < circles.size(); ++i) {
        const Circle& c = circles[i];
        if (image.kind_near(c.u, c.v) == PlaneImage::air)
            continue;
        if (inside[i]) {
            ++photo.n_inside;
        } else if (rock.solid(plane.origin + plane.u * c.u + plane.v * c.v)) {
            ++photo.n_solid;
        } else {
            RegionEllipse e;
            e.x = (c.u - image.u_lo) / image.step_u + 0.5;
            e.y = (c.v - image.v_lo) / image.step_v + 0.5;
            e.major = 2 * c.radius / sizes.pixel_m;
            e.minor = e.major * sizes.cosine;
            photo.holes.push_back(mark_of(e, sizes.pixel_m));
        }
    }
}

/// The void regions of the picture.
void mark_regions(PlaneImage image, const Sizes& sizes, SectionPhoto& photo) {
    for (std::size_t first = 0; first < image.kind.size(); ++first) {
        if (image.kind[first] != PlaneImage::hole)
            continue;
        RegionEllipse e = ellipse_of(image, image.take_region(first, PlaneImage::taken));
        e.x += 0.5;
        e.y += 0.5;
        if (e.major * sizes.pixel_m < sizes.limit_m)
            ++photo.n_small;
        else
            photo.holes.push_back(mark_of(e, sizes.pixel_m));
    }
}

/// What is to be seen, whole pixels: the stone, and every mark to its ends.
struct Extent {
    double x_lo = 1e300, y_lo = 1e300, x_hi = -1e300, y_hi = -1e300;
    void include(double x, double y) {
        x_lo = std::min(x_lo, std::floor(x));
        y_lo = std::min(y_lo, std::floor(y));
        x_hi = std::max(x_hi, std::ceil(x));
        y_hi = std::max(y_hi, std::ceil(y));
    }
};

Extent extent_of(const PlaneImage& image, const std::vector<Segment>& holes) {
    Extent extent;
    std::size_t n_pixels = 0;
    for (int j = 0; j < image.nv; ++j)
        for (int i = 0; i < image.nu; ++i)
            if (image.kind[image.at(i, j)] != PlaneImage::air) {
                extent.include(i, j);
                extent.include(i + 1, j + 1);
                ++n_pixels;
            }
    if (n_pixels == 0)
        throw Error(Fault::numeric, "section photo: no pixel of the plane lies in the solid; "
                                    "choose smaller pixels or another plane");
    for (const Segment& s : holes) {
        extent.include(s.x1, s.y1);
        extent.include(s.x2, s.y2);
    }
    return extent;
}

/// Room for the extent, a margin all round, and a strip for the bar below.
PhotoFrame frame_of(const Extent& e, double bar_px, int bar_height, double pixel_m) {
    const double width = std::max(e.x_hi - e.x_lo, std::ceil(bar_px)) + 2 * kMargin;
    const double height = e.y_hi - e.y_lo + 3 * kMargin + bar_height;
    check_size(width, height, pixel_m);
    return {static_cast<int>(e.x_lo) - kMargin, static_cast<int>(e.y_lo) - kMargin,
            static_cast<int>(width), static_cast<int>(height)};
}

Image mask_of(const PlaneImage& image, const PhotoFrame& frame) {
    Image mask(frame.width, frame.height, 1);
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x)
            *mask.at(x, y) =
                image.kind_at(frame.x0 + x, frame.y0 + y) == PlaneImage::air ? 0.0f : 1.0f;
    return mask;
}

} // namespace

SectionPhoto section_photo(const openvdb::FloatGrid& solid, const SectionKnown& known,
                           const SectionPlane& plane, const SectionPhotoSettings& settings,
                           Progress* progress) {
    const Box box = solid_box(known.base ? *known.base : solid, "section photo");
    const Sizes sizes = sizes_of(settings, box, lattice_of(solid).voxel_m);
    PlaneImage image = empty_image(box, plane, sizes);
    report_stage(progress, "photographing");
    image.sample(plane, solid, known.base, progress);

    SectionPhoto photo;
    photo.pixel_m = sizes.pixel_m;
    photo.detection_limit_m = sizes.limit_m;
    photo.area_factor = 1 / sizes.cosine;
    if (known.holes)
        mark_circles(*known.holes, solid, plane, image, sizes, photo, progress);
    else
        mark_regions(image, sizes, photo);

    const double bar_px = sizes.bar_m / sizes.pixel_m;
    const Extent extent = extent_of(image, photo.holes);
    const int bar_height = 8 + static_cast<int>((extent.x_hi - extent.x_lo) / 100);
    const PhotoFrame frame = frame_of(extent, bar_px, bar_height, sizes.pixel_m);
    for (Segment& s : photo.holes)
        s.x1 -= frame.x0, s.x2 -= frame.x0, s.y1 -= frame.y0, s.y2 -= frame.y0;
    photo.mask = mask_of(image, frame);
    for (const float pixel : photo.mask.pixels)
        photo.area_m2 += pixel;
    photo.area_m2 *= sizes.pixel_m * sizes.pixel_m * photo.area_factor;

    const Vec3 view = -(plane.normal * sizes.cosine + plane.v * sizes.sine);
    photo.picture = paint_cut({solid, plane, image, view, 2 * length(box.size())}, frame, progress);
    const int bar_y = frame.height - kMargin - bar_height;
    paint_bar(photo.picture, kMargin, bar_y, bar_px, bar_height);
    photo.scale_bar.label = "scale";
    photo.scale_bar.x1 = kMargin;
    photo.scale_bar.x2 = kMargin + bar_px;
    photo.scale_bar.y1 = photo.scale_bar.y2 = bar_y + 0.5 * bar_height;
    photo.scale_bar.diameter = sizes.bar_m;
    return photo;
}

} // namespace taihu
