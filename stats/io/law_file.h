#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stats/fit.h"
#include "stats/io/measurements.h"
#include "stats/law.h"
#include "stats/sample.h"

namespace taihu {

/// How well a family explains a sample, beside the others that were tried.
struct RankedFamily {
    Family family = Family::exponential;
    double aicc = 0;
    double weight = 0; ///< Akaike weight, 0..1; they sum to 1
    friend bool operator==(const RankedFamily&, const RankedFamily&) = default;
};

/// What law.json holds, version 1 (data/schema/law.schema.json): a law and where it comes from. A
/// law that was thought of, not measured, leaves the optional ones and the lists empty.
struct LawFile {
    Law law = Law::constant(1);
    LengthUnit unit = LengthUnit::metre;
    std::vector<Interval> intervals;  ///< one for each parameter of the law, or none
    std::optional<double> level;      ///< of the intervals and of n_v; there when one of them is
    std::optional<NumberDensity> n_v; ///< [1 / unit^3]
    std::optional<double> detection_limit; ///< [unit]
    std::uint64_t n_profiles = 0;
    std::optional<double> area; ///< [unit^2]
    std::vector<RankedFamily> ranking;
    std::vector<CdfPoint> empirical; ///< F3 straight from the sample, beside a fitted law; or empty
    std::vector<SourceFile> source;
    friend bool operator==(const LawFile&, const LawFile&) = default;
};

/// The best of the fits, the ranking of all, and what they were made from.
/// \throws Error bad_argument: a ranking without fits.
LawFile make_law_file(const LawRanking& ranking, const Measurements& measurements);

/// The JSON text: keys in the order of the struct, `mean_diameter` from the law, numbers the
/// shortest that read back exactly; the same bytes everywhere. \throws Error bad_argument: numbers
/// that read_law_file would refuse.
std::string format_law_file(const LawFile& file);

/// \param where  the file's base name, for messages.
/// \throws Error bad_input: not JSON, a key that is unknown, missing or there twice, a version
/// other
///         than 1, a number that is not finite or out of range, a mean_diameter that is not that of
///         the law to 1e-6.
LawFile parse_law_file(std::string_view text, const std::string& where);

/// \throws Error io: as read_file; bad_input: as parse_law_file.
LawFile read_law_file(const std::filesystem::path& path);

} // namespace taihu
