#pragma once
#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "stats/core/file.h"

namespace taihu {

/// What FileSet::list() names: {"taihu_files": 1, "files": [{"file", "bytes", "sha256"}, ...]}
/// (data/schema/files.schema.json).
inline constexpr const char* kFileListName = "files.json";

/// Files of one folder that belong together. They are written aside, under a temporary name, and
/// come into view when all of them are whole; then one of them, which lists the others, comes last.
/// Without publish() nothing of them is left, nor the folder where it was not there.
/// Every member throws Error io, with the path and the system's reason.
class FileSet {
public:
    /// \param folder  for the files: there already, where it may hold others, or to be made, with
    ///   the folders that it is in; empty: the current one.
    explicit FileSet(std::filesystem::path folder);
    ~FileSet();
    FileSet(const FileSet&) = delete;
    FileSet& operator=(const FileSet&) = delete;

    /// \param name  of letters, digits, - _ .
    void add(const std::string& name, std::string_view bytes);
    /// The same by a function that writes into the folder it is given; what it throws names the
    /// one where the files will be.
    void add_by(const std::function<void(const std::filesystem::path&)>& write);
    /// Adds kFileListName: the files so far, by name, with size and SHA-256 as the disk has them.
    void list();

    /// Into the folder, all at once where it is new; else one after another, `last` as the last and
    /// its namesake first out of the way. When one of them cannot be replaced, all that went before
    /// is undone. Another program that publishes into the folder waits for this
    /// one, up to three seconds.
    /// \param gone  names of an earlier set, which are removed.
    void publish(const std::string& last, std::span<const std::string> gone = {});

private:
    std::filesystem::path folder_;
    bool is_new_;
    std::unique_ptr<class Temporary> temporary_;
};

/// Files with names of their own of which none comes into view before all are whole.
class OutputFiles {
public:
    /// Written aside, as an OutputFile; not at all without a name. \throws Error io.
    void add(const std::filesystem::path& path, std::string_view bytes);
    /// In the order in which they were added. \throws Error io, or before any as
    /// require_replaceable().
    void publish();

private:
    std::list<OutputFile> files_;
};

/// Several publications that are one: discard_temporaries() waits while this lives.
class Publishing {
public:
    Publishing();
    ~Publishing();
    Publishing(const Publishing&) = delete;
    Publishing& operator=(const Publishing&) = delete;
};

/// A folder that takes its name with all that is in it: until publish() it has a temporary one
/// beside it, and goes with this object.
class WorkFolder {
public:
    /// \param goal  the folders that it is in are made with it. \throws Error io.
    explicit WorkFolder(std::filesystem::path goal);
    ~WorkFolder();
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;

    const std::filesystem::path& path() const;
    /// In one step; a folder of that name is replaced with all in it. \throws Error io.
    void publish();

private:
    std::filesystem::path goal_;
    std::unique_ptr<class Temporary> temporary_;
};

} // namespace taihu
