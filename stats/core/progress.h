#pragma once
#include <string_view>

namespace taihu {

/// How a long function reports and is told to stop. Implementations are called from any thread.
class Progress {
public:
    virtual ~Progress() = default;
    /// A new stage begins; `name` is a few lower-case words.
    virtual void stage(std::string_view name) = 0;
    /// Share of the stage that is done, 0..1; called at most about once per percent.
    virtual void fraction(double done) = 0;
    virtual bool cancelled() const = 0;
};

/// The same three on a pointer that may be null.
void report_stage(Progress* progress, std::string_view name);
void report_fraction(Progress* progress, double done);
/// \throws Error cancelled, when `progress` says so.
void check_cancelled(const Progress* progress);

} // namespace taihu
