#pragma once
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "stats/window.h"

namespace taihu {

/// The unit of a length that was measured on a picture or on a thing.
enum class LengthUnit {
    metre,   ///< "m"
    pixel,   ///< "px": no scale is known
    greatest ///< "greatest": scaled so that the greatest diameter is 1
};

/// `m`, `px`, `greatest`: the word used in files.
std::string_view unit_name(LengthUnit unit);

/// The unit of that name.
/// \throws Error bad_argument, with the names there are.
LengthUnit unit_from_name(std::string_view name);

/// How many profiles have a diameter in (lo, hi].
struct Bin {
    double lo = 0, hi = 0;
    std::uint64_t count = 0;
    friend constexpr bool operator==(const Bin&, const Bin&) = default;
};

/// Which profiles of a picture were marked.
enum class Counting {
    centre, ///< those with their centre in the window; measured to their end outside of it too
    whole   ///< those that lie wholly in the window: great ones are missed more often
};

/// One of several pictures whose profiles are one sample.
struct Frame {
    double area = 0;                       ///< of the surface that was searched [unit^2], > 0
    std::optional<double> detection_limit; ///< of this picture [unit]; else that of the sample
    std::optional<Window> window;          ///< needed for Counting::whole [unit]
};

/// Profiles (sections of holes) as they were measured on a surface: one diameter each, or counts.
struct Sample {
    std::vector<double> diameters; ///< > 0; empty when `bins` is used
    std::vector<Bin> bins;         ///< rising and contiguous; empty when `diameters` is used
    LengthUnit unit = LengthUnit::metre;
    /// Of the surface that was searched [unit^2], > 0. With frames: nothing, or their sum.
    std::optional<double> area;
    /// Nothing smaller was marked [unit], >= 0. Nothing given: the smallest diameter marked, or the
    /// lower edge of the first filled bin.
    std::optional<double> detection_limit;
    std::vector<Frame> frames; ///< or none: one surface without an edge
    Counting counting = Counting::centre;
};

/// Number of profiles.
std::uint64_t n_profiles(const Sample& sample);

/// The area searched, in all frames together; nothing when it is unknown.
std::optional<double> searched_area(const Sample& sample);

/// The detection limit of the sample, given or by default; of frames the smallest.
/// \throws Error as check_sample does.
double detection_limit(const Sample& sample);
/// That of one frame of a sound sample: its own, or that of the sample, given or by default.
double detection_limit(const Sample& sample, const Frame& frame);

/// \throws Error bad_input: no profiles, or both diameters and bins; a diameter not finite and > 0;
///         bins that do not touch, overlap or run backwards; more than 1e9 profiles; an area that
///         is not > 0, or not the sum of the frames; a detection limit below 0 or above the
///         smallest profile; Counting::whole with a frame that has no window, or without frames.
void check_sample(const Sample& sample);

} // namespace taihu
