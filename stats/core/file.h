#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace taihu {

/// The whole of a regular file.
/// \param max_bytes  a longer file is refused before anything is read.
/// \throws Error io: missing, a folder, a device or a pipe, unreadable; bad_input: too long.
std::string read_file(const std::filesystem::path& path,
                      std::size_t max_bytes = std::size_t{4} << 30);

/// A file that takes its name when it is whole: until publish() it is a temporary in the same
/// folder (`.taihu-tmp-` and six letters), which goes with this object. What a program that was
/// killed left there is removed by the next that writes into the folder.
/// An earlier file of this name gives it its rights; a link of this name is replaced, not what it
/// points to. Every member throws Error io, with the path and the system's reason; an earlier file
/// is then untouched.
class OutputFile {
public:
    /// \throws Error io  also when `path` is there and no regular file.
    explicit OutputFile(std::filesystem::path path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    const std::filesystem::path& path() const { return path_; }
    std::uint64_t size() const { return size_; } ///< written so far [bytes]
    void write(std::string_view bytes);
    /// Writes over what is there, from `at` on.
    void write_at(std::uint64_t at, std::string_view bytes);
    /// Reads back up to `bytes.size()`; returns how many there were.
    std::size_t read_at(std::uint64_t at, std::span<char> bytes) const;

    /// All of it on the disk, still under the other name: for several files, of which none shall
    /// be seen before all are whole.
    void finish();
    /// finish(), then takes the place of what has its name, in one step. \throws Error also as
    /// require_replaceable().
    void publish();

private:
    std::filesystem::path path_;
    std::unique_ptr<class Temporary> temporary_;
    std::uint64_t size_ = 0;
    bool finished_ = false;
};

/// Replace `path` by `bytes` in one step, as OutputFile does: a reader sees the old file or the new
/// one, never a part.
/// \throws Error io, with the path and the system's reason; the old file is then untouched.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Removes whatever is not yet published, of all threads: for a program that has to end on the
/// spot.
void discard_temporaries() noexcept;

/// `path` as it may be shown in a message or an output: the base name, control characters escaped.
std::string base_name(const std::filesystem::path& path);

} // namespace taihu
