// The command `taihu`: verbs over files. Parses, calls, prints; the work is in the modules.
#include <cerrno>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <system_error>
#include <unistd.h>

#include <openvdb/openvdb.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"
#include "tools/console.h"
#include "tools/verbs.h"

namespace taihu {
namespace {

enum Exit { kDone = 0, kFailed = 1, kUsage = 2, kBug = 70, kSignalled = 128 };

int fail(int code, const std::string& message) {
    std::fprintf(stderr, "%s\n", error_line(message).c_str());
    return code;
}

/// What an exception that is none of ours means. Memory runs out, and threads cannot be started,
/// anywhere: in OpenVDB, in TBB's own threads.
int fail_foreign(const std::exception& e) {
    const std::string what = e.what();
    if (dynamic_cast<const std::bad_alloc*>(&e))
        return fail(kFailed,
                    "out of memory; use a larger voxel, fewer holes or smaller files, or a greater "
                    "--memory");
    if (what.starts_with("pthread_create") || dynamic_cast<const std::system_error*>(&e))
        return fail(kFailed,
                    what + "; check paths and rights, free memory, or use fewer --threads");
    return fail(kBug, "internal error: " + what + "; please report it");
}

/// The end of a run that went well, if all that was printed arrived. A reader may close its pipe.
int end(int code) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0)
        return code;
    return errno == EPIPE ? code : fail(kFailed, "stdout: cannot write; check where it goes");
}

/// For what is thrown where nobody can catch it, as in a thread of TBB that cannot start another.
[[noreturn]] void on_terminate() {
    claim_the_end();
    int code = kBug;
    try {
        discard_temporaries();
        std::rethrow_exception(std::current_exception());
    } catch (const std::exception& e) {
        code = fail_foreign(e);
    } catch (...) {
        fail(kBug, "internal error: an exception of unknown kind; please report it");
    }
    ::_exit(code);
}

const CLI::App* find_verb(const CLI::App& app, int argc, char** argv) {
    for (const CLI::App* verb : app.get_subcommands(nullptr))
        if (argc > 1 && verb->get_name() == argv[1])
            return verb;
    return nullptr;
}

std::vector<std::string_view> verb_names(const CLI::App& app, std::vector<std::string>& storage) {
    for (const CLI::App* verb : app.get_subcommands(nullptr))
        storage.push_back(verb->get_name());
    return {storage.begin(), storage.end()};
}

/// The first argument that no option of the verb knows, with the nearest that it does know.
std::optional<std::string> unknown_option(const CLI::App& app, int argc, char** argv) {
    const CLI::App* verb = find_verb(app, argc, argv);
    if (!verb)
        return std::nullopt;
    std::vector<std::string> names;
    for (const CLI::Option* option : verb->get_options())
        for (const std::string& name : option->get_lnames())
            names.push_back("--" + name);
    const std::vector<std::string_view> known(names.begin(), names.end());
    for (int i = 2; i < argc; ++i) {
        const std::string_view argument(argv[i]);
        const std::string_view name = argument.substr(0, argument.find('='));
        if (name.starts_with("--") && name.size() > 2 &&
            std::find(known.begin(), known.end(), name) == known.end())
            return std::string(verb->get_name()) + ": unknown option '" + printable(name) + "'" +
                   did_you_mean(name, known);
    }
    return std::nullopt;
}

/// Every number that was given is finite: CLI11 reads nan, which is in all its ranges.
void check_numbers(const CLI::App& verb) {
    for (const CLI::Option* option : verb.get_options()) {
        const std::string type = option->get_type_name();
        if (!type.starts_with("FLOAT") && !type.starts_with("INT") && !type.starts_with("UINT"))
            continue;
        for (const std::string& text : option->reduced_results())
            if (const auto value = parse_number(text); !value)
                throw Error(Fault::bad_argument,
                            verb.get_name() + ": " + option->get_name() + " is '" +
                                printable(text) + "', must be a finite number" +
                                type.substr(std::min(type.find(" in "), type.size())));
    }
}

/// CLI11's own complaints, as one line of ours.
int usage_error(const CLI::App& app, int argc, char** argv, const CLI::ParseError& error) {
    if (const auto unknown = unknown_option(app, argc, argv))
        return fail(kUsage, *unknown);
    const bool has_verb = find_verb(app, argc, argv) != nullptr;
    if (!has_verb && argc > 1) {
        std::vector<std::string> storage;
        return fail(kUsage, "unknown verb '" + printable(argv[1]) + "'" +
                                did_you_mean(argv[1], verb_names(app, storage)) +
                                (std::string(" (taihu --help lists them)")));
    }
    return fail(kUsage, std::string(has_verb ? argv[1] : "taihu") + ": " + error.what());
}

int run(int argc, char** argv) {
    CLI::App app("Rocks full of holes: measured on photos, carved as sparse volumes, meshed and "
                 "certified",
                 "taihu");
    app.set_version_flag("--version", "taihu " TAIHU_VERSION);
    app.require_subcommand(1);
    app.get_formatter()->column_width(34);
    app.footer("\nLengths take units: 0.5m, 12mm, 2vox, 25%. `taihu VERB --help` explains a verb.");
    Console console;
    add_verbs(app, console);
    if (argc < 2) {
        std::fputs(app.help().c_str(), stderr);
        return kUsage;
    }
    catch_stop_signals();
    std::optional<TerminalProgress> progress;
    // Between parsing and the verb's callback, options are known: set up what they ask for.
    for (CLI::App* verb : app.get_subcommands(nullptr))
        verb->parse_complete_callback([&, verb] {
            progress.emplace(!console.quiet && ::isatty(STDERR_FILENO));
            console.progress = &*progress;
            openvdb::initialize();
            check_numbers(*verb);
        });
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp& e) {
        return end(app.exit(e));
    } catch (const CLI::CallForVersion& e) {
        return end(app.exit(e));
    } catch (const CLI::RuntimeError& e) { // a verb's own exit code, such as check's 3
        progress.reset();
        console.show_said();
        return end(e.get_exit_code());
    } catch (const CLI::ParseError& e) {
        return usage_error(app, argc, argv, e);
    } catch (const Error& e) {
        progress.reset();
        claim_the_end();
        if (e.fault() == Fault::cancelled && stop_signal() != 0)
            return fail(kSignalled + stop_signal(), stopped_text());
        return fail(e.fault() == Fault::bad_argument ? kUsage : kFailed, e.what());
    } catch (const std::exception& e) {
        progress.reset();
        claim_the_end();
        return fail_foreign(e);
    }
    progress.reset();
    console.show_said();
    return end(kDone);
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    std::set_terminate(taihu::on_terminate);
    return taihu::run(argc, argv);
}
