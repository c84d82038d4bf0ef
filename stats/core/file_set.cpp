#include "stats/core/file_set.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <fcntl.h>
#include <optional>
#include <sys/file.h>
#include <system_error>
#include <thread>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/replacing_detail.h"
#include "stats/core/sha256.h"
#include "stats/core/temporary_detail.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOld = ".old"; ///< in the staging folder: what was there before

bool is_folder(const fs::path& path) {
    std::error_code ignored;
    return fs::is_directory(path, ignored);
}

/// The nearest folder above that there is. \throws Error io: what is there is none.
fs::path folder_above(const fs::path& path) {
    std::error_code ignored;
    fs::path above = folder_of(path);
    while (!fs::exists(above, ignored) && above != folder_of(above))
        above = folder_of(above);
    if (!is_folder(above))
        throw Error(Fault::io,
                    path.string() + ": " + above.string() + " is no folder; choose another name");
    return above;
}

/// Names of the files in a folder, sorted.
std::vector<std::string> files_in(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder))
        names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

/// A folder takes a name that no other has; those that it is in are made, too, or go again.
void place_new(Temporary& folder, const fs::path& goal) {
    std::vector<fs::path> missing;
    for (fs::path above = folder_of(goal); !is_folder(above) && above != folder_of(above);
         above = folder_of(above))
        missing.push_back(above);
    std::error_code failed; // the rename will say so
    fs::create_directories(folder_of(goal), failed);
    try {
        folder.rename(goal);
    } catch (const Error&) {
        for (const fs::path& above : missing)
            fs::remove(above, failed); // where it is empty
        throw;
    }
    sync_folder(folder_of(goal));
}

/// \throws Error also io: there is such a name, and it is no file.
void require_replaceable_file(const fs::path& path) {
    require_replaceable(path);
    std::error_code ignored;
    if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored))
        throw Error(Fault::io, path.string() + ": is no regular file, and would be replaced; "
                                               "choose another folder");
}

/// While it lives, other programs that publish into this folder wait, so that their sets do not
/// mix: some seconds, as somebody else may hold the lock for a reason of his own.
class FolderLock {
public:
    explicit FolderLock(const fs::path& folder)
        : opened_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
        std::error_code failed; // a temporary one is locked by its owner, which is this program
        const fs::path whole = fs::canonical(folder, failed);
        if (opened_.value() < 0 || failed || is_temporary(whole.filename().string()))
            return;
        constexpr int kTries = 60;
        for (int i = 0; i < kTries && ::flock(opened_.value(), LOCK_EX | LOCK_NB) != 0; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }

private:
    Descriptor opened_;
};

/// Renames in one step each, and undone unless they are kept.
class Renames {
public:
    Renames() = default;
    Renames(const Renames&) = delete;
    Renames& operator=(const Renames&) = delete;
    ~Renames() {
        for (auto step = done_.rbegin(); step != done_.rend(); ++step)
            ::renameat2(AT_FDCWD, step->to.c_str(), AT_FDCWD, step->from.c_str(), step->flags);
    }
    void keep() { done_.clear(); }
    /// Nothing happens when there is no such file.
    void move(const fs::path& from, const fs::path& to) {
        if (::rename(from.c_str(), to.c_str()) == 0)
            done_.push_back({from, to, 0});
        else if (errno != ENOENT)
            fail_io(from, "cannot replace", errno);
    }
    /// `from` takes the place of `to`, which takes that of `from`.
    void swap(const fs::path& from, const fs::path& to) {
        if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) == 0)
            return done_.push_back({from, to, RENAME_EXCHANGE});
        // There is nothing to swap, or the file system cannot: then there is no way back.
        const bool is_first = errno == ENOENT;
        take_place(from, to);
        if (is_first)
            done_.push_back({from, to, 0});
    }

private:
    struct Step {
        fs::path from, to;
        unsigned flags;
    };
    std::vector<Step> done_;
};

} // namespace

FileSet::FileSet(fs::path folder)
    : folder_(folder.empty() ? fs::path(".") : std::move(folder)), is_new_(!is_folder(folder_)) {
    std::error_code ignored;
    if (folder_.has_relative_path() && !folder_.has_filename())
        folder_ = folder_.parent_path(); // without the slash at its end
    if (is_new_ && fs::exists(folder_, ignored))
        throw Error(Fault::io, folder_.string() + ": is no folder; choose another name");
    temporary_ = std::make_unique<Temporary>(Temporary::Kind::folder,
                                             is_new_ ? folder_above(folder_) : folder_, folder_);
}

FileSet::~FileSet() = default;

void FileSet::add_by(const std::function<void(const fs::path&)>& write) {
    const std::string staging = temporary_->path().string();
    try {
        write(temporary_->path());
    } catch (const Error& e) {
        std::string message = e.what();
        for (std::size_t at; (at = message.find(staging)) != std::string::npos;)
            message.replace(at, staging.size(), folder_.string());
        throw Error(e.fault(), message);
    }
}

void FileSet::add(const std::string& name, std::string_view bytes) {
    add_by([&](const fs::path& folder) { write_file(folder / name, bytes); });
}

void FileSet::list() {
    std::string text = "{\n  \"taihu_files\": 1,\n  \"files\": [";
    const char* separator = "\n";
    for (const std::string& name : files_in(temporary_->path())) {
        const std::string bytes = read_file(temporary_->path() / name);
        text += separator + ("    {\"file\": \"" + name) +
                "\", \"bytes\": " + std::to_string(bytes.size()) + ", \"sha256\": \"" +
                sha256_hex(bytes) + "\"}";
        separator = ",\n";
    }
    add(kFileListName, text + "\n  ]\n}\n");
}

void FileSet::publish(const std::string& last, std::span<const std::string> gone) {
    std::optional<FolderLock> alone;
    if (!is_new_)
        alone.emplace(folder_);
    const Publishing together;
    if (is_new_)
        return place_new(*temporary_, folder_);
    std::vector<std::string> names = files_in(temporary_->path());
    for (const std::string& name : names) {
        require_replaceable_file(folder_ / name);
        copy_rights(folder_ / name, temporary_->path() / name);
    }
    for (const std::string& name : gone)
        require_replaceable(folder_ / name);
    std::erase(names, last);
    std::error_code ignored; // the renames will say so
    const fs::path old = temporary_->path() / kOld;
    fs::create_directory(old, ignored);
    Renames renames;
    renames.move(folder_ / last, old / last);
    for (const std::string& name : gone)
        renames.move(folder_ / name, old / name);
    for (const std::string& name : names)
        renames.swap(temporary_->path() / name, folder_ / name);
    sync_folder(folder_);
    renames.swap(temporary_->path() / last, folder_ / last);
    sync_folder(folder_);
    renames.keep();
    names.push_back(last);
    for (const std::string& name : names)
        note_published(folder_ / name);
}

void OutputFiles::add(const fs::path& path, std::string_view bytes) {
    if (path.empty())
        return;
    OutputFile& file = files_.emplace_back(path);
    file.write(bytes);
    file.finish();
}

void OutputFiles::publish() {
    const Publishing together;
    for (const OutputFile& file : files_)
        require_replaceable(file.path()); // all or none
    for (OutputFile& file : files_)
        file.publish();
    files_.clear();
}

WorkFolder::WorkFolder(fs::path goal)
    : goal_(fs::absolute(goal)), // commands may be run in it
      temporary_(std::make_unique<Temporary>(Temporary::Kind::folder, folder_above(goal_), goal)) {}

WorkFolder::~WorkFolder() = default;

const fs::path& WorkFolder::path() const {
    return temporary_->path();
}

void WorkFolder::publish() {
    const Publishing together;
    if (!is_folder(goal_))
        return place_new(*temporary_, goal_);
    if (::renameat2(AT_FDCWD, path().c_str(), AT_FDCWD, goal_.c_str(), RENAME_EXCHANGE) != 0) {
        const Temporary old(Temporary::Kind::folder, folder_of(goal_), goal_);
        Renames renames; // of a file system that cannot swap
        renames.move(goal_, old.path() / kOld);
        temporary_->rename(goal_);
        renames.keep();
    }
    note_published(goal_);
    sync_folder(folder_of(goal_));
}

} // namespace taihu
