#pragma once
#include <string>
#include <string_view>

namespace taihu {

/// SHA-256 of `bytes` as 64 lower-case hexadecimal digits (OpenSSL's libcrypto).
std::string sha256_hex(std::string_view bytes);

} // namespace taihu
