#pragma once
#include <span>
#include <string>
#include <vector>

#include "tools/gallery_manifest.h"

namespace taihu {

/// An entry with what its commands left: the table's cells are figures by now.
struct MadeEntry {
    GalleryEntry entry;
    std::vector<std::pair<int, int>> sizes; ///< of its pictures [pixels]
};

struct MadeText {
    GalleryText text; ///< without its entries
    std::vector<MadeEntry> entries;
};

/// Tells a page of ours from any other.
inline constexpr const char* kGalleryMark = "<meta name=\"generator\" content=\"taihu gallery\">";

/// The page: pictures lie in a folder of the row's name beside it. No script, and nothing from
/// elsewhere.
std::string format_gallery(std::span<const MadeText> texts);

} // namespace taihu
