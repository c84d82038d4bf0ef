#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace taihu {

/// Numbers, and seeds, by what they stand for.
struct Counts {
    std::map<std::string, std::size_t> sums;
    std::map<std::string, std::vector<std::uint64_t>> refused, failed;
    NLOHMANN_DEFINE_TYPE_INTRUSIVE(Counts, sums, refused, failed)

    void add(const Counts& other);
    void print() const;
};

/// What is found of one case; failures are printed as they come.
class Recorder {
public:
    explicit Recorder(std::uint64_t seed) : seed_(seed) {}

    void add(const std::string& what, std::size_t n) { counts_.sums[what] += n; }
    /// Figures of `why` are dropped, so that alike ones are counted together.
    void refused(const std::string& why);
    void failed(const std::string& kind, const std::string& details);
    const Counts& counts() const { return counts_; }

private:
    std::uint64_t seed_;
    Counts counts_;
};

/// A case at random: an Error that it throws is a refusal, anything else a failure.
using Judge = std::function<void(std::uint64_t seed, Recorder& out)>;

/// Cases first .. first + n, so many at a time. Each is judged in a process of its own, of one
/// thread, which may crash or take longer than `longest_s` of processor time without harm to the
/// others: that is a failure, too.
Counts run_campaign(const Judge& judge, std::uint64_t first, std::uint64_t n, std::size_t n_jobs,
                    unsigned longest_s);

/// `PROGRAM N [FIRST [JOBS]]` runs a campaign and prints it; anything else the program's tests.
int campaign_main(int argc, char** argv, const Judge& judge, unsigned longest_s);

} // namespace taihu
