#include "stats/io/labelme_file_detail.h"

#include "stats/io/json_detail.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

Annotations read(const std::string& shapes, const std::string& rest = "") {
    return read_labelme(parse_json("{\"shapes\":[" + shapes + "]" + rest + "}", "a.json"),
                        "a.json");
}

std::string shape(const std::string& type, const std::string& points) {
    return R"({"label":"hole","shape_type":")" + type + R"(","points":)" + points + "}";
}

TEST(Labelme, TakesLinesAndStripsOfTwoPoints) {
    const Annotations a =
        read(shape("line", "[[1,2],[3.5,4]]") + "," + shape("linestrip", "[[5,6],[7,8]]"));
    ASSERT_EQ(a.marks.size(), 2u);
    EXPECT_EQ(a.marks[0].x2, 3.5);
    EXPECT_EQ(a.marks[1].y1, 6);
    EXPECT_EQ(a.marks[1].item, "shapes[1]");
    EXPECT_TRUE(a.other_shapes.empty());
    EXPECT_FALSE(a.photos[0].name);
    EXPECT_EQ(a.photos[0].width_px, 0);
}

TEST(Labelme, CountsWhatIsNoSegment) {
    const Annotations a = read(shape("polygon", "[]") + "," + shape("polygon", "[]") + "," +
                               shape("linestrip", "[[1,2],[3,4],[5,6]]") + "," +
                               shape("linestrip", "[[1,2]]") + ",{\"label\":\"old\"}");
    EXPECT_TRUE(a.marks.empty());
    EXPECT_THAT(a.other_shapes,
                testing::ElementsAre(testing::Pair("linestrip of less than two points", 1),
                                     testing::Pair("linestrip of more than two points", 1),
                                     testing::Pair("polygon", 3)));
}

TEST(Labelme, NamesThePhotoWithoutFolders) {
    const Annotations a =
        read("", R"(,"imagePath":"..\\my photos/r.jpg","imageWidth":640,"imageHeight":480)");
    EXPECT_EQ(a.photos[0].name, "r.jpg");
    EXPECT_EQ(a.photos[0].width_px, 640);
    EXPECT_EQ(a.photos[0].height_px, 480);
    EXPECT_EQ(read("", R"(,"imageWidth":null,"imageHeight":null)").photos[0].width_px, 0);
}

TEST(Labelme, SaysWhichShapeIsWrong) {
    const auto expect = [](const std::string& shapes, const std::string& part) {
        expect_error(Fault::bad_input, part, [&] { read(shapes); });
    };
    const std::string good = shape("line", "[[1,2],[3,4]]") + ",";
    expect(good + shape("line", "[[1,2]]"), "a.json: shapes[1]: a line of 1 points");
    expect(good + shape("line", "[[1,2],[3]]"), "shapes[1]: point 2 is not two numbers");
    expect(good + shape("line", "[[1,2],[3,null]]"), "shapes[1]: point 2 is not two numbers");
    expect(good + shape("line", "7"), "shapes[1]: 'points' is no list");
    expect(good + "7", "shapes[1]: is no object");
    expect(R"({"label":1,"shape_type":"line","points":[]})", "'label' is number");
    expect_error(Fault::bad_input, "'imageWidth' is no whole number",
                 [] { read("", R"(,"imageWidth":1.5,"imageHeight":2)"); });
    expect_error(Fault::bad_input, "'imageWidth' is -3",
                 [] { read("", R"(,"imageWidth":-3,"imageHeight":2)"); });
}

} // namespace
} // namespace taihu
