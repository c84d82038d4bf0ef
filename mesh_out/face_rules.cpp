#include <algorithm>
#include <cmath>

#include "mesh_out/face_rules_detail.h"

namespace taihu {
namespace {

constexpr double kSmooth = 2.85; ///< length of the sum of three gradients of 1 that differ little

} // namespace

FaceParabolas parabolas(const FaceCorners& face, const FaceValues& values,
                        const std::array<Vec3, 3>& gradients) {
    FaceParabolas out;
    FaceRange& r = out.range;
    r = {std::min({values[0], values[1], values[2]}), std::max({values[0], values[1], values[2]}),
         gradients[0] + gradients[1] + gradients[2]};
    double middle = (values[0] + values[1] + values[2]) / 3;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = k == 2 ? 0 : k + 1;
        const Vec3 edge = face[next] - face[k];
        const double from = dot(gradients[k], edge), to = dot(gradients[next], edge),
                     at = (values[k] + values[next]) / 2 + (from - to) / 8;
        r.lo = std::min(r.lo, at);
        r.hi = std::max(r.hi, at);
        middle += (from - to) / 18;
        out.skew = std::max(out.skew, std::abs(from + to - 2 * (values[next] - values[k])) / 8);
    }
    r.lo = std::min(r.lo, middle);
    r.hi = std::max(r.hi, middle);
    out.is_smooth = length(r.gradient) > kSmooth;
    return out;
}

} // namespace taihu
