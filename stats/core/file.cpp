#include "stats/core/file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what, int code) {
    throw Error(Fault::io, path.string() + ": " + what + ": " + std::strerror(code) +
                               "; check the path, its rights and the space left");
}

/// Closes on every way out, so that an error does not leak a descriptor.
struct Descriptor {
    int value;
    explicit Descriptor(int v) : value(v) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() {
        if (value >= 0)
            ::close(value);
    }
};

} // namespace

std::string read_file(const std::filesystem::path& path, std::size_t max_bytes) {
    // O_NONBLOCK: opening a pipe that nobody writes to must not wait.
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.value < 0)
        fail(path, "cannot open", errno);
    struct stat info {};
    if (::fstat(file.value, &info) != 0)
        fail(path, "cannot read", errno);
    if (!S_ISREG(info.st_mode))
        throw Error(Fault::io, path.string() + ": not a regular file; give a file");
    const auto size = static_cast<std::size_t>(info.st_size);
    if (size > max_bytes)
        throw Error(Fault::bad_input, path.string() + ": " + std::to_string(size) +
                                          " bytes, at most " + std::to_string(max_bytes) +
                                          " are read; split or reduce it");
    std::string bytes(size, '\0');
    std::size_t done = 0;
    while (done < size) {
        const ssize_t n = ::read(file.value, bytes.data() + done, size - done);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            fail(path, "cannot read", errno);
        if (n == 0)
            break;
        done += static_cast<std::size_t>(n);
    }
    bytes.resize(done);
    return bytes;
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
    const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
    std::string temporary = (folder / ".taihu-tmp-XXXXXX").string();
    int code = 0;
    const char* what = nullptr;
    {
        const Descriptor file(::mkostemp(temporary.data(), O_CLOEXEC));
        if (file.value < 0)
            fail(path, "cannot write", errno);
        const mode_t mask = ::umask(0);
        ::umask(mask);
        ::fchmod(file.value, 0666 & ~mask); // mkstemp's 0600 would surprise whoever shares the file
        while (!bytes.empty()) {
            const ssize_t n = ::write(file.value, bytes.data(), bytes.size());
            if (n < 0 && errno == EINTR)
                continue;
            if (n < 0) {
                code = errno;
                what = "cannot write";
                break;
            }
            bytes.remove_prefix(static_cast<std::size_t>(n));
        }
        if (!what && ::fsync(file.value) != 0) {
            code = errno;
            what = "cannot write";
        }
    }
    if (!what && ::rename(temporary.c_str(), path.c_str()) != 0) {
        code = errno;
        what = "cannot replace";
    }
    if (what) {
        ::unlink(temporary.c_str());
        fail(path, what, code);
    }
    const Descriptor parent(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (parent.value >= 0)
        ::fsync(parent.value); // best effort: some file systems refuse to sync a folder
}

std::string base_name(const std::filesystem::path& path) {
    return printable(path.filename().string(), 255);
}

} // namespace taihu
