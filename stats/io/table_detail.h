#pragma once
#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace taihu {

/// A CSV text cut into cells: a header of names, rows, `#` lines as comments.
///
/// Cells are separated by what separates the header: tabs, else semicolons, else commas. Where it
/// is not commas, numbers may have a decimal comma. UTF-8, or UTF-16 with a byte order mark; CRLF,
/// blank lines, rows of empty cells and spaces around cells are tolerated. A cell may stand in
/// double quotes, with "" for a quote; it ends on its line. Every row has as many cells as the
/// header, whose first name may be empty. Messages name line and column, both from 1.
class Table {
public:
    struct Comment {
        std::size_t line;
        std::string_view key, value; ///< of `# key=value`; a plain remark has an empty key
    };

    /// \param text   must outlive the table: cells are views into it.
    /// \param where  the file's base name.
    /// \throws Error bad_input: no header, an empty or repeated name in it, a row with another
    ///         number of cells, a quote that is not closed, text in no known encoding.
    Table(std::string_view text, std::string where);

    std::span<const std::string_view> header() const { return header_; }
    std::span<const Comment> comments() const { return comments_; }
    std::size_t n_rows() const { return lines_.size(); }
    std::string_view cell(std::size_t row, std::size_t column) const {
        return cells_[row * header_.size() + column];
    }
    std::size_t line(std::size_t row) const { return lines_[row]; }

    /// Another name for a column.
    struct Alias {
        std::string_view alias, name;
    };
    /// Gives columns their names in place of aliases.
    /// \throws Error bad_input: a name is then there twice.
    void rename(std::span<const Alias> aliases);

    /// Where `name` stands in the header, if it does.
    std::optional<std::size_t> find(std::string_view name) const;
    /// The same for a column that must be there.
    std::size_t column(std::string_view name) const;
    /// \throws Error bad_input: a header name that is not `known`, with the nearest one.
    void check_header(std::span<const std::string_view> known) const;
    /// A finite number.
    /// \throws Error bad_input, with line, column and what stands there.
    double number(std::size_t row, std::size_t column) const;
    /// A finite number as this table writes them, or nothing.
    std::optional<double> parse(std::string_view text) const;
    /// Throws Error bad_input: `where:line: column C 'name' is 'cell'` + `remedy`.
    [[noreturn]] void refuse(std::size_t row, std::size_t column, const std::string& remedy) const;
    /// Throws Error bad_input: `where:line: ` + `what`; line 0 is left out.
    [[noreturn]] void refuse_line(std::size_t line, const std::string& what) const;

private:
    std::string_view decoded(std::string_view text);
    void check_names(std::size_t line) const;
    void add_comment(std::string_view text, std::size_t line);
    void add_row(std::string_view text, std::size_t line);
    std::vector<std::string_view> split(std::string_view text, std::size_t line);
    std::string_view quoted_cell(std::string_view& rest, std::size_t line);

    std::string where_;
    char separator_ = ',';
    std::vector<std::string_view> header_, cells_;
    std::vector<std::size_t> lines_;
    std::vector<Comment> comments_;
    std::deque<std::string> unquoted_; ///< what differs from the text; stable addresses
};

} // namespace taihu
