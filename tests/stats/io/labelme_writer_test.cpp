#include "stats/io/labelme_writer.h"

#include <cmath>

#include "stats/core/file.h"
#include "stats/io/json_detail.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

/// Eight holes and a bar, none of their numbers round.
std::vector<Segment> drawn() {
    std::vector<Segment> segments;
    for (int i = 0; i < 9; ++i) {
        Segment s;
        s.label = i == 8 ? "scale" : "hole";
        s.x1 = 10 + 40.1 * i;
        s.y1 = 300 / (i + 1.0);
        s.x2 = s.x1 + 7.7 + i;
        s.y2 = s.y1 + std::sqrt(2.0) * (3 - i);
        segments.push_back(s);
    }
    return segments;
}

/// What becomes of segments that are written and read again.
Measurements reread(const std::vector<Segment>& segments, const MeasurementSettings& settings) {
    const Scratch scratch;
    const auto file = scratch / "plane.json";
    write_file(file, format_labelme("plane.png", 640, 480, segments));
    return read_measurements(std::vector{file}, settings);
}

TEST(LabelmeWriter, WhatIsReadIsWhatWasWritten) {
    const std::vector<Segment> before = drawn();
    const Measurements after = reread(before, {});
    ASSERT_EQ(after.segments.size(), 8u);
    for (std::size_t i = 0; i < 8; ++i) {
        const Segment &a = before[i], &b = after.segments[i];
        EXPECT_EQ(b.label, "hole");
        EXPECT_EQ(b.x1, a.x1); // to the last bit
        EXPECT_EQ(b.y1, a.y1);
        EXPECT_EQ(b.x2, a.x2);
        EXPECT_EQ(b.y2, a.y2);
    }
    ASSERT_EQ(after.photos.size(), 1u);
    EXPECT_EQ(after.photos[0].name, "plane.png");
    EXPECT_EQ(after.photos[0].width_px, 640);
    EXPECT_EQ(after.photos[0].height_px, 480);
}

TEST(LabelmeWriter, HasTheKeysThatLabelmeAsksFor) {
    const nlohmann::json file = parse_json(format_labelme("a\"b.png", 2, 3, drawn()), "a.json");
    EXPECT_EQ(file["version"].get<std::string>().substr(0, 2), "5.");
    EXPECT_EQ(file["imagePath"], "a\"b.png");
    EXPECT_TRUE(file["imageData"].is_null());
    ASSERT_EQ(file["shapes"].size(), 9u);
    for (const char* key : {"label", "points", "group_id", "shape_type", "flags"})
        EXPECT_TRUE(file["shapes"][0].contains(key)) << key;
    EXPECT_EQ(file["shapes"][0]["shape_type"], "line");
    EXPECT_EQ(parse_json(format_labelme("a.png", 2, 3, {}), "a.json")["shapes"].size(), 0u);
}

TEST(LabelmeWriter, RefusesWhatIsNoPhotoOrNoLine) {
    const auto fails = [](const std::string& part, const std::string& image, int width,
                          const Segment& s) {
        expect_error(Fault::bad_argument, part,
                     [&] { format_labelme(image, width, 10, std::vector{s}); });
    };
    Segment good;
    good.x2 = 1;
    fails("name is \"\"", "", 10, good);
    fails("name is \"a/b.png\"", "a/b.png", 10, good);
    fails("a side of the photo is 0 px", "a.png", 0, good);
    fails("segments[0] has length 0", "a.png", 10, Segment{});
    Segment far = good;
    far.y1 = std::nan("");
    fails("segments[0] has length nan", "a.png", 10, far);
    good.has_ends = false;
    fails("segments[0] has no ends", "a.png", 10, good);
}

// A segment drawn over a hole gives its place, the midpoint, and its diameter, the length; a bar of
// known length gives them in metres.
TEST(SeedRow, E42ASegmentGivesMidpointAndLength) {
    std::vector<Segment> segments = drawn();
    segments[0].x1 = 101, segments[0].y1 = 52; // 3, 4, 5 by ten, and its middle
    segments[0].x2 = 131, segments[0].y2 = 92;
    segments[8].x1 = 20, segments[8].y1 = 470;
    segments[8].x2 = 420, segments[8].y2 = 470; // 2 m on 400 px
    MeasurementSettings bar;
    bar.scale_bar_m = 2;
    const Measurements in_metres = reread(segments, bar);
    ASSERT_EQ(in_metres.segments.size(), 8u); // the bar is no hole
    const Segment& s = in_metres.segments[0];
    EXPECT_EQ((s.x1 + s.x2) / 2, 116);
    EXPECT_EQ((s.y1 + s.y2) / 2, 72);
    EXPECT_DOUBLE_EQ(s.diameter, 0.25);
    EXPECT_DOUBLE_EQ(in_metres.sample.diameters[0], 0.25);
    EXPECT_DOUBLE_EQ(in_metres.photos[0].unit_per_px, 0.005);
    EXPECT_EQ(in_metres.sample.unit, LengthUnit::metre);
    EXPECT_DOUBLE_EQ(*in_metres.sample.area, 640 * 480 * 0.005 * 0.005);
    const Measurements in_pixels = reread(segments, {});
    EXPECT_DOUBLE_EQ(in_pixels.sample.diameters[0], 50);
    EXPECT_EQ(in_pixels.sample.unit, LengthUnit::pixel);
}

} // namespace
} // namespace taihu
