#include "stats/io/imagej_file_detail.h"

#include "stats/core/rng.h"
#include "tests/stats/io/annotation_makers.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

Annotations results(const std::string& rows) {
    const std::string text = " ,Label,BX,BY,Width,Height,Angle,Length\n" + rows;
    return read_imagej_results(Table(text, "r.csv"), "r.csv");
}

TEST(ImageJ, ReadsALine) {
    const Annotations a = read_imagej_roi(roi_bytes({1, 2, 3, 4}), "scale-2.roi");
    ASSERT_EQ(a.marks.size(), 1u);
    EXPECT_EQ(a.marks[0].x2, 3);
    EXPECT_EQ(a.marks[0].label, "scale");
    EXPECT_EQ(a.photos[0].name, "");
    EXPECT_EQ(read_imagej_roi(roi_bytes({1, 2, 3, 4}), "0001-0178-0160.roi").marks[0].label, "");
}

TEST(ImageJ, PrefersTheNameInside) {
    std::string roi = roi_bytes({1, 2, 3, 4});
    roi.replace(64 + 16, 8, big_endian(128, 4) + big_endian(2, 4));
    roi += std::string("\x76\xf4\0-", 4) + std::string("\0", 1);
    EXPECT_EQ(read_imagej_roi(roi, "x.roi").marks[0].label, "\xe7\x9b\xb4-");
    roi.replace(64 + 20, 4, big_endian(0x7fffffff, 4)); // a name longer than the file
    expect_error(Fault::bad_input, "the ROI is cut short", [&] { read_imagej_roi(roi, "x.roi"); });
}

TEST(ImageJ, ReadsAPolylineOfTwoPoints) {
    std::string roi = roi_bytes({0, 0, 0, 0}, 5);
    roi.replace(8, 4, big_endian(100, 2) + big_endian(0xfff6, 2)); // top 100, left -10
    roi.replace(16, 2, big_endian(2, 2));
    roi.replace(60, 4, big_endian(0, 4));
    roi.replace(64, 8, big_endian(0, 2) + big_endian(30, 2) + big_endian(5, 2) + big_endian(0, 2));
    const Mark whole = read_imagej_roi(roi, "x.roi").marks.at(0);
    EXPECT_EQ(std::vector({whole.x1, whole.y1, whole.x2, whole.y2}),
              (std::vector<double>{-10, 105, 20, 100}));
    roi.replace(50, 2, big_endian(128, 2)); // the floats behind the whole numbers
    roi.replace(72, 16, roi_bytes({7, 8, 9, 11}).substr(18, 16));
    const Mark exact = read_imagej_roi(roi, "x.roi").marks.at(0);
    EXPECT_EQ(std::vector({exact.x1, exact.x2, exact.y1, exact.y2}),
              (std::vector<double>{7, 8, 9, 11}));
}

TEST(ImageJ, CountsOtherTypesAndFiles) {
    const Annotations a = read_imagej_zip(
        zip_bytes({{"a/", ""}, {"a/1.roi", roi_bytes({1, 2, 3, 4}, 0)}, {"x.txt", "hello"}}), "z");
    EXPECT_THAT(a.other_shapes, testing::ElementsAre(testing::Pair("file that is no ROI", 1),
                                                     testing::Pair("polygon", 1)));
    EXPECT_TRUE(a.marks.empty());
}

TEST(ImageJ, RefusesZipsThatAreTooMuch) {
    const auto expect = [](const std::vector<ZipEntry>& entries, const std::string& part) {
        expect_error(Fault::bad_input, part, [&] { read_imagej_zip(zip_bytes(entries), "z.zip"); });
    };
    expect({{"big.roi", std::string((1 << 20) + 1, '\0')}},
           "z.zip: 'big.roi': 1048577 bytes, a ROI has at most 1048576");
    expect({{"cut.roi", roi_bytes({1, 2, 3, 4}).substr(0, 40)}}, "'cut.roi': 40 bytes");
    std::string forged = zip_bytes({{"a.roi", roi_bytes({1, 2, 3, 4})}});
    forged[50] ^= 1; // within the entry
    expect_error(Fault::bad_input, "'a.roi': is damaged",
                 [&] { read_imagej_zip(forged, "z.zip"); });
    expect_error(Fault::bad_input, "z.zip: damaged zip",
                 [&] { read_imagej_zip(forged.substr(0, 90), "z.zip"); });
}

TEST(ImageJ, FindsTheEndsInATableOfResults) {
    // To the left and down; to the right and up; to the left; up.
    const Annotations a = results("1,r.jpg,160,178,28,46,-121.329,53.852\n"
                                  "2,r.jpg:hole-3,10,20,3,4,53.13,5\n"
                                  "3,r.jpg,10,20,30,0,180,30\n4,r.jpg,10,20,0,7,90,7\n");
    const auto ends = [&](std::size_t i) {
        const Mark& m = a.marks.at(i);
        return std::vector({m.x1, m.y1, m.x2, m.y2});
    };
    EXPECT_EQ(ends(0), (std::vector<double>{188, 178, 160, 224}));
    EXPECT_EQ(ends(1), (std::vector<double>{10, 24, 13, 20}));
    EXPECT_EQ(ends(2), (std::vector<double>{40, 20, 10, 20}));
    EXPECT_EQ(ends(3), (std::vector<double>{10, 27, 10, 20}));
    EXPECT_EQ(a.marks[0].length_px, 53.852);
    EXPECT_EQ(a.marks[1].label, "hole");
    EXPECT_EQ(a.photos.size(), 1u);
}

TEST(ImageJ, TakesTheLengthAloneWhereTheEndsAreNotKnown) {
    const std::string text = " \tLabel\tLength\n1\tr.jpg\t12,5\n2\tMean\t12,5\n3\tSD\tNaN\n";
    const Annotations a = read_imagej_results(Table(text, "r.csv"), "r.csv");
    ASSERT_EQ(a.marks.size(), 1u);
    EXPECT_EQ(a.marks[0].length_px, 12.5);
    EXPECT_FALSE(a.marks[0].has_ends);
    EXPECT_THAT(a.other_shapes, testing::ElementsAre(testing::Pair("row of Summarize", 2)));
    // A way that is longer than its box allows is no straight line.
    EXPECT_FALSE(results("1,r.jpg,10,20,3,4,53.13,9\n").marks[0].has_ends);
}

TEST(ImageJ, RefusesTablesWithoutLengths) {
    expect_error(Fault::bad_input, "r.csv:2: column 8 'Length' is '0'",
                 [] { results("1,r.jpg,10,20,0,0,0,0\n"); });
    expect_error(Fault::bad_input, "column 'Length' is missing",
                 [] { read_imagej_results(Table(" ,Label,Area\n1,r.jpg,3\n", "r.csv"), "r.csv"); });
}

// In a zip a checksum would catch these first.
TEST(ImageJ, RefusesOrReadsRoisThatAreDamaged) {
    const Rng rng{.seed = 8, .stream = 0};
    const auto read = [](const std::string& bytes) {
        try {
            for (const Mark& m : read_imagej_roi(bytes, "a.roi").marks)
                EXPECT_TRUE(std::isfinite(m.x1 + m.y1 + m.x2 + m.y2));
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::bad_input) << e.what();
        }
    };
    for (const char type : {3, 5}) {
        std::string roi = roi_bytes({1, 2, 3, 4}, type);
        roi.replace(16, 2, big_endian(2, 2));
        roi.replace(64 + 16, 8, big_endian(120, 4) + big_endian(4, 4)); // a name
        for (std::size_t n = 0; n < roi.size(); ++n)
            read(roi.substr(0, n));
        for (std::uint64_t i = 0; i < 3000; ++i) {
            std::string changed = roi;
            changed[static_cast<std::size_t>(rng.uniform(i, 0) * static_cast<double>(roi.size()))] =
                static_cast<char>(static_cast<int>(rng.uniform(i, 1) * 256));
            read(changed);
        }
    }
}

} // namespace
} // namespace taihu
