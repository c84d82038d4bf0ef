#include "vdb_ops/roughness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/reflection.h"

namespace taihu {
namespace {

constexpr int kBlocksAcross = 4, kBlocks = kBlocksAcross * kBlocksAcross;
constexpr double kStudent = 2.131; // 97.5 % quantile, 15 degrees of freedom
// How far the law itself is off, seen on tiles of known h, shaded for the second and third: of H,
// of H from a photo, and of the size from a photo.
constexpr double kTileLawSd = 0.02, kPhotoLawSd = 0.06, kPhotoSizeSd = 0.1;
constexpr double kBlack = 0.002, kWhite = 0.998;
constexpr double kLeastOneSided = 1.5, kManyClipped = 0.02, kTooManyClipped = 0.2;

void require(bool ok, const std::string& what) {
    if (!ok)
        throw Error(Fault::bad_argument, "roughness: " + what);
}

/// Squared departures from straightness at one lag and in one direction.
struct Squares {
    double n = 0, sum = 0;

    void add(double value) {
        n += 1;
        sum += value * value;
    }
};

/// What a blur leaves of the squared departures at a lag, if they follow the law with this H. The
/// blur is a mean of two neighbours: about that of a camera, or of a slope taken over two pixels.
double blur_share(double lag, double hurst) {
    const double twice = 2 * std::clamp(hurst, 0.02, 0.98); // at 1 nothing departs from straight
    const auto squared = [twice](double l) { // height differences of the blurred heights
        const auto power = [twice](double a) { return std::pow(std::abs(a), twice); };
        return 0.5 * power(l) + 0.25 * (power(l - 1) + power(l + 1)) - 0.5;
    };
    return (squared(lag) - 0.25 * squared(2 * lag)) /
           (std::pow(lag, twice) * (1 - 0.25 * std::pow(2.0, twice)));
}

/// Squares by direction, lag and block.
class Variogram {
public:
    enum class Blur { none, two_pixels };

    Variogram(std::size_t n_directions, std::vector<int> lags, Blur blur)
        : lags_(std::move(lags)), blur_(blur), sums_(n_directions * lags_.size()) {}

    const std::vector<int>& lags() const { return lags_; }
    Squares& at(std::size_t direction, std::size_t lag, std::size_t block) {
        return sums_[direction * lags_.size() + lag][block];
    }

    /// The law, and by leaving out each block in turn how far it can be known.
    Roughness fitted(double pixel_m) const {
        const auto all = line(kBlocks);
        std::array<std::array<double, 2>, kBlocks> without;
        std::array<double, 2> mean{}, squares{};
        for (std::size_t b = 0; b < kBlocks; ++b) {
            without[b] = line(b);
            for (std::size_t k = 0; k < 2; ++k)
                mean[k] += without[b][k] / kBlocks;
        }
        for (std::size_t b = 0; b < kBlocks; ++b)
            for (std::size_t k = 0; k < 2; ++k)
                squares[k] += std::pow(without[b][k] - mean[k], 2);
        const bool exact = blur_ == Blur::none;
        const std::array<double, 2> law = {2 * (exact ? kTileLawSd : kPhotoLawSd),
                                           exact ? 0 : 2 * std::log2(1 + kPhotoSizeSd)};
        std::array<double, 2> reach;
        for (std::size_t k = 0; k < 2; ++k)
            reach[k] = kStudent * std::sqrt(squares[k] * (kBlocks - 1) / kBlocks + law[k] * law[k]);
        Roughness out;
        out.hurst = {0.5 * all[0], 0.5 * (all[0] - reach[0]), 0.5 * (all[0] + reach[0])};
        const auto size = [](double log2_square) { return std::exp2(0.5 * log2_square); };
        out.departure_m = {size(all[1]), size(all[1] - reach[1]), size(all[1] + reach[1])};
        out.first_lag_px = lags_.front();
        out.last_lag_px = lags_.back();
        out.pixel_m = pixel_m;
        return out;
    }

private:
    /// Mean square at each lag, without one block.
    std::vector<double> mean_squares(std::size_t left_out) const {
        const std::size_t n_lags = lags_.size(), n_directions = sums_.size() / n_lags;
        std::vector<double> out(n_lags, 0);
        for (std::size_t k = 0; k < sums_.size(); ++k) {
            Squares total;
            for (std::size_t b = 0; b < kBlocks; ++b)
                if (b != left_out) {
                    total.n += sums_[k][b].n;
                    total.sum += sums_[k][b].sum;
                }
            out[k % n_lags] += total.sum / total.n / static_cast<double>(n_directions);
        }
        return out;
    }

    /// {slope, value at lag 1} of the line through log2 of the mean squares, without one block. The
    /// larger the lag the fewer places there are to see it: weights fall with it.
    std::array<double, 2> line(std::size_t left_out) const {
        const std::vector<double> squares = mean_squares(left_out);
        std::array<double, 2> out{1, 0};
        for (int round = 0; round < (blur_ == Blur::none ? 1 : 8); ++round) {
            double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
            for (std::size_t j = 0; j < lags_.size(); ++j) {
                const double lag = lags_[j], w = 1 / lag, x = std::log2(lag);
                const double share = blur_ == Blur::none ? 1 : blur_share(lag, 0.5 * out[0]);
                if (!(squares[j] > 0))
                    throw Error(Fault::numeric,
                                "roughness: there is nothing rough in it; choose another patch");
                const double y = std::log2(squares[j] / share);
                n += w, sx += w * x, sy += w * y, sxx += w * x * x, sxy += w * x * y;
            }
            const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
            out = {slope, (sy - slope * sx) / n};
        }
        return out;
    }

    std::vector<int> lags_;
    Blur blur_;
    std::vector<std::array<Squares, kBlocks>> sums_;
};

/// 8, 16, ... up to an eighth of the side, smaller ones when it is short. Nearer to a pixel,
/// neither repeated halving nor a camera is self-similar.
std::vector<int> doubled_lags(int side) {
    const int first = std::clamp(side / 32, 1, 8), last = side / 8;
    std::vector<int> lags;
    for (int lag = first; lag <= last; lag *= 2)
        lags.push_back(lag);
    return lags;
}

std::size_t block_of(double x, double y, const Image& image) {
    const auto part = [](double a, int n) {
        return static_cast<std::size_t>(
            std::clamp(static_cast<int>(a * kBlocksAcross / n), 0, kBlocksAcross - 1));
    };
    return part(y, image.height) * kBlocksAcross + part(x, image.width);
}

/// One channel: luminance without alpha (weights of ITU-R BT.709).
Image grey(const Image& photo) {
    Image out(photo.width, photo.height, 1);
    const auto n = static_cast<std::size_t>(photo.channels);
    for (std::size_t i = 0; i < out.pixels.size(); ++i) {
        const float* p = photo.pixels.data() + i * n;
        out.pixels[i] = n < 3 ? p[0] : 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2];
    }
    return out;
}

/// Brightness over the plane fitted to it, less 1: on a lattice, the sums of a plane fit separate.
Image contrast(const Image& brightness) {
    const int w = brightness.width, h = brightness.height;
    double mean = 0, along_x = 0, along_y = 0, xx = 0, yy = 0;
    const auto cx = [w](int x) { return x - 0.5 * (w - 1); };
    const auto cy = [h](int y) { return y - 0.5 * (h - 1); };
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const double b = *brightness.at(x, y);
            mean += b;
            along_x += b * cx(x);
            along_y += b * cy(y);
            xx += cx(x) * cx(x);
            yy += cy(y) * cy(y);
        }
    mean /= static_cast<double>(brightness.pixels.size());
    Image out(w, h, 1);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const double plane = mean + along_x / xx * cx(x) + along_y / yy * cy(y);
            if (!(plane > 0))
                throw Error(Fault::numeric, "roughness: part of the photo is dark; choose a patch "
                                            "that is lit evenly");
            *out.at(x, y) = static_cast<float>(*brightness.at(x, y) / plane - 1);
        }
    return out;
}

/// Squared differences across pixels, as a tensor: {xx, xy, yy}, y to the top of the image.
std::array<double, 3> structure(const Image& c) {
    std::array<double, 3> t{};
    for (int y = 1; y + 1 < c.height; ++y)
        for (int x = 1; x + 1 < c.width; ++x) {
            const double dx = double{*c.at(x + 1, y)} - *c.at(x - 1, y);
            const double dy = double{*c.at(x, y - 1)} - *c.at(x, y + 1);
            t[0] += dx * dx;
            t[1] += dx * dy;
            t[2] += dy * dy;
        }
    return t;
}

double interpolated(const Image& image, double x, double y) {
    const int i = std::clamp(static_cast<int>(x), 0, image.width - 2),
              j = std::clamp(static_cast<int>(y), 0, image.height - 2);
    const double u = x - i, v = y - j;
    return (1 - v) * ((1 - u) * *image.at(i, j) + u * *image.at(i + 1, j)) +
           v * ((1 - u) * *image.at(i, j + 1) + u * *image.at(i + 1, j + 1));
}

/// Sums of the contrast along lines towards the light, and their differences at each lag.
Variogram summed_contrast(const Image& c, double azimuth_deg, double scale) {
    Variogram out(1, doubled_lags(std::min(c.width, c.height)), Variogram::Blur::two_pixels);
    const double angle = azimuth_deg * std::numbers::pi / 180;
    const double ux = std::cos(angle), uy = -std::sin(angle);
    const double cx = 0.5 * (c.width - 1), cy = 0.5 * (c.height - 1);
    const int reach = static_cast<int>(std::hypot(cx, cy)) + 1;
    std::vector<double> x, y, sums;
    for (int t = -reach; t <= reach; ++t) {
        x.clear(), y.clear(), sums.assign(1, 0);
        for (int s = -reach; s <= reach; ++s) {
            const double px = cx + s * ux - t * uy, py = cy + s * uy + t * ux;
            constexpr double kRounding = 1e-9; // the last row may come out just outside
            if (px < -kRounding || py < -kRounding || px > c.width - 1 + kRounding ||
                py > c.height - 1 + kRounding)
                continue;
            x.push_back(px);
            y.push_back(py);
            sums.push_back(sums.back() + scale * interpolated(c, px, py));
        }
        for (std::size_t j = 0; j < out.lags().size(); ++j) {
            const auto lag = static_cast<std::size_t>(out.lags()[j]);
            for (std::size_t i = lag; i + lag < sums.size(); ++i)
                out.at(0, j, block_of(x[i], y[i], c))
                    .add(sums[i] - 0.5 * (sums[i - lag] + sums[i + lag]));
        }
    }
    return out;
}

void check(const Image& photo, const PhotoRoughnessSettings& s) {
    require(photo.channels >= 1 && photo.channels <= 4 && photo.width >= 96 && photo.height >= 96,
            "the photo is " + std::to_string(photo.width) + " x " + std::to_string(photo.height) +
                " pixels, must be 96 x 96 or more; take a larger patch");
    require(s.pixel_m > 0 && s.pixel_m <= 1e6,
            "pixel_m is " + shortest(s.pixel_m) + ", must be > 0, up to 1e6");
    require(s.elevation_deg >= 5 && s.elevation_deg <= 85,
            "elevation_deg is " + shortest(s.elevation_deg) + ", must be 5..85");
    require(s.ambient_share >= 0 && s.ambient_share <= 0.9,
            "ambient_share is " + shortest(s.ambient_share) + ", must be 0..0.9");
    require(!s.azimuth_deg || std::abs(*s.azimuth_deg) <= 3600, "azimuth_deg must be -3600..3600");
}

} // namespace

double Roughness::departure_at_m(double lag_px) const {
    return departure_m.value * std::pow(lag_px, hurst.value);
}

Roughness fit_roughness(const Image& heights, double pixel_m, std::optional<int> scale_px) {
    require(heights.channels == 1 && heights.width >= 32 && heights.height >= 32,
            "the tile is " + std::to_string(heights.width) + " x " +
                std::to_string(heights.height) + " points of " + std::to_string(heights.channels) +
                " channels, must be 32 x 32 or more of 1; make a larger one");
    const int scale = scale_px.value_or(std::min(heights.width, heights.height));
    require(scale >= 32 && scale <= std::min(heights.width, heights.height),
            "scale_px is " + std::to_string(scale) + ", must be 32 to the shorter side");
    Variogram variogram(2, doubled_lags(scale), Variogram::Blur::none);
    tbb::parallel_for(std::size_t{0}, 2 * variogram.lags().size(), [&](std::size_t k) {
        const std::size_t j = k / 2, direction = k % 2;
        const int lag = variogram.lags()[j];
        const int dx = direction == 0 ? lag : 0, dy = direction == 0 ? 0 : lag;
        for (int y = dy; y + dy < heights.height; ++y)
            for (int x = dx; x + dx < heights.width; ++x)
                variogram.at(direction, j, block_of(x, y, heights))
                    .add(*heights.at(x, y) - 0.5 * (double{*heights.at(x - dx, y - dy)} +
                                                    double{*heights.at(x + dx, y + dy)}));
    });
    return variogram.fitted(pixel_m);
}

PhotoRoughness photo_roughness(const Image& photo, const PhotoRoughnessSettings& settings) {
    check(photo, settings);
    const Image brightness = grey(photo);
    PhotoRoughness out;
    out.clipped_share =
        static_cast<double>(std::count_if(brightness.pixels.begin(), brightness.pixels.end(),
                                          [](float b) { return !(b > kBlack && b < kWhite); })) /
        static_cast<double>(brightness.pixels.size());
    const std::string clipped =
        rounded(100 * out.clipped_share) + " % of the pixels are black or white";
    if (out.clipped_share > kTooManyClipped)
        throw Error(Fault::numeric,
                    "roughness: " + clipped + "; choose a patch that is exposed and lit evenly");
    const Image c = contrast(brightness);
    const auto [xx, xy, yy] = structure(c);
    const double major = 0.5 * std::atan2(2 * xy, xx - yy);
    out.azimuth_deg =
        settings.azimuth_deg.value_or(major * 180 / std::numbers::pi + (major < 0 ? 180 : 0));
    const double a = out.azimuth_deg * std::numbers::pi / 180, ca = std::cos(a), sa = std::sin(a);
    const double along = ca * ca * xx + 2 * ca * sa * xy + sa * sa * yy;
    out.one_sidedness = along / (xx + yy - along);
    if (!(out.one_sidedness >= kLeastOneSided))
        out.doubts.push_back("light and shade show no direction: colour, shadow or a light from "
                             "the front may be what is measured");
    if (out.clipped_share > kManyClipped)
        out.doubts.push_back(clipped + ": slopes are cut there");
    const double tangent = std::tan((90 - settings.elevation_deg) * std::numbers::pi / 180);
    const double scale = settings.pixel_m / (tangent * (1 - settings.ambient_share));
    out.roughness = summed_contrast(c, out.azimuth_deg, scale).fitted(settings.pixel_m);
    if (out.roughness.hurst.hi <= 0 || out.roughness.hurst.lo >= 1)
        out.doubts.push_back("H is not between 0 and 1: no fractal surface looks like this");
    return out;
}

Image image_part(const Image& image, int x, int y, int width, int height) {
    require(x >= 0 && y >= 0 && width > 0 && height > 0 && width <= image.width - x &&
                height <= image.height - y,
            "the patch " + std::to_string(x) + "," + std::to_string(y) + "," +
                std::to_string(width) + "," + std::to_string(height) +
                " is not inside of the photo of " + std::to_string(image.width) + " x " +
                std::to_string(image.height) + " pixels; give X,Y,WIDTH,HEIGHT in it");
    Image out(width, height, image.channels);
    for (int row = 0; row < height; ++row)
        std::copy_n(image.at(x, y + row), width * image.channels, out.at(0, row));
    return out;
}

} // namespace taihu
