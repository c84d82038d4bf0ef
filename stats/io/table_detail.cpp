#include "stats/io/table_detail.h"

#include <algorithm>
#include <set>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/io/utf_detail.h"

namespace taihu {

namespace {

// What separates the cells of a header; what stands in quotes separates nothing.
char separator_of(std::string_view header) {
    char found = ',';
    bool quoted = false;
    for (const char c : header) {
        quoted ^= c == '"';
        if (!quoted && (c == '\t' || (c == ';' && found == ',')))
            found = c;
    }
    return found;
}

} // namespace

Table::Table(std::string_view text, std::string where) : where_(std::move(where)) {
    text = decoded(text);
    if (text.starts_with("#filename,")) // the header of VIA 1 looks like a comment
        text.remove_prefix(1);
    for (std::size_t line = 1; !text.empty(); ++line) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view row = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (row.ends_with('\r'))
            row.remove_suffix(1);
        const std::string_view words = trimmed(row);
        if (words.empty())
            continue;
        if (words.starts_with('#'))
            add_comment(words.substr(1), line);
        else
            add_row(row, line);
    }
    if (header_.empty())
        refuse_line(0, "has no header line; the first line must name the columns");
}

// The text as UTF-8 without its mark.
std::string_view Table::decoded(std::string_view text) {
    const bool little = text.starts_with("\xff\xfe"), big = text.starts_with("\xfe\xff");
    if (little || big) {
        auto utf8 = utf8_from_utf16(text.substr(2), big);
        if (!utf8)
            refuse_line(0, "is damaged UTF-16 text; save it as UTF-8");
        return unquoted_.emplace_back(std::move(*utf8));
    }
    if (text.starts_with("\xef\xbb\xbf"))
        text.remove_prefix(3);
    if (!is_utf8(text))
        refuse_line(0, "is not UTF-8 text; save it as UTF-8, in a spreadsheet as 'CSV UTF-8'");
    if (text.find('\0') != std::string_view::npos)
        refuse_line(0, "holds zero bytes, so it is no table; save it as CSV (UTF-8)");
    return text;
}

void Table::add_comment(std::string_view text, std::size_t line) {
    // A spreadsheet fills a comment up with empty cells.
    text = text.substr(0, text.find_last_not_of(",;\t ") + 1);
    const std::size_t equals = text.find('=');
    const std::string_view key = trimmed(text.substr(0, equals));
    const bool is_setting = equals != std::string_view::npos && !key.empty() &&
                            key.find_first_of(" \t") == std::string_view::npos;
    if (is_setting)
        comments_.push_back({line, key, trimmed(text.substr(equals + 1))});
    else
        comments_.push_back({line, {}, trimmed(text)});
}

void Table::check_names(std::size_t line) const {
    std::set<std::string_view> names;
    for (std::size_t i = 0; i < header_.size(); ++i) {
        if (header_[i].empty() && i > 0)
            refuse_line(line, "column " + std::to_string(i + 1) + " has no name; name it");
        if (!names.insert(header_[i]).second)
            refuse_line(line, "column " + std::to_string(i + 1) + " '" + printable(header_[i]) +
                                  "' is there twice; keep one of them");
    }
}

void Table::add_row(std::string_view text, std::size_t line) {
    if (header_.empty())
        separator_ = separator_of(text);
    const auto cells = split(text, line);
    const bool blank = std::all_of(cells.begin(), cells.end(), [](auto c) { return c.empty(); });
    if (blank && cells.size() > 1)
        return;
    if (header_.empty()) {
        header_ = cells;
        check_names(line);
        return;
    }
    if (cells.size() != header_.size())
        refuse_line(line, std::to_string(cells.size()) + " cells, the header has " +
                              std::to_string(header_.size()) + "; correct the row");
    cells_.insert(cells_.end(), cells.begin(), cells.end());
    lines_.push_back(line);
}

void Table::rename(std::span<const Alias> aliases) {
    for (std::string_view& name : header_)
        for (const Alias& alias : aliases)
            if (name == alias.alias)
                name = alias.name;
    check_names(0);
}

std::vector<std::string_view> Table::split(std::string_view text, std::size_t line) {
    std::vector<std::string_view> cells;
    while (true) {
        const char* blanks = separator_ == '\t' ? " " : " \t";
        text = text.substr(std::min(text.find_first_not_of(blanks), text.size()));
        if (text.starts_with('"')) {
            cells.push_back(quoted_cell(text, line));
        } else {
            const std::size_t end = std::min(text.find(separator_), text.size());
            cells.push_back(trimmed(text.substr(0, end)));
            text.remove_prefix(end);
        }
        if (text.empty())
            return cells;
        text.remove_prefix(1); // the separator
    }
}

// The cell whose opening quote begins `rest`; `rest` then begins with a separator or is empty.
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
    rest = rest.substr(std::min(rest.find_first_not_of(' ', at), rest.size()));
    if (!rest.empty() && rest[0] != separator_)
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
    for (const std::string_view name : header_) {
        if (std::find(known.begin(), known.end(), name) != known.end())
            continue;
        const std::string nearest = did_you_mean(name, known);
        refuse_line(0, "unknown column '" + printable(name) + "'" +
                           (nearest.empty() ? "; drop it, or give it a known name" : nearest));
    }
}

double Table::number(std::size_t row, std::size_t column) const {
    const auto value = parse(cell(row, column));
    if (!value)
        refuse(row, column, "must be a finite number");
    return *value;
}

std::optional<double> Table::parse(std::string_view text) const {
    const std::size_t comma = text.find(',');
    if (separator_ == ',' || comma == std::string_view::npos ||
        text.find('.') != std::string_view::npos)
        return parse_number(text);
    std::string with_point(text);
    with_point[comma] = '.';
    return parse_number(with_point);
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
