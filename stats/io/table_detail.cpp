#include "stats/io/table_detail.h"

#include <algorithm>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {

Table::Table(std::string_view text, std::string where) : where_(std::move(where)) {
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
        refuse_line(0, "is UTF-16 text; save it as UTF-8");
    if (text.starts_with("\xef\xbb\xbf"))
        text.remove_prefix(3);
    for (std::size_t line = 1; !text.empty(); ++line) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        const std::string_view row = trimmed(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
        if (row.empty())
            continue;
        if (row.starts_with('#'))
            add_comment(row.substr(1), line);
        else
            add_row(row, line);
    }
    if (header_.empty())
        refuse_line(0, "has no header line; the first line must name the columns");
}

void Table::add_comment(std::string_view text, std::size_t line) {
    const std::size_t equals = text.find('=');
    const std::string_view key = trimmed(text.substr(0, equals));
    const bool is_setting = equals != std::string_view::npos && !key.empty() &&
                            key.find_first_of(" \t") == std::string_view::npos;
    if (is_setting)
        comments_.push_back({line, key, trimmed(text.substr(equals + 1))});
    else
        comments_.push_back({line, {}, trimmed(text)});
}

void Table::add_row(std::string_view text, std::size_t line) {
    const auto cells = split(text, line);
    if (header_.empty()) {
        for (std::size_t i = 0; i < cells.size(); ++i) {
            if (cells[i].empty())
                refuse_line(line, "column " + std::to_string(i + 1) + " has no name; name it");
            if (std::find(cells.begin(), cells.begin() + static_cast<std::ptrdiff_t>(i),
                          cells[i]) != cells.begin() + static_cast<std::ptrdiff_t>(i))
                refuse_line(line, "column " + std::to_string(i + 1) + " '" + printable(cells[i]) +
                                      "' is there twice; keep one of them");
        }
        header_ = cells;
        return;
    }
    if (cells.size() != header_.size())
        refuse_line(line, std::to_string(cells.size()) + " cells, the header has " +
                              std::to_string(header_.size()) + "; correct the row");
    cells_.insert(cells_.end(), cells.begin(), cells.end());
    lines_.push_back(line);
}

std::vector<std::string_view> Table::split(std::string_view text, std::size_t line) {
    std::vector<std::string_view> cells;
    while (true) {
        text = text.substr(std::min(text.find_first_not_of(" \t"), text.size()));
        if (text.starts_with('"')) {
            cells.push_back(quoted_cell(text, line));
        } else {
            const std::size_t end = std::min(text.find(','), text.size());
            cells.push_back(trimmed(text.substr(0, end)));
            text.remove_prefix(end);
        }
        if (text.empty())
            return cells;
        text.remove_prefix(1); // the comma
    }
}

// The cell whose opening quote begins `rest`; `rest` then begins with a comma or is empty.
std::string_view Table::quoted_cell(std::string_view& rest, std::size_t line) {
    std::string cell;
    std::size_t at = 1;
    while (true) {
        const std::size_t quote = rest.find('"', at);
        if (quote == std::string_view::npos)
            refuse_line(line, "a quote is not closed; close it on its line");
        cell += rest.substr(at, quote - at);
        at = quote + 1;
        if (at >= rest.size() || rest[at] != '"')
            break;
        cell += '"';
        ++at;
    }
    rest = rest.substr(std::min(rest.find_first_not_of(" \t", at), rest.size()));
    if (!rest.empty() && rest[0] != ',')
        refuse_line(line, "text behind a closing quote; write a quote inside of quotes as \"\"");
    return unquoted_.emplace_back(std::move(cell));
}

std::optional<std::size_t> Table::find(std::string_view name) const {
    const auto found = std::find(header_.begin(), header_.end(), name);
    if (found == header_.end())
        return std::nullopt;
    return static_cast<std::size_t>(found - header_.begin());
}

std::size_t Table::column(std::string_view name) const {
    const auto found = find(name);
    if (!found)
        refuse_line(0, "column '" + std::string(name) + "' is missing; add it");
    return *found;
}

void Table::check_header(std::span<const std::string_view> known) const {
    for (const std::string_view name : header_)
        if (std::find(known.begin(), known.end(), name) == known.end())
            refuse_line(0, "unknown column '" + printable(name) + "'" +
                               (name.find_first_of(";\t") != std::string_view::npos
                                    ? "; separate columns by commas"
                                    : did_you_mean(name, known)));
}

double Table::number(std::size_t row, std::size_t column) const {
    const auto value = parse_number(cell(row, column));
    if (!value)
        refuse(row, column, "must be a finite number");
    return *value;
}

void Table::refuse(std::size_t row, std::size_t column, const std::string& remedy) const {
    refuse_line(line(row), "column " + std::to_string(column + 1) + " '" +
                               printable(header_[column]) + "' is '" +
                               printable(cell(row, column)) + "'; " + remedy);
}

void Table::refuse_line(std::size_t line, const std::string& what) const {
    throw Error(Fault::bad_input,
                where_ + (line > 0 ? ":" + std::to_string(line) : std::string()) + ": " + what);
}

} // namespace taihu
