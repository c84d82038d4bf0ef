#include "tests/fuzz/formats.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"
#include "tests/support/scratch.h"

namespace taihu {

void PrintTo(const FuzzFormat& format, std::ostream* out) {
    *out << format.name; // or its bytes would be part of the test's name
}

namespace {

namespace fs = std::filesystem;

class FormatsOf : public testing::TestWithParam<FuzzFormat> {};

TEST_P(FormatsOf, ReadTheFilesThatDamageBeginsWith) {
    const Scratch scratch;
    const auto bases = GetParam().bases();
    ASSERT_FALSE(bases.empty());
    for (const std::string& base : bases) {
        EXPECT_LT(base.size(), 100'000u); // most of a .vdb are tables of its nodes
        EXPECT_NO_THROW(GetParam().read(base, scratch.path())) << base.substr(0, 200);
    }
    EXPECT_EQ(bases, GetParam().bases());
}

/// Every file that was once accepted wrongly, or worse, is refused by an error of ours.
TEST_P(FormatsOf, RefuseTheRegressionCorpus) {
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

/// The key that a path ends in, as `/a/of/0/size_m/1` in size_m.
std::string key_of(std::string path) {
    while (path.find_last_not_of("0123456789") == path.rfind('/'))
        path.resize(path.rfind('/'));
    return path.substr(path.rfind('/') + 1);
}

TEST(Formats, EveryNumberInJsonIsReadOrRefusedByItsKey) {
    using nlohmann::json;
    const json others[] = {nullptr, true, "1", json::array(), json::object()};
    const json numbers[] = {-1, -0.0, 0, 0.5, 1e-320, 1e-30, 1e30, 1e308, INT64_MAX, UINT64_MAX};
    const Scratch scratch;
    std::size_t n_refused = 0;
    const auto read = [&](const FuzzFormat& format, const json& file, const std::string& key) {
        try {
            format.read(file.dump(), scratch.path());
        } catch (const Error& e) {
            ++n_refused;
            EXPECT_NE(e.fault(), Fault::bad_argument) << e.what(); // that is the command's
            EXPECT_THAT(e.what(), testing::HasSubstr(key)) << file.dump();
        }
    };
    for (const FuzzFormat& format : fuzz_formats()) {
        if (format.name != "law" && format.name != "recipe" && format.name != "relief" &&
            format.name != "tiles")
            continue;
        for (const std::string& base : format.bases()) {
            const json flat = json::parse(base).flatten();
            for (const auto& [path, value] : flat.items()) {
                if (!value.is_number())
                    continue;
                for (const json& other : others) {
                    json file = json::parse(base);
                    file[json::json_pointer(path)] = other;
                    read(format, file, key_of(path));
                }
                for (const json& number : numbers) { // some are refused for what they mean together
                    json file = json::parse(base);
                    file[json::json_pointer(path)] = number;
                    read(format, file, "mutant.json: ");
                }
            }
        }
    }
    EXPECT_GT(n_refused, 1000u);
}

INSTANTIATE_TEST_SUITE_P(All, FormatsOf,
                         testing::ValuesIn(fuzz_formats().begin(), fuzz_formats().end()),
                         [](const auto& about) { return std::string(about.param.name); });

} // namespace
} // namespace taihu
