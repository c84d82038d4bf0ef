#pragma once
#include <array>
#include <string_view>

namespace taihu {

/// A row of the performance table of Deix, "Real-time rendering of fractal rocks", section 8, and
/// what the same work takes here.
struct FractalRow {
    std::string_view process;              ///< Midpoint, Subdivision, Dyn.Bump.
    std::size_t n_triangles = 0;           ///< worked on
    double paper_ms = 0, paper_per_ms = 0; ///< his duration, his vertices in a millisecond
    double ms = 0;                         ///< processor time, the least of the runs

    /// He counts three for each triangle.
    double n_vertices() const { return 3 * static_cast<double>(n_triangles); }
    double per_ms() const { return n_vertices() / ms; }
};

/// Times the nine rows: displacement and damping of models of 20, 320 and 5120 triangles, and for
/// the bump map the averaged normals of one and their way through spherical texture coordinates
/// into a map of 256 x 256.
/// \param runs  of each, at least 1; short ones are repeated until a run takes 5 ms.
std::array<FractalRow, 9> time_fractal_rows(int runs);

/// The order that the paper reports: damping takes less time than displacement and gains more from
/// larger models, and every process takes longer for larger ones.
bool same_order(const std::array<FractalRow, 9>& rows);

} // namespace taihu
