#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace taihu {

struct GalleryPicture {
    std::string file, caption;
    bool enlarged = false; ///< shown larger than it is, with its pixels
};

/// Columns of a table as curves over another.
struct GalleryChart {
    std::size_t x = 0;
    std::vector<std::size_t> y;
    bool log = false; ///< both axes
};

/// Figures then and now. In a cell, `{2/triangles}` stands for what the second command says there
/// (a JSON pointer; a .json file that a command wrote may stand for the number), `{2/triangles /
/// 1/triangles}` for a ratio, `{1/f3/0:.2f}` for a number in a format of fmt.
struct GalleryTable {
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows; ///< as many cells as columns
    std::optional<GalleryChart> chart;
};

/// A row of the texts, made again.
struct GalleryEntry {
    std::string row;    ///< in the list of what the texts can do: T11
    std::string figure; ///< what it was called there, or empty: Plate 1
    std::string title, look;
    std::vector<std::pair<std::string, std::string>> files; ///< names and bytes: commands read them
    std::vector<std::string> commands;                      ///< `taihu VERB ...`
    std::vector<GalleryPicture> pictures;                   ///< that the commands leave
    std::optional<GalleryTable> table;
};

struct GalleryText {
    std::string id, title, about;
    std::vector<GalleryEntry> entries;
};

/// What the gallery makes: data/gallery, which is part of the program.
std::vector<GalleryText> gallery_texts();

/// A cell of a table. \param results  of the commands. \throws Error bad_input: no such figure.
std::string filled_cell(const std::string& cell, std::span<const nlohmann::ordered_json> results);

/// A file of data/, as the program carries it: a text of the gallery, or what its commands read.
struct GalleryData {
    std::string_view name, bytes;
};
std::span<const GalleryData> gallery_data();

} // namespace taihu
