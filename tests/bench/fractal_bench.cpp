// fractal_bench: the performance table of Deix again, beside his. Exit code 1 when the order of
// rows is another one.
#include <fmt/format.h>

#include "tests/bench/fractal_rows.h"

int main() {
    const auto rows = taihu::time_fractal_rows(15);
    fmt::print("process      triangles   then ms  vertex/ms     now ms  vertex/ms    faster\n");
    for (const taihu::FractalRow& row : rows)
        fmt::print("{:<12} {:>9} {:>9.2f} {:>10.4f} {:>10.4f} {:>10.0f} {:>8.0f} x\n", row.process,
                   row.n_triangles, row.paper_ms, row.paper_per_ms, row.ms, row.per_ms(),
                   row.paper_ms / row.ms);
    const bool same = taihu::same_order(rows);
    fmt::print("order (damping below displacement and scaling better, larger models dearer): {}\n",
               same ? "as then" : "not as then");
    const auto gain = [&](std::size_t from, bool paper) {
        return paper ? rows[from + 2].paper_per_ms / rows[from].paper_per_ms
                     : rows[from + 2].per_ms() / rows[from].per_ms();
    };
    fmt::print("vertex/ms of 5120 triangles / of 20: displacement {:.1f} then, {:.1f} now; damping "
               "{:.1f} then, {:.1f} now\n",
               gain(0, true), gain(0, false), gain(3, true), gain(3, false));
    return same ? 0 : 1;
}
