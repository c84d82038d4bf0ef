#pragma once

namespace taihu {

/// Natural logarithm with the same bits on every IEEE machine: integers and + - * / only.
///
/// Error below 1 unit in the last place, subnormal numbers included. 0 gives -infinity, +infinity
/// gives itself, a negative number or a NaN gives a NaN, as std::log does.
double portable_log(double x);

} // namespace taihu
