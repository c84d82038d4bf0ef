#include "stats/window.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "window: " + what);
}

void check_length(const char* name, double length) {
    if (!(length > 0 && std::isfinite(length)))
        refuse(std::string(name) + " is " + shortest(length) + "; must be finite and > 0");
}

// One row of squared distances: min over j of (i - j)^2 + down[j]^2, by the lower envelope of
// these parabolas. Beyond both ends of the row the mask has ended: parabolas of height 0 stand
// there.
//
// Source: Felzenszwalb and Huttenlocher 2012, Theory of Computing 8, 415 (from memory, unchecked).
class RowEnvelope {
public:
    explicit RowEnvelope(int width)
        : width_(width), apex_(static_cast<std::size_t>(width) + 2), from_(apex_.size() + 1) {}

    template <class Result>
    void operator()(const std::int32_t* down, Result result) {
        const auto height = [&](int j) {
            const double v = j < 0 || j == width_ ? 0 : down[j];
            return v * v;
        };
        std::size_t n = 0;
        for (int j = -1; j <= width_; ++j) {
            double start = -std::numeric_limits<double>::infinity();
            while (n > 0) {
                const int a = apex_[n - 1];
                start = 0.5 * (a + j) + (height(j) - height(a)) / (2.0 * (j - a));
                if (start > from_[n - 1])
                    break;
                start = -std::numeric_limits<double>::infinity();
                --n;
            }
            apex_[n] = j;
            from_[n++] = start;
        }
        from_[n] = std::numeric_limits<double>::infinity();
        for (int i = 0, k = 0; i < width_; ++i) {
            while (from_[static_cast<std::size_t>(k) + 1] < i)
                ++k;
            const int a = apex_[static_cast<std::size_t>(k)];
            result(i, std::sqrt(height(a) + static_cast<double>(i - a) * (i - a)));
        }
    }

private:
    int width_;
    std::vector<int> apex_;
    std::vector<double> from_; ///< where the parabola of the same index becomes the lowest
};

// For each pixel the number of steps up or down to the next one outside, 0 for those outside.
std::vector<std::int32_t> column_distances(const std::vector<bool>& inside, int width, int height) {
    std::vector<std::int32_t> steps(inside.size());
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    for (std::size_t x = 0; x < w; ++x) {
        std::int32_t run = 0;
        for (std::size_t y = 0; y < h; ++y)
            steps[y * w + x] = run = inside[y * w + x] ? run + 1 : 0;
        run = 0;
        for (std::size_t y = h; y-- > 0;) {
            run = inside[y * w + x] ? run + 1 : 0;
            steps[y * w + x] = std::min(steps[y * w + x], run);
        }
    }
    return steps;
}

constexpr int kPerPixel = 8; // steps of the tables

// How many pixels lie at least k / kPerPixel px from the outside, for k = 0, 1, ...; 0 at the end.
std::vector<double> erosion_table(const std::vector<bool>& inside, int width, int height) {
    const std::vector<std::int32_t> down = column_distances(inside, width, height);
    std::vector<double> histogram;
    RowEnvelope envelope(width);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
        envelope(down.data() + y * static_cast<std::size_t>(width), [&](int, double distance) {
            if (distance == 0)
                return;
            // From a pixel's centre to the edge of the one outside, half a pixel before its centre.
            const auto k = static_cast<std::size_t>(std::lround((distance - 0.5) * kPerPixel));
            if (k >= histogram.size())
                histogram.resize(k + 1);
            ++histogram[k];
        });
    // The points of a pixel spread over half a pixel to both sides of its centre's distance.
    std::vector<double> table(histogram.size() + kPerPixel / 2 + 1);
    for (std::size_t k = 0; k < histogram.size(); ++k) {
        const std::size_t all = k >= kPerPixel / 2 ? k - kPerPixel / 2 : 0;
        table[all] += histogram[k]; // counts end here; the ramp follows
    }
    double counted = 0; // pixels wholly at least this far
    for (std::size_t k = table.size(); k-- > 0;)
        table[k] = counted += table[k];
    for (std::size_t r = 0; r < table.size(); ++r)
        for (std::size_t k = r > kPerPixel / 2 ? r - kPerPixel / 2 + 1 : 0;
             k < histogram.size() && k < r + kPerPixel / 2; ++k)
            table[r] += histogram[k] *
                        (static_cast<double>(k) + kPerPixel / 2 - static_cast<double>(r)) /
                        kPerPixel;
    return table;
}

} // namespace

struct Window::Shape {
    double width = 0, height = 0, area = 0;
    // Of masks only.
    std::vector<bool> inside; ///< row by row
    int columns = 0, rows = 0;
    double unit_per_px = 0;
    std::vector<double> eroded; ///< areas, half a diameter of k / kPerPixel px apart
};

Window::Window(std::shared_ptr<const Shape> shape) : shape_(std::move(shape)) {}

Window Window::rectangle(double width, double height) {
    check_length("width", width);
    check_length("height", height);
    Shape shape;
    shape.width = width;
    shape.height = height;
    shape.area = width * height;
    return Window(std::make_shared<const Shape>(std::move(shape)));
}

Window Window::mask(const Image& mask, double unit_per_px) {
    check_length("unit_per_px", unit_per_px);
    if (mask.channels != 1 || mask.width < 1 || mask.height < 1 ||
        mask.pixels.size() !=
            static_cast<std::size_t>(mask.width) * static_cast<std::size_t>(mask.height))
        refuse("the mask is " + std::to_string(mask.width) + " x " + std::to_string(mask.height) +
               " with " + std::to_string(mask.channels) + " channels; give pixels of one channel");
    Shape shape;
    shape.columns = mask.width;
    shape.rows = mask.height;
    shape.unit_per_px = unit_per_px;
    shape.width = mask.width * unit_per_px;
    shape.height = mask.height * unit_per_px;
    shape.inside.resize(mask.pixels.size());
    std::size_t n = 0;
    for (std::size_t i = 0; i < mask.pixels.size(); ++i)
        n += (shape.inside[i] = mask.pixels[i] > 0.5F);
    if (n == 0)
        refuse("no pixel of the mask is above 1/2; paint the searched part white");
    const double pixel = unit_per_px * unit_per_px;
    shape.area = static_cast<double>(n) * pixel;
    shape.eroded = erosion_table(shape.inside, mask.width, mask.height);
    for (double& area : shape.eroded)
        area *= pixel;
    return Window(std::make_shared<const Shape>(std::move(shape)));
}

double Window::width() const {
    return shape_->width;
}

double Window::height() const {
    return shape_->height;
}

double Window::area() const {
    return shape_->area;
}

double Window::eroded_area(double d) const {
    if (!(d > 0))
        return shape_->area;
    const Shape& s = *shape_;
    if (s.eroded.empty())
        return std::max(0.0, s.width - d) * std::max(0.0, s.height - d);
    const double at = 0.5 * d / s.unit_per_px * kPerPixel;
    if (!(at < static_cast<double>(s.eroded.size() - 1)))
        return 0;
    const auto k = static_cast<std::size_t>(at);
    return std::lerp(s.eroded[k], s.eroded[k + 1], at - static_cast<double>(k));
}

bool Window::contains(double x, double y) const {
    const Shape& s = *shape_;
    if (!(x >= 0 && x <= s.width && y >= 0 && y <= s.height))
        return false;
    if (s.inside.empty())
        return true;
    const int i = std::min(static_cast<int>(x / s.unit_per_px), s.columns - 1);
    const int j = std::min(static_cast<int>(y / s.unit_per_px), s.rows - 1);
    return s.inside[static_cast<std::size_t>(j) * static_cast<std::size_t>(s.columns) +
                    static_cast<std::size_t>(i)];
}

} // namespace taihu
