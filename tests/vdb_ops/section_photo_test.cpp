#include "vdb_ops/section_photo.h"

#include <cmath>
#include <numbers>

#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/carve.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

/// A plane through the origin.
SectionPlane plane_of(const Vec3& normal) {
    const Vec3 n = normalized(normal);
    const Vec3 u = normalized(cross(std::abs(n.x) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}, n));
    return {{}, u, cross(n, u), n, 0};
}

/// A ball of radius 1 m with balls cut out of it.
struct Rock {
    std::vector<Sphere> holes;
    openvdb::FloatGrid::Ptr base, rock;
    explicit Rock(std::vector<Sphere> list, double voxel_m = 0.02)
        : holes(std::move(list)), base(ball_rock(1, voxel_m)), rock(carve(*base, holes).rock) {}

    SectionPhoto photo(const SectionPlane& plane, const SectionPhotoSettings& settings,
                       bool with_list = true) const {
        SectionKnown known{base.get(), {}};
        if (with_list)
            known.holes = holes;
        return section_photo(*rock, known, plane, settings);
    }
};

double length_px(const Segment& s) {
    return std::hypot(s.x2 - s.x1, s.y2 - s.y1);
}

double bright(const Image& image, double x, double y) {
    return image.at(static_cast<int>(x), static_cast<int>(y))[1];
}

const std::vector<Sphere> kApart = {
    {{0.1, 0.05, 0}, 0.25}, {{-0.5, 0.1, 0.1}, 0.2}, {{0.2, 0.1, 0.6}, 0.2}, {{0.1, 0.6, 0}, 0.15}};

// A circle on an oblique plane is seen as an ellipse whose major axis is its diameter, so planes of
// any tilt may be pooled.
TEST(SeedRow, E47TheMajorAxisIsTheDiameterAtAnyTilt) {
    const Rock rock(kApart);
    std::size_t n = 0;
    for (const Vec3& normal : {Vec3{0, 0, 1}, Vec3{0.2, 1, 0.1}, Vec3{1, 0.3, 0.4}})
        for (const double tilt : {0.0, 25.0, 60.0}) {
            const SectionPlane plane = plane_of(normal);
            const double cosine = std::cos(tilt * kPi / 180);
            const SectionPhotoSettings settings{.pixel_m = 0.008, .tilt_deg = tilt};
            const SectionPhoto exact = rock.photo(plane, settings);
            const SectionPhoto seen = rock.photo(plane, settings, false);
            std::vector<double> truth;
            for (const Sphere& hole : rock.holes) {
                const double h = dot(hole.center, plane.normal);
                if (std::abs(h) < hole.radius_m)
                    truth.push_back(2 * std::sqrt(hole.radius_m * hole.radius_m - h * h));
            }
            ASSERT_EQ(exact.holes.size(), truth.size());
            ASSERT_EQ(seen.holes.size(), truth.size());
            EXPECT_NEAR(exact.area_factor, 1 / cosine, 1e-11);
            const auto ends = [&](const SectionPhoto& p) {
                std::vector<double> d;
                for (const Segment& s : p.holes) {
                    // What fit reads: the length beside that of the bar.
                    d.push_back(length_px(s) * p.scale_bar.diameter / length_px(p.scale_bar));
                    EXPECT_NEAR(d.back(), s.diameter, 1e-12);
                    EXPECT_NEAR(*s.minor_px, length_px(s) * cosine, 0.8); // as below, in pixels
                }
                std::sort(d.begin(), d.end());
                return d;
            };
            std::sort(truth.begin(), truth.end());
            const auto by_list = ends(exact), by_pixels = ends(seen);
            for (std::size_t i = 0; i < truth.size(); ++i) {
                EXPECT_NEAR(by_list[i], truth[i], 1e-12);
                // Lattice noise of second moments, well below a pixel of 8 mm.
                EXPECT_NEAR(by_pixels[i], truth[i], 0.003) << tilt;
                ++n;
            }
            const auto middle = [](const Segment& s) {
                return std::pair((s.x1 + s.x2) / 2, (s.y1 + s.y2) / 2);
            };
            for (const Segment& s : seen.holes) {
                double nearest = 1e9;
                for (const Segment& e : exact.holes)
                    nearest = std::min(nearest, std::hypot(middle(s).first - middle(e).first,
                                                           middle(s).second - middle(e).second));
                EXPECT_LT(nearest, 0.5); // pixels
            }
        }
    EXPECT_GT(n, 18u);
}

TEST(SectionPhoto, TheMaskIsWhatWasSearched) {
    const Rock rock({{{0, 0, 0}, 0.3}, {{1, 0, 0}, 0.2}});
    for (const double tilt : {0.0, 60.0}) {
        const SectionPhoto photo =
            rock.photo(plane_of({0, 0, 1}), {.pixel_m = 0.01, .tilt_deg = tilt});
        double sum = 0;
        for (const float pixel : photo.mask.pixels)
            sum += pixel;
        const double cosine = std::cos(tilt * kPi / 180);
        // Holes filled, the bite at the rim too; counting noise 0.3 px^1.5 sqrt(628 px), 4 sd.
        EXPECT_NEAR(sum, kPi * 100 * 100 * cosine, 31);
        EXPECT_NEAR(photo.area_m2, kPi, 31e-4 / cosine);
        EXPECT_EQ(photo.picture.width, photo.mask.width);
        EXPECT_EQ(photo.picture.height, photo.mask.height);
    }
}

TEST(SectionPhoto, HolesAreDarkStoneIsBrightAndTheRestIsFlat) {
    const Rock rock({{{0.2, 0.3, 0}, 0.25}});
    const SectionPlane plane = plane_of({0, 0, 1}); // its v points to -y or to y
    const SectionPhoto photo = rock.photo(plane, {.pixel_m = 0.01, .scale_bar_m = 0.4});
    ASSERT_EQ(photo.holes.size(), 1u);
    const Segment& hole = photo.holes[0];
    const double x = (hole.x1 + hole.x2) / 2, y = (hole.y1 + hole.y2) / 2;
    // The picture is u to the right and v upwards: the disc of the stone is 200 px wide.
    EXPECT_NEAR(x, 16 + 100 + 100 * dot(rock.holes[0].center, plane.u), 1);
    EXPECT_NEAR(y, 16 + 100 - 100 * dot(rock.holes[0].center, plane.v), 1);
    const double stone = bright(photo.picture, 2 * 116 - x, 2 * 116 - y);
    EXPECT_LT(bright(photo.picture, x, y), 0.5 * stone);
    EXPECT_LT(bright(photo.picture, hole.x1 + 2, y), 0.8 * stone);
    EXPECT_GT(stone, 0.3);
    EXPECT_EQ(bright(photo.picture, 0, 0), bright(photo.picture, photo.picture.width - 1, 3));
}

TEST(SectionPhoto, TheBarIsDrawnWhereItIsMarked) {
    const Rock rock({{{0, 0, 0}, 0.2}}, 0.05);
    const SectionPhoto photo =
        rock.photo(plane_of({0, 1, 0}), {.pixel_m = 0.01, .scale_bar_m = 0.4});
    const Segment& bar = photo.scale_bar;
    EXPECT_EQ(bar.label, "scale");
    EXPECT_DOUBLE_EQ(length_px(bar), 40);
    EXPECT_DOUBLE_EQ(bar.diameter, 0.4);
    const double y = bar.y1;
    EXPECT_LT(bright(photo.picture, bar.x1 + 5, y), 0.1);
    EXPECT_GT(bright(photo.picture, bar.x1 + 15, y), 0.8);
    EXPECT_LT(bright(photo.picture, bar.x2 - 0.5, y), 0.1);
    EXPECT_EQ(bright(photo.picture, bar.x1 - 1, y), bright(photo.picture, 0, 0));
    EXPECT_EQ(bright(photo.picture, bar.x2 + 1, y), bright(photo.picture, 0, 0));
    EXPECT_EQ(*photo.mask.at(static_cast<int>(bar.x1 + 5), static_cast<int>(y)), 0);
    // Left open: the same for every plane, and short enough for any.
    EXPECT_EQ(rock.photo(plane_of({1, 2, 3}), {.pixel_m = 0.01}).scale_bar.diameter, 0.5);
}

TEST(SectionPhoto, MarksWhatAPersonWouldSee) {
    const std::vector<Sphere> holes = {{{0, 0, 0}, 0.3},       {{0.1, 0, 0}, 0.1},  // inside
                                       {{0.35, 0, 0}, 0.1},                         // overlaps
                                       {{-0.6, 0, 0}, 0.2},    {{-0.6, 0, 0}, 0.2}, // twice
                                       {{0, 0.7, 0.1}, 0.105},                      // small here
                                       {{0, -1.05, 0}, 0.2}}; // centre in the air
    Rock rock(holes);
    const SectionPlane plane = plane_of({0, 0, 1});
    const SectionPhotoSettings settings{.pixel_m = 0.01, .detection_limit_m = 0.1};
    const SectionPhoto photo = rock.photo(plane, settings);
    EXPECT_EQ(photo.holes.size(), 3u);
    EXPECT_EQ(photo.n_inside, 2u);
    EXPECT_EQ(photo.n_small, 1u);
    EXPECT_EQ(photo.n_solid, 0u);
    for (const Segment& s : photo.holes)
        EXPECT_GE(s.diameter, 0.1);
    rock.holes.push_back({{0, -0.5, 0}, 0.1}); // what cleaning filled is in the list alone
    EXPECT_EQ(rock.photo(plane, settings).holes.size(), 3u);
    EXPECT_EQ(rock.photo(plane, settings).n_solid, 1u);
    // Two that overlap are one region; the bite in the rim is one, too.
    EXPECT_EQ(rock.photo(plane, settings, false).holes.size(), 3u);
}

TEST(SectionPhoto, ShowsEveryMarkToItsEnds) {
    const Rock rock({{{0.9, 0, 0}, 0.5}}, 0.05);
    const SectionPhoto photo = rock.photo(plane_of({0, 0, 1}), {.pixel_m = 0.01});
    ASSERT_EQ(photo.holes.size(), 1u);
    EXPECT_DOUBLE_EQ(photo.holes[0].diameter, 1);
    for (const double x : {photo.holes[0].x1, photo.holes[0].x2}) {
        EXPECT_GE(x, 0);
        EXPECT_LE(x, photo.picture.width);
    }
}

TEST(SectionPhoto, WithoutABaseTheOutlineIsFilled) {
    const Rock rock({{{0.2, 0, 0}, 0.3}, {{1, 0, 0}, 0.3}});
    const SectionPhoto photo =
        section_photo(*rock.rock, {}, plane_of({0, 0, 1}), {.pixel_m = 0.01});
    EXPECT_EQ(photo.holes.size(), 1u);
    EXPECT_LT(photo.area_m2, kPi - 0.1);
    EXPECT_GT(photo.area_m2, kPi - 0.3 * 0.3 * kPi);
}

TEST(SectionPhoto, SettingsLeftOpenFitTheSolid) {
    const Rock rock({{{0, 0, 0}, 0.06}});
    const SectionPhoto photo = rock.photo(plane_of({0, 0, 1}), {});
    EXPECT_NEAR(photo.pixel_m, 2.0 / 800, 0.0001);
    EXPECT_DOUBLE_EQ(photo.detection_limit_m, 0.04); // two voxels are more than four pixels
    EXPECT_EQ(photo.area_factor, 1);
}

TEST(SectionPhoto, RefusesByName) {
    const Rock rock({{{0, 0, 0}, 0.3}}, 0.05);
    const auto fails = [&](const std::string& part, const SectionPhotoSettings& settings) {
        expect_error(Fault::bad_argument, part, [&] { rock.photo(plane_of({0, 0, 1}), settings); });
    };
    fails("tilt_deg is -1; must be in 0..80", {.tilt_deg = -1});
    fails("tilt_deg is 81; must be in 0..80", {.tilt_deg = 81});
    fails("tilt_deg is nan", {.tilt_deg = std::nan("")});
    fails("pixel_m is 0; must be", {.pixel_m = 0});
    fails("scale_bar_m is -1; must be", {.scale_bar_m = -1});
    fails("scale_bar_m is 3, longer than the picture, which is 2 m", {.scale_bar_m = 3});
    fails("pixel_m is 0.1, with which the scale bar of 0.5 m is less than 8 pixels",
          {.pixel_m = 0.1});
    fails("detection_limit_m is 0.02; with pixels of 0.01 m and voxels of 0.05 m holes show from "
          "0.1 m on",
          {.pixel_m = 0.01, .detection_limit_m = 0.02});
    fails("pixel_m is 1e-04, which makes a picture of 2e+04 x 2e+04", {.pixel_m = 1e-4});
    fails("at most 16777216 are drawn; choose pixels from ", {.pixel_m = 1e-200});
    SectionPlane beside = plane_of({0, 0, 1});
    beside.origin.z = 5;
    expect_error(Fault::numeric, "no pixel of the plane lies in the solid",
                 [&] { rock.photo(beside, {.pixel_m = 0.01}); });
}

TEST(SectionPhoto, ThePixelThatIsNamedWillDo) {
    const Rock rock({{{0, 0, 0}, 0.3}}, 0.1);
    std::string said;
    try {
        rock.photo(plane_of({0, 0, 1}), {.pixel_m = 1e-5});
    } catch (const Error& e) {
        said = e.what();
    }
    const std::size_t at = said.find("pixels from ");
    ASSERT_NE(at, std::string::npos) << said;
    const double pixel_m = std::stod(said.substr(at + 12));
    EXPECT_GT(pixel_m, 2.0 / 4096);
    EXPECT_LT(pixel_m, 1.15 * 2.2 / 4096);
}

TEST(SectionPhoto, StopsWhenAsked) {
    struct Stopped : Progress {
        void stage(std::string_view) override {}
        void fraction(double) override {}
        bool cancelled() const override { return true; }
    } stopped;
    const auto rock = ball_rock(1, 0.1);
    expect_error(Fault::cancelled, "", [&] {
        section_photo(*rock, {}, plane_of({0, 0, 1}), {.pixel_m = 0.02}, &stopped);
    });
}

} // namespace
} // namespace taihu
