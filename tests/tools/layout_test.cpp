// The house keeps its order: includes go one way, and nothing new stands at the top.
#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include <gtest/gtest.h>

#include "stats/core/file.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

TEST(Layout, IncludesNeverGoUpwards) {
    const std::map<std::string, int> rank = {{"stats/core", 0}, {"stats", 1}, {"vdb_ops", 2},
                                             {"mesh_out", 3},   {"tools", 4}, {"tests", 5}};
    const auto module_of = [](const std::string& path) {
        if (path.starts_with("stats/core/"))
            return std::string("stats/core");
        return path.substr(0, path.find('/'));
    };
    const std::regex include("#include \"([a-z_]+/[^\"]+)\"");
    int n = 0;
    for (const char* top : {"stats", "vdb_ops", "mesh_out", "tools"})
        for (const auto& entry : fs::recursive_directory_iterator(fs::path(TAIHU_SOURCE) / top)) {
            const auto extension = entry.path().extension();
            if (extension != ".h" && extension != ".cpp")
                continue;
            const std::string path = fs::relative(entry.path(), TAIHU_SOURCE).string();
            const std::string text = read_file(entry.path());
            for (std::sregex_iterator it(text.begin(), text.end(), include), end; it != end; ++it) {
                const std::string target = (*it)[1];
                ASSERT_TRUE(rank.count(module_of(target))) << path << " includes " << target;
                EXPECT_LE(rank.at(module_of(target)), rank.at(module_of(path)))
                    << path << " includes " << target;
                ++n;
            }
        }
    EXPECT_GT(n, 100);
}

TEST(Layout, TheTopLevelIsFixed) {
    const std::set<std::string> known = {
        "CMakeLists.txt", "CMakePresets.json", "vdb_ops", "stats", "mesh_out", "tools", "tests",
        "data",           "README.md"};
    const std::set<std::string> ignored = {"build", "out"}; // git does not see them
    for (const auto& entry : fs::directory_iterator(TAIHU_SOURCE)) {
        const std::string name = entry.path().filename();
        EXPECT_TRUE(name.starts_with('.') || known.count(name) || ignored.count(name)) << name;
    }
}

TEST(Layout, HeadersSayNothingOfTheLibrariesBehindThem) {
    // Draco, glTF, OpenEXR, JSON and CLI11 types stay in sources and internal headers.
    const std::regex foreign(
        "#include <(draco|nlohmann|OpenEXR|Imf|CLI|OpenMesh|embree3|boost|png)");
    for (const char* top : {"stats", "vdb_ops", "mesh_out"})
        for (const auto& entry : fs::recursive_directory_iterator(fs::path(TAIHU_SOURCE) / top)) {
            const std::string name = entry.path().filename();
            if (entry.path().extension() != ".h" || name.ends_with("_detail.h"))
                continue;
            EXPECT_FALSE(std::regex_search(read_file(entry.path()), foreign)) << entry.path();
        }
}

} // namespace
} // namespace taihu
