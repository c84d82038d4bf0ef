#pragma once
#include <filesystem>

#include "stats/core/image.h"

namespace taihu {

/// A PNG as a mask: one channel, 1 where it is brighter than middle grey, else 0. Colours count by
/// their brightness, what is transparent is outside.
/// \throws Error io: as read_file; bad_input: no PNG, damaged, more than 2^28 pixels, or more than
///         its bytes can hold.
Image read_photo_mask(const std::filesystem::path& path);

} // namespace taihu
