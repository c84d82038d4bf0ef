#pragma once
#include <string>

#include "stats/core/vec3.h"

namespace taihu {

/// A length as people type it: a number with m, cm, mm, um, vox or %; without a unit it is metres.
struct Length {
    enum class Unit { metre, voxel, percent };
    double value = 0;
    Unit unit = Unit::metre;
};

/// What relative lengths refer to [m]; 0 where there is no such thing.
struct Measure {
    double voxel_m = 0;
    double longest_m = 0; ///< of the solid, for percent
};

/// \param option  its name, for messages.
/// \throws Error bad_argument: no number, an unknown unit, not > 0, not in 1e-9..1e6 m or 1e-9..1e9
/// voxels or percent.
Length parse_length(const std::string& option, const std::string& text);

/// \throws Error bad_argument: a relative length where nothing is there to refer to.
double in_metres(const std::string& option, const Length& length, const Measure& of);

/// parse_length and in_metres in one.
double length_m(const std::string& option, const std::string& text, const Measure& of = {});

/// An angle as people type it [deg]: `25deg`, or `25`; -1e6..1e6.
/// \throws Error bad_argument: no number, another unit.
double angle_deg(const std::string& option, const std::string& text);

/// An amount of memory as people type it: `4GB`, `500MB`, or a number of bytes.
double memory_bytes(const std::string& option, const std::string& text);

/// `X`, or `X,Y,Z`, of lengths in metres; one number stands for all three.
Vec3 parse_size(const std::string& option, const std::string& text);

} // namespace taihu
