#include "stats/core/progress.h"

#include "stats/core/error.h"

namespace taihu {

void report_stage(Progress* progress, std::string_view name) {
    check_cancelled(progress);
    if (progress)
        progress->stage(name);
}

void report_fraction(Progress* progress, double done) {
    if (progress)
        progress->fraction(done);
}

void check_cancelled(const Progress* progress) {
    if (progress && progress->cancelled())
        throw Error(Fault::cancelled, "cancelled");
}

} // namespace taihu
