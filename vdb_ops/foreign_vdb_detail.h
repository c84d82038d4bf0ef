#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace taihu {

/// In the program that reads for others: the first level set that is the file on standard input, or
/// with the word `any` the first grid of floats, flat; empty when there is none. Throws what
/// OpenVDB throws.
std::string flat_vdb(std::string_view bytes, const std::string& where,
                     const std::vector<std::string>& words);

} // namespace taihu
