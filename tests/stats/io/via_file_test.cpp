#include "stats/io/via_file_detail.h"

#include "stats/io/json_detail.h"
#include "tests/stats/io/annotation_makers.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

Annotations read(const std::string& regions) {
    return read_via(parse_json(R"({"a1":{"filename":"a.jpg","regions":)" + regions + "}}", "v"),
                    "v");
}

std::string region(const std::string& attributes, const std::string& shape = "") {
    return R"({"shape_attributes":)" + (shape.empty() ? via_shape({1, 2, 3, 4}) : shape) +
           R"(,"region_attributes":)" + attributes + "}";
}

TEST(Via, FindsTheLabelAmongTheAttributes) {
    const auto label = [](const std::string& attributes) {
        return read("[" + region(attributes) + "]").marks.at(0).label;
    };
    EXPECT_EQ(label(R"({"type":"hole"})"), "hole");
    EXPECT_EQ(label(R"({"sort":"hole"})"), "hole");
    EXPECT_EQ(label(R"({"kind":"x","label":"hole"})"), "hole");
    EXPECT_EQ(label(R"({"kind":"x","sort":"y"})"), "");
    EXPECT_EQ(label(R"({"type":{"hole":true,"crack":false}})"), "hole");
    EXPECT_EQ(label("{}"), "");
}

TEST(Via, CountsOtherShapesAndKeepsEmptyPhotos) {
    const Annotations a = read("[" + region("{}", R"({"name":"rect","x":1})") + "]");
    EXPECT_THAT(a.other_shapes, testing::ElementsAre(testing::Pair("rect", 1)));
    EXPECT_EQ(read("[]").photos.size(), 1u);
    const std::string csv = "filename,region_shape_attributes,region_attributes\n"
                            "a.jpg,\"{}\",\"{}\"\n";
    const Annotations table = read_via_table(Table(csv, "v"), "v");
    EXPECT_EQ(table.photos.size(), 1u);
    EXPECT_TRUE(table.marks.empty());
}

TEST(Via, SaysWhichRegionIsWrong) {
    const auto expect = [](const std::string& regions, const std::string& part) {
        expect_error(Fault::bad_input, part, [&] { read(regions); });
    };
    expect("7", "image 'a1': has no regions");
    expect("[7]", "regions[0] of 'a.jpg': has no attributes");
    expect("[" + region("{}") + "," + region("7") + "]", "regions[1] of 'a.jpg': its attributes");
    expect("[" + region("{}", R"({"name":"polyline","all_points_x":[1],"all_points_y":[]})") + "]",
           "1 x and 0 y coordinates");
    expect("[" + region("{}", R"({"name":"polyline","all_points_x":[null]})") + "]",
           "'all_points_x' holds null");
    expect("[" + region("{}", R"({"name":"polyline"})") + "]", "'all_points_x' is no list");
    const std::string csv = "filename,region_shape_attributes,region_attributes\n"
                            "a.jpg,\"{\",\"{}\"\n";
    expect_error(Fault::bad_input, "v:2: column 2:1:2: not JSON",
                 [&] { read_via_table(Table(csv, "v"), "v"); });
}

} // namespace
} // namespace taihu
