#include "stats/core/file.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/replacing_detail.h"
#include "stats/core/temporary_detail.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

/// Up to `bytes.size()` from `at` on; returns how many there were.
std::size_t read_all(int descriptor, std::uint64_t at, std::span<char> bytes,
                     const fs::path& path) {
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t n = ::pread(descriptor, bytes.data() + done, bytes.size() - done,
                                  static_cast<off_t>(at + done));
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            fail_io(path, "cannot read", errno);
        if (n == 0)
            break;
        done += static_cast<std::size_t>(n);
    }
    return done;
}

} // namespace

std::string read_file(const fs::path& path, std::size_t max_bytes) {
    // O_NONBLOCK: opening a pipe that nobody writes to must not wait.
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.value() < 0)
        fail_io(path, "cannot open", errno);
    struct stat info {};
    if (::fstat(file.value(), &info) != 0)
        fail_io(path, "cannot read", errno);
    if (!S_ISREG(info.st_mode))
        throw Error(Fault::io, path.string() + ": not a regular file; give a file");
    const auto size = static_cast<std::size_t>(info.st_size);
    if (size > max_bytes)
        throw Error(Fault::bad_input, path.string() + ": " + std::to_string(size) +
                                          " bytes, at most " + std::to_string(max_bytes) +
                                          " are read; split or reduce it");
    note_read(file.value());
    std::string bytes(size, '\0');
    bytes.resize(read_all(file.value(), 0, bytes, path));
    return bytes;
}

OutputFile::OutputFile(fs::path path) : path_(std::move(path)) {
    struct stat info {};
    if (::stat(path_.c_str(), &info) == 0 && !S_ISREG(info.st_mode))
        throw Error(Fault::io, path_.string() + ": is no regular file, and would be replaced; "
                                                "choose another name");
    temporary_ = std::make_unique<Temporary>(Temporary::Kind::file, folder_of(path_), path_);
}

OutputFile::~OutputFile() = default;

void OutputFile::write(std::string_view bytes) {
    write_at(size_, bytes);
}

void OutputFile::write_at(std::uint64_t at, std::string_view bytes) {
    size_ = std::max(size_, at + bytes.size());
    while (!bytes.empty()) {
        const ssize_t n =
            ::pwrite(temporary_->descriptor(), bytes.data(), bytes.size(), static_cast<off_t>(at));
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            fail_io(path_, "cannot write", n < 0 ? errno : ENOSPC);
        bytes.remove_prefix(static_cast<std::size_t>(n));
        at += static_cast<std::uint64_t>(n);
    }
}

std::size_t OutputFile::read_at(std::uint64_t at, std::span<char> bytes) const {
    return read_all(temporary_->descriptor(), at, bytes, path_);
}

void OutputFile::finish() {
    if (finished_)
        return;
    if (::fsync(temporary_->descriptor()) != 0)
        fail_io(path_, "cannot write", errno);
    // What closing would say, of a second descriptor: the first holds the lock until the rename.
    const int second = ::fcntl(temporary_->descriptor(), F_DUPFD_CLOEXEC, 0);
    if (second < 0 || ::close(second) != 0)
        fail_io(path_, "cannot write", errno);
    finished_ = true;
}

void OutputFile::publish() {
    finish();
    temporary_->rename(path_);
    sync_folder(folder_of(path_));
}

void write_file(const fs::path& path, std::string_view bytes) {
    OutputFile file(path);
    file.write(bytes);
    file.publish();
}

std::string base_name(const fs::path& path) {
    return printable(path.filename().string(), 255);
}

} // namespace taihu
