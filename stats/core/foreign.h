#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "stats/core/progress.h"

namespace taihu {

// Bytes from elsewhere that a library parses which was not made for hostile ones (OpenVDB, OpenEXR,
// Draco) are parsed by a program of their own, `taihu-reader`, with little memory, little processor
// time and no way to write a file. What it found comes back flat, and is checked again.

/// What the program may take: RLIMIT_AS, RLIMIT_CPU; and 16 open files.
struct ForeignLimits {
    std::uint64_t memory_bytes = 0;
    unsigned processor_s = 0;
};
/// 768 MB and 100 bytes for each one given; 2 s and 1 s more for every 10 MB.
ForeignLimits foreign_limits(std::size_t n_bytes);

/// What `taihu-reader KIND` makes of the bytes. It is sought as the environment's TAIHU_READER
/// says, beside the running program, where taihu was installed, and where it was built. \param
/// where  the file, in messages. \param words  what the kind wants to know beside. \throws Error as
/// the reader of that kind; bad_input: it crashed, or took more than
///   foreign_limits(); unsupported: there is no such program; io; cancelled.
std::string read_foreign(const std::string& kind, std::string_view bytes, const std::string& where,
                         const std::vector<std::string>& words = {}, Progress* progress = nullptr);

/// Bytes in, flat values out. \throws Error, or anything that a library throws.
using ForeignReader = std::function<std::string(std::string_view bytes, const std::string& where,
                                                const std::vector<std::string>& words)>;

/// The other side: takes standard input for the bytes, limits itself, answers on standard output.
/// Returns the exit code.
int serve_foreign(int argc, char** argv, const std::map<std::string, ForeignReader>& readers);

} // namespace taihu
