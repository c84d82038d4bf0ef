#include "tests/support/campaign.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr std::size_t kReported = 100; ///< cases, after which all is printed that was found
constexpr std::size_t kMostSeeds = 20; ///< that are printed of a kind

struct Job {
    std::uint64_t seed = 0;
    int from = 0; ///< what it says at its end
};

Counts judged(const Judge& judge, std::uint64_t seed) {
    Recorder out(seed);
    try {
        judge(seed, out);
    } catch (const Error& e) {
        out.refused(e.what());
    } catch (const std::exception& e) {
        out.failed("another exception", e.what());
    }
    return out.counts();
}

pid_t start(const Judge& judge, Job& job, unsigned longest_s) {
    int ends[2];
    if (pipe(ends) != 0)
        throw std::runtime_error("no pipe");
    const pid_t child = fork();
    if (child < 0)
        throw std::runtime_error("no process");
    job.from = ends[0];
    if (child > 0) {
        close(ends[1]);
        return child;
    }
    const rlimit limit{longest_s, longest_s};
    setrlimit(RLIMIT_CPU, &limit);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const std::string found = nlohmann::json(judged(judge, job.seed)).dump();
    // Far less than a pipe holds without a reader.
    const bool told = write(ends[1], found.data(), found.size()) == ssize_t(found.size());
    _exit(told ? 0 : 1);
}

Counts finished(const Job& job, int status, unsigned longest_s) {
    std::string text;
    char part[4096];
    for (ssize_t n; (n = read(job.from, part, sizeof part)) > 0;)
        text.append(part, static_cast<std::size_t>(n));
    close(job.from);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
        return nlohmann::json::parse(text).get<Counts>();
    Recorder out(job.seed);
    const int by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (by == SIGXCPU || by == SIGKILL)
        out.failed("too long", "more than " + std::to_string(longest_s) + " s");
    else
        out.failed("crash", "signal " + std::to_string(by));
    return out.counts();
}

void print_seeds(const char* what,
                 const std::map<std::string, std::vector<std::uint64_t>>& by_kind) {
    for (const auto& [kind, seeds] : by_kind) {
        std::printf("%s %zu: %s: seeds", what, seeds.size(), kind.c_str());
        for (std::size_t i = 0; i < std::min(seeds.size(), kMostSeeds); ++i)
            std::printf(" %llu", static_cast<unsigned long long>(seeds[i]));
        std::printf("%s\n", seeds.size() > kMostSeeds ? " ..." : "");
    }
}

} // namespace

void Counts::add(const Counts& other) {
    for (const auto& [name, n] : other.sums)
        sums[name] += n;
    for (const auto& [what, seeds] : other.refused)
        refused[what].insert(refused[what].end(), seeds.begin(), seeds.end());
    for (const auto& [what, seeds] : other.failed)
        failed[what].insert(failed[what].end(), seeds.begin(), seeds.end());
}

void Counts::print() const {
    for (const auto& [what, n] : sums)
        std::printf("%12zu %s\n", n, what.c_str());
    print_seeds("refused", refused);
    print_seeds("FAILED", failed);
    std::fflush(stdout);
}

void Recorder::refused(const std::string& why) {
    std::string kind;
    for (const char c : why) {
        const bool figure =
            (c >= '0' && c <= '9') || (c == '.' && !kind.empty() && kind.back() == '#');
        if (!figure)
            kind += c;
        else if (kind.empty() || kind.back() != '#')
            kind += '#';
    }
    counts_.refused[kind] = {seed_};
}

void Recorder::failed(const std::string& kind, const std::string& details) {
    counts_.failed[kind] = {seed_};
    std::printf("case %llu: %s: %s\n", static_cast<unsigned long long>(seed_), kind.c_str(),
                details.c_str());
    std::fflush(stdout);
}

Counts run_campaign(const Judge& judge, std::uint64_t first, std::uint64_t n, std::size_t n_jobs,
                    unsigned longest_s) {
    Counts counts;
    std::map<pid_t, Job> running;
    for (std::uint64_t seed = first; seed < first + n || !running.empty();) {
        if (seed < first + n && running.size() < n_jobs) {
            Job job{seed++};
            const pid_t child = start(judge, job, longest_s);
            running[child] = job;
            continue;
        }
        int status = 0;
        const pid_t child = wait(&status);
        if (running.count(child) == 0)
            throw std::runtime_error("no child process to wait for");
        counts.add(finished(running.at(child), status, longest_s));
        running.erase(child);
        if (++counts.sums["cases"] % kReported == 0)
            counts.print();
    }
    return counts;
}

int campaign_main(int argc, char** argv, const Judge& judge, unsigned longest_s) {
    if (argc < 2 || argc > 4 || argv[1][0] == '-') {
        testing::InitGoogleTest(&argc, argv);
        return RUN_ALL_TESTS();
    }
    const auto number = [&](int i, std::uint64_t otherwise) {
        return i < argc ? std::strtoull(argv[i], nullptr, 10) : otherwise;
    };
    const Counts counts = run_campaign(judge, number(2, 0), number(1, 0),
                                       std::max<std::size_t>(1, number(3, 2)), longest_s);
    counts.print();
    return !counts.failed.empty();
}

} // namespace taihu
