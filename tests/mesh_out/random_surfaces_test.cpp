// Recipes at random as chains of levels, each level judged by CGAL and by the recipe's own formula.
// `random_surfaces N [FIRST [JOBS]]` makes N of them, so many at a time, and prints what it saw,
// with the seeds of all that failed; the test makes a fixed few. Each is made in a process of its
// own, which may crash or take too long without harm to the others.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include "mesh_out/lod.h"
#include "stats/core/error.h"
#include "tests/bench/ratio.h"
#include "tests/support/bound_check.h"
#include "tests/support/cgal_oracle.h"
#include "tests/support/random_recipe.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {
namespace {

constexpr double kVoxel = 2.0 / 64; // 64 voxels across
constexpr int kLevels = 3;
constexpr rlim_t kLongest_s = 100; // of processor time; most take one

constexpr std::size_t kReported = 100; ///< recipes, after which all is printed that was found

/// Numbers, and seeds, by what they stand for.
struct Counts {
    std::map<std::string, std::size_t> sums;
    std::map<std::string, std::vector<std::uint64_t>> refused, failed;
    NLOHMANN_DEFINE_TYPE_INTRUSIVE(Counts, sums, refused, failed)

    void add(const Counts& other) {
        for (const auto& [name, n] : other.sums)
            sums[name] += n;
        for (const auto& [what, seeds] : other.refused)
            refused[what].insert(refused[what].end(), seeds.begin(), seeds.end());
        for (const auto& [what, seeds] : other.failed)
            failed[what].insert(failed[what].end(), seeds.begin(), seeds.end());
    }
};

/// What is found of one recipe; failures are printed as they come.
class Recorder {
public:
    explicit Recorder(std::uint64_t seed) : seed_(seed) {}

    void add(const char* what, std::size_t n) { counts_.sums[what] += n; }
    void refused(const std::string& why) { counts_.refused[why] = {seed_}; }
    void failed(const std::string& kind, const std::string& details) {
        counts_.failed[kind] = {seed_};
        std::printf("recipe %llu: %s: %s\n", static_cast<unsigned long long>(seed_), kind.c_str(),
                    details.c_str());
        std::fflush(stdout);
    }
    const Counts& counts() const { return counts_; }

private:
    std::uint64_t seed_;
    Counts counts_;
};

void judge_topology(const LodLevel& level, const TriMesh& mesh, const std::string& where,
                    Recorder& out) {
    const CgalVerdict cgal = cgal_verdict(mesh);
    if (!cgal.manifold)
        out.failed("not 2-manifold", where);
    else if (!cgal.closed)
        out.failed("not closed", where);
    if (cgal.n_degenerate > 0)
        out.failed("degenerate faces", where + ": " + std::to_string(cgal.n_degenerate));
    if (cgal.n_self_intersections > 0)
        out.failed("self-intersections", where + ": " + std::to_string(cgal.n_self_intersections));
    else if (cgal.closed && !cgal.bounds_volume)
        out.failed("not outward", where);
    const Certificate& c = level.certificate;
    if (!c.holds() || (c.n_self_intersections > 0) != (cgal.n_self_intersections > 0))
        out.failed("certificate against CGAL", where);
}

std::string shown(const OffBound& off) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "%zu samples (%zu where it is thinner than a voxel), %.2f "
                  "times the bound at (%.5f, %.5f, %.5f)",
                  off.n, off.n_thin, off.worst_rel, off.worst.x, off.worst.y, off.worst.z);
    return text;
}

void judge_bound(const LodLevel& level, const std::vector<Sphere>& unseen, const TriMesh& mesh,
                 const BoundCheck& check, const std::string& where, Recorder& out) {
    std::vector<Sphere> named;
    for (const UnresolvedPlace& place : level.unresolved)
        named.push_back({place.center, place.radius_m + level.bound_m});
    for (const Sphere& closed : level.closed)
        named.push_back({closed.center, closed.radius_m + level.bound_m});
    for (const Sphere& place : unseen)
        named.push_back({place.center, place.radius_m + level.bound_m});
    const BoundVerdict verdict = check.judge(mesh, level.bound_m, named);
    out.add("samples", verdict.n_samples);
    out.add("samples named", verdict.n_named);
    out.add("samples undecided", verdict.n_unclear);
    out.add("places", named.size());
    const auto tell = [&](const OffBound& off, const std::string& what) {
        if (off.n > 0)
            out.failed(what + (off.n == off.n_thin ? ", all of it thin" : ""),
                       where + ": " + shown(off));
    };
    tell(verdict.mesh, "mesh beyond its bound");
    tell(verdict.surface, "surface beyond the bound");
    if (level.error_m > level.bound_m)
        out.failed("stated error above the bound", where);
}

/// An error without its figures, so that alike ones are counted together.
std::string kind_of(const std::string& message) {
    std::string kind;
    for (const char c : message) {
        const bool figure =
            (c >= '0' && c <= '9') || (c == '.' && !kind.empty() && kind.back() == '#');
        if (!figure)
            kind += c;
        else if (kind.empty() || kind.back() != '#')
            kind += '#';
    }
    return kind;
}

std::size_t milliseconds(double s) {
    return static_cast<std::size_t>(1000 * s);
}

Counts run_recipe(std::uint64_t seed) {
    Recorder out(seed);
    const double start_s = processor_s();
    try {
        const RandomRecipe recipe = random_recipe(seed, kVoxel);
        const std::string where = "recipe";
        const RecipeSolid solid = make_recipe(recipe.text, where, {});
        const LodChain chain =
            make_lods(*solid.solid, solid.field.get(),
                      {.levels = bounds_by_factor(kLevels, 0.25 * kVoxel, 2), .openness = false});
        const double made_s = processor_s();
        out.add("ms of making", milliseconds(made_s - start_s));
        const BoundCheck check(recipe.distance_m, bounds(chain.levels[0].encoded.decoded), kVoxel);
        out.add("short chains", !chain.note.empty());
        for (std::size_t j = 0; j < chain.levels.size(); ++j) {
            const LodLevel& level = chain.levels[j];
            const TriMesh mesh = decode_draco(level.encoded.draco, where);
            const std::string which = "level " + std::to_string(j);
            judge_topology(level, mesh, which, out);
            judge_bound(level, chain.unseen, mesh, check, which, out);
            out.add("levels", 1);
            out.add("triangles", mesh.triangles.size());
        }
        out.add("ms of judging", milliseconds(processor_s() - made_s));
        out.add("chains", 1);
        out.add("chains that hold", out.counts().failed.empty());
    } catch (const Error& e) { // in place of a mesh; parts that do not meet leave none
        out.refused(kind_of(e.what()));
    } catch (const std::exception& e) {
        out.failed("another exception", e.what());
    }
    return out.counts();
}

struct Job {
    std::uint64_t seed = 0;
    int from = 0; ///< what it says at its end
};

/// run_recipe() in a process of its own, of one thread.
pid_t start(Job& job) {
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
    const rlimit limit{kLongest_s, kLongest_s};
    setrlimit(RLIMIT_CPU, &limit);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const std::string found = nlohmann::json(run_recipe(job.seed)).dump();
    // Far less than a pipe holds without a reader.
    const bool told = write(ends[1], found.data(), found.size()) == ssize_t(found.size());
    _exit(told ? 0 : 1);
}

Counts finished(const Job& job, int status) {
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
        out.failed("too long", "more than " + std::to_string(kLongest_s) + " s");
    else
        out.failed("crash", "signal " + std::to_string(by));
    return out.counts();
}

void print_seeds(const char* what,
                 const std::map<std::string, std::vector<std::uint64_t>>& by_kind) {
    for (const auto& [kind, seeds] : by_kind) {
        std::printf("%s %zu: %s: seeds", what, seeds.size(), kind.c_str());
        for (std::size_t i = 0; i < std::min<std::size_t>(seeds.size(), 20); ++i)
            std::printf(" %llu", static_cast<unsigned long long>(seeds[i]));
        std::printf("%s\n", seeds.size() > 20 ? " ..." : "");
    }
}

void print(const Counts& counts) {
    for (const auto& [what, n] : counts.sums)
        std::printf("%12zu %s\n", n, what.c_str());
    print_seeds("refused", counts.refused);
    print_seeds("FAILED", counts.failed);
}

Counts run_recipes(std::uint64_t first, std::uint64_t n, std::size_t n_jobs) {
    Counts counts;
    std::map<pid_t, Job> running;
    for (std::uint64_t seed = first; seed < first + n || !running.empty();) {
        if (seed < first + n && running.size() < n_jobs) {
            Job job{seed++};
            const pid_t child = start(job);
            running[child] = job;
            continue;
        }
        int status = 0;
        const pid_t child = wait(&status);
        if (running.count(child) == 0)
            throw std::runtime_error("no child process to wait for");
        counts.add(finished(running.at(child), status));
        running.erase(child);
        if (++counts.sums["recipes"] % kReported == 0)
            print(counts);
    }
    return counts;
}

TEST(RandomSurfaces, AreClosedManifoldUncrossedAndNowhereBeyondTheirBounds) {
    const Counts counts = run_recipes(0, 5, 2);
    print(counts);
    EXPECT_EQ(counts.sums.at("chains"), 5u);
    EXPECT_TRUE(counts.failed.empty());
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    openvdb::initialize();
    if (argc >= 2 && argc <= 4 && argv[1][0] != '-') {
        const auto number = [&](int i, std::uint64_t otherwise) {
            return i < argc ? std::strtoull(argv[i], nullptr, 10) : otherwise;
        };
        const taihu::Counts counts =
            taihu::run_recipes(number(2, 0), number(1, 0), std::max<std::size_t>(1, number(3, 2)));
        taihu::print(counts);
        return !counts.failed.empty();
    }
    testing::InitGoogleTest(&argc, argv);
    return RUN_ALL_TESTS();
}
