#include "stats/io/holes_file.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/sampler.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

using testing::HasSubstr;

std::vector<Sphere> read_text(const std::string& text) {
    const Scratch scratch;
    write_file(scratch / "holes.csv", text);
    return read_holes(scratch / "holes.csv");
}

TEST(HolesFile, ReadsBackTheSameBits) {
    const HoleStream stream(Law::exponential(3), {{-1, -1, -1}, {1, 1, 1}}, 0.7, 5);
    std::vector<Sphere> holes = {{{0, -0.0, 1e-300}, 5e-324}, {{1e9, 1.0 / 3, -1e-5}, 0.1}};
    for (std::uint64_t i = 0; i < 100; ++i)
        holes.push_back(stream.hole(i));
    EXPECT_EQ(read_text(format_holes(holes)), holes);
}

TEST(HolesFile, HasTheDocumentedForm) {
    const std::vector<Sphere> holes = {{{0.5, -2, 1e-7}, 0.1}};
    const std::vector<std::string> comments = {"seed=7", "two\nlines"};
    EXPECT_EQ(format_holes(holes, comments),
              "# seed=7\n# two\n# lines\nx_m,y_m,z_m,radius_m\n0.5,-2,1e-07,0.1\n");
    EXPECT_EQ(read_text(format_holes(holes, comments)), holes);
    EXPECT_TRUE(read_text(format_holes({})).empty());
}

TEST(HolesFile, TakesDiametersAndAnyOrderOfColumns) {
    const auto holes = read_text("diameter_m,z_m,y_m,x_m\n4,3,2,1\n");
    ASSERT_EQ(holes.size(), 1u);
    EXPECT_EQ(holes[0], (Sphere{{1, 2, 3}, 2}));
}

std::string refusal(const std::string& text) {
    try {
        read_text(text);
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        return e.what();
    }
    return "accepted";
}

TEST(HolesFile, NamesTheRowThatIsWrong) {
    EXPECT_THAT(refusal("x_m,y_m,z_m,radius_m\n1,2,3,1e308\n"),
                HasSubstr("holes.csv:2: column 4 'radius_m' is '1e308'; must be at most 1e9 m"));
    EXPECT_THAT(refusal("x_m,y_m,z_m,radius_m\n1,-1e308,3,1\n"),
                HasSubstr("holes.csv:2: column 2 'y_m' is '-1e308'; must be within 1e9 m"));
    EXPECT_THAT(refusal("x_m,y_m,z_m,radius_m\n1,2,3,4\n1,2,3,-0.02\n"),
                HasSubstr("holes.csv:3: column 4 'radius_m' is '-0.02'; must be > 0"));
    EXPECT_THAT(refusal("x_m,y_m,z_m,diameter_m\n1,2,3,0\n"), HasSubstr("'diameter_m' is '0'"));
    EXPECT_THAT(refusal("x_m,y_m,z_m,radius_m\n1,inf,3,1\n"), HasSubstr("'y_m' is 'inf'"));
    EXPECT_THAT(refusal("x_m,y_m,z_m,radius\n"), HasSubstr("did you mean 'radius_m'?"));
    EXPECT_THAT(refusal("x_m,y_m,z_m\n"), HasSubstr("column 'radius_m' is missing"));
    EXPECT_THAT(refusal("x_m,y_m,z_m,radius_m,diameter_m\n"), HasSubstr("keep one of them"));
    EXPECT_THAT(refusal(std::string(1000, '\0')), HasSubstr("holds zero bytes"));
}

TEST(HolesFile, WritesNoHoleThatItWouldRefuse) {
    const std::vector<Sphere> bad = {{{0, 0, 0}, 1}, {{0, 0, 0}, 0}};
    try {
        format_holes(bad);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_argument);
        EXPECT_THAT(e.what(), HasSubstr("holes[1]: radius_m is 0"));
    }
    const std::vector<Sphere> nan = {{{0, std::numeric_limits<double>::quiet_NaN(), 0}, 1}};
    EXPECT_THROW(format_holes(nan), Error);
}

} // namespace
} // namespace taihu
