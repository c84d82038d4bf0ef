#include "tools/gallery_page.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "stats/core/text.h"

namespace taihu {
namespace {

constexpr const char* kStyle = R"css(
:root{--ink:#23241f;--soft:#6a6a60;--line:#dcd9cf;--paper:#faf9f5;--card:#fff;--mark:#8a5a2b}
*{box-sizing:border-box}
html{scroll-behavior:smooth;scroll-padding-top:4rem}
body{margin:0;font:16px/1.55 system-ui,sans-serif;color:var(--ink);background:var(--paper)}
header,main,footer{max-width:76rem;margin:0 auto;padding:0 1.25rem}
header{padding-top:3rem}
h1,h2,h3{font-family:"Iowan Old Style",Palatino,"Book Antiqua",Georgia,serif;font-weight:600;
line-height:1.2}
h1{font-size:2.6rem;margin:0}h2{font-size:1.8rem;margin:0}h3{font-size:1.25rem;margin:0}
header p,.text>p{max-width:46rem;color:var(--soft)}
nav{position:sticky;top:0;z-index:1;background:var(--paper);border-bottom:1px solid var(--line)}
nav div{max-width:76rem;margin:0 auto;padding:.7rem 1.25rem;display:flex;gap:1.5rem;
flex-wrap:wrap}
a{color:var(--mark);text-decoration:none}a:hover{text-decoration:underline}
.text{padding-top:3rem}
.rows{display:flex;flex-wrap:wrap;gap:.35rem;padding:0;list-style:none;font-size:.8rem}
.rows a{display:block;padding:.1rem .5rem;border:1px solid var(--line);border-radius:1rem;
background:var(--card)}
article{background:var(--card);border:1px solid var(--line);border-radius:.6rem;
padding:1.25rem 1.4rem;margin:1.5rem 0;overflow:hidden}
.head{display:flex;flex-wrap:wrap;gap:.2rem .8rem;align-items:baseline}
.row{font-weight:600;color:var(--mark);font-variant-numeric:tabular-nums}
.figure{color:var(--soft);font-size:.9rem}
.look{margin:.35rem 0 1rem;max-width:52rem}
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,16rem),1fr));
gap:1rem}
figure{margin:0}
img{display:block;width:100%;height:auto;border-radius:.3rem}
img.small{width:auto;margin:0 auto}
img.enlarged{image-rendering:pixelated}
@media(min-width:42rem){.large{grid-column:span 2}}
.shown{min-height:6rem;display:grid;align-items:center}
figcaption{color:var(--soft);font-size:.87rem;margin-top:.4rem}
.numbers{display:flex;flex-wrap:wrap;gap:1.5rem;align-items:flex-start;margin-top:1rem}
.scroll{overflow-x:auto;max-width:100%}
table{border-collapse:collapse;font-size:.88rem;font-variant-numeric:tabular-nums}
th,td{text-align:right;padding:.25rem .75rem;border-bottom:1px solid var(--line)}
th{color:var(--soft);font-weight:600}
th:first-child,td:first-child{text-align:left;padding-left:0}
svg{width:24rem;max-width:100%;height:auto;font-size:11px}
details{margin-top:1rem;font-size:.88rem}summary{cursor:pointer;color:var(--mark)}
pre{background:#f4f2ec;border-radius:.3rem;padding:.8rem 1rem;overflow-x:auto;margin:.5rem 0 0;
line-height:1.5}
footer{padding:2rem 1.25rem 3rem;color:var(--soft);font-size:.9rem}
)css";

/// Text in a page: no control bytes, no markup.
std::string html(std::string_view text) {
    std::string safe;
    for (const char c : printable(text, 4000))
        safe += c == '&'   ? "&amp;"
                : c == '<' ? "&lt;"
                : c == '>' ? "&gt;"
                : c == '"' ? "&quot;"
                           : std::string(1, c);
    return safe;
}

// --- Charts

constexpr double kLeft = 48, kRight = 372, kTop = 14, kBottom = 196; // of the plot [px]
constexpr const char* kInks[] = {"#8a5a2b", "#2f6f8f", "#5b7f3a", "#7a4a86"};

/// One axis: numbers to pixels.
struct Axis {
    double lo = 0, hi = 1, from_px = 0, to_px = 1;
    bool log = false;

    double px(double value) const {
        const double t = log ? (std::log(value) - std::log(lo)) / (std::log(hi) - std::log(lo))
                             : (value - lo) / (hi - lo);
        return from_px + t * (to_px - from_px);
    }
    std::vector<double> ticks() const {
        std::vector<double> at;
        if (log) {
            for (double t = std::pow(10, std::ceil(std::log10(lo) - 1e-9)); t <= hi * 1.001;
                 t *= 10)
                at.push_back(t);
            return at.size() > 1 ? at : std::vector<double>{lo, hi};
        }
        const double rough = (hi - lo) / 4, decade = std::pow(10, std::floor(std::log10(rough)));
        const double step = decade * (rough < 1.5 * decade   ? 1
                                      : rough < 3.5 * decade ? 2
                                      : rough < 7.5 * decade ? 5
                                                             : 10);
        for (double t = std::ceil(lo / step - 1e-9) * step; t <= hi + 1e-9 * step; t += step)
            at.push_back(std::abs(t) < 1e-9 * step ? 0 : t);
        return at;
    }
};

using Curve = std::vector<std::pair<double, double>>;

Axis axis_of(const std::vector<double>& values, double from_px, double to_px, bool log) {
    const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
    Axis axis{log ? *lo : std::min(0.0, *lo), *hi, from_px, to_px, log};
    if (!(axis.hi > axis.lo))
        axis.hi = axis.lo + 1;
    return axis;
}

/// \param beneath  broad and pale, so that a curve on it leaves it to be seen.
std::string curve_svg(const Curve& curve, const Axis& x, const Axis& y, const char* ink,
                      bool beneath) {
    std::string line, dots;
    for (const auto& [a, b] : curve) {
        line += fmt::format("{}{:.1f},{:.1f}", line.empty() ? "" : " ", x.px(a), y.px(b));
        dots += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\"/>", x.px(a), y.px(b),
                            beneath ? 5 : 2.6);
    }
    return fmt::format("<g fill=\"{0}\" opacity=\"{1}\"><polyline points=\"{2}\" fill=\"none\" "
                       "stroke=\"{0}\" stroke-width=\"{3}\"/>{4}</g>",
                       ink, beneath ? 0.45 : 1, line, beneath ? 5 : 1.6, dots);
}

/// The curves of a table's chart; cells that are no numbers are left out.
std::string chart_svg(const GalleryTable& table) {
    const GalleryChart& chart = *table.chart;
    std::vector<Curve> curves(chart.y.size());
    std::vector<double> xs, ys;
    for (const auto& row : table.rows)
        for (std::size_t k = 0; k < chart.y.size(); ++k) {
            const auto x = parse_number(row[chart.x]), y = parse_number(row[chart.y[k]]);
            if (!x || !y || (chart.log && (*x <= 0 || *y <= 0)))
                continue;
            curves[k].emplace_back(*x, *y);
            xs.push_back(*x);
            ys.push_back(*y);
        }
    if (xs.empty())
        return {};
    const Axis x = axis_of(xs, kLeft, kRight, chart.log), y = axis_of(ys, kBottom, kTop, chart.log);
    std::string svg = "<svg viewBox=\"0 0 384 246\" role=\"img\">";
    for (const double t : x.ticks())
        svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\" "
                           "fill=\"#6a6a60\">{:.4g}</text>",
                           x.px(t), kBottom + 16, t);
    for (const double t : y.ticks())
        svg += fmt::format("<path d=\"M{} {:.1f}H{}\" stroke=\"#dcd9cf\"/><text x=\"{}\" "
                           "y=\"{:.1f}\" text-anchor=\"end\" fill=\"#6a6a60\">{:.4g}</text>",
                           kLeft, y.px(t), kRight, kLeft - 6, y.px(t) + 4, t);
    svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\" fill=\"#23241f\">{}</text>",
                       kRight, kBottom + 30, html(table.columns[chart.x]));
    double key_x = kLeft;
    for (std::size_t k = 0; k < curves.size(); ++k) {
        const char* ink = kInks[k % std::size(kInks)];
        svg += curve_svg(curves[k], x, y, ink, k == 0 && curves.size() > 1);
        const std::string& name = table.columns[chart.y[k]];
        svg += fmt::format("<text x=\"{:.0f}\" y=\"242\" fill=\"{}\">{}</text>", key_x, ink,
                           html(name));
        key_x += 16 + 6.2 * static_cast<double>(name.size());
    }
    return svg + "</svg>";
}

// --- Entries

constexpr int kSmallPx = 120, kLargePx = 480; // widths of what is shown as it is, and wider

std::string table_html(const GalleryTable& table) {
    std::string out = "<div class=\"scroll\"><table><tr>";
    for (const std::string& column : table.columns)
        out += "<th>" + html(column) + "</th>";
    out += "</tr>\n";
    for (const auto& row : table.rows) {
        out += "<tr>";
        for (const std::string& cell : row)
            out += "<td>" + html(cell) + "</td>";
        out += "</tr>\n";
    }
    return out + "</table></div>\n";
}

std::string picture_html(const MadeEntry& made, std::size_t i) {
    const GalleryPicture& p = made.entry.pictures[i];
    const auto [width, height] = made.sizes[i];
    const char* kind = p.enlarged ? "enlarged" : width < kSmallPx ? "small" : "full";
    return fmt::format("<figure class=\"{}\"><div class=\"shown\"><img class=\"{}\" src=\"{}/{}\" "
                       "width=\"{}\" height=\"{}\" alt=\"{}\" loading=\"lazy\"></div>"
                       "<figcaption>{}</figcaption></figure>\n",
                       width > kLargePx ? "large" : "one", kind, html(made.entry.row), html(p.file),
                       width, height, html(p.caption), html(p.caption));
}

std::string recipe_html(const GalleryEntry& entry) {
    if (entry.commands.empty())
        return {};
    std::string out = "<details><summary>How it is made</summary>";
    for (const auto& [name, bytes] : entry.files)
        out += fmt::format("<p>It reads <a href=\"{}/{}\">{}</a>.</p>", html(entry.row), html(name),
                           html(name));
    out += "<pre>";
    for (const std::string& command : entry.commands)
        out += html(command) + "\n";
    return out + "</pre></details>\n";
}

std::string entry_html(const MadeEntry& made) {
    const GalleryEntry& e = made.entry;
    std::string out =
        fmt::format("<article id=\"{0}\"><div class=\"head\"><a class=\"row\" href=\"#{0}\">{0}</a>"
                    "<h3>{1}</h3><span class=\"figure\">{2}</span></div>\n<p class=\"look\">{3}"
                    "</p>\n",
                    html(e.row), html(e.title), html(e.figure), html(e.look));
    if (!e.pictures.empty()) {
        out += "<div class=\"pictures\">\n";
        for (std::size_t i = 0; i < e.pictures.size(); ++i)
            out += picture_html(made, i);
        out += "</div>\n";
    }
    if (e.table) {
        out += "<div class=\"numbers\">" + table_html(*e.table);
        if (e.table->chart)
            out += chart_svg(*e.table);
        out += "</div>\n";
    }
    return out + recipe_html(e) + "</article>\n";
}

} // namespace

std::string format_gallery(std::span<const MadeText> texts) {
    std::string nav, body;
    for (const MadeText& t : texts) {
        nav += fmt::format("<a href=\"#{}\">{}</a>", html(t.text.id), html(t.text.title));
        body += fmt::format("<section class=\"text\" id=\"{}\"><h2>{}</h2><p>{}</p>\n<ul "
                            "class=\"rows\">",
                            html(t.text.id), html(t.text.title), html(t.text.about));
        for (const MadeEntry& e : t.entries)
            body += fmt::format("<li><a href=\"#{0}\" title=\"{1}\">{0}</a></li>",
                                html(e.entry.row), html(e.entry.title));
        body += "</ul>\n";
        for (const MadeEntry& e : t.entries)
            body += entry_html(e);
        body += "</section>\n";
    }
    return fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
        "{}\n"
        "<title>taihu: the gallery</title>\n<style>{}</style></head>\n<body>\n"
        "<header><h1>The gallery</h1><p>Three texts on stone in computer graphics, made again: "
        "figures, plates and tables by the commands that stand under each, and what was printed "
        "then beside what comes out now.</p></header>\n"
        "<nav><div>{}</div></nav>\n<main>\n{}</main>\n"
        "<footer>Made by <code>taihu gallery</code>.</footer>\n</body></html>\n",
        kGalleryMark, kStyle, nav, body);
}

} // namespace taihu
