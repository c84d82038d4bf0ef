#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "stats/core/image.h"

namespace taihu {

/// An OpenEXR picture with the names of its channels.
struct ExrImage {
    Image image;                       ///< linear, as many channels as there are names
    std::vector<std::string> channels; ///< such as Y, or R, G, B, A
    std::vector<std::pair<std::string, std::string>> attributes; ///< those that are text
};

enum class ExrSamples {
    full, ///< 32 bits, lossless
    half  ///< 16 bits: 11 significant ones, magnitudes from 6e-8 to 65504
};

/// Write a scanline EXR, ZIP compression. In one step, like write_file(); the same image gives the
/// same bytes.
/// \throws Error bad_argument: not as many different names as channels, a number that a half
///         cannot hold, or what OpenEXR refuses; io.
void write_exr(const std::filesystem::path& path, const ExrImage& exr,
               ExrSamples samples = ExrSamples::full);

/// An EXR of one part, scanlines or tiles, half, float or integer samples.
///
/// \param channels  which ones, in this order; empty: all that there are, by name.
/// \throws Error bad_input: not an EXR, cut short or damaged, more than 2^28 samples, more than its
///         bytes can unpack to, no such channel; unsupported: several parts, deep or subsampled
///         channels, DWA compression; io. Nothing is allocated on the word of a header alone.
ExrImage read_exr(const std::filesystem::path& path, std::span<const std::string> channels = {});

} // namespace taihu
