#pragma once
#include <string>

#include "stats/core/progress.h"

namespace taihu {

/// What gnuplot draws: an SVG picture.
/// \param name    of the picture, letters alone: its parts are named after it, so that several may
///                stand on one page.
/// \param script  commands and data, after the terminal was set; it must not hold foreign text.
/// \throws Error unsupported: there is no gnuplot, or it stumbles over the script; io: no memory
///         for its files, or a limit of their size; cancelled: at once, gnuplot is ended.
std::string gnuplot_svg(const std::string& name, const std::string& script,
                        const Progress* progress = nullptr);

} // namespace taihu
