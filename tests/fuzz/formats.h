#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace taihu {

/// A reader said yes to what it must refuse.
struct Unsound : std::logic_error {
    using std::logic_error::logic_error;
};

/// A kind of input as tests, campaign and fuzzers know it.
struct FuzzFormat {
    std::string_view name; ///< as that of the folder of its corpus
    std::string_view file; ///< what a file of it is called when it is read
    /// Valid files of it, small, the same each time.
    std::vector<std::string> (*bases)();
    /// Reads bytes as taihu does and checks what was accepted: finite numbers, indices in range,
    /// what is written again reads the same. \param folder  scratch, its own as long as it reads.
    /// \throws Error: refused; Unsound: accepted and wrong. Anything else is a defect, too.
    void (*read)(const std::string& bytes, const std::filesystem::path& folder);
    /// Makes lengths and checksums right again, so that other damage is met behind them; or null.
    void (*mend)(std::string& bytes) = nullptr;
};

/// All of them, by name.
std::span<const FuzzFormat> fuzz_formats();

/// Mutation `item` of a format's bases; those with odd numbers are mended.
std::string mutated_file(const FuzzFormat& format, std::span<const std::string> bases,
                         std::uint64_t seed, std::uint64_t item);

/// \throws Unsound, unless `sound`.
void demand(bool sound, const char* what);
/// A file for the readers of paths; nothing of it is synced, as write_file() would.
std::filesystem::path in_file(const std::string& bytes, const std::filesystem::path& folder,
                              const char* name);

// Readers of solid_formats.cpp.

void read_vdb_bytes(const std::string& bytes, const std::filesystem::path& folder);
void read_tiles_bytes(const std::string& bytes, const std::filesystem::path& folder);
void read_recipe_bytes(const std::string& bytes, const std::filesystem::path& folder);

// Bases, in bases.cpp; those of solids in solid_bases.cpp.

std::vector<std::string> obj_bases();
std::vector<std::string> ply_bases();
std::vector<std::string> stl_bases();
std::vector<std::string> off_bases();
std::vector<std::string> glb_bases();
std::vector<std::string> drc_bases();
std::vector<std::string> vdb_bases();
std::vector<std::string> exr_bases();
std::vector<std::string> png_bases();
std::vector<std::string> holes_bases();
std::vector<std::string> table_bases();
std::vector<std::string> labelme_bases();
std::vector<std::string> via_bases();
std::vector<std::string> cvat_bases();
std::vector<std::string> roi_bases();
std::vector<std::string> zip_bases();
std::vector<std::string> law_bases();
std::vector<std::string> tiles_bases();
std::vector<std::string> relief_bases();
/// Those name files that write_recipe_files() makes.
std::vector<std::string> recipe_bases();
/// What recipe_bases() name, into a folder.
void write_recipe_files(const std::filesystem::path& folder);

} // namespace taihu
