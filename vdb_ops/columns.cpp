#include "vdb_ops/columns_detail.h"

#include <algorithm>
#include <atomic>
#include <tuple>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/rounding_detail.h"

namespace taihu {
namespace {

constexpr double kColumn_bytes = 60; // at the peak: its count, and two crossings in most

/// A face's edge at height y.
struct Cut {
    double x, z;
    int sign; ///< +1 when the face's edge runs upwards in y
};

/// Calls fn(x, y, z, sign) for each column that passes through the face.
template <class Fn>
void each_crossing(const std::array<Vec3, 3>& p, const Triangle& id, Fn&& fn) {
    const double z_low = std::min({p[0].z, p[1].z, p[2].z});
    const double z_high = std::max({p[0].z, p[1].z, p[2].z});
    const int y0 = ceil_int(std::min({p[0].y, p[1].y, p[2].y}));
    const int y1 = ceil_int(std::max({p[0].y, p[1].y, p[2].y})) - 1;
    for (int y = y0; y <= y1; ++y) {
        Cut cut[2];
        int n = 0;
        for (std::size_t k = 0; k < 3 && n < 2; ++k) {
            std::size_t s = k, e = (k + 1) % 3;
            const int sign = p[s].y <= y ? 1 : -1;
            if (id[s] > id[e])
                std::swap(s, e); // the same edge rounds the same from both its faces
            if ((p[s].y <= y) == (p[e].y <= y))
                continue;
            const double u = (y - p[s].y) / (p[e].y - p[s].y);
            cut[n++] = {p[s].x + u * (p[e].x - p[s].x), p[s].z + u * (p[e].z - p[s].z), sign};
        }
        if (n < 2)
            continue;
        const Cut &left = cut[cut[0].x <= cut[1].x ? 0 : 1],
                  &right = cut[cut[0].x <= cut[1].x ? 1 : 0];
        const double slope = right.x > left.x ? (right.z - left.z) / (right.x - left.x) : 0;
        const int x1 = ceil_int(right.x) - 1;
        for (int x = ceil_int(left.x); x <= x1; ++x)
            fn(x, y, std::clamp(left.z + slope * (x - left.x), z_low, z_high), left.sign);
    }
}

} // namespace

Columns::Columns(const ClosedMesh& mesh, const std::vector<Vec3>& points,
                 const openvdb::CoordBBox& box)
    : x0_(box.min().x()), y0_(box.min().y()), nx_(box.dim().x()), ny_(box.dim().y()) {
    const std::size_t n_columns = static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_);
    const double needed = kColumn_bytes * static_cast<double>(n_columns);
    if (const double limit = memory_limit_bytes(); needed > limit)
        throw Error(Fault::unsupported, "refused: a mesh over " + std::to_string(nx_) + " x " +
                                            std::to_string(ny_) + " voxels would need over " +
                                            human_bytes(needed) + " (limit " + human_bytes(limit) +
                                            "); use a larger voxel");
    std::vector<std::atomic<std::uint32_t>> count(n_columns);
    constexpr std::size_t kChunk = 256; // faces
    const std::size_t n_faces = mesh.triangles.size();
    std::vector<std::vector<std::pair<std::size_t, Hit>>> found((n_faces + kChunk - 1) / kChunk);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
        for (std::size_t i = chunk * kChunk; i < std::min(n_faces, (chunk + 1) * kChunk); ++i) {
            const Triangle& t = mesh.triangles[i];
            each_crossing({points[t[0]], points[t[1]], points[t[2]]}, t,
                          [&](int x, int y, double z, int sign) {
                              const std::size_t c = column(x, y);
                              found[chunk].push_back({c, {ceil_int(z), sign, mesh.shell_of[i]}});
                              count[c].fetch_add(1, std::memory_order_relaxed);
                          });
        }
    });
    first_.assign(n_columns + 1, 0);
    for (std::size_t c = 0; c < n_columns; ++c)
        first_[c + 1] = first_[c] + count[c].load(std::memory_order_relaxed);
    hits_.resize(first_[n_columns]);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
        for (const auto& [c, hit] : found[chunk])
            hits_[first_[c] + count[c].fetch_sub(1, std::memory_order_relaxed) - 1] = hit;
    });
    // Sorting makes the result independent of the order in which threads came.
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n_columns, 1024), [&](const auto& range) {
        for (std::size_t c = range.begin(); c < range.end(); ++c)
            if (first_[c + 1] - first_[c] > 1)
                std::sort(hits_.begin() + static_cast<std::ptrdiff_t>(first_[c]),
                          hits_.begin() + static_cast<std::ptrdiff_t>(first_[c + 1]),
                          [](const Hit& a, const Hit& b) {
                              return std::tie(a.shell, a.z, a.sign) <
                                     std::tie(b.shell, b.z, b.sign);
                          });
    });
    find_overlaps(mesh);
}

void Columns::find_overlaps(const ClosedMesh& mesh) {
    overlaps_.assign(mesh.shells.size(), 0);
    for (std::size_t c = 0; c + 1 < first_.size(); ++c) {
        int winding = 0;
        for (std::size_t i = first_[c]; i < first_[c + 1]; ++i) {
            const Hit& hit = hits_[i];
            if (i == first_[c] || hits_[i - 1].shell != hit.shell)
                winding = 0;
            winding += mesh.shells[hit.shell].volume_m3 < 0 ? -hit.sign : hit.sign;
            const bool last_here = i + 1 == first_[c + 1] || hits_[i + 1].shell != hit.shell ||
                                   hits_[i + 1].z != hit.z;
            if (last_here && (winding > 1 || winding < 0))
                overlaps_[hit.shell] = 1;
        }
    }
}

int Columns::winding(const openvdb::Coord& voxel, std::uint32_t shell) const {
    if (!contains(voxel.x(), voxel.y()))
        return 0;
    int sum = 0;
    for (const Hit* hit = begin(voxel.x(), voxel.y()); hit != end(voxel.x(), voxel.y()); ++hit)
        if (hit->shell == shell && hit->z <= voxel.z())
            sum += hit->sign;
    return sum;
}

void Columns::winding_row(const openvdb::Coord& voxel, std::uint32_t shell,
                          std::int8_t* out) const {
    constexpr int kRow = 8;
    int steps[kRow] = {};
    bool even = true; // no step above the first voxel
    for (const Hit* hit = begin(voxel.x(), voxel.y()); hit != end(voxel.x(), voxel.y()); ++hit)
        if (const int z = std::max(hit->z - voxel.z(), 0); hit->shell == shell && z < kRow) {
            steps[z] += hit->sign;
            even = even && z == 0;
        }
    const auto held = [](int n) { return static_cast<std::int8_t>(std::clamp(n, -100, 100)); };
    if (even) {
        std::fill(out, out + kRow, held(steps[0]));
        return;
    }
    int sum = 0;
    for (int z = 0; z < kRow; ++z)
        out[z] = held(sum += steps[z]);
}

} // namespace taihu
