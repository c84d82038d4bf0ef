#include "mesh_out/grain.h"

#include <cmath>
#include <limits>

#include "stats/core/rng.h"

namespace taihu {
namespace {

constexpr std::uint32_t kGrainStream = 0x6772616e; // "gran"

} // namespace

double grain(const Vec3& p, double size_m, std::uint64_t seed) {
    const Rng rng{seed, kGrainStream};
    const auto unit = [](std::uint32_t word) { return (word + 0.5) / 0x1p32; };
    const Vec3 at = p / size_m;
    double nearest = std::numeric_limits<double>::infinity(), value = 0;
    for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
            for (int k = -1; k <= 1; ++k) {
                const Vec3 cube{std::floor(at.x) + i, std::floor(at.y) + j, std::floor(at.z) + k};
                std::uint64_t item = 0; // 21 bits an axis: no two cubes of a rock share one
                for (int axis = 0; axis < 3; ++axis)
                    item = item << 21 |
                           (static_cast<std::uint64_t>(static_cast<std::int64_t>(cube[axis])) &
                            0x1fffff);
                const auto words = rng.words(item);
                const double d = length_squared(
                    cube + Vec3{unit(words[0]), unit(words[1]), unit(words[2])} - at);
                if (d < nearest) {
                    nearest = d;
                    value = unit(words[3]);
                }
            }
    return value;
}

} // namespace taihu
