#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stats/sample.h"

namespace taihu {

/// A segment as a file tells it, before it is known whether it is a hole.
struct Mark {
    std::size_t photo = 0; ///< index into Annotations::photos
    std::string label;
    double x1 = 0, y1 = 0, x2 = 0, y2 = 0; ///< [px], y downwards, finite
    std::optional<double> length_px;       ///< where the file says it beside, or without, the ends
    bool has_ends = true;
    std::optional<double> unit_per_px, minor_px; ///< > 0
    std::size_t line = 0;                        ///< in a table
    std::string item; ///< what it is called where there are no lines: `shapes[3]`
};

struct MarkedPhoto {
    std::optional<std::string> name; ///< nothing: the file does not tell, and it is its own photo
    int width_px = 0, height_px = 0; ///< 0: the file does not tell
};

/// What any format of annotations says: every reader makes one of these.
struct Annotations {
    std::string file; ///< base name
    std::optional<LengthUnit> unit;
    /// The lengths may be in pixels or in a unit already; the file does not tell (ImageJ's table).
    bool perhaps_calibrated = false;
    std::vector<MarkedPhoto> photos;
    std::vector<Mark> marks;
    std::map<std::string, std::size_t> other_shapes; ///< left out: how many of which kind

    /// The photo of that name, added if it is new.
    std::size_t photo(const std::optional<std::string>& name);
    /// Says the size of a photo, both sides > 0 or both 0 when it is not known.
    /// \throws Error bad_input: another size than said before.
    void set_size(std::size_t photo, int width_px, int height_px);
    /// Counts a shape that is no segment.
    void leave_out(std::string_view kind);
    /// A polyline of two points becomes `mark`; any other is no segment and is counted.
    void add_polyline(Mark mark, const std::vector<std::pair<double, double>>& points,
                      std::string_view kind);

private:
    std::map<std::optional<std::string>, std::size_t> index_;
};

/// `file:12` or `file: shapes[3]`.
std::string place_of(const Annotations& file, const Mark& mark);

/// A side of a picture, or nothing unless it is a whole number in 1..1,000,000.
std::optional<int> picture_side(double value);

/// The part of `path` behind its folders, written with / or with \.
std::string last_part(std::string_view path);

} // namespace taihu
