#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace taihu {

/// The whole of a regular file.
/// \param max_bytes  a longer file is refused before anything is read.
/// \throws Error io: missing, a folder, a device or a pipe, unreadable; bad_input: too long.
std::string read_file(const std::filesystem::path& path,
                      std::size_t max_bytes = std::size_t{4} << 30);

/// Replace `path` by `bytes` in one step: a temporary in the same folder is written, synced and
/// renamed, so that a reader sees the old file or the new one, never a part.
/// \throws Error io, with the path and the system's reason; the old file is then untouched.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// `path` as it may be shown in a message or an output: the base name, control characters escaped.
std::string base_name(const std::filesystem::path& path);

} // namespace taihu
