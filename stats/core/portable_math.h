#pragma once

namespace taihu {

/// Natural logarithm with the same bits on every IEEE machine: integers and + - * / only.
///
/// Error below 1 unit in the last place, subnormal numbers included. 0 gives -infinity, +infinity
/// gives itself, a negative number or a NaN gives a NaN, as std::log does.
double portable_log(double x);

/// e to the power of `x`, with the same bits on every IEEE machine.
///
/// Error below 2 units in the last place for normal results. Above 709.79 it is infinite, below
/// -745.2 it is 0; a NaN gives a NaN.
double portable_exp(double x);

} // namespace taihu
