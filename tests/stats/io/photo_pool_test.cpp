// How marks on photos become a sample: scales, labels, masks, windows.
#include <numeric>

#include "stats/core/file.h"
#include "stats/io/measurements.h"
#include "tests/stats/io/annotation_makers.h"
#include "tests/stats/io/png_maker.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// Files named 0, 1, ... and masks, read together.
class Photos : public testing::Test {
protected:
    Measurements read(const std::vector<std::string>& files) const {
        std::vector<std::filesystem::path> paths;
        for (std::size_t i = 0; i < files.size(); ++i) {
            paths.push_back(scratch_ / std::to_string(i));
            write_file(paths.back(), files[i]);
        }
        return read_measurements(paths, settings_);
    }
    void expect(Fault fault, const std::vector<std::string>& files, const std::string& part) const {
        expect_error(fault, part, [&] { read(files); });
    }
    void add_mask(const std::string& photo, unsigned width, unsigned height,
                  const std::vector<unsigned char>& grey) {
        const auto file = scratch_ / "mask.png";
        write_file(file, png_of(width, height, PNG_FORMAT_GRAY, grey));
        settings_.masks.push_back({photo, file});
    }

    Scratch scratch_;
    MeasurementSettings settings_;
    const std::string header_ = csv_text({});
};

std::vector<Drawn> with_bar(std::vector<Drawn> drawn, int bar_px, const std::string& label) {
    drawn.push_back({5, 5, 5 + bar_px, 5, label});
    return drawn;
}

TEST_F(Photos, EachHasItsOwnScale) {
    settings_.scale_bar_m = 0.5;
    const Measurements m = read({labelme_text(with_bar(eight_holes(), 100, "scale"), "a.jpg"),
                                 labelme_text(with_bar(eight_holes(), 200, "Scale"), "b.jpg")});
    ASSERT_EQ(m.photos.size(), 2u);
    EXPECT_EQ(m.photos[0].unit_per_px, 0.005);
    EXPECT_EQ(m.photos[1].unit_per_px, 0.0025);
    EXPECT_EQ(m.segments[8].photo, 1u);
    EXPECT_EQ(m.segments[8].diameter, m.segments[0].diameter / 2); // a power of two is exact
    EXPECT_EQ(m.sample.unit, LengthUnit::metre);
    // 560 x 450 px each; products of rounded numbers, 1e-14 relative.
    EXPECT_NEAR(*m.sample.area, 560 * 450 * 0.005 * 0.005 * 1.25, 1e-13);
    ASSERT_EQ(m.sample.frames.size(), 2u);
    EXPECT_NEAR(m.photos[1].window->width(), 560 * 0.0025, 1e-14);
}

TEST_F(Photos, NeedTheBarThatIsSpokenOf) {
    settings_.scale_bar_m = 0.5;
    expect(Fault::bad_argument, {labelme_text(eight_holes())}, "no segment is labelled 'scale'");
    expect(Fault::bad_input,
           {labelme_text(with_bar(eight_holes(), 100, "scale"), "a.jpg"),
            labelme_text(eight_holes(), "b.jpg")},
           "b.jpg: the photo has no scale but 'a.jpg' has one");
    expect(Fault::bad_input, {csv_text(with_bar(eight_holes(), 100, "scale"), "0.01")},
           "0:2: the image has a scale bar and a unit_per_px of 0.01; keep one");
    expect(Fault::bad_input, {"# unit=px\n" + csv_text(with_bar(eight_holes(), 9, "scale"))},
           "unit is px but there is a scale bar");
    expect(Fault::bad_argument, {"# unit=m\ndiameter\n1\n"}, "no file has segments");
    settings_.unit = LengthUnit::pixel;
    expect(Fault::bad_argument, {labelme_text(eight_holes())}, "gives metres but unit is px");
}

TEST_F(Photos, AverageTheirBars) {
    settings_.scale_bar_m = 0.5;
    const auto drawn = with_bar(with_bar(eight_holes(), 90, "scale"), 110, "scale");
    const Measurements m = read({labelme_text(drawn)});
    EXPECT_EQ(m.photos[0].unit_per_px, 0.005);
    EXPECT_THAT(m.warnings, testing::ElementsAre(
                                "rock01.jpg: its scale bars are 90 to 110 px long; their mean is "
                                "used"));
}

TEST_F(Photos, LeaveBarsOutWhenTheirLengthIsNotSaid) {
    const Measurements m = read({labelme_text(with_bar(eight_holes(), 100, "scale"))});
    EXPECT_EQ(m.sample.diameters.size(), 8u);
    EXPECT_EQ(m.sample.unit, LengthUnit::pixel);
    EXPECT_EQ(m.sample.area, 560 * 450);
    EXPECT_THAT(m.warnings, Contains(HasSubstr("1 segment labelled 'scale' left out")));
}

TEST_F(Photos, TakeTheLabelThatIsAskedFor) {
    const std::string file = labelme_text(with_bar(eight_holes(), 100, "crack"));
    EXPECT_EQ(read({file}).sample.diameters.size(), 9u);
    settings_.label = "hole";
    const Measurements m = read({file});
    EXPECT_EQ(m.sample.diameters.size(), 8u);
    EXPECT_THAT(m.warnings, testing::ElementsAre("1 segment labelled 'crack' left out"));
    settings_.label = "hloe";
    expect(Fault::bad_argument, {file}, "no segment is labelled 'hloe'; did you mean 'hole'?");
    settings_.label = "scale";
    expect(Fault::bad_argument, {file}, "label is 'scale'");
}

TEST_F(Photos, HaveOneScaleEach) {
    const std::string rows = csv_text(eight_holes(), "0.01").substr(header_.size());
    const std::string other = "rock01.jpg,hole,1,2,3,4,0.02\n", none = "rock01.jpg,hole,1,2,3,4,\n";
    settings_.unit = LengthUnit::metre;
    expect(Fault::bad_input, {header_ + rows + other},
           "0:10: unit_per_px is 0.02 but 0.01 on the same image before");
    expect(Fault::bad_input, {header_ + rows + none}, "0:10: some rows have a scale and some");
    EXPECT_EQ(read({header_ + rows + "b" + other}).photos[1].unit_per_px, 0.02);
}

TEST_F(Photos, AreJoinedByName) {
    const Measurements m = read({labelme_text(eight_holes()), cvat_text(eight_holes())});
    EXPECT_EQ(m.photos.size(), 1u);
    EXPECT_EQ(m.sample.area, 560 * 450);
    ASSERT_EQ(m.warnings.size(), 8u);
    EXPECT_EQ(m.warnings[0], "1: shape 2 of 'rock01.jpg': the same segment as in 0: shapes[1]; it "
                             "is counted twice");
    // Zips of ROIs do not say what they lie on.
    EXPECT_EQ(read({roi_zip_bytes(eight_holes()), roi_zip_bytes(eight_holes())}).photos.size(), 2u);
    expect(Fault::bad_input,
           {labelme_text(eight_holes()),
            R"(<annotations><image name="rock01.jpg" width="280" height="225"/></annotations>)"},
           "1: image 'rock01.jpg' is 280 x 225 px here and 560 x 450 px before");
}

TEST_F(Photos, HoldTheirSegments) {
    auto drawn = eight_holes();
    drawn.push_back({10, 20, 561, 20});
    EXPECT_EQ(read({cvat_text(drawn)}).segments.size(), 9u); // a pixel outside is rounding
    drawn.push_back({10, 449, 12, 452});
    expect(Fault::bad_input, {cvat_text(drawn)},
           "0: shape 10 of 'rock01.jpg': y2 is 452, outside of the image of 560 x 450 px");
    const std::string sized = "image,label,x1,y1,x2,y2,unit_per_px,width_px,height_px\n";
    expect(Fault::bad_input, {sized + "a,h,1,2,3,40,,30,20\n"}, "0:2: y2 is 40, outside");
    expect(Fault::bad_input, {sized + "a,h,1,2,3,4,,30,\n"}, "0:2: only one of width_px");
    expect(Fault::bad_input, {sized + "a,h,1,2,3,4,,30,2.5\n"}, "column 9 'height_px' is '2.5'");
}

TEST_F(Photos, WithoutHolesDoNotCountAsSearched) {
    const Measurements m = read({cvat_text(eight_holes()),
                                 R"(<annotations><image name="b.jpg" width="9" height="9"/>
                                 </annotations>)"});
    EXPECT_EQ(m.photos.size(), 1u);
    EXPECT_EQ(m.sample.area, 560 * 450);
    EXPECT_THAT(m.warnings, Contains(HasSubstr("b.jpg: no holes are marked")));
}

TEST_F(Photos, AreSearchedWhereTheirMaskIsBright) {
    // The left half; of the holes, three have their middle in the right one.
    std::vector<unsigned char> grey(560 * 450);
    for (std::size_t i = 0; i < grey.size(); ++i)
        grey[i] = i % 560 < 280 ? 255 : 0;
    auto drawn = eight_holes();
    for (int i = 0; i < 3; ++i)
        drawn.push_back({20 + 10 * i, 300, 25 + 10 * i, 300});
    add_mask("", 560, 450, grey);
    const Measurements m = read({csv_text(drawn)});
    EXPECT_EQ(m.segments.size(), 8u);
    EXPECT_EQ(m.sample.area, 280 * 450);
    EXPECT_EQ(m.photos[0].width_px, 560);
    EXPECT_THAT(m.warnings, testing::ElementsAre("rock01.jpg: 3 segments outside of the mask left "
                                                 "out"));
    settings_.unit = LengthUnit::greatest;
    const Measurements greatest = read({csv_text(drawn)});
    EXPECT_EQ(*std::max_element(greatest.sample.diameters.begin(), greatest.sample.diameters.end()),
              1);
    // The greatest is the one from (188, 178) to (160, 224); rounded products, 1e-14 relative.
    EXPECT_NEAR(*greatest.sample.area, 280 * 450 / (28.0 * 28 + 46 * 46), 1e-12);
}

TEST_F(Photos, MasksBelongToThePhotoTheyAreNamedAfter) {
    for (const char* name : {"rock-10-mask.png", "rock-1-mask.png"}) {
        const auto file = scratch_ / name;
        write_file(file, png_of(560, 450, PNG_FORMAT_GRAY,
                                std::vector<unsigned char>(560 * 450, name[6] == '0' ? 255 : 0)));
        settings_.masks.push_back({"", file});
    }
    const Measurements m = read({labelme_text(eight_holes(), "photos/rock-1.jpg"),
                                 labelme_text(eight_holes(), "rock-10.jpg")});
    EXPECT_EQ(m.sample.diameters.size(), 8u); // the first is dark all over
    ASSERT_EQ(m.photos.size(), 1u);
    EXPECT_TRUE(m.photos[0].masked);
    EXPECT_EQ(m.photos[0].name, "rock-10.jpg");
}

TEST_F(Photos, RefuseMasksThatDoNotFit) {
    const std::string file = labelme_text(eight_holes());
    add_mask("rock01.jpg", 3, 2, {255, 0, 0, 0, 0, 0});
    expect(Fault::bad_input, {file}, "mask.png: 3 x 2 pixels, its photo 'rock01.jpg' has 560 x");
    settings_.masks[0].photo = "rock1.jpg";
    expect(Fault::bad_argument, {file}, "mask 'mask.png': there is no photo 'rock1.jpg'");
    settings_.masks[0].photo = "";
    expect(Fault::bad_argument, {file, labelme_text(eight_holes(), "b.jpg")},
           "both 'rock01.jpg' and 'b.jpg' could be its photo");
    expect(Fault::bad_argument, {imagej_results_text(eight_holes())}, "may not be in pixels");
    settings_.masks.push_back(settings_.masks[0]);
    expect(Fault::bad_argument, {csv_text(eight_holes())}, "'rock01.jpg' has another one");
}

TEST_F(Photos, KeepAGivenArea) {
    settings_.area = 3;
    const Measurements m = read({labelme_text(eight_holes())});
    EXPECT_EQ(m.sample.area, 3);
    EXPECT_TRUE(m.sample.frames.empty());
    EXPECT_TRUE(m.photos[0].window);
}

TEST_F(Photos, HaveNoAreaWhenOneHasNoSize) {
    const Measurements m = read({labelme_text(eight_holes(), "a.jpg"), csv_text(eight_holes())});
    EXPECT_FALSE(m.sample.area);
    EXPECT_THAT(m.warnings, Contains("pixels of 2 photos are pooled as if they were equal; give "
                                     "each its scale"));
    const std::string plain = "# unit=px\ndiameter\n4\n";
    EXPECT_FALSE(read({labelme_text(eight_holes()), plain}).sample.area);
}

TEST_F(Photos, OfImageJMayBeInMetresAlready) {
    const std::string file = imagej_results_text(eight_holes());
    EXPECT_THAT(read({file}).warnings, Contains(HasSubstr("lengths are read as pixels")));
    settings_.unit = LengthUnit::metre;
    const Measurements m = read({file});
    EXPECT_EQ(m.sample.unit, LengthUnit::metre);
    EXPECT_NEAR(m.sample.diameters[1], 5, 1e-6); // six decimals in the table
    EXPECT_TRUE(m.warnings.empty());
    expect(Fault::bad_input, {labelme_text(eight_holes())}, "unit is m but unit_per_px is empty");
}

} // namespace
} // namespace taihu
