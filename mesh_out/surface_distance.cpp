#include "mesh_out/surface_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "mesh_out/closest_point_detail.h"
#include "stats/core/error.h"

namespace taihu {

struct SurfaceDistance::Scene {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    Vec3 center;       ///< positions are kept relative to it, for float's sake
    double extent = 0; ///< of the relative positions
    /// Corners, relative: what distances are computed from. Side by side, since memory is what a
    /// search waits for.
    std::vector<std::array<Vec3, 3>> corners;
    /// A ball round each triangle: most of those that Embree offers are told to be too far by it.
    struct Ball {
        float x, y, z, radius;
    };
    std::vector<Ball> balls;

    static Ball ball_round(const std::array<Vec3, 3>& corners) {
        const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
        Ball ball{static_cast<float>(middle.x), static_cast<float>(middle.y),
                  static_cast<float>(middle.z), 0};
        double radius = 0;
        for (const Vec3& corner : corners)
            radius = std::max(radius, length(corner - Vec3{ball.x, ball.y, ball.z}));
        ball.radius = std::nextafter(static_cast<float>(radius * (1 + 1e-12)),
                                     std::numeric_limits<float>::infinity());
        return ball;
    }

    ~Scene() {
        if (scene)
            rtcReleaseScene(scene);
        if (device)
            rtcReleaseDevice(device);
    }

    struct Search {
        const Scene* scene;
        Vec3 point; ///< relative
        double best, best_squared;
        double slack; ///< more than float rounds off, so that no triangle is culled wrongly
        std::uint32_t triangle;
        Vec3 nearest;
    };

    static float search_radius(double distance, double slack) {
        const double radius = distance * (1 + 1e-6) + slack;
        return radius < 1e18 ? static_cast<float>(radius) : std::numeric_limits<float>::infinity();
    }

    static bool visit(RTCPointQueryFunctionArguments* args) {
        Search& search = *static_cast<Search*>(args->userPtr);
        const Ball& ball = search.scene->balls[args->primID];
        const double reach = (search.best + ball.radius) * (1 + 1e-12); // more than double rounds
        if (length_squared(search.point - Vec3{ball.x, ball.y, ball.z}) > reach * reach)
            return false;
        const auto& [a, b, c] = search.scene->corners[args->primID];
        const Vec3 q = closest_point_on_triangle(search.point, a, b, c);
        const double squared = length_squared(q - search.point);
        // Ties go to the lower index: the answer must not depend on the shape of the hierarchy.
        if (squared > search.best_squared ||
            (squared == search.best_squared && args->primID >= search.triangle))
            return false;
        search.best = std::sqrt(squared);
        search.best_squared = squared;
        search.triangle = args->primID;
        search.nearest = q;
        const float radius = search_radius(search.best, search.slack);
        if (radius >= args->query->radius)
            return false;
        args->query->radius = radius;
        return true;
    }

    Search search(const Vec3& point, double at_most) const {
        Search result{this, point - center,          at_most, at_most * at_most,
                      0,    RTC_INVALID_GEOMETRY_ID, {}};
        const Vec3& p = result.point;
        result.slack = 1e-6 * (extent + std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}));
        RTCPointQuery query;
        query.x = static_cast<float>(p.x);
        query.y = static_cast<float>(p.y);
        query.z = static_cast<float>(p.z);
        query.time = 0;
        query.radius = search_radius(at_most, result.slack);
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(scene, &query, &context, &Scene::visit, &result);
        return result;
    }
};

SurfaceDistance::SurfaceDistance(const TriMesh& mesh) : scene_(std::make_unique<Scene>()) {
    if (mesh.triangles.empty())
        throw Error(Fault::bad_argument,
                    "surface distance: the mesh has 0 triangles; give one with a surface");
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t])
            if (v >= mesh.positions.size() || !is_finite(mesh.positions[v]))
                throw Error(Fault::bad_argument,
                            "surface distance: triangles[" + std::to_string(t) + "] has vertex " +
                                std::to_string(v) + " without a finite position; repair the mesh");
    Scene& s = *scene_;
    const Box box = bounds(mesh);
    s.center = box.center();
    s.extent = box.longest();
    s.corners.reserve(mesh.triangles.size());
    s.balls.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
        s.corners.push_back({mesh.positions[t[0]] - s.center, mesh.positions[t[1]] - s.center,
                             mesh.positions[t[2]] - s.center});
        s.balls.push_back(Scene::ball_round(s.corners.back()));
    }

    s.device = rtcNewDevice("verbose=0");
    s.scene = rtcNewScene(s.device);
    rtcSetSceneFlags(s.scene, RTC_SCENE_FLAG_ROBUST);
    const RTCGeometry geometry = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), mesh.positions.size()));
    auto* indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), mesh.triangles.size()));
    if (vertices && indices) {
        for (const Vec3& p : mesh.positions)
            for (int k = 0; k < 3; ++k) // unused positions may be non-finite; Embree need not know
                *vertices++ = is_finite(p) ? static_cast<float>(p[k] - s.center[k]) : 0.0f;
        for (const Triangle& t : mesh.triangles)
            indices = std::copy(t.begin(), t.end(), indices);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(s.scene, geometry);
        rtcCommitScene(s.scene);
    }
    rtcReleaseGeometry(geometry);
    if (rtcGetDeviceError(s.device) != RTC_ERROR_NONE)
        throw Error(Fault::numeric, "surface distance: Embree cannot hold " +
                                        std::to_string(mesh.triangles.size()) +
                                        " triangles; use a smaller mesh");
}

SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;
SurfaceDistance::~SurfaceDistance() = default;

double SurfaceDistance::operator()(const Vec3& point, double at_most) const {
    const Scene::Search found = scene_->search(point, at_most);
    return found.triangle == RTC_INVALID_GEOMETRY_ID ? at_most : std::min(at_most, found.best);
}

Vec3 SurfaceDistance::nearest(const Vec3& point) const {
    return scene_->search(point, 1e300).nearest + scene_->center;
}

std::uint32_t SurfaceDistance::nearest_triangle(const Vec3& point) const {
    return scene_->search(point, 1e300).triangle;
}

namespace {

/// What one chunk of samples adds up to.
struct Sum {
    double max_m = 0, weighted_squares = 0, weight = 0;
    std::size_t n = 0;

    void add(const Sum& other) {
        max_m = std::max(max_m, other.max_m);
        weighted_squares += other.weighted_squares;
        weight += other.weight;
        n += other.n;
    }
};

/// Asks for one sample after another. Distance changes by no more than the way between two points,
/// so the last answer bounds the next search; the answers are the same as without.
class Walk {
public:
    explicit Walk(const SurfaceDistance& surface) : surface_(surface) {}

    void sample(const Vec3& p, double weight) {
        const double reach = sum_.n == 0 ? 1e300 : (d_ + length(p - p_)) * (1 + 1e-9) + 1e-300;
        d_ = surface_(p, reach);
        p_ = p;
        sum_.max_m = std::max(sum_.max_m, d_);
        sum_.weighted_squares += weight * d_ * d_;
        sum_.weight += weight;
        ++sum_.n;
    }
    const Sum& sum() const { return sum_; }

private:
    const SurfaceDistance& surface_;
    Vec3 p_;
    double d_ = 0;
    Sum sum_;
};

/// `visit(item, walk)` for items 0..n-1 in fixed chunks; summed in their order.
template <typename Visit>
Sum sum_over(std::size_t n, const SurfaceDistance& surface, Visit visit) {
    constexpr std::size_t kChunk = 4096;
    std::vector<Sum> sums((n + kChunk - 1) / kChunk);
    tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t chunk) {
        Walk walk(surface);
        for (std::size_t i = chunk * kChunk; i < std::min(n, (chunk + 1) * kChunk); ++i)
            visit(i, walk);
        sums[chunk] = walk.sum();
    });
    Sum total;
    for (const Sum& sum : sums)
        total.add(sum);
    return total;
}

std::vector<std::uint64_t> unique_edges(const TriMesh& mesh) {
    std::vector<std::uint64_t> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [lo, hi] = std::minmax(t[k], t[(k + 1) % 3]);
            edges.push_back(std::uint64_t{lo} << 32 | hi);
        }
    tbb::parallel_sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

/// The centroids of the k^2 equal triangles that a face falls into; each stands for its share of
/// the area, so that the mean does not depend on how the surface is cut into faces.
void sample_face(const Vec3& a, const Vec3& b, const Vec3& c, double spacing_m, Walk& walk) {
    const double longest = std::max({length(b - a), length(c - b), length(a - c)});
    const int k = std::max(1, static_cast<int>(std::ceil(longest / spacing_m)));
    const double weight = length(cross(b - a, c - a)) / (2.0 * k * k);
    const Vec3 u = (b - a) / k, v = (c - a) / k;
    for (int i = 0; i < k; ++i)
        for (int j = 0; i + j < k; ++j) {
            walk.sample(a + u * (i + 1.0 / 3) + v * (j + 1.0 / 3), weight);
            if (i + j + 1 < k)
                walk.sample(a + u * (i + 2.0 / 3) + v * (j + 2.0 / 3), weight);
        }
}

Sum one_way(const TriMesh& from, const SurfaceDistance& to, double spacing_m) {
    const std::vector<Vec3>& p = from.positions;
    std::vector<std::uint8_t> used(p.size(), 0);
    for (const Triangle& t : from.triangles)
        for (const std::uint32_t v : t)
            used[v] = 1;
    Sum total = sum_over(p.size(), to, [&](std::size_t i, Walk& walk) {
        if (used[i])
            walk.sample(p[i], 0);
    });
    const std::vector<std::uint64_t> edges = unique_edges(from);
    total.add(sum_over(edges.size(), to, [&](std::size_t i, Walk& walk) {
        const Vec3 &a = p[edges[i] >> 32], b = p[edges[i] & 0xffffffffu];
        const int n = std::max(2, static_cast<int>(std::ceil(length(b - a) / spacing_m)));
        for (int k = 1; k < n; ++k)
            walk.sample(a + (b - a) * (static_cast<double>(k) / n), 0);
    }));
    total.add(sum_over(from.triangles.size(), to, [&](std::size_t i, Walk& walk) {
        const Triangle& t = from.triangles[i];
        sample_face(p[t[0]], p[t[1]], p[t[2]], spacing_m, walk);
    }));
    return total;
}

} // namespace

TwoSidedDistance two_sided_distance(const TriMesh& a, const TriMesh& b, double spacing_m) {
    constexpr double kFinest = 1e-5; // of the larger mesh: the square of its inverse still counts
    const double longest = std::max(bounds(a).longest(), bounds(b).longest());
    if (!(spacing_m > 0) || spacing_m < kFinest * longest)
        throw Error(Fault::bad_argument,
                    "two-sided distance: spacing_m is " + std::to_string(spacing_m) +
                        ", must be > 0 and at least 1e-5 of the mesh; give a wider spacing");
    const Sum ab = one_way(a, SurfaceDistance(b), spacing_m);
    const Sum ba = one_way(b, SurfaceDistance(a), spacing_m);
    const auto rms = [](const Sum& sum) {
        return sum.weight > 0 ? std::sqrt(sum.weighted_squares / sum.weight) : 0.0;
    };
    TwoSidedDistance result;
    result.max_a_to_b_m = ab.max_m;
    result.max_b_to_a_m = ba.max_m;
    result.max_m = std::max(ab.max_m, ba.max_m);
    result.rms_m = std::max(rms(ab), rms(ba));
    result.n_samples = ab.n + ba.n;
    return result;
}

} // namespace taihu
