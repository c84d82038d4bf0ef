#pragma once

namespace taihu {

// std::floor() and std::ceil() are calls into the library on plain x86-64. |v| < 2^31.

inline int floor_int(double v) {
    const int i = static_cast<int>(v);
    return i - (i > v);
}

inline int ceil_int(double v) {
    const int i = static_cast<int>(v);
    return i + (i < v);
}

} // namespace taihu
