#include "stats/assess.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "stats/boolean_model.h"
#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr double kSignificance = 0.05;
constexpr std::size_t kFewestPoints = 10, kPointsForSixCells = 30;
constexpr double kFlat = 5; // radius of a rock / mean diameter from which it passes for flat

std::string percent(double share) {
    return rounded(100 * share, 2) + " %";
}

void test_fit(const Fit& fit, const Measurements& measurements, const AssessSettings& settings,
              Assessment& a, Progress* progress) {
    const FitSettings again{.resolution = settings.resolution};
    const Family family = fit.law.family();
    const Refit refit = [&](const Sample& s) { return likeliest_law(s, family, again); };
    try {
        a.goodness = goodness(measurements.sample, fit.law, refit,
                              {settings.n_resamples, settings.seed}, progress);
    } catch (const Error& e) {
        if (e.fault() != Fault::bad_input && e.fault() != Fault::numeric)
            throw;
        a.findings.push_back("The fit could not be tested: " + std::string(e.what()) + ".");
        return;
    }
    // Where a law ends, its end falls beside the greatest profile each time that it is fitted, and
    // one profile beyond it would be all that Anderson-Darling sees.
    const bool ends = family == Family::constant || family == Family::uniform;
    const double p = (ends ? a.goodness->cramer_von_mises : a.goodness->anderson_darling).p_value;
    const std::string name(family_name(family));
    const std::string by = ends ? " holes (Cramer-von Mises p " : " holes (Anderson-Darling p ";
    if (p > kSignificance)
        a.findings.push_back("The sizes look like sections of " + name + by + rounded(p, 2) +
                             "); that does not exclude the other laws.");
    else
        a.findings.push_back("The sizes do not look like sections of " + name + by + rounded(p, 2) +
                             "); take the table of the photo in place of the law, or look whether "
                             "two kinds of holes were marked.");
}

std::vector<PlanePoint> points_of(const Measurements& m, std::size_t photo) {
    const Photo& p = m.photos[photo];
    std::vector<PlanePoint> points;
    for (const Segment& s : m.segments) {
        const PlanePoint middle{0.5 * (s.x1 + s.x2) * p.unit_per_px,
                                0.5 * (s.y1 + s.y2) * p.unit_per_px};
        // Rounding may put a centre just outside.
        if (s.photo == photo && s.has_ends && p.window->contains(middle.x, middle.y))
            points.push_back(middle);
    }
    return points;
}

std::string location_words(const Photo& photo, const PhotoLocation& at) {
    const std::string name = printable(photo.name);
    if (!at.near)
        return name + ": too few holes to say whether they crowd anywhere.";
    std::string text = name + ": ";
    if (at.near->p_value > kSignificance)
        text += "holes lie as if thrown at random";
    else
        text += at.near->deviation > 0 ? "holes crowd together" : "holes keep apart";
    text += " (p " + rounded(at.near->p_value, 2) + ")";
    if (at.cells->p_value > kSignificance)
        return text + ", and about as many in each part of the photo (p " +
               rounded(at.cells->p_value, 2) + ").";
    return text + ", but not equally many in each part of the photo (p " +
           rounded(at.cells->p_value, 2) + ").";
}

void test_locations(const Measurements& m, const AssessSettings& settings, Assessment& a,
                    Progress* progress) {
    for (std::size_t i = 0; i < m.photos.size(); ++i) {
        const Photo& photo = m.photos[i];
        if (!photo.window)
            continue;
        PhotoLocation at{i, points_of(m, i), {}, {}};
        if (at.points.size() >= kFewestPoints && at.points.size() <= 10'000) {
            const bool wide = photo.window->width() > photo.window->height();
            const int along = at.points.size() >= kPointsForSixCells ? 3 : 2;
            const int across = along - 1;
            try {
                at.cells = quadrat_test(at.points, *photo.window, wide ? along : across,
                                        wide ? across : along);
                at.near = neighbour_test(at.points, *photo.window, 999, settings.seed, progress);
            } catch (const Error& e) { // a window that is a corner of its picture, or a thread
                if (e.fault() == Fault::cancelled)
                    throw;
                at.cells.reset();
            }
        }
        if (!photo.masked)
            a.findings.push_back(
                printable(photo.name) + ": all of the photo counts as searched rock, " +
                rounded(photo.window->area()) + " " + std::string(unit_name(m.sample.unit)) +
                "^2; where it shows more than the rock, there are more holes "
                "than this says, and they seem to crowd: give a mask.");
        a.findings.push_back(location_words(photo, at));
        a.locations.push_back(std::move(at));
    }
}

void count_holes(const Fit& fit, const SolidSize& solid, Assessment& a) {
    if (!(solid.volume > 0 && std::isfinite(solid.volume) && solid.area >= 0 &&
          std::isfinite(solid.area)))
        throw Error(Fault::bad_argument, "assess: the solid has volume " + shortest(solid.volume) +
                                             " and area " + shortest(solid.area) +
                                             "; give a volume > 0 and an area >= 0");
    const double mean = fit.law.mean();
    a.curvature = std::cbrt(3 * solid.volume / (4 * std::numbers::pi)) / mean;
    if (*a.curvature < kFlat)
        a.findings.push_back("The rock is small for its holes: its radius is " +
                             rounded(*a.curvature, 2) +
                             " mean diameters, below 5 its surface is too curved and there are "
                             "fewer holes than this says.");
    if (!fit.n_v)
        return;
    a.holes = expected_holes(*fit.n_v, solid.volume);
    if (solid.area > 0)
        a.holes_biting = fit.n_v->estimate * solid.area * mean / 2;
    const double sd = std::sqrt(a.holes->estimate);
    a.findings.push_back("Your rock has about " + rounded(a.holes->estimate, 2) + " holes (" +
                         rounded(a.holes->lo, 2) + " to " + rounded(a.holes->hi, 2) +
                         "; another rock of the same kind may differ by " + rounded(sd, 2) + ")" +
                         (a.holes_biting
                              ? ", and some " + rounded(*a.holes_biting, 2) +
                                    " more that are centred outside and bite its surface."
                              : "."));
}

void look_at_density(const Fit& fit, Assessment& a) {
    if (!fit.n_v)
        return;
    const double n_v = fit.n_v->estimate;
    a.porosity = boolean_model(fit.law, n_v).porosity;
    a.n_v_overlap = overlap_corrected_n_v(fit.law, n_v);
    if (fit.n_v->extrapolated_share > 0.005)
        a.findings.push_back(percent(fit.n_v->extrapolated_share) +
                             " of all holes are smaller than the smallest that could be marked: "
                             "nobody saw them, the law adds them.");
    std::string text =
        "Holes of this law and number make up " + percent(*a.porosity) + " of the rock's volume.";
    if (*a.porosity > 0.1 && a.n_v_overlap)
        text += " If those that are hidden in larger ones were not marked, there are up to " +
                rounded(*a.n_v_overlap / n_v, 2) + " times as many.";
    else if (*a.porosity > 0.1)
        text += " They overlap so much that many cannot have been seen: mark every hole that can "
                "still be told from its neighbours.";
    a.findings.push_back(std::move(text));
}

void advise(const Fit& fit, const Measurements& m, Assessment& a) {
    const auto say = [&](std::string text) { a.advice.push_back(std::move(text)); };
    if (m.sample.unit != LengthUnit::metre)
        say("Put a ruler or anything of known length into the photo and draw a segment labelled "
            "'scale' along it: then lengths are in metres.");
    if (!fit.n_v)
        say("Say which part of the photo was searched, by a mask or by the size of the photo in "
            "the file: only then holes can be counted by volume.");
    if (!m.sample.detection_limit)
        say("Say below which size holes were not marked any more; so far the smallest one marked "
            "stands for it, which is a little too large.");
    if (fit.n_v && fit.n_v->extrapolated_share > 0.3)
        say("Mark smaller holes too, from a closer photo: " + percent(fit.n_v->extrapolated_share) +
            " of the holes are a guess of the law.");
    if (fit.n_profiles < 100)
        say("Mark more holes: the width of every interval falls with the square root of their "
            "number, 4 times as many halve it.");
    for (const PhotoLocation& at : a.locations)
        if (at.cells && at.cells->p_value <= kSignificance) {
            say("Look whether all of each photo was searched equally well; leave the rest out by a "
                "mask. If the rock itself differs from place to place, fit its parts apart.");
            break;
        }
    if (m.sample.frames.size() > 0 && m.sample.counting == Counting::whole)
        say("Mark holes that cross the edge of the photo to their end, if their middle is inside: "
            "that is the more exact rule (centre).");
    if (std::none_of(m.segments.begin(), m.segments.end(),
                     [](const Segment& s) { return s.minor_px.has_value(); }) &&
        !m.segments.empty())
        say("Where the camera looked at a slant, give the minor axes of the holes too, or the "
            "area factor: otherwise there seem to be more holes than there are.");
}

} // namespace

Assessment assess(const Fit& fit, const Measurements& measurements, const AssessSettings& settings,
                  Progress* progress) {
    Assessment a;
    test_fit(fit, measurements, settings, a, progress);
    report_stage(progress, "testing where the holes lie");
    test_locations(measurements, settings, a, progress);
    look_at_density(fit, a);
    if (settings.solid)
        count_holes(fit, *settings.solid, a);
    advise(fit, measurements, a);
    return a;
}

} // namespace taihu
