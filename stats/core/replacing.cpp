#include "stats/core/replacing.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <mutex>
#include <set>
#include <sys/stat.h>
#include <utility>
#include <vector>

#include "stats/core/error.h"
#include "stats/core/replacing_detail.h"
#include "stats/core/temporary_detail.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

struct Rules {
    bool keep_existing = false;
    std::set<std::pair<dev_t, ino_t>> taken = {}; ///< read or published
};
/// Those that live.
struct AllRules {
    std::mutex guard;
    std::vector<Rules> stack;
};
AllRules& all() {
    static AllRules one;
    return one;
}
std::atomic<bool> g_published{false};

void note(const struct stat& info) {
    const std::lock_guard lock(all().guard);
    if (!all().stack.empty())
        all().stack.back().taken.emplace(info.st_dev, info.st_ino);
}

bool keeps_existing() {
    const std::lock_guard lock(all().guard);
    return !all().stack.empty() && all().stack.back().keep_existing;
}

[[noreturn]] void fail_exists(const fs::path& path) {
    throw Error(Fault::io, path.string() + ": exists; choose another name, or drop --no-clobber");
}

} // namespace

OutputRules::OutputRules(bool keep_existing) {
    const std::lock_guard lock(all().guard);
    all().stack.push_back({keep_existing});
}

OutputRules::~OutputRules() {
    const std::lock_guard lock(all().guard);
    all().stack.pop_back();
}

void require_replaceable(const fs::path& path) {
    struct stat info {};
    if (::lstat(path.c_str(), &info) != 0)
        return;
    {
        const std::lock_guard lock(all().guard);
        if (!all().stack.empty() && all().stack.back().taken.count({info.st_dev, info.st_ino}) != 0)
            throw Error(Fault::bad_argument,
                        path.string() +
                            ": is also read or written by this command; choose another name");
    }
    if (keeps_existing())
        fail_exists(path);
}

bool any_published() noexcept {
    return g_published;
}

void note_read(int descriptor) {
    struct stat info {};
    if (::fstat(descriptor, &info) == 0)
        note(info);
}

void note_published(const fs::path& path) {
    std::error_code ignored;
    const fs::path whole = fs::absolute(path, ignored);
    // What a temporary folder holds comes into view later, or goes, and its number may come back.
    if (std::any_of(whole.begin(), whole.end(),
                    [](const fs::path& part) { return is_temporary(part.string()); }))
        return;
    struct stat info {};
    if (::lstat(path.c_str(), &info) == 0)
        note(info);
    g_published = true;
}

void copy_rights(const fs::path& to, const fs::path& from) {
    struct stat info {};
    if (::lstat(to.c_str(), &info) == 0 && S_ISREG(info.st_mode))
        ::chmod(from.c_str(), info.st_mode & 0777);
}

void take_place(const fs::path& from, const fs::path& to) {
    require_replaceable(to);
    copy_rights(to, from);
    const bool keep = keeps_existing();
    // Somebody may have made one meanwhile. Not every file system can refuse in the same step.
    if (!keep || ::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) != 0) {
        if (keep && errno == EEXIST)
            fail_exists(to);
        if (::rename(from.c_str(), to.c_str()) != 0)
            fail_io(to, "cannot replace", errno);
    }
    note_published(to);
}

} // namespace taihu
