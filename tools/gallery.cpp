// taihu gallery: every figure, plate and table of the three source texts, made again.
#include <algorithm>
#include <chrono>
#include <set>

#include "mesh_out/io/image_file.h"
#include "stats/core/error.h"
#include "stats/core/file_set.h"
#include "stats/core/text.h"
#include "tools/gallery_manifest.h"
#include "tools/gallery_page.h"
#include "tools/verbs.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPage = "index.html";

struct GalleryArgs {
    fs::path out = "out/gallery";
    std::vector<std::string> only;
    bool list = false;
};

/// What is asked for, in the order of the page.
std::vector<GalleryText> chosen_texts(const std::vector<std::string>& only) {
    std::vector<GalleryText> texts = gallery_texts();
    std::vector<std::string_view> known;
    for (const GalleryText& text : texts)
        for (const GalleryEntry& e : text.entries)
            known.push_back(e.row);
    for (const std::string& row : only)
        if (std::find(known.begin(), known.end(), row) == known.end())
            throw Error(Fault::bad_argument, "--only: there is no row '" + printable(row) + "'" +
                                                 did_you_mean(row, known) +
                                                 "; taihu gallery --list shows them");
    const auto unwanted = [&](const GalleryEntry& e) {
        return !only.empty() && std::find(only.begin(), only.end(), e.row) == only.end();
    };
    for (GalleryText& text : texts)
        std::erase_if(text.entries, unwanted);
    std::erase_if(texts, [](const GalleryText& text) { return text.entries.empty(); });
    return texts;
}

void list_rows(const std::vector<GalleryText>& texts, const Console& console) {
    auto json = nlohmann::ordered_json::array();
    for (const GalleryText& text : texts)
        for (const GalleryEntry& e : text.entries) {
            json.push_back({{"row", e.row},
                            {"figure", e.figure},
                            {"title", e.title},
                            {"text", text.title},
                            {"commands", e.commands},
                            {"pictures", e.pictures.size()}});
            if (!console.json)
                fmt::print("{:<5} {:<26} {}\n", e.row, e.figure, e.title);
        }
    console.result({{"rows", json}});
}

/// Commands name files of their own folder; the one before is the current one again afterwards.
class CurrentFolder {
public:
    explicit CurrentFolder(const fs::path& path) : before_(fs::current_path()) {
        fs::current_path(path);
    }
    ~CurrentFolder() {
        std::error_code ignored;
        fs::current_path(before_, ignored);
    }
    CurrentFolder(const CurrentFolder&) = delete;
    CurrentFolder& operator=(const CurrentFolder&) = delete;

private:
    fs::path before_;
};

/// \throws Error io: a folder has other files than those of an earlier gallery, which may go.
void require_gallery(const fs::path& folder) {
    std::error_code ignored;
    if (!fs::is_regular_file(folder / kPage, ignored) ||
        read_file(folder / kPage).find(kGalleryMark) == std::string::npos)
        throw Error(Fault::io, folder.string() + ": a folder with other files; choose a new one "
                                                 "for the gallery");
    std::set<fs::path> known = {kPage};
    for (const GalleryText& text : gallery_texts())
        for (const GalleryEntry& e : text.entries) {
            for (const auto& [name, bytes] : e.files)
                known.insert(fs::path(e.row) / name);
            for (const GalleryPicture& p : e.pictures)
                known.insert(fs::path(e.row) / p.file);
        }
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (!entry.is_directory() && !known.count(entry.path().lexically_relative(folder)))
            throw Error(Fault::io, entry.path().string() +
                                       ": is not of the gallery, which would replace its folder; "
                                       "move it, or choose a new folder");
}

/// Before any work, and again after it: whether the folder can be made, and nothing of others would
/// go.
void check_output(const fs::path& out, const Console& console) {
    std::error_code failed;
    if (!out.has_filename())
        throw Error(Fault::bad_argument, "-o: '" + printable(out.string()) +
                                             "' ends with a slash; name the folder without it");
    if (!fs::exists(out, failed))
        return;
    if (!fs::is_directory(out))
        throw Error(Fault::io, out.string() + ": is a file; name a folder");
    if (console.no_clobber)
        throw Error(Fault::io,
                    out.string() + ": exists; choose another name, or drop --no-clobber");
    if (!fs::is_empty(out))
        require_gallery(out);
}

/// Runs an entry's commands in the current folder. Returns it with its figures.
MadeEntry run_entry(GalleryEntry entry, Progress* progress) {
    for (const auto& [name, bytes] : entry.files)
        write_file(name, bytes);
    std::vector<nlohmann::ordered_json> results;
    for (const std::string& command : entry.commands) {
        check_cancelled(progress);
        try {
            results.push_back(run_command(command, progress));
        } catch (const Error& e) {
            throw Error(e.fault(), "`" + command + "`: " + e.what());
        }
    }
    if (entry.table)
        for (auto& row : entry.table->rows)
            for (std::string& cell : row)
                cell = filled_cell(cell, results);
    std::vector<std::pair<int, int>> sizes;
    for (const GalleryPicture& p : entry.pictures) {
        const Image picture = read_png(p.file);
        sizes.emplace_back(picture.width, picture.height);
    }
    return {std::move(entry), std::move(sizes)};
}

/// An entry with its pictures, and what its commands read, in a folder of the row's name.
MadeEntry make_entry(const GalleryEntry& entry, const fs::path& gallery, Progress* progress) {
    const fs::path folder = gallery / entry.row;
    const WorkFolder work(folder);
    MadeEntry made = [&] {
        const CurrentFolder inside(work.path());
        return run_entry(entry, progress);
    }();
    std::set<fs::path> kept; // a picture may be shown twice
    for (const GalleryPicture& p : entry.pictures)
        kept.insert(p.file);
    for (const auto& [name, bytes] : entry.files)
        kept.insert(name);
    for (const fs::path& file : kept) {
        fs::create_directories((folder / file).parent_path());
        fs::rename(work.path() / file, folder / file);
    }
    return made;
}

void run(const GalleryArgs& args, const Console& console) {
    const std::vector<GalleryText> texts = chosen_texts(args.only);
    if (args.list)
        return list_rows(texts, console);
    check_output(args.out, console);
    WorkFolder work(args.out);
    std::size_t n_entries = 0, n_pictures = 0;
    std::vector<MadeText> made;
    for (const GalleryText& text : texts) {
        made.push_back({{text.id, text.title, text.about, {}}, {}});
        for (const GalleryEntry& entry : text.entries) {
            const auto begin = std::chrono::steady_clock::now();
            report_stage(console.progress, entry.row + " " + entry.title);
            try {
                made.back().entries.push_back(make_entry(entry, work.path(), console.progress));
            } catch (const Error& e) {
                throw Error(e.fault(), "gallery: " + entry.row + ": " + e.what());
            }
            const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
            console.say("{:<4} {}: {} picture{}, {:.1f} s", entry.row, entry.title,
                        entry.pictures.size(), entry.pictures.size() == 1 ? "" : "s", took.count());
            ++n_entries;
            n_pictures += entry.pictures.size();
        }
    }
    write_file(work.path() / kPage, format_gallery(made));
    check_cancelled(console.progress);
    check_output(args.out, console);
    work.publish();
    const fs::path page = args.out / kPage;
    console.say("{}: {} rows, {} pictures", page.string(), n_entries, n_pictures);
    console.result({{"file", page.string()}, {"rows", n_entries}, {"pictures", n_pictures}});
}

} // namespace

void add_gallery(CLI::App& app, Console& console) {
    auto args = std::make_shared<GalleryArgs>();
    auto* verb = console.verb(app, "gallery",
                              "Make every figure, plate and table of the source texts again, on a "
                              "page with what it takes",
                              "  taihu gallery\n"
                              "  taihu gallery --list\n"
                              "  taihu gallery --only T11,D17 -o plates");
    verb->add_option("-o,--output", args->out,
                     "Folder of the page, index.html, and its pictures; an earlier gallery in it "
                     "is replaced")
        ->capture_default_str();
    verb->add_option("--only", args->only, "These rows alone, as T11,D17 [all]")->delimiter(',');
    verb->add_flag("--list", args->list, "Print the rows, and make nothing");
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
