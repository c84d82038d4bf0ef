#include "tools/gnuplot.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <spawn.h>
#include <string_view>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

/// A file in memory, which a program may read or write without waiting for us.
class MemoryFile {
public:
    explicit MemoryFile(const std::string& content = "")
        : fd_(::memfd_create("taihu", MFD_CLOEXEC)) {
        std::string_view left = content;
        ssize_t n = fd_ < 0 ? -1 : 0;
        while (n >= 0 && !left.empty()) {
            n = ::write(fd_, left.data(), left.size());
            left.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
        }
        if (n < 0 || ::lseek(fd_, 0, SEEK_SET) != 0) {
            const int code = errno;
            ::close(fd_);
            throw Error(Fault::io, "report: " + std::string(std::strerror(code)) +
                                       " for a plot; close other programs and raise limits");
        }
    }
    ~MemoryFile() { ::close(fd_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;

    int fd() const { return fd_; }
    std::string content() const {
        std::string text;
        std::array<char, 65536> part;
        ::lseek(fd_, 0, SEEK_SET);
        for (ssize_t n; (n = ::read(fd_, part.data(), part.size())) > 0;)
            text.append(part.data(), static_cast<std::size_t>(n));
        return text;
    }

private:
    int fd_;
};

/// Exit status of a program that was started; it is killed when the work is cancelled.
int wait_for(pid_t child, const Progress* progress) {
    constexpr timespec kNap{.tv_sec = 0, .tv_nsec = 2'000'000};
    int status = 0;
    for (pid_t ended = 0; ended == 0;) {
        ended = ::waitpid(child, &status, WNOHANG);
        if (ended == 0 && progress && progress->cancelled()) {
            ::kill(child, SIGKILL);
            ::waitpid(child, &status, 0);
            check_cancelled(progress);
        }
        if (ended == 0)
            ::nanosleep(&kNap, nullptr);
    }
    check_cancelled(progress); // Ctrl-C ends it as well as it asks us
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

/// Exit status of gnuplot, or -1 when it cannot be started.
int run_gnuplot(const MemoryFile& in, const MemoryFile& out, const MemoryFile& err,
                const Progress* progress) {
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, in.fd(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&files, out.fd(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&files, err.fd(), STDERR_FILENO);
    // -d: not the user's own settings. The locale decides on decimal commas, so it is set here.
    std::array<std::string, 2> words = {"gnuplot", "-d"};
    std::array<char*, 3> arguments = {words[0].data(), words[1].data(), nullptr};
    std::string locale = "LC_ALL=C.UTF-8", path = "PATH=";
    if (const char* own = std::getenv("PATH"))
        path += own;
    std::array<char*, 3> environment = {locale.data(), path.data(), nullptr};
    pid_t child = -1;
    const int failed = ::posix_spawnp(&child, words[0].c_str(), &files, nullptr, arguments.data(),
                                      environment.data());
    posix_spawn_file_actions_destroy(&files);
    return failed != 0 ? -1 : wait_for(child, progress);
}

} // namespace

std::string gnuplot_svg(const std::string& name, const std::string& script,
                        const Progress* progress) {
    const MemoryFile in("set terminal svg size 720,400 dynamic font 'sans-serif,13' name '" + name +
                        "' noenhanced\nset encoding utf8\n" + script);
    const MemoryFile out, err;
    const int status = run_gnuplot(in, out, err, progress);
    if (status < 0 || status == 127)
        throw Error(Fault::unsupported, "report: there is no gnuplot to draw its plots; install "
                                        "the Debian package gnuplot-nox");
    std::string svg = out.content();
    if (status == 0 && svg.find("</svg>") == std::string::npos)
        throw Error(Fault::io,
                    "report: gnuplot's picture is cut off; raise the limit of file sizes");
    const std::size_t start = svg.find("<svg"); // without the XML declaration, which HTML has not
    if (status != 0 || start == std::string::npos)
        throw Error(Fault::unsupported, "report: gnuplot says '" + printable(err.content(), 200) +
                                            "'; is it version 5.4 or later");
    svg.erase(0, start);
    // Shapes of points, which no plot of ours has: their ids are the same in every picture.
    const std::size_t defs = svg.find("<defs>"), end = svg.find("</defs>");
    if (defs < end && end != std::string::npos)
        svg.erase(defs, end + std::string("</defs>").size() - defs);
    return svg;
}

} // namespace taihu
