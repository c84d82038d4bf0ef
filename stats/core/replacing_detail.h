#pragma once
#include <filesystem>

#include "stats/core/replacing.h"

namespace taihu {

/// That an open file was read.
void note_read(int descriptor);
/// That a file or folder was given this name, which is no temporary one.
void note_published(const std::filesystem::path& path);
/// Renames a file or folder in one step: a file of that name is replaced, and its rights are kept;
/// a link of that name is replaced, not what it points to.
/// \throws Error as require_replaceable(), or io.
void take_place(const std::filesystem::path& from, const std::filesystem::path& to);
/// Gives `from` the rights of the file `to`, where there is one.
void copy_rights(const std::filesystem::path& to, const std::filesystem::path& from);

} // namespace taihu
