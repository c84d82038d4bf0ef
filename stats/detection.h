#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "stats/sample.h"

namespace taihu {

/// g(d) in 0..1: the share of the searched surface on which a profile of diameter d would have been
/// marked, had its centre been there.
///
/// A frame counts nothing below its detection limit, then everything (Counting::centre), or the
/// share eroded_area(d) / area of its window (Counting::whole). Several frames are weighted by
/// their areas. Windows are tabulated: straight lines over 64 steps, within 1e-4. Immutable.
///
/// Source: own derivation: minus-sampling as part of the likelihood, see Miles 1974 and Lantuejoul
/// 1980 for the weights 1 / g (from memory, unchecked).
class Detection {
public:
    /// \throws Error bad_input: as check_sample; a profile greater than any that fits the windows.
    explicit Detection(const Sample& sample);

    double limit() const { return pieces_.front().lo; }    ///< g is 0 below [unit]
    std::optional<double> area() const { return area_; }   ///< searched [unit^2]
    double last_knot() const { return pieces_.back().lo; } ///< g is constant past it [unit]
    double share(double d) const;                          ///< g(d)
    /// Whether g is one number on lo..hi.
    bool is_flat(double lo, double hi) const;

    /// int_lo^hi f2(d) g(d) dd, from 1 - F2 of the sections; `hi` may be infinite.
    double seen(const std::function<double(double)>& survival, double lo, double hi) const;

private:
    struct Piece {
        double lo, hi, g_lo, g_hi; // straight between; the last hi is infinite and g constant
    };
    const Piece* piece_at(double d) const;

    std::optional<double> area_;
    std::vector<Piece> pieces_; ///< rising and contiguous; g may jump between them
};

} // namespace taihu
