#pragma once
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "stats/assess.h"
#include "stats/bootstrap.h"
#include "stats/fit.h"
#include "stats/io/measurements.h"

namespace taihu {

/// What a report of a fit is made of.
struct FitReport {
    const Measurements& measurements;
    const LawRanking& ranking; ///< the first of its fits is the law
    const Assessment& assessment;
    const Band& band;                 ///< of the law's F3
    const std::optional<Law>& photos; ///< F3 above the limit with no family assumed
    const Progress* progress = nullptr;
};

/// One self-contained page for people who are no statisticians.
/// \throws Error as gnuplot_svg().
std::string format_report_html(const FitReport& report);

/// The same figures for programs.
nlohmann::ordered_json assessment_json(const Assessment& assessment,
                                       const Measurements& measurements);

} // namespace taihu
