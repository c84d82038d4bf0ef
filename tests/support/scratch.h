#pragma once
#include <cstdlib>
#include <filesystem>
#include <string>

namespace taihu {

/// A new empty folder for one test, removed with everything in it at the end of the scope.
class Scratch {
public:
    Scratch() {
        std::string name = (std::filesystem::temp_directory_path() / "taihu-test-XXXXXX").string();
        if (!::mkdtemp(name.data()))
            std::abort();
        path_ = name;
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    ~Scratch() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

private:
    std::filesystem::path path_;
};

} // namespace taihu
