#pragma once
#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

namespace taihu {

/// A number as it stands in a file, from bytes that need no alignment.
template <class T>
T load_number(const char* from, std::endian order = std::endian::little) {
    char bytes[sizeof(T)];
    if (order == std::endian::native)
        std::memcpy(bytes, from, sizeof(T));
    else
        std::reverse_copy(from, from + sizeof(T), bytes);
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
}

/// Append a number, little-endian.
template <class T>
void append_number(std::string& out, T value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    if constexpr (std::endian::native == std::endian::big)
        std::reverse(bytes, bytes + sizeof(T));
    out.append(bytes, sizeof(T));
}

} // namespace taihu
