#include "stats/sample.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

using testing::HasSubstr;

TEST(Sample, CountsBothKinds) {
    Sample sample;
    sample.diameters = {3, 1, 2};
    EXPECT_EQ(n_profiles(sample), 3u);
    EXPECT_EQ(detection_limit(sample), 1);
    sample = {};
    sample.bins = {{0, 1, 0}, {1, 2, 5}, {2, 4, 1}};
    EXPECT_EQ(n_profiles(sample), 6u);
    EXPECT_EQ(detection_limit(sample), 1);
    sample.detection_limit = 0.5;
    EXPECT_EQ(detection_limit(sample), 0.5);
}

TEST(Sample, JoinsItsFrames) {
    Sample sample;
    sample.diameters = {3, 1, 2};
    EXPECT_FALSE(searched_area(sample));
    sample.frames = {{2, 0.5, {}}, {3, {}, {}}};
    EXPECT_EQ(searched_area(sample), 5);
    EXPECT_EQ(detection_limit(sample), 0.5);
    EXPECT_EQ(detection_limit(sample, sample.frames[1]), 1);
}

void expect_refused(const Sample& sample, const char* message) {
    try {
        check_sample(sample);
        ADD_FAILURE() << "no exception for " << message;
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        EXPECT_THAT(e.what(), HasSubstr(message));
    }
}

Sample with_diameters(std::vector<double> diameters) {
    Sample sample;
    sample.diameters = std::move(diameters);
    return sample;
}

Sample with_bins(std::vector<Bin> bins) {
    Sample sample;
    sample.bins = std::move(bins);
    return sample;
}

TEST(Sample, SaysWhatIsWrongWithIt) {
    expect_refused({}, "has no profiles");
    expect_refused(with_bins({{0, 1, 0}}), "has no profiles");
    expect_refused(with_diameters({1, -2}), "diameters[1] is -2; must be finite and > 0");
    expect_refused(with_diameters({std::nan("")}), "diameters[0] is nan");
    expect_refused(with_bins({{1, 1, 3}}), "bins[0] is 1..1; edges must rise");
    expect_refused(with_bins({{-1, 1, 3}}), "bins[0] is -1..1");
    expect_refused(with_bins({{0, 1, 3}, {1.5, 2, 3}}), "bins[1] begins at 1.5");
    expect_refused(with_bins({{0, 1, 2'000'000'000}}), "at most 1e9");
    Sample both = with_diameters({1});
    both.bins = {{0, 1, 1}};
    expect_refused(both, "has diameters and bins");
    Sample no_area = with_diameters({1});
    no_area.area = 0;
    expect_refused(no_area, "area is 0");
    Sample negative = with_diameters({1});
    negative.detection_limit = -1;
    expect_refused(negative, "detection limit is -1");
    Sample framed = with_diameters({1});
    framed.frames = {{2, {}, {}}, {3, {}, {}}};
    framed.area = 6;
    expect_refused(framed, "area is 6 but that of the frames together is 5");
    framed.area.reset();
    framed.counting = Counting::whole;
    expect_refused(framed, "frames[0] has no window");
    framed.frames.clear();
    expect_refused(framed, "whole profiles were counted but no window is known");
    framed.frames = {{0, {}, Window::rectangle(1, 1)}};
    expect_refused(framed, "frames[0].area is 0");
    framed.frames = {{1, 2, Window::rectangle(1, 1)}};
    expect_refused(framed, "detection limit is 2 but the smallest profile is 1");
}

TEST(LengthUnit, IsFoundByItsName) {
    for (const auto unit : {LengthUnit::metre, LengthUnit::pixel, LengthUnit::greatest})
        EXPECT_EQ(unit_from_name(unit_name(unit)), unit);
    try {
        unit_from_name("inch");
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_THAT(e.what(), HasSubstr("'inch' is none; use m, px or greatest"));
    }
}

} // namespace
} // namespace taihu
