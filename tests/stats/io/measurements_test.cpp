#include "stats/io/measurements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

using testing::HasSubstr;

// The files are named 0.csv, 1.csv, ...
Measurements read_texts(const std::vector<std::string>& texts,
                        const MeasurementSettings& settings = {}) {
    const Scratch scratch;
    std::vector<std::filesystem::path> paths;
    for (std::size_t i = 0; i < texts.size(); ++i) {
        paths.push_back(scratch / (std::to_string(i) + ".csv"));
        write_file(paths.back(), texts[i]);
    }
    return read_measurements(paths, settings);
}

std::string refusal(const std::vector<std::string>& texts,
                    const MeasurementSettings& settings = {}) {
    try {
        read_texts(texts, settings);
    } catch (const Error& e) {
        return e.what();
    }
    return "accepted";
}

const std::string kPlain = "diameter\n1\n2\n3\n4\n5\n6\n7\n8\n";
const std::string kBins = "diameter_lo,diameter_hi,count\n0,1,0\n1,2,5\n2,3,4\n";
const std::string kHeader = "image,label,x1,y1,x2,y2,unit_per_px\n";

// `n` segments of 5 px, one below the other.
std::string segments(int n, const std::string& scale) {
    std::string rows;
    for (int i = 0; i < n; ++i)
        rows += "a.png,hole," + std::to_string(i) + ",0," + std::to_string(i + 3) + ",4," + scale +
                "\n";
    return rows;
}

TEST(Measurements, ReadTheRockOfTheThesis) {
    const std::filesystem::path path = TAIHU_DATA "/measurements/rock1.csv";
    const Measurements m = read_measurements({&path, 1});
    EXPECT_EQ(m.sample.unit, LengthUnit::greatest);
    EXPECT_EQ(n_profiles(m.sample), 46u);
    EXPECT_EQ(detection_limit(m.sample), 0.1);
    ASSERT_EQ(m.sample.bins.size(), 10u);
    EXPECT_EQ(m.sample.bins[9], (Bin{0.9, 1, 1}));
    EXPECT_FALSE(m.sample.area);
    EXPECT_TRUE(m.warnings.empty());
    EXPECT_EQ(m.sources[0], (SourceFile{"rock1.csv", sha256_hex(read_file(path))}));
}

TEST(Measurements, ReadPlainDiameters) {
    const Measurements m = read_texts({"# unit=m\n# area=12.5\n" + kPlain});
    EXPECT_EQ(m.sample.diameters, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8}));
    EXPECT_EQ(m.sample.unit, LengthUnit::metre);
    EXPECT_EQ(m.sample.area, 12.5);
    const Measurements set = read_texts(
        {kPlain},
        {.unit = LengthUnit::pixel, .unit_per_px = {}, .area = 3.0, .detection_limit = 0.5});
    EXPECT_EQ(set.sample.unit, LengthUnit::pixel);
    EXPECT_EQ(set.sample.area, 3);
    EXPECT_EQ(detection_limit(set.sample), 0.5);
}

TEST(Measurements, ReadSegmentsInPixelsWhenNoScaleIsKnown) {
    for (const char* scale : {"", "1"}) {
        const Measurements m = read_texts({kHeader + segments(8, scale)});
        EXPECT_EQ(m.sample.unit, LengthUnit::pixel);
        EXPECT_EQ(m.sample.diameters, std::vector<double>(8, 5.0));
        ASSERT_EQ(m.segments.size(), 8u);
        EXPECT_EQ(m.segments[2].image, "a.png");
        EXPECT_EQ(m.segments[2].x1, 2);
        EXPECT_EQ(m.segments[2].line, 4u);
    }
}

TEST(Measurements, ScaleSegments) {
    const Measurements m = read_texts({"# unit=m\n" + kHeader + segments(8, "0.02")});
    EXPECT_EQ(m.sample.unit, LengthUnit::metre);
    EXPECT_DOUBLE_EQ(m.sample.diameters[0], 0.1);
    MeasurementSettings settings;
    settings.unit = LengthUnit::metre;
    settings.unit_per_px = 0.04;
    EXPECT_DOUBLE_EQ(read_texts({kHeader + segments(8, "")}, settings).sample.diameters[0], 0.2);
    // The file's own scale is nearer to the picture than the setting.
    EXPECT_DOUBLE_EQ(read_texts({kHeader + segments(8, "0.02")}, settings).sample.diameters[0],
                     0.1);
    settings.unit = LengthUnit::greatest;
    EXPECT_EQ(read_texts({kHeader + segments(8, "0.02")}, settings).sample.diameters[0], 1);
}

TEST(Measurements, UndoTheSlantOfThePicture) {
    std::string text = "# area=100\nimage,label,x1,y1,x2,y2,unit_per_px,minor\n";
    for (int i = 0; i < 8; ++i)
        text += "a,," + std::to_string(i) + ",0," + std::to_string(i) + ",10,," +
                (i % 2 ? "4" : "6") + "\n";
    // E[minor / major] = 0.5: the picture shows the surface at half its size.
    EXPECT_DOUBLE_EQ(*read_texts({text}).sample.area, 200);
    EXPECT_THAT(refusal({text + "a,,9,0,9,10,,11\n"}),
                HasSubstr("'minor' is '11'; must be > 0 and"));
    // One hole without a minor axis: the slant is not known.
    EXPECT_EQ(*read_texts({text + "a,,9,0,9,10,,\n"}).sample.area, 100);
}

TEST(Measurements, ReadTheProfilesOfASection) {
    std::string text = "# area_m2=2\nplane,u_m,v_m,diameter_m\n";
    for (int i = 1; i <= 8; ++i)
        text += "0,0,0,0." + std::to_string(i) + "\n";
    const Measurements m = read_texts({text, text});
    EXPECT_EQ(m.sample.unit, LengthUnit::metre);
    EXPECT_EQ(m.sample.area, 4);
    EXPECT_EQ(m.sample.diameters.size(), 16u);
}

TEST(Measurements, JoinFiles) {
    const std::string bins = "# unit=px\n# area=2\n" + kBins;
    const Measurements m = read_texts({bins, bins});
    EXPECT_EQ(m.sample.bins[1].count, 10u);
    EXPECT_EQ(m.sample.area, 4);
    EXPECT_EQ(m.sources.size(), 2u);
    const Measurements mixed = read_texts({"# unit=px\n" + kPlain, kHeader + segments(2, "")});
    EXPECT_EQ(mixed.sample.diameters.size(), 10u);

    EXPECT_THAT(refusal({bins, "# unit=px\n# area=2\n" + kPlain}), HasSubstr("do not mix"));
    EXPECT_THAT(refusal({"# unit=px\n" + kPlain, "# unit=m\n" + kPlain}),
                HasSubstr("1.csv: unit is m but the files before are in px"));
    EXPECT_THAT(refusal({bins, "# unit=px\n" + kBins}), HasSubstr("only some of the files say"));
    EXPECT_THAT(refusal({bins, bins + "3,4,1\n"}), HasSubstr("1.csv: its bins differ"));
}

TEST(Measurements, WarnOfWhatLooksLikeASlip) {
    const Measurements m =
        read_texts({"# aera=3\n" + kHeader + segments(8, "") + "a.png,again,3,4,0,0,\n"});
    ASSERT_EQ(m.warnings.size(), 2u);
    EXPECT_EQ(m.warnings[0], "0.csv:1: comment 'aera' is not read; did you mean 'area'?");
    EXPECT_EQ(m.warnings[1], "0.csv:11: the same segment as on line 3; it is counted twice");
    EXPECT_EQ(m.sample.diameters.size(), 9u);
}

TEST(Measurements, NameTheRowThatIsWrong) {
    const std::string plain = "# unit=m\n" + kPlain, bins = "# unit=m\n" + kBins;
    EXPECT_THAT(refusal({plain + "nan\n"}), HasSubstr("0.csv:11: column 1 'diameter' is 'nan'"));
    EXPECT_THAT(refusal({plain + "0\n"}), HasSubstr("0.csv:11: column 1 'diameter' is '0'"));
    EXPECT_THAT(refusal({bins + "3,4,-1\n"}), HasSubstr("0.csv:6: column 3 'count' is '-1'"));
    EXPECT_THAT(refusal({bins + "3,4,1.5\n"}), HasSubstr("must be a whole number"));
    EXPECT_THAT(refusal({bins + "3.5,4,1\n"}),
                HasSubstr("the bin before ends at 3, bins must touch"));
    EXPECT_THAT(refusal({bins + "2.5,4,1\n"}), HasSubstr("bins must touch"));
    EXPECT_THAT(refusal({bins + "3,3,1\n"}), HasSubstr("must be above the lower edge"));
    EXPECT_THAT(refusal({kHeader + segments(8, "") + "a,b,1,1,1,1,\n"}),
                HasSubstr("0.csv:10: the segment has length 0"));
    EXPECT_THAT(refusal({kHeader + segments(8, "0")}),
                HasSubstr("'unit_per_px' is '0'; must be > 0"));
    EXPECT_THAT(refusal({"# unit=m\n" + kHeader + segments(7, "2") + segments(1, "")}),
                HasSubstr("some rows have a scale and some have none"));
    EXPECT_THAT(refusal({"# unit=m\ndiameter\n1\n2\n"}), HasSubstr("2 profiles; at least 8"));
    EXPECT_THAT(refusal({"# unit=m\ndiameter_lo,diameter_hi,count\n0,1,0\n"}),
                HasSubstr("0 profiles; at least 8"));
}

TEST(Measurements, InsistOnAUnit) {
    EXPECT_THAT(refusal({kPlain}), HasSubstr("0.csv: the unit of the lengths is not said"));
    EXPECT_THAT(refusal({kHeader + segments(8, "0.02")}), HasSubstr("unit of the lengths"));
    EXPECT_THAT(refusal({"# unit=m\n" + kHeader + segments(8, "")}),
                HasSubstr("unit is m but unit_per_px is empty"));
    EXPECT_THAT(refusal({"# unit=inch\n" + kPlain}), HasSubstr("0.csv:1: unit: 'inch' is none"));
    MeasurementSettings pixels;
    pixels.unit = LengthUnit::pixel;
    EXPECT_THAT(refusal({"# unit=m\n" + kPlain}, pixels), HasSubstr("unit is m, not px as asked"));
    EXPECT_THAT(refusal({"# unit=greatest\n" + kPlain}),
                HasSubstr("the greatest diameter is not 1"));
    EXPECT_THAT(refusal({"# unit=greatest\n" + kBins}),
                HasSubstr("the greatest diameter is not 1"));
    EXPECT_THAT(refusal({"# unit=greatest\n# area=3\n" + kHeader + segments(8, "")}),
                HasSubstr("an area has no unit"));
}

TEST(Measurements, FindTheFormatByTheHeader) {
    EXPECT_THAT(refusal({"diametre\n1\n"}), HasSubstr("did you mean 'diameter'?"));
    EXPECT_THAT(refusal({"diameter,colour\n1,2\n"}), HasSubstr("unknown column 'colour'"));
    EXPECT_THAT(refusal({"image,label,x1,y1,x2,y2\n"}),
                HasSubstr("column 'unit_per_px' is missing"));
    EXPECT_THAT(refusal({"image,label\n"}), HasSubstr("the columns make no format"));
}

TEST(Measurements, ReadChineseHeadersWithDecimalCommas) {
    std::string text =
        "\xef\xbb\xbf# unit=m;;;;;;\r\n图像;标签;起点x;起点y;终点x;终点y;每像素长度\r\n";
    for (int i = 0; i < 8; ++i)
        text +=
            "石.jpg;hole;" + std::to_string(i) + ",5;0;" + std::to_string(i + 3) + ",5;4;0,02\r\n";
    const Measurements m = read_texts({text});
    EXPECT_EQ(m.segments.at(7).x1, 7.5);
    EXPECT_EQ(m.segments[7].image, "石.jpg");
    EXPECT_DOUBLE_EQ(m.sample.diameters[0], 0.1);
    EXPECT_THAT(refusal({"直径\n1\n-1\n"}), HasSubstr("0.csv:3: column 1 'diameter' is '-1'"));
}

TEST(Measurements, SayWhatOtherFilesLack) {
    EXPECT_THAT(refusal({"Index,Name,Type,Group,X,Y,Width,Height,LWidth\n1,a,Line,0,1,2,3,4,0\n"}),
                HasSubstr("is the list of ImageJ's ROI Manager, which has no ends"));
    EXPECT_THAT(refusal({"{\"images\":[],\"annotations\":[]}"}),
                HasSubstr("neither of labelme nor of VIA"));
    EXPECT_THAT(refusal({""}), HasSubstr("is empty"));
}

TEST(Measurements, CheckTheSettings) {
    EXPECT_THAT(
        refusal({kPlain}, {.unit = {}, .unit_per_px = -1, .area = {}, .detection_limit = {}}),
        HasSubstr("unit_per_px is -1; must be finite and > 0"));
    EXPECT_THAT(refusal({"# unit=m\n" + kPlain},
                        {.unit = {}, .unit_per_px = {}, .area = {}, .detection_limit = 2}),
                HasSubstr("detection limit is 2 but the smallest profile is 1"));
    EXPECT_THAT(refusal({}), HasSubstr("no files; give at least one"));
}

} // namespace
} // namespace taihu
