#include "tools/console.h"

#include <csignal>
#include <cstdio>
#include <unistd.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

volatile std::sig_atomic_t g_signal = 0;

void on_signal(int signal) {
    g_signal = signal;
}

} // namespace

int stop_signal() {
    return g_signal;
}

void catch_stop_signals() {
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = static_cast<int>(SA_RESETHAND); // a second Ctrl-C kills
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    std::signal(SIGPIPE, SIG_IGN); // a closed pipe is an error of printf, not a death
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
    verb->footer("\nExamples:\n" + examples);
    return verb;
}

void Console::say_text(const std::string& line) const {
    if (!quiet)
        std::fprintf(stderr, "%s%s\n", ::isatty(STDERR_FILENO) ? "\r\033[K" : "", line.c_str());
}

void Console::say_all(const std::string& where, const std::vector<std::string>& lines) const {
    for (const std::string& line : lines)
        say("{}: {}", where, line);
}

void Console::result(const nlohmann::ordered_json& object) const {
    if (json && (std::printf("%s\n", object.dump().c_str()) < 0 || std::fflush(stdout) != 0))
        throw Error(Fault::io, "stdout: cannot write; check where it goes");
}

void Console::may_write(const std::filesystem::path& path) const {
    if (no_clobber && std::filesystem::exists(path))
        throw Error(Fault::io,
                    path.string() + ": exists; choose another name, or drop --no-clobber");
}

} // namespace taihu
