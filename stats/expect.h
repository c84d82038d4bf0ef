#pragma once
#include <cstdint>
#include <optional>

#include "stats/core/progress.h"
#include "stats/goodness.h"
#include "stats/io/measurements.h"
#include "stats/law.h"
#include "stats/sample.h"

namespace taihu {

/// Whether profiles obey a law that was asked for: their sizes, and how many there are.
struct Expectation {
    Goodness sizes; ///< against the law as it is, nothing fitted
    struct Number {
        std::uint64_t found = 0;
        double expected = 0; ///< N_V mu A int f2 g
        double p_value = 1;  ///< two-sided
        /// How many profiles a hole that is cut at all has on average, less 1: large when many
        /// planes cut one rock. Sizes are then those of fewer holes than profiles, and a "no" to
        /// them is less sure.
        double shared = 0;
    };
    std::optional<Number> number; ///< nothing without a density, or when the area is unknown
    bool obeys = false;           ///< no test rejects; a true law passes in 95 of 100 cases
};

/// Sizes are judged by the Anderson-Darling test; with the number, each is rejected at 2.5 % in
/// place of 5 %. The number is Poisson's on one plane. P planes through a rock of volume V, placed
/// without regard to each other, cut the same N_V V holes again and again: its variance is then
/// L + (1 - 1 / P) L^2 E[D^2] / (mu^2 N_V V), L its mean, and its law is taken for the negative
/// binomial of these (own derivation).
/// \param law  in the unit of the sample.
/// \param shared  what is known of the planes; nothing: one, or far apart.
/// \param n_v  hole centres per unit^3, > 0; nothing: only the sizes are judged.
/// \throws Error as goodness; bad_argument: n_v.
Expectation expect_law(const Sample& sample, const Law& law, std::optional<double> n_v,
                       const std::optional<SharedHoles>& shared = {},
                       const GoodnessSettings& settings = {}, Progress* progress = nullptr);

} // namespace taihu
