#pragma once
#include <string>

#include <fmt/format.h>

namespace taihu {

/// Counts the figures that are held to something, and how many hold.
class Bars {
public:
    /// `0.116 (<= 0.135)`, with the word that says whether.
    std::string at_most(double figure, double bar, int digits = 3) {
        return judge(figure, figure <= bar, fmt::format("<= {:.{}f}", bar, digits), digits);
    }
    std::string at_least(double figure, double bar, int digits = 3) {
        return judge(figure, figure >= bar, fmt::format(">= {:.{}f}", bar, digits), digits);
    }
    std::string within(double figure, double lo, double hi, int digits = 3) {
        return judge(figure, figure >= lo && figure <= hi,
                     fmt::format("{:.{}f}..{:.{}f}", lo, digits, hi, digits), digits);
    }
    void print_sum() const {
        fmt::print("\n{} of {} figures hold what they are held to\n", n_met_, n_);
    }

private:
    std::string judge(double figure, bool met, const std::string& bar, int digits) {
        ++n_;
        n_met_ += met;
        return fmt::format("{:.{}f} ({}, {})", figure, digits, bar, met ? "met" : "not met");
    }

    int n_ = 0, n_met_ = 0;
};

} // namespace taihu
