#include "tools/fit_plots.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "stats/detection.h"
#include "stats/wicksell.h"
#include "tools/gnuplot.h"

namespace taihu {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kPoints = 160;   // of a curve
constexpr int kMostLaws = 4;   // drawn beside each other
constexpr int kMaskRows = 120; // of what was searched, as it is drawn

constexpr const char* kLook = "set border 3 lc rgb '#777777'\nset tics nomirror out\n"
                              "set grid ytics lc rgb '#dddddd' lt 1\nset key right\n";

/// Density of the marked profiles by a law, at d.
class Marked {
public:
    Marked(const Sample& sample, const Law& law) : detection_(sample), section_(law) {
        whole_ = share(detection_.limit(), kInfinity, 1);
    }
    double density(double d) const { return section_.pdf(d) * detection_.share(d) / whole_; }

private:
    double share(double lo, double hi, double whole) const {
        return detection_.seen([&](double d) { return section_.survival(d); }, lo, hi) / whole;
    }
    Detection detection_;
    SectionLaw section_;
    double whole_ = 1;
};

/// The bins of a binned sample, or as many as show the shape of one that is not.
std::vector<Bin> histogram(const Sample& sample) {
    if (!sample.bins.empty())
        return sample.bins;
    const auto n = static_cast<double>(sample.diameters.size());
    const int n_bins = std::clamp(static_cast<int>(1.5 * std::sqrt(n)), 6, 40);
    const double lo = detection_limit(sample), hi = greatest_profile(sample);
    std::vector<Bin> bins;
    for (int i = 0; i < n_bins; ++i)
        bins.push_back({lo + (hi - lo) * i / n_bins, lo + (hi - lo) * (i + 1) / n_bins, 0});
    for (const double d : sample.diameters) {
        const double at = (d - lo) / (hi - lo) * n_bins;
        ++bins[static_cast<std::size_t>(std::clamp(at, 0.0, n_bins - 1.0))].count;
    }
    return bins;
}

std::string density_curve(const Sample& sample, const Law& law, double end,
                          const DisplayUnit& unit) {
    const Marked marked(sample, law);
    const double lo = detection_limit(sample);
    std::string data;
    for (int i = 0; i <= kPoints; ++i) {
        const double d = lo + (end - lo) * (i + 0.5) / (kPoints + 1);
        if (const double y = marked.density(d); std::isfinite(y))
            data += fmt::format("{:.6g} {:.6g}\n", d * unit.factor, y / unit.factor);
    }
    return data + "e\n";
}

} // namespace

DisplayUnit display_unit(const Sample& sample) {
    if (sample.unit == LengthUnit::pixel)
        return {1, "px", "px²", "cubic pixel"};
    if (sample.unit == LengthUnit::greatest)
        return {1, "of the greatest", "greatest²", "cube of the greatest diameter"};
    const double greatest = greatest_profile(sample);
    const bool mm = greatest < 0.03, cm = greatest < 3;
    return {mm ? 1000.0 : cm ? 100.0 : 1.0, mm ? "mm" : cm ? "cm" : "m", "m²", "cubic metre"};
}

double smallest_profile(const Sample& sample) {
    if (sample.bins.empty())
        return *std::min_element(sample.diameters.begin(), sample.diameters.end());
    return std::find_if(sample.bins.begin(), sample.bins.end(),
                        [](const Bin& b) { return b.count > 0; })
        ->lo;
}

double greatest_profile(const Sample& sample) {
    if (sample.bins.empty())
        return *std::max_element(sample.diameters.begin(), sample.diameters.end());
    return std::find_if(sample.bins.rbegin(), sample.bins.rend(),
                        [](const Bin& b) { return b.count > 0; })
        ->hi;
}

std::string plot_sections(const Sample& sample, const LawRanking& ranking, const DisplayUnit& unit,
                          const Progress* progress) {
    const double end = 1.15 * greatest_profile(sample);
    const auto n = static_cast<double>(n_profiles(sample));
    const std::size_t n_laws = std::min<std::size_t>(ranking.fits.size(), kMostLaws);
    std::string script = kLook;
    script += fmt::format("set xlabel 'diameter of the section [{}]'\nset ylabel 'density of "
                          "sections'\nset xrange [0:{:.6g}]\nset yrange [0:*]\n",
                          unit.name, end * unit.factor);
    script += "plot '-' using 1:2:3 with boxes fs solid 1 lc rgb '#d9cfb8' title 'marked'";
    for (std::size_t i = n_laws; i-- > 0;) // the best on top
        script +=
            fmt::format(", '-' with lines lw {} lc rgb '{}' title '{}'", i == 0 ? 2.5 : 1.2,
                        i == 0 ? "#a03020" : "#8899aa", family_name(ranking.fits[i].law.family()));
    script += "\n";
    for (const Bin& b : histogram(sample)) {
        const double width = (b.hi - b.lo) * unit.factor;
        script += fmt::format("{:.6g} {:.6g} {:.6g}\n", 0.5 * (b.lo + b.hi) * unit.factor,
                              static_cast<double>(b.count) / n / width, width);
    }
    script += "e\n";
    for (std::size_t i = n_laws; i-- > 0;)
        script += density_curve(sample, ranking.fits[i].law, end, unit);
    return gnuplot_svg("sections", script, progress);
}

std::string plot_holes(const Fit& fit, const Band& band, const std::optional<Law>& photos,
                       const DisplayUnit& unit, const Progress* progress) {
    std::string script = kLook;
    script += fmt::format("set key bottom right\nset xlabel 'diameter of the hole [{}]'\n"
                          "set ylabel 'share of the holes'\nset xrange [0:{:.6g}]\n"
                          "set yrange [0:1]\n",
                          unit.name, band.diameters.back() * unit.factor);
    script += fmt::format("set arrow from {0:.6g},0 to {0:.6g},1 nohead dt 2 lc rgb '#555555'\n",
                          fit.detection_limit * unit.factor);
    script += "plot '-' using 1:2:3 with filledcurves fs solid 1 lc rgb '#ead8d2' title 'band', "
              "'-' with lines lw 2.5 lc rgb '#a03020' title '" +
              std::string(family_name(fit.law.family())) + "'";
    if (photos)
        script += ", '-' with lines lw 1.5 lc rgb '#33557a' title 'photos alone'";
    script += "\n";
    for (std::size_t i = 0; i < band.diameters.size(); ++i)
        script += fmt::format("{:.6g} {:.6g} {:.6g}\n", band.diameters[i] * unit.factor, band.lo[i],
                              band.hi[i]);
    script += "e\n";
    for (std::size_t i = 0; i < band.diameters.size(); ++i)
        script += fmt::format("{:.6g} {:.6g}\n", band.diameters[i] * unit.factor, band.f3[i]);
    script += "e\n";
    if (photos) { // they know the holes above the limit alone: below, the law's share
        const double below = fit.law.cdf(fit.detection_limit);
        for (const CdfPoint& p : photos->points())
            script += fmt::format("{:.6g} {:.6g}\n", p.diameter * unit.factor,
                                  below + (1 - below) * p.cdf);
        script += "e\n";
    }
    return gnuplot_svg("holes", script, progress);
}

std::string plot_places(const Measurements& measurements, const PhotoLocation& at,
                        const DisplayUnit& unit, const Progress* progress) {
    const Photo& photo = measurements.photos[at.photo];
    const Window& window = *photo.window;
    const double f = unit.factor, step = window.height() / kMaskRows;
    std::string script = kLook;
    script += fmt::format("unset key\nunset grid\nset size ratio -1\nset xlabel '[{}]'\n"
                          "set xrange [0:{:.6g}]\nset yrange [{:.6g}:0]\n",
                          unit.name, window.width() * f, window.height() * f);
    script += "plot '-' using 1:2:3:4:5:6 with boxxyerror fs solid 1 border lc rgb '#e6e6e6' "
              "lc rgb '#e6e6e6', "
              "'-' using 1:2:3 with circles fs transparent solid 0.55 lc rgb '#a03020'\n";
    const int n_columns = std::clamp(static_cast<int>(window.width() / step), 2, 4 * kMaskRows);
    const double wide = window.width() / n_columns;
    for (int row = 0; row < kMaskRows; ++row) { // runs of what was searched
        const double y = (row + 0.5) * step;
        for (int x = 0; x < n_columns;) {
            int end = x;
            while (end < n_columns && window.contains((end + 0.5) * wide, y))
                ++end;
            if (end > x)
                script += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g} {:.6g} {:.6g}\n",
                                      0.5 * (x + end) * wide * f, y * f, x * wide * f,
                                      end * wide * f, row * step * f, (row + 1) * step * f);
            x = end + 1;
        }
    }
    script += "e\n";
    for (const Segment& s : measurements.segments)
        if (s.photo == at.photo && s.has_ends)
            script +=
                fmt::format("{:.6g} {:.6g} {:.6g}\n", 0.5 * (s.x1 + s.x2) * photo.unit_per_px * f,
                            0.5 * (s.y1 + s.y2) * photo.unit_per_px * f, 0.5 * s.diameter * f);
    script += "e\n";
    return gnuplot_svg("places" + std::to_string(at.photo), script, progress);
}

} // namespace taihu
