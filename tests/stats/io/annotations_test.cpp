// What all formats of annotations have in common.
#include <cstdlib>
#include <functional>
#include <sys/mman.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/io/measurements.h"
#include "tests/stats/io/annotation_makers.h"

namespace taihu {
namespace {

struct Format {
    std::string name;
    std::function<std::string(const std::vector<Drawn>&)> make;
};

const std::vector<Format>& formats() {
    static const std::vector<Format> kFormats = {
        {"Csv", [](const auto& d) { return csv_text(d); }},
        {"Labelme", [](const auto& d) { return labelme_text(d); }},
        {"Via2Json", [](const auto& d) { return via_json_text(d); }},
        {"Via1Json", [](const auto& d) { return via_json_text(d, ViaRegions::object); }},
        {"ViaProject", via_project_text},
        {"Via2Csv", [](const auto& d) { return via_csv_text(d); }},
        {"Via1Csv", [](const auto& d) { return via_csv_text(d, "#"); }},
        {"ImagejZip", roi_zip_bytes},
        {"ImagejResults", imagej_results_text},
        {"Cvat", cvat_text}};
    return kFormats;
}

/// A file in memory under one path: thousands of them on a disk take too long.
class MemoryFile {
public:
    MemoryFile() : descriptor_(::memfd_create("annotations", MFD_CLOEXEC)) {
        if (descriptor_ < 0)
            std::abort();
    }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile() { ::close(descriptor_); }

    Measurements read(const std::string& bytes, const MeasurementSettings& settings = {}) const {
        EXPECT_EQ(::ftruncate(descriptor_, 0), 0);
        EXPECT_EQ(::pwrite(descriptor_, bytes.data(), bytes.size(), 0),
                  static_cast<ssize_t>(bytes.size()));
        const std::filesystem::path path = "/proc/self/fd/" + name();
        return read_measurements({&path, 1}, settings);
    }
    std::string name() const { return std::to_string(descriptor_); }

private:
    int descriptor_;
};

class Annotation : public testing::TestWithParam<Format> {};

TEST_P(Annotation, HasTheSameSegmentsInEveryFormat) {
    const MemoryFile file;
    MeasurementSettings settings;
    settings.label = "hole";
    settings.scale_bar_m = 0.5;
    std::vector<Drawn> drawn = eight_holes();
    drawn.push_back({10, 440, 110, 440, "scale"}); // 100 px: a pixel is 5 mm
    const Measurements m = file.read(GetParam().make(drawn), settings);
    EXPECT_EQ(m.sample.unit, LengthUnit::metre);
    ASSERT_EQ(m.segments.size(), 8u);
    ASSERT_EQ(m.photos.size(), 1u);
    EXPECT_EQ(m.photos[0].unit_per_px, 0.005);
    EXPECT_EQ(m.photos[0].name, GetParam().name == "ImagejZip" ? file.name() : "rock01.jpg");
    for (std::size_t i = 0; i < 8; ++i) {
        const Segment& s = m.segments[i];
        EXPECT_EQ(s.label, "hole");
        EXPECT_TRUE(s.has_ends);
        EXPECT_EQ(s.x1, drawn[i].x1);
        EXPECT_EQ(s.y1, drawn[i].y1);
        EXPECT_EQ(s.x2, drawn[i].x2);
        EXPECT_EQ(s.y2, drawn[i].y2);
        // ImageJ's table has six decimals here, of a pixel of 5 mm.
        EXPECT_NEAR(s.diameter, 0.005 * std::hypot(s.x2 - s.x1, s.y2 - s.y1), 0.005e-6);
        EXPECT_EQ(m.sample.diameters[i], s.diameter);
    }
    EXPECT_THAT(m.warnings, testing::IsEmpty());
}

TEST_P(Annotation, IsRefusedOrSoundWhenCutShort) {
    const MemoryFile file;
    const std::string bytes = GetParam().make(eight_holes());
    EXPECT_EQ(file.read(bytes).segments.size(), 8u);
    std::size_t n_refused = 0;
    for (std::size_t n = 0; n < bytes.size(); ++n) {
        try {
            const Measurements m = file.read(bytes.substr(0, n));
            EXPECT_NO_THROW(check_sample(m.sample));
            EXPECT_EQ(m.segments.size(), 8u);
        } catch (const Error& e) {
            EXPECT_NE(e.fault(), Fault::io) << e.what();
            ++n_refused;
        }
    }
    EXPECT_GT(n_refused, bytes.size() * 9 / 10); // the last row of a table may lose some digits
}

TEST_P(Annotation, IsRefusedOrSoundWhenBytesChange) {
    const MemoryFile file;
    const std::string bytes = GetParam().make(eight_holes());
    const Rng rng{.seed = 7, .stream = 0};
    for (std::uint64_t i = 0; i < 3000; ++i) {
        std::string changed = bytes;
        const auto at =
            static_cast<std::size_t>(rng.uniform(i, 0) * static_cast<double>(bytes.size()));
        changed[at] = static_cast<char>(static_cast<int>(rng.uniform(i, 1) * 256));
        try {
            const Measurements m = file.read(changed);
            EXPECT_NO_THROW(check_sample(m.sample));
            for (const Segment& s : m.segments) {
                EXPECT_TRUE(s.diameter > 0 && std::isfinite(s.diameter));
                EXPECT_LT(s.photo, m.photos.size());
            }
        } catch (const Error& e) {
            EXPECT_EQ(std::string_view(e.what()).find('\n'), std::string_view::npos) << e.what();
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Formats, Annotation, testing::ValuesIn(formats()),
                         [](const auto& p) { return p.param.name; });

} // namespace
} // namespace taihu
