#pragma once
#include <filesystem>

namespace taihu {

/// While it lives, no output takes the place of a file that read_file() has read since, of one that
/// was published since, nor, with `keep_existing`, of any: it throws Error bad_argument (read or
/// published) or io (existing), and what was there is untouched. Of several that live the last
/// counts. A program without any replaces what it likes.
class OutputRules {
public:
    explicit OutputRules(bool keep_existing);
    ~OutputRules();
    OutputRules(const OutputRules&) = delete;
    OutputRules& operator=(const OutputRules&) = delete;
};

/// \throws Error as OutputRules says: `path` may not be replaced.
void require_replaceable(const std::filesystem::path& path);

/// Whether anything has come into view so far outside of temporary folders.
bool any_published() noexcept;

} // namespace taihu
