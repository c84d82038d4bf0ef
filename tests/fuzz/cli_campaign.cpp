// cli_campaign PROGRAM [N [SEED [quick]]]: every option of every verb that takes a value, with
// values that must not do harm, then N command lines (1,000) damaged at random. Prints what became
// of them; exits with 1 when one crashed, took over 10 s or 1 GB, or was refused in anything but
// one short line, or a number that is none was not refused by the option's name.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "stats/core/file.h"
#include "stats/core/rng.h"
#include "stats/core/text.h"
#include "tests/fuzz/formats.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

using Words = std::vector<std::string>;
namespace fs = std::filesystem;

constexpr int kMostSeconds = 10;
constexpr long kMostKilobytes = 1 << 20;

/// Cheap jobs that end well, each of a verb.
constexpr const char* kJobs[] = {
    "fit marks.csv -o law.json",
    "sample bare.json --in base.vdb --scale 10% --count 5 -o o.csv",
    "shape boulder --subdivisions 1 -o o.ply",
    "shape fractal-rock --iterations 1 -o o.ply",
    "voxelize base.ply --dim 16 -o o.vdb",
    "carve base.ply --dim 16 --holes holes.csv -o o.vdb",
    "rock recipe.json --dim 16 -o o.vdb",
    "mesh base.vdb -o o.ply",
    "lod base.vdb --levels 2 -o o.glb",
    "bake base.vdb --levels 1 --size 64 --ao-rays 1 -o o.glb",
    "check base.ply",
    "measure base.vdb",
    "section base.vdb --planes 2 -o o.csv",
    "relief fractal --size 9 -o o.exr",
    "render base.ply --size 16x16 --samples 1 -o o.png",
    "info base.ply",
    "gallery --list"}; // the last: without its second word it works for minutes

const Words kValues = {"nan",
                       "inf",
                       "-inf",
                       "-1",
                       "-0",
                       "0",
                       "1e-320",
                       "1e-30",
                       "1e30",
                       "1e308",
                       "1e400",
                       "9223372036854775807",
                       "18446744073709551616",
                       "0x10",
                       "1,5",
                       "",
                       "word",
                       "\x1b[31m\n",
                       std::string(5000, 'x')};

bool is_no_number(const std::string& value) {
    return value == "nan" || value.ends_with("inf") || value == "1e400" || value.empty() ||
           value == "word" || value.size() > 1000;
}

struct Ran {
    int status = 0;
    double seconds = 0; ///< of processor time
    long kilobytes = 0;
    std::string out, err;
};

std::string all_of(int file) {
    std::string text(static_cast<std::size_t>(std::min<off_t>(::lseek(file, 0, SEEK_END), 1 << 20)),
                     '\0');
    const ssize_t n = ::pread(file, text.data(), text.size(), 0);
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
    ::close(file);
    return text;
}

/// A program in a folder, killed a little after the processor time that it may take.
Ran run(const std::string& program, const Words& words, const fs::path& folder) {
    const int out = ::memfd_create("out", MFD_CLOEXEC), err = ::memfd_create("err", MFD_CLOEXEC);
    std::vector<char*> argv = {const_cast<char*>("taihu")};
    for (const std::string& word : words)
        argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    const auto begin = std::chrono::steady_clock::now();
    const pid_t pid = ::fork();
    if (pid == 0) {
        const rlimit no_core{0, 0}, file{256 << 20, 256 << 20},
            time{kMostSeconds + 2, kMostSeconds + 2};
        ::setrlimit(RLIMIT_CPU, &time);
        ::setrlimit(RLIMIT_CORE, &no_core);
        ::setrlimit(RLIMIT_FSIZE, &file);
        if (::chdir(folder.c_str()) != 0)
            ::_exit(99);
        ::dup2(out, STDOUT_FILENO);
        ::dup2(err, STDERR_FILENO);
        ::execv(program.c_str(), argv.data());
        ::_exit(99);
    }
    Ran ran;
    rusage usage{};
    const auto seconds = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    while (::wait4(pid, &ran.status, WNOHANG, &usage) == 0) {
        if (seconds() > 12 * kMostSeconds) // it waits for something
            ::kill(pid, SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    ran.seconds = double(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec);
    ran.kilobytes = usage.ru_maxrss;
    ran.out = all_of(out);
    ran.err = all_of(err);
    return ran;
}

enum Fate { done, said_no, failed, usage, crash, slow, big, unclear, unnamed, refused, kFates };
constexpr std::array<const char*, kFates> kFateNames = {
    "done", "said no", "failed", "usage", "crash", "slow", "big", "unclear", "unnamed", "refused"};

bool is_one_line(const Ran& ran) {
    return ran.err.starts_with("taihu: ") && ran.err.size() <= kMostErrorBytes + 1 &&
           ran.err.find('\n') == ran.err.size() - 1 && ran.out.empty() &&
           printable(ran.err, ran.err.size()) == ran.err.substr(0, ran.err.size() - 1) + "\\x0a";
}

/// \param option  that a refusal must name; empty: none.
Fate fate_of(const Ran& ran, const std::string& option) {
    if (ran.seconds > kMostSeconds || (WIFSIGNALED(ran.status) && WTERMSIG(ran.status) == SIGKILL))
        return slow;
    if (ran.kilobytes > kMostKilobytes)
        return big;
    const int code = WIFEXITED(ran.status) ? WEXITSTATUS(ran.status) : -1;
    if (code == 0)
        return option.empty() ? done : unnamed;
    if (code == 3)
        return said_no;
    if (code != 1 && code != 2)
        return crash;
    if (!is_one_line(ran))
        return unclear;
    if (!option.empty() && (code != 2 || ran.err.find(option) == std::string::npos))
        return unnamed;
    return code == 1 ? failed : usage;
}

Words split(const std::string& text) {
    std::istringstream in(text);
    Words words;
    for (std::string word; in >> word;)
        words.push_back(word);
    return words;
}

struct Option {
    std::string name;
    bool number = false; ///< FLOAT, INT or UINT
};

/// Those of a verb that take a value, by its help.
std::vector<Option> options_of(const std::string& program, const std::string& verb) {
    std::vector<Option> options; // but --stages, whose nine stages are work
    std::istringstream help(run(program, {verb, "--help"}, ".").out);
    for (std::string line; std::getline(help, line);) {
        const std::size_t dashes = line.find("--");
        if (!line.starts_with("  -") || dashes == std::string::npos)
            continue;
        const Words words = split(line.substr(dashes));
        if (words.size() < 2)
            continue;
        const std::string type = words[1].substr(0, words[1].find_first_of(":="));
        const bool number = type == "FLOAT" || type == "INT" || type == "UINT";
        if ((number || type == "TEXT") && words[0] != "--stages")
            options.push_back({words[0].substr(0, words[0].find(',')), number});
    }
    return options;
}

struct Trial {
    Words words;
    std::string must_name = {}; ///< the option that a refusal has to name
    bool must_work = false;
};

/// The job with an option set, in place of what it had.
Words with(const Words& job, const std::string& option, const Words& value) {
    Words words = job;
    const auto at = std::find(words.begin(), words.end(), option);
    if (at != words.end())
        words.erase(at, at + 2);
    words.push_back(option);
    words.insert(words.end(), value.begin(), value.end());
    return words;
}

/// \param quick  numbers alone, and what is none for them.
std::vector<Trial> systematic(const std::string& program, bool quick) {
    const Words values = quick ? Words{"nan", "word"} : kValues;
    std::vector<Trial> trials;
    for (const char* text : kJobs) {
        const Words job = split(text);
        trials.push_back({job, "", true});
        for (const Option& option : options_of(program, job.front())) {
            if (quick && !option.number)
                continue;
            trials.push_back({with(job, option.name, {}), option.name});
            for (const std::string& value : values)
                trials.push_back({with(job, option.name, {value}),
                                  option.number && is_no_number(value) ? option.name : ""});
        }
    }
    return trials;
}

/// A job with one to four damages: words dropped, doubled, exchanged or replaced.
Words damaged(const std::string& program, std::uint64_t seed, std::uint64_t item) {
    static std::map<std::string, std::vector<Option>> known;
    const Rng rng{seed, 0x636c69};
    std::uint32_t draw = 0;
    const auto below = [&](std::size_t n) { return rng.words(item, draw++)[0] % n; };
    Words words = split(kJobs[below(std::size(kJobs) - 1)]);
    const std::string verb = words.front();
    if (!known.contains(verb))
        known[verb] = options_of(program, verb);
    for (std::size_t n = 1 + below(4); n > 0; --n) {
        const std::size_t at = below(words.size());
        switch (below(6)) {
        case 0:
            if (words.size() > 1) // no words at all ask for help
                words.erase(words.begin() + static_cast<std::ptrdiff_t>(at));
            break;
        case 1:
            words.insert(words.begin() + static_cast<std::ptrdiff_t>(below(words.size())),
                         words[at]);
            break;
        case 2:
            std::swap(words[at], words[below(words.size())]);
            break;
        case 3:
            words[at] = kValues[below(kValues.size())];
            break;
        default:
            if (!known[verb].empty()) {
                words.push_back(known[verb][below(known[verb].size())].name);
                words.push_back(kValues[below(kValues.size())]);
            }
        }
    }
    return words;
}

void make_files(const fs::path& folder) {
    const auto put = [&](const char* name, const std::string& bytes) {
        std::ofstream(folder / name, std::ios::binary) << bytes;
    };
    put("base.ply", ply_bases().front());
    put("base.vdb", vdb_bases().front());
    put("holes.csv", holes_bases().front());
    put("bare.json", law_bases()[1]);
    put("recipe.json", recipe_bases().front());
    put("marks.csv", table_bases()[1]);
}

/// All trials, two at a time. \return how many ended how.
std::array<std::size_t, kFates> try_all(const std::string& program,
                                        const std::vector<Trial>& trials, const fs::path& files) {
    std::array<std::size_t, kFates> counts{};
    std::array<int, kFates> shown{};
    std::atomic<std::size_t> next{0};
    std::mutex printing;
    const auto work = [&] {
        for (std::size_t i = next++; i < trials.size(); i = next++) {
            const Scratch folder;
            fs::copy(files, folder.path());
            const Ran ran = run(program, trials[i].words, folder.path());
            Fate fate = fate_of(ran, trials[i].must_name);
            if (trials[i].must_work && fate < crash && fate != done)
                fate = refused;
            const std::lock_guard lock(printing);
            ++counts[fate];
            if (fate < crash || shown[fate]++ >= 25)
                continue;
            std::string line;
            for (const std::string& word : trials[i].words)
                line += " '" + printable(word, 30) + "'";
            std::printf("  %s (status %d, %.1f s, %ld kB):%s\n      %s\n", kFateNames[fate],
                        ran.status, ran.seconds, ran.kilobytes, line.c_str(),
                        printable(ran.err + ran.out, 400).c_str());
            std::fflush(stdout);
        }
    };
    std::thread other(work);
    work();
    other.join();
    return counts;
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    using namespace taihu;
    if (argc < 2) {
        std::fprintf(stderr, "usage: cli_campaign PROGRAM [N [SEED [quick]]]\n");
        return 2;
    }
    const std::string program = fs::absolute(argv[1]).string();
    const std::uint64_t n = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1000,
                        seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
    const bool quick = argc > 4 && std::string_view(argv[4]) == "quick";
    const Scratch files;
    make_files(files.path());
    std::vector<Trial> random;
    for (std::uint64_t item = 0; item < n; ++item)
        random.push_back({damaged(program, seed, item), ""});
    std::size_t n_wrong = 0;
    for (const auto& [name, trials] :
         {std::pair("options", systematic(program, quick)), std::pair("random", random)}) {
        const auto counts = try_all(program, trials, files.path());
        std::printf("%s:", name);
        for (std::size_t f = 0; f < kFates; ++f)
            std::printf(" %zu %s%s", counts[f], kFateNames[f], f + 1 < kFates ? "," : "\n");
        for (std::size_t f = crash; f < kFates; ++f)
            n_wrong += counts[f];
        if (!trials.empty() && counts[usage] == 0)
            ++n_wrong; // nothing was tried
    }
    return n_wrong == 0 ? 0 : 1;
}
