#include "stats/sample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr std::array<std::string_view, 3> kUnits = {"m", "px", "greatest"};

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_input, "sample: " + what);
}

void check_bins(const std::vector<Bin>& bins) {
    for (std::size_t i = 0; i < bins.size(); ++i) {
        const auto name = "bins[" + std::to_string(i) + "]";
        const Bin& bin = bins[i];
        if (!(bin.lo >= 0 && bin.lo < bin.hi && std::isfinite(bin.hi)))
            refuse(name + " is " + shortest(bin.lo) + ".." + shortest(bin.hi) +
                   "; edges must rise from 0 or more");
        if (i > 0 && bin.lo != bins[i - 1].hi)
            refuse(name + " begins at " + shortest(bin.lo) + " but the one before ends at " +
                   shortest(bins[i - 1].hi) + "; bins must touch, empty ones included");
    }
}

double smallest(const Sample& sample) {
    if (!sample.diameters.empty())
        return *std::min_element(sample.diameters.begin(), sample.diameters.end());
    return std::find_if(sample.bins.begin(), sample.bins.end(),
                        [](const Bin& bin) { return bin.count > 0; })
        ->lo;
}

void check_area(const std::string& name, double area) {
    if (!(area > 0 && std::isfinite(area)))
        refuse(name + " is " + shortest(area) + "; must be finite and > 0");
}

void check_limit(const std::string& name, double limit) {
    if (!(limit >= 0 && std::isfinite(limit)))
        refuse(name + " is " + shortest(limit) + "; must be finite and >= 0");
}

void check_frames(const Sample& sample) {
    if (sample.counting == Counting::whole && sample.frames.empty())
        refuse("whole profiles were counted but no window is known; give its frames");
    for (std::size_t i = 0; i < sample.frames.size(); ++i) {
        const auto name = "frames[" + std::to_string(i) + "]";
        const Frame& frame = sample.frames[i];
        check_area(name + ".area", frame.area);
        if (frame.detection_limit)
            check_limit(name + ".detection_limit", *frame.detection_limit);
        if (sample.counting == Counting::whole && !frame.window)
            refuse(name + " has no window although whole profiles were counted; give it");
    }
    if (sample.frames.empty() || !sample.area)
        return;
    double sum = 0;
    for (const Frame& frame : sample.frames)
        sum += frame.area;
    if (!(std::abs(sum - *sample.area) <= 1e-9 * sum))
        refuse("area is " + shortest(*sample.area) + " but that of the frames together is " +
               shortest(sum) + "; leave it out");
}

constexpr double kLeastLimit = 1e-9; // of the smallest profile

// check_sample's end: what needs the profiles to be sound.
double checked_limit(const Sample& sample) {
    double limit = sample.detection_limit.value_or(smallest(sample));
    if (!sample.frames.empty())
        limit = detection_limit(sample, sample.frames.front());
    for (const Frame& frame : sample.frames)
        limit = std::min(limit, detection_limit(sample, frame));
    if (limit > 0 && limit < kLeastLimit * smallest(sample))
        refuse("detection limit is " + shortest(limit) +
               ", less than a billionth of the smallest "
               "profile, " +
               shortest(smallest(sample)) + "; give a larger one, or 0");
    if (!(limit <= smallest(sample)))
        refuse("detection limit is " + shortest(limit) + " but the smallest profile is " +
               shortest(smallest(sample)) + "; the limit must be >= 0 and not above it");
    return limit;
}

} // namespace

std::string_view unit_name(LengthUnit unit) {
    return kUnits[static_cast<std::size_t>(unit)];
}

LengthUnit unit_from_name(std::string_view name) {
    const auto found = std::find(kUnits.begin(), kUnits.end(), name);
    if (found == kUnits.end())
        throw Error(Fault::bad_argument,
                    "unit: '" + printable(name) + "' is none; use m, px or greatest");
    return static_cast<LengthUnit>(found - kUnits.begin());
}

std::uint64_t n_profiles(const Sample& sample) {
    std::uint64_t n = sample.diameters.size();
    for (const Bin& bin : sample.bins)
        n += bin.count;
    return n;
}

std::optional<double> searched_area(const Sample& sample) {
    if (sample.frames.empty())
        return sample.area;
    double sum = 0;
    for (const Frame& frame : sample.frames)
        sum += frame.area;
    return sum;
}

double detection_limit(const Sample& sample, const Frame& frame) {
    if (frame.detection_limit)
        return *frame.detection_limit;
    return sample.detection_limit ? *sample.detection_limit : smallest(sample);
}

double detection_limit(const Sample& sample) {
    check_sample(sample);
    return checked_limit(sample);
}

void check_sample(const Sample& sample) {
    constexpr std::uint64_t kMost = 1'000'000'000;
    if (!sample.diameters.empty() && !sample.bins.empty())
        refuse("has diameters and bins; give one of them");
    for (std::size_t i = 0; i < sample.diameters.size(); ++i)
        if (!(sample.diameters[i] > 0 && std::isfinite(sample.diameters[i])))
            refuse("diameters[" + std::to_string(i) + "] is " + shortest(sample.diameters[i]) +
                   "; must be finite and > 0");
    check_bins(sample.bins);
    for (const Bin& bin : sample.bins)
        if (bin.count > kMost)
            refuse("a bin holds " + std::to_string(bin.count) + " profiles; at most 1e9 are taken");
    const std::uint64_t n = n_profiles(sample);
    if (n == 0)
        refuse("has no profiles; mark some holes");
    if (n > kMost)
        refuse("has " + std::to_string(n) + " profiles; at most 1e9 are taken");
    if (sample.area)
        check_area("area", *sample.area);
    if (sample.detection_limit)
        check_limit("detection limit", *sample.detection_limit);
    check_frames(sample);
    checked_limit(sample);
}

} // namespace taihu
