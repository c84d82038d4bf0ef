#include "tools/gallery_manifest.h"

#include <fmt/format.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

using nlohmann::ordered_json;

constexpr std::string_view kTexts[] = {"thesis.json", "relief.json", "rocks.json"};

std::string_view data_named(std::string_view name) {
    for (const GalleryData& d : gallery_data())
        if (d.name == name)
            return d.bytes;
    throw Error(Fault::bad_input, "gallery: there is no " + std::string(name) + " in its data");
}

GalleryTable table_of(const ordered_json& json) {
    GalleryTable table;
    table.columns = json.at("columns");
    table.rows = json.at("rows");
    if (json.contains("chart")) {
        const ordered_json& chart = json["chart"];
        table.chart = GalleryChart{chart.at("x"), chart.at("y"), chart.value("log", false)};
    }
    return table;
}

GalleryEntry entry_of(const ordered_json& json) {
    GalleryEntry entry{.row = json.at("row"),
                       .figure = json.value("figure", ""),
                       .title = json.at("title"),
                       .look = json.at("look"),
                       .files = {},
                       .commands = json.at("commands"),
                       .pictures = {},
                       .table = {}};
    const auto files = json.value("files", ordered_json::object());
    for (const auto& [name, content] : files.items())
        entry.files.emplace_back(name, content.is_string()
                                           ? std::string(data_named(content.get<std::string>()))
                                           : content.dump(1) + "\n");
    for (const ordered_json& p : json.value("pictures", ordered_json::array()))
        entry.pictures.push_back({p.at("file"), p.at("caption"), p.value("enlarged", false)});
    if (json.contains("table"))
        entry.table = table_of(json["table"]);
    return entry;
}

/// `2/levels/0/triangles`: of the second command; `report.json/levels`: of a file that one wrote.
ordered_json figure_at(std::string_view place, std::span<const ordered_json> results) {
    const std::size_t slash = place.find('/');
    const std::string_view source = place.substr(0, slash);
    ordered_json whole;
    if (const auto command = parse_integer(source);
        command && *command >= 1 && static_cast<std::size_t>(*command) <= results.size())
        whole = results[static_cast<std::size_t>(*command) - 1];
    else if (source.ends_with(".json"))
        whole = ordered_json::parse(read_file(source));
    const ordered_json::json_pointer at{slash == place.npos ? ""
                                                            : std::string(place.substr(slash))};
    if (!whole.contains(at))
        throw Error(Fault::bad_input, "no command gives the figure '" + printable(place) + "'");
    return whole[at];
}

std::string shown(const ordered_json& value, const std::string& format) {
    if (value.is_number_float() || (value.is_number() && !format.empty()))
        return fmt::format(fmt::runtime("{:" + (format.empty() ? ".4g" : format) + "}"),
                           value.get<double>());
    return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string figure(std::string_view text, std::span<const ordered_json> results) {
    const std::size_t colon = text.find(':');
    const std::string format(colon == text.npos ? "" : text.substr(colon + 1));
    const std::string_view places = text.substr(0, colon);
    const std::size_t over = places.find(" / ");
    if (over == places.npos)
        return shown(figure_at(places, results), format);
    return shown(figure_at(places.substr(0, over), results).get<double>() /
                     figure_at(places.substr(over + 3), results).get<double>(),
                 format);
}

} // namespace

std::vector<GalleryText> gallery_texts() {
    std::vector<GalleryText> texts;
    for (const std::string_view name : kTexts) {
        const auto json = ordered_json::parse(data_named(name));
        GalleryText text{json.at("id"), json.at("title"), json.at("about"), {}};
        for (const ordered_json& entry : json.at("entries"))
            text.entries.push_back(entry_of(entry));
        texts.push_back(std::move(text));
    }
    return texts;
}

std::string filled_cell(const std::string& cell, std::span<const ordered_json> results) {
    std::string out;
    for (std::size_t at = 0; at < cell.size();) {
        const std::size_t open = cell.find('{', at), close = cell.find('}', open);
        out += cell.substr(at, open - at);
        if (close == cell.npos)
            break;
        out += figure(std::string_view(cell).substr(open + 1, close - open - 1), results);
        at = close + 1;
    }
    return out;
}

} // namespace taihu
