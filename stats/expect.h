#pragma once
#include <cstdint>
#include <optional>

#include "stats/core/progress.h"
#include "stats/goodness.h"
#include "stats/law.h"
#include "stats/sample.h"

namespace taihu {

/// Whether profiles obey a law that was asked for: their sizes, and how many there are.
struct Expectation {
    Goodness sizes; ///< against the law as it is, nothing fitted
    struct Number {
        std::uint64_t found = 0;
        double expected = 0; ///< N_V mu A int f2 g
        double p_value = 1;  ///< two-sided, of a Poisson number with this mean
    };
    std::optional<Number> number; ///< nothing without a density, or when the area is unknown
    bool obeys = false;           ///< no test rejects; a true law passes in 95 of 100 cases
};

/// Sizes are judged by the Anderson-Darling test, the number by its Poisson law; with both, each is
/// rejected at 2.5 % in place of 5 %. Planes that cut the same holes give numbers that spread more
/// than Poisson's: cut a large rock by few planes.
/// \param law  in the unit of the sample.
/// \param n_v  hole centres per unit^3, > 0; nothing: only the sizes are judged.
/// \throws Error as goodness; bad_argument: n_v.
Expectation expect_law(const Sample& sample, const Law& law, std::optional<double> n_v,
                       const GoodnessSettings& settings = {}, Progress* progress = nullptr);

} // namespace taihu
