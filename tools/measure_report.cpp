#include "tools/measure_report.h"

#include "stats/number_detail.h"

namespace taihu {
namespace {

using Json = nlohmann::ordered_json;

Json optional_json(const std::optional<double>& value) {
    return value ? Json(*value) : nullptr;
}

Json estimate_json(const std::optional<Estimate>& e) {
    return e ? Json{{"value", e->value}, {"se", optional_json(e->se)}} : Json(nullptr);
}

/// `0.221 +- 0.011`.
std::string estimate_text(const Estimate& e) {
    return rounded(e.value) + (e.se ? " +- " + rounded(*e.se, 2) : "");
}

Json chords_json(const ChordLengths& chords) {
    Json quantiles = Json::array();
    for (std::size_t q = 0; q < kQuantiles.size(); ++q)
        quantiles.push_back({kQuantiles[q], optional_json(chords.quantiles_m[q])});
    return {{"n", chords.n},
            {"mean_m", estimate_json(chords.mean_m)},
            {"quantiles_m", quantiles},
            {"histogram", {{"bin_m", chords.bin_m}, {"shares", chords.shares}}}};
}

Json diameters_json(const std::optional<BallDiameters>& balls) {
    if (!balls)
        return nullptr;
    Json quantiles = Json::array();
    for (std::size_t q = 0; q < kQuantiles.size(); ++q)
        quantiles.push_back({kQuantiles[q], balls->quantiles_m[q]});
    return {
        {"mean_m", balls->mean_m}, {"quantiles_m", quantiles}, {"greatest_m", balls->greatest_m}};
}

/// A number of the tradition, as JSON and text name it.
struct Item {
    const char *group, *key, *words;
    double TraditionMeasures::*value;
};
using M = TraditionMeasures;
constexpr Item kItems[] = {
    {"thin", "body_in_hull", "body in hull", &M::body_in_hull},
    {"thin", "body_in_box", "body in box", &M::body_in_box},
    {"thin", "slenderness", "slenderness", &M::slenderness},
    {"thin", "waist", "waist", &M::waist},
    {"thin", "wall_share", "walls", &M::wall},
    {"seen_through", "open_share", "open share", &M::see_through},
    {"seen_through", "views_with_window_share", "views with a window", &M::views_with_window},
    {"seen_through", "windows_per_view", "windows per view", &M::windows_per_view},
    {"seen_through", "widest_window_m", "widest window", &M::widest_window_m},
    {"leaky", "channel_m", "channel", &M::channel_m},
    {"leaky", "sealed_voids", "sealed voids", &M::sealed_voids},
    {"leaky", "sealed_porosity", "sealed porosity", &M::sealed_porosity},
    {"wrinkled", "area_ratio", "area ratio", &M::area_ratio},
    {"wrinkled", "roughness_share", "roughness", &M::roughness},
    {"wrinkled", "curvature", "curvature", &M::curvature},
    {"wrinkled", "concave_share", "concave share", &M::concave_share}};

Json both_json(double fine, double coarse) {
    return {{"value", fine}, {"coarse", coarse}, {"settled", agree(fine, coarse)}};
}

/// What the coarser lattice says otherwise.
std::string unsettled(const Tradition& t) {
    std::string list;
    const auto add = [&](const std::string& words) { list += (list.empty() ? "" : ", ") + words; };
    for (const Item& item : kItems)
        if (!agree(t.fine.*item.value, t.coarse.*item.value))
            add(item.words);
    for (std::size_t k = 0; k < kBallShares.size(); ++k) {
        const std::string ball = fmt::format(" ({:.4g} m ball)", kBallShares[k] * t.fine.size_m);
        if (!agree(t.fine.ways[k], t.coarse.ways[k]))
            add("ways through" + ball);
        if (!agree(t.fine.open_porosity[k], t.coarse.open_porosity[k]))
            add("open porosity" + ball);
    }
    return list;
}

struct Compared {
    std::string key, words;
    Estimate measured;
    double predicted;
};

std::vector<Compared> compared(const PoreMeasures& m, const Prediction& p, std::size_t every) {
    const BooleanModel& model = p.model;
    std::vector<Compared> rows = {{"porosity", "porosity", m.porosity, model.porosity},
                                  {"s_v_m1", "hole surface [m^2 per m^3]", m.s_v_m1, model.s_v}};
    // Mean chords, where anything has a surface.
    if (model.s_v > 0 && m.solid_chords.mean_m && m.hole_chords.mean_m) {
        rows.push_back({"solid_chord_m", "stretch of rock, mean [m]", *m.solid_chords.mean_m,
                        4 * (1 - model.porosity) / model.s_v});
        rows.push_back({"hole_chord_m", "stretch of hole, mean [m]", *m.hole_chords.mean_m,
                        4 * model.porosity / model.s_v});
    }
    for (std::size_t k = every - 1; k < m.correlation.size(); k += every)
        if (const CorrelationPoint& c = m.correlation[k]; c.both)
            rows.push_back({fmt::format("correlation_{}", k),
                            fmt::format("both in holes, {:.3g} m apart", c.distance_m), *c.both,
                            boolean_covariance(p.law, p.n_v_m3, c.distance_m)});
    return rows;
}

std::optional<double> difference_se(const Compared& row) {
    if (!row.measured.se || !(*row.measured.se > 0))
        return std::nullopt;
    return (row.measured.value - row.predicted) / *row.measured.se;
}

} // namespace

Json pores_json(const PoreMeasures& m) {
    Json correlation = Json::array();
    for (const CorrelationPoint& c : m.correlation)
        correlation.push_back({{"distance_m", c.distance_m},
                               {"both_in_holes", c.both ? Json(c.both->value) : nullptr},
                               {"se", c.both ? optional_json(c.both->se) : nullptr}});
    return {{"margin_m", m.margin_m},
            {"voxel_m", m.voxel_m},
            {"coarser", m.coarser},
            {"porosity", estimate_json(m.porosity)},
            {"s_v_m1", estimate_json(m.s_v_m1)},
            {"s_v_line_se_m1", m.s_v_line_se_m1},
            {"solid_chords", chords_json(m.solid_chords)},
            {"hole_chords", chords_json(m.hole_chords)},
            {"correlation", correlation},
            {"walls", diameters_json(m.walls)},
            {"pores", diameters_json(m.pores)},
            {"euler_voxels_6", m.euler_faces},
            {"euler_voxels_26", m.euler_corners}};
}

Json comparison_json(const PoreMeasures& measures, const Prediction& prediction) {
    Json rows = Json::object();
    for (const Compared& row : compared(measures, prediction, 1))
        rows[row.key] = {{"measured", row.measured.value},
                         {"se", optional_json(row.measured.se)},
                         {"predicted", row.predicted},
                         {"differs_se", optional_json(difference_se(row))}};
    return rows;
}

Json tradition_json(const Tradition& t) {
    Json json = {{"voxel_m", t.voxel_m},
                 {"coarser", t.coarser},
                 {"size_m", t.fine.size_m},
                 {"height_m", t.fine.height_m}};
    for (const Item& item : kItems)
        json[item.group][item.key] = both_json(t.fine.*item.value, t.coarse.*item.value);
    for (std::size_t k = 0; k < kBallShares.size(); ++k)
        json["leaky"]["balls"].push_back(
            {{"diameter_m", kBallShares[k] * t.fine.size_m},
             {"ways", both_json(t.fine.ways[k], t.coarse.ways[k])},
             {"open_porosity", both_json(t.fine.open_porosity[k], t.coarse.open_porosity[k])}});
    return json;
}

void say_pores(const PoreMeasures& m, const std::string& where, const std::string& base,
               const Console& console) {
    console.say("{}: holes inside {}, from {:.3g} m below its surface", where,
                base.empty() ? "the solid with its enclosed voids filled" : base, m.margin_m);
    if (m.coarser > 1)
        console.say("{}: too large for all its voxels: walls, pores and Euler numbers are taken at "
                    "steps of {} voxels, {:.3g} m",
                    where, m.coarser, m.voxel_m);
    console.say("{}: porosity {}, hole surface {} m^2 per m^3 (of this solid +- {})", where,
                estimate_text(m.porosity), estimate_text(m.s_v_m1), rounded(m.s_v_line_se_m1, 2));
    const auto median = [](const ChordLengths& chords) {
        const auto& q = chords.quantiles_m[2];
        return q ? "half below " + rounded(*q) : std::string("over half leave the base");
    };
    if (m.solid_chords.mean_m && m.hole_chords.mean_m)
        console.say("{}: a line runs through {} m of rock ({}), then {} m of hole ({})", where,
                    estimate_text(*m.solid_chords.mean_m), median(m.solid_chords),
                    estimate_text(*m.hole_chords.mean_m), median(m.hole_chords));
    const auto balls = [&](const char* what, const std::optional<BallDiameters>& b) {
        if (b)
            console.say("{}: {} {:.3g} m wide: 5 % below {:.3g}, half below {:.3g}, 5 % above "
                        "{:.3g}",
                        where, what, b->mean_m, b->quantiles_m[0], b->quantiles_m[2],
                        b->quantiles_m[4]);
    };
    balls("walls", m.walls);
    balls("pores", m.pores);
    console.say("{}: Euler characteristic of its voxels {} over faces, {} over corners", where,
                m.euler_faces, m.euler_corners);
}

void say_comparison(const PoreMeasures& measures, const Prediction& prediction,
                    const Console& console) {
    console.say("{:34} {:>10} {:>9} {:>10}  {}", "", "measured", "se", "predicted", "difference");
    for (const Compared& row : compared(measures, prediction, 4)) {
        const auto se = difference_se(row);
        console.say("{:34} {:>10} {:>9} {:>10}  {}", row.words, rounded(row.measured.value),
                    row.measured.se ? rounded(*row.measured.se, 2) : "-", rounded(row.predicted),
                    se ? fmt::format("{:+.1f} se", *se) : "-");
    }
}

void say_tradition(const Tradition& t, const std::string& where, const Console& console) {
    const TraditionMeasures& m = t.fine;
    console.say("{}: thin: fills {:.3g} of its hull and {:.3g} of its box, slenderness {:.3g}, "
                "waist {:.3g}, walls {:.3g} of its size of {:.3g} m",
                where, m.body_in_hull, m.body_in_box, m.slenderness, m.waist, m.wall, m.size_m);
    console.say("{}: seen through: {:.3g} of its outline is open, {:.3g} windows a view, {:.0f} of "
                "{} views have one, the widest {:.3g} m",
                where, m.see_through, m.windows_per_view, m.views_with_window * kViews, kViews,
                m.widest_window_m);
    for (std::size_t k = 0; k < kBallShares.size(); ++k)
        console.say(
            "{}: leaky: {} reaches {:.3g} of its outline's volume and has {:.0f} ways through",
            where,
            k == 0 ? std::string("water")
                   : fmt::format("a ball of {:.3g} m", kBallShares[k] * m.size_m),
            m.open_porosity[k], m.ways[k]);
    console.say("{}: leaky: {}; {:.0f} sealed voids", where,
                m.channel_m > 0
                    ? fmt::format("a channel of {:.3g} m leads from top to bottom", m.channel_m)
                    : std::string("no channel leads from top to bottom"),
                m.sealed_voids);
    console.say("{}: wrinkled: {:.3g} times the area of its smoothed surface, {:.3g} of its size "
                "off it; curvature {:.3g} (a ball has 2), {:.3g} concave",
                where, m.area_ratio, m.roughness, m.curvature, m.concave_share);
    const std::string differ = unsettled(t);
    console.say("{}: measured at steps of {} voxel{}, {:.3g} m; {}", where, t.coarser,
                t.coarser > 1 ? "s" : "", t.voxel_m,
                differ.empty() ? "at half the resolution all is within 5 %"
                               : "at half the resolution off by more than 5 %: " + differ);
}

} // namespace taihu
