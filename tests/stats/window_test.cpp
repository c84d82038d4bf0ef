#include "stats/window.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

using testing::HasSubstr;

Image disc(int size, double radius) {
    Image image(size, size, 1);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            *image.at(x, y) =
                std::hypot(x + 0.5 - 0.5 * size, y + 0.5 - 0.5 * size) <= radius ? 1.0F : 0.0F;
    return image;
}

TEST(Window, ErodesARectangleExactly) {
    const Window window = Window::rectangle(8, 6);
    EXPECT_EQ(window.area(), 48);
    EXPECT_EQ(window.eroded_area(0), 48);
    EXPECT_EQ(window.eroded_area(2), 24);
    EXPECT_EQ(window.eroded_area(6), 0);
    EXPECT_EQ(window.eroded_area(7), 0); // not (8 - 7) (6 - 7)
    EXPECT_TRUE(window.contains(8, 0));
    EXPECT_FALSE(window.contains(8.01, 1));
    EXPECT_FALSE(window.contains(1, -0.01));
}

TEST(Window, ErodesAMaskOfTheWholePictureAsTheRectangle) {
    Image image(80, 60, 1);
    for (float& pixel : image.pixels)
        pixel = 1;
    const Window mask = Window::mask(image, 0.1), rectangle = Window::rectangle(8, 6);
    EXPECT_NEAR(mask.area(), 48, 1e-12);
    EXPECT_NEAR(mask.width(), 8, 1e-12);
    // Within a pixel: a strip half a pixel wide around the eroded rectangle at most.
    for (double d = 0; d < 7; d += 0.13)
        EXPECT_NEAR(mask.eroded_area(d), rectangle.eroded_area(d), 0.05 * 28) << d;
    // Straight edges are met exactly but for the corners.
    EXPECT_NEAR(mask.eroded_area(1.3), rectangle.eroded_area(1.3), 0.02);
}

TEST(Window, ErodesADiscToASmallerDisc) {
    const Window window = Window::mask(disc(200, 90), 0.01);
    for (double d = 0; d < 1.7; d += 0.1) {
        const double radius = 0.9 - 0.5 * d;
        // Half a pixel of the radius.
        EXPECT_NEAR(window.eroded_area(d), std::numbers::pi * radius * radius,
                    2 * std::numbers::pi * radius * 0.005 + 1e-4)
            << d;
    }
    EXPECT_EQ(window.eroded_area(1.83), 0);
    EXPECT_TRUE(window.contains(1, 1));
    EXPECT_FALSE(window.contains(0.1, 0.1));
}

TEST(Window, NeverGrowsWithTheDiscItErodesBy) {
    Image image = disc(61, 29);
    for (int x = 0; x < 61; ++x)
        *image.at(x, 20) = 0; // a scratch across
    const Window window = Window::mask(image, 1);
    double before = window.area();
    for (double d = 0; d < 70; d += 0.05) {
        EXPECT_LE(window.eroded_area(d), before) << d;
        before = window.eroded_area(d);
    }
    EXPECT_EQ(before, 0);
    EXPECT_FALSE(window.contains(30, 20.5));
    EXPECT_TRUE(window.contains(30, 21.5));
}

TEST(Window, SaysWhatIsWrongWithIt) {
    const auto refusal = [](auto make) -> std::string {
        try {
            make();
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::bad_argument);
            return e.what();
        }
        return "no exception";
    };
    EXPECT_THAT(refusal([] { Window::rectangle(0, 1); }), HasSubstr("width is 0; must be finite"));
    EXPECT_THAT(refusal([] { Window::rectangle(1, std::nan("")); }), HasSubstr("height is nan"));
    EXPECT_THAT(refusal([] { Window::mask(Image(4, 4, 1), 1); }),
                HasSubstr("no pixel of the mask"));
    EXPECT_THAT(refusal([] { Window::mask(Image(4, 4, 3), 1); }), HasSubstr("with 3 channels"));
    EXPECT_THAT(refusal([] { Window::mask(disc(9, 4), -1); }), HasSubstr("unit_per_px is -1"));
}

} // namespace
} // namespace taihu
