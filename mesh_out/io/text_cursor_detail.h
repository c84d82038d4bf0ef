#pragma once
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "stats/core/progress.h"
#include "stats/core/text.h"

namespace taihu {

/// What differs between the text formats.
struct TextSyntax {
    bool hash_comments = false; ///< '#' at the start of a word ends the line
    bool continuations = false; ///< '\' at the end of a line joins it with the next one
};

/// Words, numbers and lines of a text file, and the error that names the line. A copy remembers a
/// place. `where` must outlive the cursor.
class TextCursor {
public:
    TextCursor(std::string_view text, const std::string& where, TextSyntax syntax,
               Progress* progress);

    std::size_t bytes_left() const { return text_.size() - at_; }
    std::string_view left() const { return text_.substr(at_); }
    const std::string& recipe() const { return recipe_; }

    [[noreturn]] void fail(const std::string& what, const std::string& remedy) const;

    /// The next word of this line; empty at its end.
    std::string_view word() {
        skip_blanks();
        const std::size_t first = at_;
        while (at_ < text_.size() && !delimits(at_))
            ++at_;
        return text_.substr(first, at_ - first);
    }

    /// Nothing more on this line?
    bool line_done() {
        skip_blanks();
        return at_ >= text_.size() || text_[at_] == '\n';
    }

    /// To the end of this line, and of the lines that continue it.
    void skip_line() {
        while (!word().empty()) {
        }
    }

    /// The rest of this line as it stands, without the line's end.
    std::string_view rest_of_line();

    /// To the start of the next line; false when this one was the last.
    bool next_line() {
        at_ = std::min(text_.find('\n', at_), text_.size());
        if (at_ == text_.size())
            return false;
        ++at_;
        if ((++line_ & 0xffff) == 0) {
            check_cancelled(progress_);
            report_fraction(progress_,
                            static_cast<double>(at_) / static_cast<double>(text_.size()));
        }
        return true;
    }

    /// To the next word, over as many lines as it takes; false at the end of the text.
    bool next_word() {
        do {
            skip_blanks();
            if (at_ < text_.size() && text_[at_] != '\n')
                return true;
        } while (next_line());
        return false;
    }

    /// A finite number from this line; `what` names it in the error.
    double number(const char* what) {
        skip_blanks();
        double value = 0;
        const char* const begin = text_.data() + at_;
        const auto [end, fault] = std::from_chars(begin, text_.data() + text_.size(), value);
        const std::size_t after = at_ + static_cast<std::size_t>(end - begin);
        if (fault == std::errc() && std::isfinite(value) && delimits(after)) {
            at_ = after;
            return value;
        }
        const std::string_view text = word();
        const auto parsed = parse_number(text); // knows +1 as well
        if (!parsed)
            fail_word(what, text, "not a finite number");
        return *parsed;
    }

    /// A whole number from this line.
    std::int64_t integer(const char* what);

    /// Says that the word `text`, which stands for `what`, is wrong; an empty one is missing.
    [[noreturn]] void fail_word(const char* what, std::string_view text, const char* why) const;

    /// Refuses anything more on this line.
    void end_line();

private:
    /// Is the character at `at` the end of a word? A carriage return counts as a blank.
    bool delimits(std::size_t at) const {
        return at >= text_.size() || text_[at] == ' ' || (text_[at] >= '\t' && text_[at] <= '\r') ||
               (text_[at] == '\\' && continuation_length(at) > 0);
    }

    std::size_t continuation_length(std::size_t at) const {
        if (!syntax_.continuations)
            return 0;
        const auto next = text_.substr(at + 1, 2);
        return next.starts_with('\n') ? 2 : next == "\r\n" ? 3 : 0;
    }

    void skip_blanks() {
        while (at_ < text_.size() && text_[at_] != '\n' && delimits(at_)) {
            if (text_[at_] == '\\') {
                at_ += continuation_length(at_);
                ++line_;
            } else {
                ++at_;
            }
        }
        if (syntax_.hash_comments && at_ < text_.size() && text_[at_] == '#') {
            read_comment();
        }
    }

    void read_comment();

    std::string_view text_;
    const std::string* where_;
    TextSyntax syntax_;
    Progress* progress_;
    std::size_t at_ = 0, line_ = 1;
    std::string recipe_;
};

} // namespace taihu
