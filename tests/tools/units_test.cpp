#include "tools/units.h"

#include "tests/support/errors.h"

namespace taihu {
namespace {

TEST(Units, LengthsTakeTheUnitsPeopleType) {
    const Measure of{0.01, 2};
    EXPECT_DOUBLE_EQ(length_m("--x", "0.5", of), 0.5);
    EXPECT_DOUBLE_EQ(length_m("--x", "0.5m", of), 0.5);
    EXPECT_DOUBLE_EQ(length_m("--x", "12mm", of), 0.012);
    EXPECT_DOUBLE_EQ(length_m("--x", "3cm", of), 0.03);
    EXPECT_DOUBLE_EQ(length_m("--x", "2e3um", of), 0.002);
    EXPECT_DOUBLE_EQ(length_m("--x", "2vox", of), 0.02);
    EXPECT_DOUBLE_EQ(length_m("--x", "25%", of), 0.5);
}

TEST(Units, EverythingElseIsRefusedByName) {
    for (const char* bad : {"", "m", "-1m", "0", "1 m", "1,5m", "2km", "1e999", "nan"})
        expect_error(Fault::bad_argument, "--x: '", [&] { length_m("--x", bad); });
    for (const char* bad : {"1e308", "1e-30", "1e-320", "2e6m", "1e-4um", "1e308vox", "1e-30%"})
        expect_error(Fault::bad_argument, "is out of range; give 1e-9", [&] {
            length_m("--x", bad, {1, 1});
        });
    expect_error(Fault::bad_argument, "is out of range", [] { angle_deg("--tilt", "1e308"); });
    expect_error(Fault::bad_argument, "in voxels has nothing", [] { length_m("--x", "2vox"); });
    expect_error(Fault::bad_argument, "in percent has nothing", [] { length_m("--x", "2%"); });
}

TEST(Units, SizesAreOneLengthOrThree) {
    EXPECT_EQ(parse_size("--size", "1m"), (Vec3{1, 1, 1}));
    EXPECT_EQ(parse_size("--size", "1,50cm,2"), (Vec3{1, 0.5, 2}));
    for (const char* bad : {"1,2", "1,2,3,4", "1,,2", ","})
        expect_error(Fault::bad_argument, "--size", [&] { parse_size("--size", bad); });
}

TEST(Units, AnglesAreInDegrees) {
    EXPECT_DOUBLE_EQ(angle_deg("--tilt", "25deg"), 25);
    EXPECT_DOUBLE_EQ(angle_deg("--tilt", "-2.5"), -2.5);
    for (const char* bad : {"", "deg", "1rad", "1 deg", "nan"})
        expect_error(Fault::bad_argument, "--tilt: '", [&] { angle_deg("--tilt", bad); });
}

TEST(Units, MemoryTakesDecimalUnits) {
    EXPECT_EQ(memory_bytes("--memory", "4GB"), 4e9);
    EXPECT_EQ(memory_bytes("--memory", "0.5MB"), 5e5);
    EXPECT_EQ(memory_bytes("--memory", "1000"), 1000);
    for (const char* text : {"", "GB", "4G", "-1GB", "0"})
        expect_error(Fault::bad_argument, "write 4GB", [&] { memory_bytes("--memory", text); });
}

} // namespace
} // namespace taihu
