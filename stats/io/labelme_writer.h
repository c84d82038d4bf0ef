#pragma once
#include <span>
#include <string>

#include "stats/io/measurements.h"

namespace taihu {

/// Segments as a labelme file (JSON, version 5): each a shape of type `line` with its label and its
/// ends to the last digit. labelme opens it beside the photo; read_measurements() gives the same
/// segments back. Minor axes have no place in it.
///
/// \param image  the photo's name, without folders: it lies beside the file.
/// \param width_px, height_px  of the photo, 1..1e6.
/// \param segments  their `image` is not looked at.
/// \throws Error bad_argument: no name or one with a folder, a side out of range, segments[i]
///         without ends, with ends that are not finite, or of length 0.
std::string format_labelme(const std::string& image, int width_px, int height_px,
                           std::span<const Segment> segments);

} // namespace taihu
