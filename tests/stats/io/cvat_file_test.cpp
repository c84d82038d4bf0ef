#include "stats/io/cvat_file_detail.h"

#include "tests/support/errors.h"

namespace taihu {
namespace {

Annotations read(const std::string& images) {
    return read_cvat("<annotations>\n" + images + "</annotations>", "c.xml");
}

TEST(Cvat, TakesPolylinesOfTwoPointsAndCountsTheRest) {
    const Annotations a = read(R"(<image name="d/a.jpg" width="20" height="10">
      <polyline points=" 1.5,2 ; 3,4" label="hole"><attribute name="n">1</attribute></polyline>
      <polyline label="hole" points="1,2;3,4;5,6"/><box label="b"/><box/><tag label="t"/></image>
      <image name="b.jpg"/><track/>)");
    ASSERT_EQ(a.marks.size(), 1u);
    EXPECT_EQ(a.marks[0].x1, 1.5);
    EXPECT_EQ(a.marks[0].label, "hole");
    ASSERT_EQ(a.photos.size(), 2u);
    EXPECT_EQ(a.photos[0].name, "d/a.jpg");
    EXPECT_EQ(a.photos[0].width_px, 20);
    EXPECT_EQ(a.photos[1].height_px, 0);
    EXPECT_THAT(a.other_shapes,
                testing::ElementsAre(testing::Pair("box", 2),
                                     testing::Pair("polyline of more than two points", 1),
                                     testing::Pair("track of a video", 1)));
}

TEST(Cvat, DoesNotReadEntities) {
    const Annotations a = read_cvat("<!DOCTYPE a [<!ENTITY e SYSTEM \"file:///etc/passwd\">]>"
                                    "<annotations><image name=\"&e;.jpg\"/></annotations>",
                                    "c.xml");
    EXPECT_EQ(a.photos[0].name, "&e;.jpg");
}

TEST(Cvat, SaysWhatIsWrong) {
    const auto expect = [](const std::string& images, const std::string& part) {
        expect_error(Fault::bad_input, part, [&] { read(images); });
    };
    const std::string open = R"(<image name="a">)", close = "</image>";
    expect("<image/>", "c.xml: image 1: has no name");
    expect(R"(<image name="a" width="0" height="1"/>)", "width is '0'");
    expect(R"(<image name="a" width="9"/>)", "only one of width and height");
    expect(open + R"(<polyline label="h"/>)" + close, "shape 1 of 'a': has no label or no points");
    expect(open + R"(<polyline label="h" points="1,2;3"/>)" + close, "point '3' is not x,y");
    expect(open + R"(<polyline label="h" points="1,nan;3,4"/>)" + close, "point '1,nan'");
    expect("<image", "c.xml:2: not XML");
    expect_error(Fault::bad_input, "root 'html'", [] { read_cvat("<html/>", "c.xml"); });
    expect_error(Fault::bad_input, "67108865 bytes of XML, at most 67108864 are read",
                 [] { read_cvat(std::string((std::size_t{64} << 20) + 1, ' '), "c.xml"); });
    expect_error(Fault::bad_input, "not UTF-8", [] { read_cvat("<a\xff/>", "c.xml"); });
}

} // namespace
} // namespace taihu
