#include "mesh_out/io/text_cursor_detail.h"

#include <algorithm>

#include "mesh_out/io/mesh_formats_detail.h"
#include "stats/core/error.h"

namespace taihu {

TextCursor::TextCursor(std::string_view text, const std::string& where, TextSyntax syntax,
                       Progress* progress)
    : text_(text), where_(&where), syntax_(syntax), progress_(progress) {
    if (text_.starts_with("\xEF\xBB\xBF"))
        at_ = 3;
    if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF"))
        fail("the text is UTF-16", "save it as UTF-8");
}

void TextCursor::fail(const std::string& what, const std::string& remedy) const {
    throw Error(Fault::bad_input,
                *where_ + ":" + std::to_string(line_) + ": " + what + "; " + remedy);
}

std::string_view TextCursor::rest_of_line() {
    const auto end = std::min(text_.find('\n', at_), text_.size());
    auto rest = text_.substr(at_, end - at_);
    at_ = end;
    if (rest.ends_with('\r'))
        rest.remove_suffix(1);
    return rest;
}

std::int64_t TextCursor::integer(const char* what) {
    const std::string_view text = word();
    const auto parsed = parse_integer(text);
    if (!parsed)
        fail_word(what, text, "not a whole number");
    return *parsed;
}

void TextCursor::fail_word(const char* what, std::string_view text, const char* why) const {
    if (text.empty())
        fail(printable(what) + " is missing", "the file is cut short or damaged");
    fail(printable(what) + " is '" + printable(text) + "', " + why,
         "mend the file or export it again");
}

void TextCursor::end_line() {
    if (const std::string_view extra = word(); !extra.empty())
        fail("'" + printable(extra) + "' is too much on this line",
             "mend the file or export it again");
}

/// From a '#' to the end of its line.
void TextCursor::read_comment() {
    ++at_;
    take_recipe_line(rest_of_line(), recipe_);
}

} // namespace taihu
