#include "tools/console.h"

#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <pthread.h>
#include <semaphore.h>
#include <sys/resource.h>
#include <tbb/info.h>
#include <unistd.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"
#include "tools/units.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/tiles.h"

namespace taihu {
namespace {

std::atomic<int> g_signal{0};
static_assert(std::atomic<int>::is_always_lock_free); // so a handler may write it
sem_t g_asked;
std::atomic_flag g_ending;

void on_signal(int signal) {
    int none = 0;
    g_signal.compare_exchange_strong(none, signal);
    ::sem_post(&g_asked);
}

/// Ends the program where the work does not by itself: not all that a library does can be asked to
/// stop. Files come into view by renames alone, so nothing is torn.
void* end_soon(void*) {
    constexpr timespec kPatience{.tv_sec = 1, .tv_nsec = 0};
    while (::sem_wait(&g_asked) != 0)
        ;
    ::nanosleep(&kPatience, nullptr);
    claim_the_end();
    discard_temporaries();
    std::fprintf(stderr, "%staihu: %s\n", ::isatty(STDERR_FILENO) ? "\r\033[K" : "",
                 stopped_text());
    ::_exit(128 + g_signal);
}

/// A small thread. False: it cannot be had.
bool start_backstop() {
    pthread_attr_t small;
    pthread_t thread;
    sigset_t all, before;
    ::sem_init(&g_asked, 0, 0);
    sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before); // signals go to the threads that work
    ::pthread_attr_init(&small);
    ::pthread_attr_setdetachstate(&small, PTHREAD_CREATE_DETACHED);
    ::pthread_attr_setstacksize(&small, std::size_t{256} << 10);
    const bool started = ::pthread_create(&thread, &small, end_soon, nullptr) == 0;
    ::pthread_attr_destroy(&small);
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return started;
}

/// What this process has of data and stacks by now.
double data_bytes() {
    std::ifstream pages("/proc/self/statm");
    double size = 0, resident = 0, shared = 0, text = 0, lib = 0, data = 0;
    pages >> size >> resident >> shared >> text >> lib >> data;
    return data * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

} // namespace

int stop_signal() {
    return g_signal;
}

const char* stopped_text() {
    return any_published() ? "stopped; what was written before is whole"
                           : "stopped; no output was written";
}

void claim_the_end() {
    if (g_ending.test_and_set()) {
        // By then the other has ended it, unless it fails in doing so. Signals wake this one early.
        for (unsigned left_s = 3; left_s > 0;)
            left_s = ::sleep(left_s);
        ::_exit(70);
    }
}

void catch_stop_signals() {
    struct sigaction action {};
    action.sa_handler = on_signal;
    // Signals often come twice, as timeout sends them to the program and to its group: a second one
    // kills only where nothing else ends what does not look up.
    action.sa_flags = start_backstop() ? 0 : static_cast<int>(SA_RESETHAND);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction before {};
        sigaction(signal, nullptr, &before);
        if (before.sa_handler != SIG_IGN) // as nohup and shells ask for
            sigaction(signal, &action, nullptr);
    }
    // A closed pipe and a file size limit are errors of the call that meets them, not deaths.
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

TerminalProgress::~TerminalProgress() {
    if (visible_ && percent_ >= 0)
        std::fputs("\r\033[K", stderr);
}

void TerminalProgress::stage(std::string_view name) {
    stage_ = name;
    percent_ = 0;
    print(0);
}

void TerminalProgress::fraction(double done) {
    const int now = static_cast<int>(100 * done);
    if (percent_.exchange(now) != now)
        print(now);
}

void TerminalProgress::print(int percent) {
    if (visible_)
        std::fprintf(stderr, "\r\033[K%s %d %%", stage_.c_str(), percent);
}

bool TerminalProgress::cancelled() const {
    return g_signal != 0;
}

CLI::App* Console::verb(CLI::App& app, const std::string& name, const std::string& does,
                        const std::string& examples) {
    CLI::App* verb = app.add_subcommand(name, does);
    const std::string group = "Common options";
    verb->add_flag("--json", json, "Print the result as one JSON object on stdout")->group(group);
    verb->add_flag("-q,--quiet", quiet, "Say nothing but errors")->group(group);
    verb->add_flag("--no-clobber", no_clobber, "Refuse to replace a file that exists")
        ->group(group);
    verb->add_option("--threads", n_threads, "Threads to use; results do not depend on it [all]")
        ->check(CLI::Range(1, 1024))
        ->group(group);
    verb->add_option("--memory", memory,
                     "Refuse what would need more, as 4GB, and end what takes more [what the "
                     "machine has left]")
        ->check([](const std::string& text) { return std::string(text.empty() ? "is empty" : ""); })
        ->group(group);
    verb->footer("\nExamples:\n" + examples);
    return verb;
}

std::optional<double> Console::memory_bytes() const {
    if (memory.empty())
        return std::nullopt;
    return taihu::memory_bytes("--memory", memory);
}

void Console::require_memory(double n, double bytes_each, const std::string& remedy) const {
    constexpr double kProgram_bytes = 45e6;
    const double needed = kProgram_bytes + n * bytes_each;
    const double limit = memory_limit_bytes(memory_bytes());
    if (needed > limit)
        throw Error(Fault::unsupported, "refused: would need about " + human_bytes(needed) +
                                            " (limit " + human_bytes(limit) + "); " + remedy);
}

/// Estimates refuse before the work; this is for what they did not foresee. Beyond what the program
/// holds already, and the stacks of its threads, of which little is ever touched.
void Console::limit_memory() const {
    constexpr double kStack_bytes = 8 << 20;
    // What is left may come back, as other programs end: so much is tried at least.
    constexpr double kLeast_bytes = 512e6;
    const double allowed = memory_bytes().value_or(std::max(kLeast_bytes, memory_limit_bytes()));
    rlimit data{};
    if (::getrlimit(RLIMIT_DATA, &data) != 0)
        return;
    const int n = n_threads > 0 ? n_threads : tbb::info::default_concurrency();
    const double most = data_bytes() + allowed + kStack_bytes * n;
    if (most < static_cast<double>(data.rlim_cur)) // RLIM_INFINITY is the greatest number
        data.rlim_cur = static_cast<rlim_t>(most);
#ifndef TAIHU_SANITIZED // whose own memory counts, too
    ::setrlimit(RLIMIT_DATA, &data);
#endif
}

void Console::say_text(const std::string& line) const {
    if (!quiet)
        said_.push_back(printable(line, 4096));
}

void Console::show_said() const {
    for (const std::string& line : said_)
        std::fprintf(stderr, "%s%s\n", ::isatty(STDERR_FILENO) ? "\r\033[K" : "", line.c_str());
    said_.clear();
}

void Console::say_all(const std::string& where, const std::vector<std::string>& lines) const {
    for (const std::string& line : lines)
        say("{}: {}", where, line);
}

void Console::result(const nlohmann::ordered_json& object) const {
    if (sink) {
        *sink = object;
        return;
    }
    const auto replace = nlohmann::ordered_json::error_handler_t::replace; // names may be any bytes
    if (!json || (std::printf("%s\n", object.dump(-1, ' ', false, replace).c_str()) >= 0 &&
                  std::fflush(stdout) == 0))
        return;
    if (errno == EPIPE) // one who has read enough may close the pipe
        std::clearerr(stdout);
    else
        throw Error(Fault::io, "stdout: cannot write; check where it goes");
}

void Console::may_write(const std::filesystem::path& path,
                        std::initializer_list<std::filesystem::path> others) const {
    namespace fs = std::filesystem;
    std::error_code ignored;
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (!fs::is_directory(folder, ignored))
        throw Error(Fault::io,
                    path.string() + ": there is no folder " + folder.string() + "; make it first");
    if (fs::is_directory(path, ignored))
        throw Error(Fault::io, path.string() + ": is a folder; name a file");
    if (path.filename().string().size() > NAME_MAX)
        throw Error(Fault::io, path.string() + ": a name of more than " + std::to_string(NAME_MAX) +
                                   " bytes; choose a shorter one");
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
        throw Error(Fault::io, path.string() + ": cannot write: " + std::strerror(errno) +
                                   "; check the rights of its folder");
    for (const fs::path& other : others)
        if (!other.empty() &&
            fs::weakly_canonical(other, ignored) == fs::weakly_canonical(path, ignored))
            throw Error(Fault::bad_argument,
                        path.string() +
                            ": is also read or written by this command; choose another name");
    if (no_clobber && fs::exists(fs::symlink_status(path, ignored)))
        throw Error(Fault::io,
                    path.string() + ": exists; choose another name, or drop --no-clobber");
}

void Console::may_write_tiles(const std::filesystem::path& folder) const {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored))
        throw Error(Fault::io, folder.string() + ": is a file; --tiles needs the name of a folder");
    const fs::path parent = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
    if (!fs::is_directory(parent, ignored))
        throw Error(Fault::io, folder.string() + ": there is no folder " + parent.string() +
                                   "; make it first");
    const fs::path set = folder / kTileSetName;
    if (no_clobber && fs::exists(set, ignored))
        throw Error(Fault::io,
                    set.string() + ": exists; choose another name, or drop --no-clobber");
}

} // namespace taihu
