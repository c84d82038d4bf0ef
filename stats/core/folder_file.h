#pragma once
#include <filesystem>
#include <optional>
#include <string_view>

namespace taihu {

/// Whether a name that a file gives can only mean a file in one folder: 1 to 255 bytes of UTF-8
/// without slashes or control characters, and neither `.` nor `..`. So no path, no URL.
bool is_plain_name(std::string_view name);

/// The regular file of this name in `folder`, links followed; nothing when there is none: a folder,
/// a device and a pipe are none.
/// \param name  is_plain_name().
/// \throws Error bad_input: a link that leads out of the folder; bad_argument: no plain name.
std::optional<std::filesystem::path> file_in(const std::filesystem::path& folder,
                                             std::string_view name);

} // namespace taihu
