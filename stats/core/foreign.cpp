#include "stats/core/foreign.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <new>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "stats/core/error.h"
#include "stats/core/flat.h"
#include "stats/core/text.h"

extern char** environ;

namespace taihu {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProgram = "taihu-reader";
constexpr std::uint64_t kLeastMemory = std::uint64_t{768} << 20, kMemoryPerByte = 100;
constexpr unsigned kLeastTime_s = 2;
constexpr std::size_t kBytesPerSecond = 10'000'000;
constexpr int kWait_ms = 50;       ///< between looks at whether to go on
constexpr double kIdleFactor = 15; ///< seconds on the clock for one of the processor
constexpr std::size_t kMostText = 200;
constexpr std::uint64_t kMostFiles = 16; ///< that a reader may have open

/// The first byte of an answer.
enum class Answer : std::uint8_t { found, refused };

/// Owns a descriptor.
class Handle {
public:
    explicit Handle(int value) : value_(value) {}
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() { reset(); }
    void reset() {
        if (value_ >= 0)
            ::close(value_);
        value_ = -1;
    }
    int get() const { return value_; }

private:
    int value_;
};

[[noreturn]] void fail_system(const std::string& where, const char* what) {
    throw Error(Fault::io, where + ": " + what + ": " + std::strerror(errno) +
                               "; check memory and the limits of this process");
}

fs::path find_program(const std::string& where) {
    std::vector<fs::path> places;
    if (const char* asked = std::getenv("TAIHU_READER"))
        places.emplace_back(asked);
    std::error_code none;
    const fs::path self = fs::read_symlink("/proc/self/exe", none);
    if (!none)
        places.push_back(self.parent_path() / kProgram);
    places.emplace_back(TAIHU_READER_INSTALLED);
    places.emplace_back(TAIHU_READER_BUILT);
    for (const fs::path& place : places)
        if (::access(place.c_str(), X_OK) == 0)
            return place;
    throw Error(Fault::unsupported, where + ": the program " + kProgram +
                                        ", which reads such files, is not beside this one; put it "
                                        "there, or name it in TAIHU_READER");
}

void write_all(int file, std::string_view bytes, const std::string& where) {
    while (!bytes.empty()) {
        const ssize_t n = ::write(file, bytes.data(), bytes.size());
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            fail_system(where, "cannot be handed to its reader");
        bytes.remove_prefix(static_cast<std::size_t>(n));
    }
}

std::string read_all(int file, const std::string& where) {
    struct stat info {};
    if (::fstat(file, &info) != 0)
        fail_system(where, "its reader's answer cannot be read");
    std::string bytes(static_cast<std::size_t>(info.st_size), '\0');
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t n =
            ::pread(file, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            fail_system(where, "its reader's answer cannot be read");
        done += static_cast<std::size_t>(n);
    }
    return bytes;
}

/// A running reader; killed and waited for on every way out.
class Child {
public:
    Child(const fs::path& program, std::vector<std::string> arguments, int in, int out, int alive,
          const std::string& where) {
        std::vector<char*> argv;
        for (std::string& a : arguments)
            argv.push_back(a.data());
        argv.push_back(nullptr);
        posix_spawn_file_actions_t files;
        ::posix_spawn_file_actions_init(&files);
        ::posix_spawn_file_actions_adddup2(&files, in, STDIN_FILENO);
        ::posix_spawn_file_actions_adddup2(&files, out, STDOUT_FILENO);
        // Nothing is written there; the other end hears when the last copy is closed.
        ::posix_spawn_file_actions_adddup2(&files, alive, STDERR_FILENO);
        posix_spawnattr_t how;
        ::posix_spawnattr_init(&how);
        sigset_t all;
        ::sigfillset(&all);
        ::posix_spawnattr_setsigdefault(&how, &all);
        sigset_t none;
        ::sigemptyset(&none);
        ::posix_spawnattr_setsigmask(&how, &none);
        // A group of its own: Ctrl-C reaches it through `progress`.
        ::posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK |
                                             POSIX_SPAWN_SETPGROUP);
        const int code = ::posix_spawn(&id_, program.c_str(), &files, &how, argv.data(), environ);
        ::posix_spawnattr_destroy(&how);
        ::posix_spawn_file_actions_destroy(&files);
        if (code != 0) {
            errno = code;
            fail_system(where, "its reader cannot be started");
        }
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;
    ~Child() {
        if (id_ > 0) {
            ::kill(id_, SIGKILL);
            wait();
        }
    }
    /// waitpid's status.
    int wait() {
        int status = 0;
        while (::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
        }
        id_ = -1;
        return status;
    }

private:
    pid_t id_ = -1;
};

/// Until everybody has closed the other end. Returns false when `limit_s` have passed before.
bool wait_for_end(int pipe, double limit_s, const Progress* progress) {
    using Clock = std::chrono::steady_clock;
    const auto until = Clock::now() + std::chrono::duration<double>(limit_s);
    while (Clock::now() < until) {
        check_cancelled(progress);
        pollfd end{pipe, POLLIN, 0};
        if (::poll(&end, 1, kWait_ms) <= 0)
            continue;
        char noise[512];
        if ((end.revents & POLLIN) != 0 && ::read(pipe, noise, sizeof noise) > 0)
            continue; // what a library says there is for nobody
        return true;
    }
    return false;
}

std::string limits_text(const ForeignLimits& limits) {
    return std::to_string(limits.processor_s) + " s and " +
           std::to_string(limits.memory_bytes >> 20) + " MB";
}

} // namespace

ForeignLimits foreign_limits(std::size_t n_bytes) {
    return {kLeastMemory + kMemoryPerByte * n_bytes,
            kLeastTime_s + static_cast<unsigned>(n_bytes / kBytesPerSecond)};
}

std::string read_foreign(const std::string& kind, std::string_view bytes, const std::string& where,
                         const std::vector<std::string>& words, Progress* progress) {
    const ForeignLimits limits = foreign_limits(bytes.size());
    const fs::path program = find_program(where);
    const Handle in(::memfd_create("taihu-in", MFD_CLOEXEC)),
        out(::memfd_create("taihu-out", MFD_CLOEXEC));
    int ends[2] = {-1, -1};
    if (in.get() < 0 || out.get() < 0 || ::pipe2(ends, O_CLOEXEC) != 0)
        fail_system(where, "its reader cannot be started");
    const Handle end(ends[0]);
    Handle alive(ends[1]);
    write_all(in.get(), bytes, where);
    if (::lseek(in.get(), 0, SEEK_SET) != 0)
        fail_system(where, "cannot be handed to its reader");
    std::vector<std::string> arguments = {kProgram, kind, where};
    arguments.insert(arguments.end(), words.begin(), words.end());
    Child child(program, arguments, in.get(), out.get(), alive.get(), where);
    alive.reset();
    if (!wait_for_end(end.get(), kIdleFactor * limits.processor_s, progress))
        throw Error(Fault::bad_input, where + ": its reader did not end in time; is the machine "
                                              "overloaded, or the file damaged? try again");
    const int status = child.wait();
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw Error(Fault::bad_input, where + ": damaged: reading it took more than " +
                                          limits_text(limits) +
                                          ", or crashed; write the file again");
    std::string answer = read_all(out.get(), where);
    FlatReader flat(answer, where);
    if (flat.get<Answer>() == Answer::found)
        return answer.substr(sizeof(Answer));
    const auto fault = flat.get<Fault>();
    if (fault < Fault::bad_argument || fault > Fault::cancelled)
        flat.fail("is no answer");
    throw Error(fault, printable(flat.get_text(), 1000));
}

namespace {

void limit(int resource, std::uint64_t most) {
    const rlimit both{most, most};
    ::setrlimit(static_cast<__rlimit_resource>(resource), &both);
}

std::string input() {
    struct stat info {};
    std::string bytes;
    if (::fstat(STDIN_FILENO, &info) == 0 && S_ISREG(info.st_mode))
        bytes = read_all(STDIN_FILENO, "standard input");
    return bytes;
}

void limit_self(std::size_t n_bytes) {
    const ForeignLimits limits = foreign_limits(n_bytes);
#ifndef TAIHU_SANITIZED // they take terabytes of addresses
    limit(RLIMIT_AS, limits.memory_bytes);
#endif
    limit(RLIMIT_CPU, limits.processor_s);
    limit(RLIMIT_FSIZE, limits.memory_bytes); // of the answer
    limit(RLIMIT_NOFILE, kMostFiles);
    limit(RLIMIT_CORE, 0);
    ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
}

} // namespace

int serve_foreign(int argc, char** argv, const std::map<std::string, ForeignReader>& readers) {
    const auto reader = argc > 2 ? readers.find(argv[1]) : readers.end();
    if (reader == readers.end()) {
        std::fprintf(stderr, "%s: reads files for taihu, which starts it\n", kProgram);
        return 2;
    }
    ::prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0);
    // What libraries say on standard output is not part of the answer.
    const Handle out(::dup(STDOUT_FILENO));
    ::dup2(STDERR_FILENO, STDOUT_FILENO);
    FlatWriter answer;
    const auto refuse = [&](Fault fault, const std::string& message) {
        answer.bytes.clear();
        answer.put(Answer::refused);
        answer.put(fault);
        answer.put_text(message);
    };
    const std::string where = argv[2];
    try {
        const std::string bytes = input();
        limit_self(bytes.size());
        answer.put(Answer::found);
        answer.bytes += reader->second(bytes, where, {argv + 3, argv + argc});
    } catch (const Error& e) {
        refuse(e.fault(), e.what());
    } catch (const std::bad_alloc&) {
        refuse(Fault::bad_input, where + ": asks for more memory than its size allows; it is "
                                         "damaged, write it again");
    } catch (const std::exception& e) {
        refuse(Fault::bad_input,
               where + ": damaged (" + printable(e.what(), kMostText) + "); write the file again");
    }
    try {
        write_all(out.get(), answer.bytes, where);
    } catch (const Error&) {
        return 1;
    }
    return 0;
}

} // namespace taihu
