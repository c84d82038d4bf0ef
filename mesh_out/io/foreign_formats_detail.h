#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace taihu {

// In the program that reads for others; they throw what OpenEXR and Draco throw.

/// The channels named, or all, of an EXR.
std::string flat_exr(std::string_view bytes, const std::string& where,
                     const std::vector<std::string>& channels);

/// What decode_draco_mesh() makes of a stream.
std::string flat_draco(std::string_view bytes, const std::string& where,
                       const std::vector<std::string>& words);

} // namespace taihu
