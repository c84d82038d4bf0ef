#pragma once
#include <filesystem>
#include <string>

namespace taihu {

/// \throws Error io: `PATH: WHAT: the system's reason for `code``.
[[noreturn]] void fail_io(const std::filesystem::path& path, const char* what, int code);

/// Closes on every way out, so that an error does not leak a descriptor.
class Descriptor {
public:
    explicit Descriptor(int value = -1) : value_(value) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { reset(-1); }
    int value() const { return value_; }
    void reset(int value);

private:
    int value_; ///< -1: none
};

/// A file or folder named `.taihu-tmp-` and six letters, locked for as long as this lives: that is
/// how a sweep tells it from one whose program was killed. It is removed, with all in it, unless it
/// was renamed.
class Temporary {
public:
    enum class Kind { file, folder };
    /// \param goal  what messages name. \throws Error io: none can be made in `folder`.
    Temporary(Kind kind, const std::filesystem::path& folder, const std::filesystem::path& goal);
    ~Temporary();
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

    const std::filesystem::path& path() const { return path_; }
    int descriptor() const { return descriptor_.value(); }
    /// Takes the place of a file, or of an empty folder or none. \throws Error as take_place().
    void rename(const std::filesystem::path& to);

    /// Removes it already now.
    void discard() const;

private:
    bool make(Kind kind, const std::filesystem::path& goal);

    std::filesystem::path path_; ///< empty: there is none, or no longer
    Descriptor descriptor_;
};

/// Whether a base name is that of a temporary.
bool is_temporary(const std::string& name);

/// The folder that a file is or will be in.
std::filesystem::path folder_of(const std::filesystem::path& path);

/// Removes the temporaries in a folder that nobody holds; looks once a folder and process.
void sweep(const std::filesystem::path& folder);

/// Names that came and went in a folder, onto the disk. \throws Error io.
void sync_folder(const std::filesystem::path& folder);

} // namespace taihu
