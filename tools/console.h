#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "stats/core/progress.h"
#include "stats/core/replacing.h"

namespace taihu {

/// Stages and percent on a terminal's stderr; silent anywhere else. Cancelled by signals.
class TerminalProgress final : public Progress {
public:
    explicit TerminalProgress(bool visible) : visible_(visible) {}
    ~TerminalProgress() override;
    void stage(std::string_view name) override;
    void fraction(double done) override;
    bool cancelled() const override;

private:
    void print(int percent);
    bool visible_;
    std::atomic<int> percent_{-1};
    std::string stage_;
};

/// What every verb has: its streams, its common options, its progress.
/// stdout carries the result alone; people are told on stderr.
struct Console {
    bool json = false, quiet = false, no_clobber = false;
    int n_threads = 0;  ///< 0: all
    std::string memory; ///< --memory
    Progress* progress = nullptr;
    nlohmann::ordered_json* sink = nullptr; ///< takes the result instead of stdout, where set

    /// A verb with the common options and runnable examples in its help.
    CLI::App* verb(CLI::App& app, const std::string& name, const std::string& does,
                   const std::string& examples);

    /// Runs a verb within the memory and on as many threads as were asked for, be they more than
    /// the machine has.
    template <class Run>
    void within_limits(Run&& run) const {
        limit_memory();
        const OutputRules rules(no_clobber);
        if (n_threads == 0)
            return run();
        const auto n = static_cast<std::size_t>(n_threads);
        const tbb::global_control most(tbb::global_control::max_allowed_parallelism, n);
        tbb::task_arena(n_threads).execute(run);
    }

    /// What --memory allows [bytes].
    std::optional<double> memory_bytes() const;
    /// Before the work. \throws Error unsupported: `n` things of so many bytes each are more than
    /// --memory, or the machine, allows.
    void require_memory(double n, double bytes_each, const std::string& remedy) const;

    /// A line for people, unless -q; held until show_said(), so that a verb which refuses says
    /// nothing but why.
    template <class... Args>
    void say(fmt::format_string<Args...> format, Args&&... args) const {
        say_text(fmt::format(format, std::forward<Args>(args)...));
    }
    void say_text(const std::string& line) const;
    /// Prints what was said since the last time.
    void show_said() const;
    /// Findings about `where`, one line each.
    void say_all(const std::string& where, const std::vector<std::string>& lines) const;
    /// The machine's result: with --json one object on stdout.
    void result(const nlohmann::ordered_json& object) const;
    /// Asked before any work. \param others  what else the command reads and writes.
    /// \throws Error io: no such folder, or `path` exists and --no-clobber was given; bad_argument:
    /// it
    ///   is one of the others.
    void may_write(const std::filesystem::path& path,
                   std::initializer_list<std::filesystem::path> others = {}) const;
    /// The same of a folder for tiles, which may be there already.
    void may_write_tiles(const std::filesystem::path& folder) const;

private:
    void limit_memory() const;
    mutable std::vector<std::string> said_;
};

/// Exit code of a verb whose answer is no.
inline constexpr int kSaysNo = 3;

/// The signal that asked to stop, or 0.
int stop_signal();
/// Let SIGINT, SIGTERM and SIGHUP cancel instead of kill, unless they are ignored; what has not
/// ended a second later is ended.
void catch_stop_signals();
/// What is said then.
const char* stopped_text();
/// Of threads that end the program the first goes on; others wait for the end here.
void claim_the_end();

// One function a verb, each in the file of its name.
void add_bake(CLI::App& app, Console& console);
void add_carve(CLI::App& app, Console& console);
void add_check(CLI::App& app, Console& console);
void add_fit(CLI::App& app, Console& console);
void add_gallery(CLI::App& app, Console& console);
void add_info(CLI::App& app, Console& console);
void add_lod(CLI::App& app, Console& console);
void add_measure(CLI::App& app, Console& console);
void add_mesh(CLI::App& app, Console& console);
void add_relief(CLI::App& app, Console& console);
void add_render(CLI::App& app, Console& console);
void add_rock(CLI::App& app, Console& console);
void add_sample(CLI::App& app, Console& console);
void add_section(CLI::App& app, Console& console);
void add_shape(CLI::App& app, Console& console);
void add_voxelize(CLI::App& app, Console& console);

} // namespace taihu
