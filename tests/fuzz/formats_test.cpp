#include "tests/fuzz/formats.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

class Formats : public testing::TestWithParam<FuzzFormat> {};

TEST_P(Formats, ReadTheFilesThatDamageBeginsWith) {
    const Scratch scratch;
    const auto bases = GetParam().bases();
    ASSERT_FALSE(bases.empty());
    for (const std::string& base : bases) {
        EXPECT_LT(base.size(), 16384u); // so that damage meets what matters
        EXPECT_NO_THROW(GetParam().read(base, scratch.path())) << base.substr(0, 200);
    }
    EXPECT_EQ(bases, GetParam().bases());
}

/// Every file that was once accepted wrongly, or worse, is refused by an error of ours.
TEST_P(Formats, RefuseTheRegressionCorpus) {
    const Scratch scratch;
    const fs::path folder = fs::path(TAIHU_CORPUS) / std::string(GetParam().name);
    if (!fs::is_directory(folder))
        GTEST_SKIP() << "nothing was found in this format so far";
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder))
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files)
        try {
            GetParam().read(read_file(file), scratch.path());
            ADD_FAILURE() << file << " was accepted";
        } catch (const Error& e) {
            EXPECT_LE(error_line(e.what()).size(), kMostErrorBytes) << file;
        }
}

INSTANTIATE_TEST_SUITE_P(All, Formats,
                         testing::ValuesIn(fuzz_formats().begin(), fuzz_formats().end()),
                         [](const auto& about) { return std::string(about.param.name); });

} // namespace
} // namespace taihu
