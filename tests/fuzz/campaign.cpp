// fuzz_campaign [N [SEED [FORMAT...]]]: N mutations (10,000) of every input format, each read by
// one of two processes, so that what dies, hangs or grows is counted and the rest goes on. Prints a
// table and, for what must not happen, the format and the item; exits with 1 when there was any.
// fuzz_campaign write FORMAT SEED ITEM FILE: that mutation as a file.
// fuzz_campaign bases FORMAT FOLDER: what mutations of this format begin with.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <new>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"
#include "tests/fuzz/formats.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

constexpr double kMostSeconds = 10; ///< of processor time, and twice in a row by the clock
constexpr std::size_t kMostBytes = std::size_t{1} << 30, kWorkers = 2, kShown = 5;

/// What became of a mutation; those from `crash` on must not be.
enum Fate : unsigned char {
    untouched,
    accepted,
    bad_input,
    unsupported,
    other_refusal, // bad_argument, io, numeric
    crash,
    slow,
    big,
    unsound, // accepted, and wrong
    unclear, // refused, but not in one line of ours
    chatter, // something else was said on stderr
    escaped, // an exception that is no Error
    kFates
};
constexpr std::array<const char*, kFates> kFateNames = {
    "-",    "accepted", "bad input", "unsupported", "other",   "crash",
    "slow", "big",      "unsound",   "unclear",     "chatter", "escaped"};

/// What a worker shares with the one who watches it.
struct Shared {
    std::atomic<std::uint64_t> item[kWorkers]; ///< being read; ~0: none any more
    std::atomic<std::int64_t> since_ms[kWorkers];
    Fate fates[1]; ///< one per item
};

struct Job {
    const FuzzFormat& format;
    std::vector<std::string> bases;
    std::uint64_t seed, n;
    Shared* shared;
    int said[kWorkers]; ///< files that take a worker's stderr
};

[[noreturn]] void stop(const char* what) {
    std::perror(what);
    std::exit(2);
}

std::int64_t now_ms() {
    return std::chrono::duration_cast<std::chrono::milliseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

/// Processor time of this process and of those that it waited for: a machine that pauses makes
/// nothing slow.
double processor_s() {
    double s = 0;
    for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
        rusage usage{};
        ::getrusage(who, &usage);
        for (const timeval& t : {usage.ru_utime, usage.ru_stime})
            s += double(t.tv_sec) + 1e-6 * double(t.tv_usec);
    }
    return s;
}

/// A line of /proc/self/status, in bytes.
std::size_t memory(const char* key) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with(key))
            return std::strtoull(line.c_str() + std::string_view(key).size(), nullptr, 10) << 10;
    return 0;
}

void limit_memory() {
#ifndef TAIHU_SANITIZED // whose shadow takes terabytes of addresses
    const std::size_t most = memory("VmSize:") + kMostBytes + kMostBytes / 4;
    const rlimit limit{most, most};
    ::setrlimit(RLIMIT_AS, &limit);
#endif
}

/// Whether a refusal is what people are told: the file, a cause, a remedy.
bool is_clear(const Error& e, const FuzzFormat& format) {
    const std::string line = error_line(e.what());
    const std::string_view stem = format.file.substr(0, format.file.find('.'));
    return line.find(stem) != std::string::npos && line.find(": ") != std::string::npos &&
           line.size() <= kMostErrorBytes && line.find(';') != std::string::npos;
}

Fate fate_of(const Job& job, std::uint64_t item, const std::filesystem::path& folder) {
    const std::string bytes = mutated_file(job.format, job.bases, job.seed, item);
    try {
        job.format.read(bytes, folder);
        return accepted;
    } catch (const Error& e) {
        if (!is_clear(e, job.format)) {
            std::fprintf(stderr, "%s\n", error_line(e.what()).c_str());
            return unclear;
        }
        return e.fault() == Fault::bad_input     ? bad_input
               : e.fault() == Fault::unsupported ? unsupported
                                                 : other_refusal;
    } catch (const Unsound& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return unsound;
    } catch (const std::bad_alloc&) {
        return big;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return escaped;
    }
}

/// Reads one, and says what became of it by its memory and time. By the clock a read is slow when
/// it is slow once more: it may have waited for others the first time, or the machine paused.
Fate judged_fate(const Job& job, std::size_t worker, std::uint64_t item,
                 const std::filesystem::path& folder) {
    for (bool again = false;; again = true) {
        std::ofstream("/proc/self/clear_refs") << 5; // the peak begins anew
        const std::size_t before = memory("VmHWM:");
        const double before_s = processor_s();
        const std::int64_t start_ms = now_ms();
        job.shared->since_ms[worker] = start_ms;
        job.shared->item[worker] = item;
        const Fate fate = fate_of(job, item, folder);
        if (fate >= crash)
            return fate;
        if (::lseek(STDERR_FILENO, 0, SEEK_CUR) > 0)
            return chatter;
        if (memory("VmHWM:") > before + kMostBytes)
            return big;
        if (processor_s() - before_s > kMostSeconds)
            return slow;
        if (double(now_ms() - start_ms) <= 1000 * kMostSeconds)
            return fate;
        if (again)
            return slow;
    }
}

/// Reads every kWorkers'th mutation from `first` on. What is said stays in job.said after the last
/// item that said anything.
[[noreturn]] void work(const Job& job, std::size_t worker, std::uint64_t first) {
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    ::dup2(job.said[worker], STDERR_FILENO);
    limit_memory();
    const Scratch folder;
    for (std::uint64_t item = first; item < job.n; item += kWorkers) {
        const Fate fate = judged_fate(job, worker, item, folder.path());
        job.shared->fates[item] = fate;
        if (fate >= crash)
            break; // the watcher shows what was said, and starts the next one
    }
    job.shared->item[worker] = ~std::uint64_t{0};
    std::filesystem::remove_all(folder.path());
    ::_exit(0);
}

pid_t start(const Job& job, std::size_t worker, std::uint64_t first) {
    if (::ftruncate(job.said[worker], 0) != 0 || ::lseek(job.said[worker], 0, SEEK_SET) != 0)
        stop("memfd");
    job.shared->item[worker] = first;
    job.shared->since_ms[worker] = now_ms();
    std::fflush(stdout);
    const pid_t pid = ::fork();
    if (pid == 0)
        work(job, worker, first);
    if (pid < 0)
        stop("fork");
    return pid;
}

void show(const Job& job, std::size_t worker, std::uint64_t item, Fate fate) {
    std::string said(2000, '\0');
    const ssize_t n = ::pread(job.said[worker], said.data(), said.size(), 0);
    said.resize(static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
    std::printf("  %s: %s %llu %llu: %s\n", kFateNames[fate], std::string(job.format.name).c_str(),
                static_cast<unsigned long long>(job.seed), static_cast<unsigned long long>(item),
                printable(said, 600).c_str());
}

/// One worker's process, and the item it began with.
struct Run {
    std::uint64_t first = 0;
    pid_t pid = 0; ///< 0: none any more
    bool killed = false;
};

/// What a process that has ended leaves: marks and shows the item it stopped at, if any, and starts
/// the next one behind it.
void follow(const Job& job, std::size_t worker, Run& run, std::map<Fate, std::size_t>& shown) {
    std::uint64_t item = job.shared->item[worker];
    if (item != ~std::uint64_t{0}) { // it died over this one
        job.shared->fates[item] = run.killed ? slow : crash;
    } else { // it ended, or stopped at something to show
        item = run.first;
        while (item < job.n && job.shared->fates[item] < crash)
            item += kWorkers;
    }
    if (item < job.n) {
        const Fate fate = job.shared->fates[item];
        if (shown[fate]++ < kShown)
            show(job, worker, item, fate);
    }
    run = {item + kWorkers, 0, false};
    if (run.first < job.n)
        run.pid = start(job, worker, run.first);
}

/// Keeps the workers at work to the last of their items. One thread watches them all: a fork beside
/// another thread may take along a lock that it holds, the allocator's of a sanitizer too.
void watch(const Job& job) {
    std::map<Fate, std::size_t> shown;
    std::array<Run, kWorkers> runs;
    for (std::size_t w = 0; w < kWorkers && w < job.n; ++w)
        runs[w] = {w, start(job, w, w), false};
    for (std::size_t n_running = kWorkers; n_running > 0;) {
        n_running = 0;
        for (std::size_t w = 0; w < kWorkers; ++w) {
            Run& run = runs[w];
            if (run.pid == 0)
                continue;
            int status = 0;
            if (::waitpid(run.pid, &status, WNOHANG) != 0)
                follow(job, w, run, shown);
            else if (now_ms() - job.shared->since_ms[w] > 12000 * kMostSeconds && !run.killed)
                run.killed = ::kill(run.pid, SIGKILL) == 0;
            n_running += run.pid != 0;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

using Counts = std::array<std::size_t, kFates>;

Counts run(const FuzzFormat& format, std::uint64_t seed, std::uint64_t n) {
    const std::size_t size = sizeof(Shared) + n;
    void* memory = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED)
        stop("mmap");
    Job job{format, {}, seed, n, new (memory) Shared, {}};
    // Bases come from a process of their own: writers may start threads, which a fork would lose.
    job.bases = [&] {
        const Scratch folder;
        const pid_t pid = ::fork();
        if (pid == 0) {
            std::size_t i = 0;
            for (const std::string& base : format.bases())
                write_bytes(folder / std::to_string(i++), base);
            ::_exit(0);
        }
        ::waitpid(pid, nullptr, 0);
        std::vector<std::string> bases;
        while (std::filesystem::exists(folder / std::to_string(bases.size())))
            bases.push_back(read_file(folder / std::to_string(bases.size())));
        return bases;
    }();
    for (int& said : job.said)
        said = ::memfd_create("said", 0);
    watch(job);
    for (const int said : job.said)
        ::close(said);
    Counts counts{};
    for (std::uint64_t i = 0; i < n; ++i)
        ++counts[job.shared->fates[i]];
    ::munmap(memory, size);
    return counts;
}

void print_row(const std::string& name, const Counts& counts, double seconds) {
    std::printf("%-8s", name.c_str());
    for (std::size_t f = accepted; f < kFates; ++f)
        std::printf(" %11zu", counts[f]);
    std::printf(" %7.1f s\n", seconds);
    std::fflush(stdout);
}

int campaign(std::uint64_t n, std::uint64_t seed, std::span<char*> names) {
    std::printf("%-8s", "format");
    for (std::size_t f = accepted; f < kFates; ++f)
        std::printf(" %11s", kFateNames[f]);
    std::printf("\n");
    Counts total{};
    const std::int64_t begin = now_ms();
    for (const FuzzFormat& format : fuzz_formats()) {
        if (!names.empty() && std::find(names.begin(), names.end(), format.name) == names.end())
            continue;
        const std::int64_t start = now_ms();
        const Counts counts = run(format, seed, n);
        for (std::size_t f = 0; f < kFates; ++f)
            total[f] += counts[f];
        print_row(std::string(format.name), counts, double(now_ms() - start) / 1000);
    }
    print_row("all", total, double(now_ms() - begin) / 1000);
    std::size_t n_read = 0, n_wrong = total[untouched];
    for (std::size_t f = accepted; f < kFates; ++f)
        (f < crash ? n_read : n_wrong) += total[f];
    return n_wrong == 0 && n_read > 0 ? 0 : 1;
}

const FuzzFormat& format_named(std::string_view name) {
    for (const FuzzFormat& format : fuzz_formats())
        if (format.name == name)
            return format;
    std::fprintf(stderr, "fuzz_campaign: no format '%s'\n", std::string(name).c_str());
    std::exit(2);
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    const auto number = [&](int i, std::uint64_t otherwise) {
        return argc > i ? std::strtoull(argv[i], nullptr, 10) : otherwise;
    };
    if (std::filesystem::is_directory("/dev/shm")) // files are written by the ten thousand
        ::setenv("TMPDIR", "/dev/shm", 0);
    if (argc == 6 && std::string_view(argv[1]) == "write") {
        const auto& format = taihu::format_named(argv[2]);
        taihu::write_bytes(argv[5],
                           taihu::mutated_file(format, format.bases(), number(3, 0), number(4, 0)));
        return 0;
    }
    if (argc == 4 && std::string_view(argv[1]) == "bases") {
        int i = 0;
        for (const std::string& base : taihu::format_named(argv[2]).bases())
            taihu::write_bytes(std::filesystem::path(argv[3]) / ("base" + std::to_string(i++)),
                               base);
        return 0;
    }
    return taihu::campaign(number(1, 10'000), number(2, 1),
                           std::span(argv + std::min(argc, 3), argv + argc));
}
