#pragma once
#include <memory>

#include "stats/core/image.h"

namespace taihu {

/// The part of a picture that was searched for holes. Lengths in the unit of the sample, x to the right,
/// y downwards, origin at the top left corner of the picture. Cheap to copy; safe to ask from threads.
class Window {
public:
    /// \throws Error bad_argument: a side that is not finite and > 0.
    static Window rectangle(double width, double height);
    /// Pixels above 1/2 belong to the window; pixel (i, j) covers [i, i + 1] x [j, j + 1] px.
    /// \param mask  one channel. \throws Error bad_argument: no pixel belongs to it, or unit_per_px.
    static Window mask(const Image& mask, double unit_per_px);

    double width() const;  ///< of the whole picture
    double height() const;
    double area() const; ///< of the window
    /// Area of the places where the centre of a disc of diameter `d` may lie with the disc wholly inside;
    /// area() at 0, falling. Rectangles exactly; masks from their Euclidean distance map, within a pixel.
    double eroded_area(double d) const;
    bool contains(double x, double y) const;

private:
    struct Shape;
    explicit Window(std::shared_ptr<const Shape> shape);
    std::shared_ptr<const Shape> shape_;
};

} // namespace taihu
