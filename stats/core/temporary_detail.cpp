#include "stats/core/temporary_detail.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <mutex>
#include <set>
#include <string_view>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <system_error>
#include <tuple>
#include <unistd.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/file_set.h"
#include "stats/core/replacing_detail.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = ".taihu-tmp-";
constexpr std::size_t kNLetters = 6;

/// Those of this process that there are.
struct Live {
    std::recursive_timed_mutex guard;
    std::set<const Temporary*> temporaries;
};
Live& live() {
    static Live all;
    return all;
}

/// A name that was free a moment ago. It is in no output, so it need not be the same again.
std::string new_name() {
    std::array<unsigned char, kNLetters> random{};
    if (::getrandom(random.data(), random.size(), 0) < 0)
        random.fill(static_cast<unsigned char>(::getpid()));
    std::string name(kPrefix);
    for (const unsigned char r : random)
        name += static_cast<char>('a' + r % 26);
    return name;
}

/// Whether the name still means what was opened.
bool is_at(int descriptor, const fs::path& path) {
    struct stat open {};
    struct stat named {};
    return ::fstat(descriptor, &open) == 0 && ::lstat(path.c_str(), &named) == 0 &&
           open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

/// Locks it. False: a sweep was faster, and has removed it or is about to. Where the file system
/// knows no locks nothing is swept either.
bool hold(int descriptor, const fs::path& path) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        return false;
    return is_at(descriptor, path);
}

void remove_if_left(const fs::path& path) {
    const Descriptor left(
        ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC)); // no pipe's writer
    std::error_code ignored;
    if (left.value() >= 0 && ::flock(left.value(), LOCK_EX | LOCK_NB) == 0 &&
        is_at(left.value(), path))
        fs::remove_all(path, ignored);
}

} // namespace

void fail_io(const fs::path& path, const char* what, int code) {
    throw Error(Fault::io, path.string() + ": " + what + ": " + std::strerror(code) +
                               "; check the path, its rights and the space left");
}

void Descriptor::reset(int value) {
    if (value_ >= 0)
        ::close(value_);
    value_ = value;
}

/// False: the name is taken, or a sweep was faster.
bool Temporary::make(Kind kind, const fs::path& goal) {
    int opened = -1;
    if (kind == Kind::file) {
        opened = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } else if (::mkdir(path_.c_str(), 0777) == 0) {
        opened = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        const int code = errno;
        if (opened < 0)
            ::rmdir(path_.c_str());
        errno = code == ENOENT ? EEXIST : code;
    }
    if (opened < 0 && errno != EEXIST)
        fail_io(goal, "cannot write", errno);
    descriptor_.reset(opened);
    return opened >= 0 && hold(opened, path_);
}

Temporary::Temporary(Kind kind, const fs::path& folder, const fs::path& goal) {
    sweep(folder);
    constexpr int kTries = 100;
    for (int i = 0; i < kTries; ++i) {
        path_ = folder / new_name();
        if (!make(kind, goal))
            continue;
        const std::lock_guard lock(live().guard);
        live().temporaries.insert(this);
        return;
    }
    fail_io(goal, "cannot write", EEXIST);
}

Temporary::~Temporary() {
    {
        const std::lock_guard lock(live().guard);
        live().temporaries.erase(this);
    }
    descriptor_.reset(-1); // removing a folder takes one, and there may be no other
    discard();
}

void Temporary::discard() const {
    std::error_code ignored;
    if (!path_.empty())
        fs::remove_all(path_, ignored);
}

void Temporary::rename(const fs::path& to) {
    const std::lock_guard lock(live().guard);
    take_place(path_, to);
    path_.clear();
}

void discard_temporaries() noexcept {
    // What is being published takes its place first. Not for ever: whoever does it may be stuck.
    if (live().guard.try_lock_for(std::chrono::milliseconds(700)))
        for (const Temporary* t : live().temporaries)
            t->discard(); // the lock stays: nothing more is published
}

Publishing::Publishing() {
    live().guard.lock();
}

Publishing::~Publishing() {
    live().guard.unlock();
}

bool is_temporary(const std::string& name) {
    return name.starts_with(kPrefix) && name.size() == kPrefix.size() + kNLetters &&
           std::all_of(name.begin() + kPrefix.size(), name.end(),
                       [](char c) { return c >= 'a' && c <= 'z'; });
}

fs::path folder_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

void sweep(const fs::path& folder) {
    static std::mutex guard; // of what one process has seen to: once is enough
    static std::set<std::tuple<fs::path, dev_t, ino_t>> swept; // a number may come back
    struct stat info {};
    if (::stat(folder.c_str(), &info) != 0)
        return;
    {
        const std::lock_guard lock(guard);
        if (!swept.emplace(folder, info.st_dev, info.st_ino).second)
            return;
    }
    std::error_code failed;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed))
        if (is_temporary(entry->path().filename().string()))
            remove_if_left(entry->path());
}

void sync_folder(const fs::path& folder) {
    const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    // One that may be written but not read cannot be synced, and some file systems know no such.
    if (opened.value() >= 0 && ::fsync(opened.value()) != 0 && errno != EINVAL && errno != ENOTSUP)
        fail_io(folder, "cannot write", errno);
}

} // namespace taihu
