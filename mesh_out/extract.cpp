#include "mesh_out/extract.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "mesh_out/level_set_check_detail.h"
#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

using Quads = std::vector<openvdb::Vec4I>;

struct DualMesh {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles; ///< none unless it is adaptive
    Quads quads;
};

DualMesh dual_mesh(const openvdb::FloatGrid& solid, double adaptivity) {
    DualMesh result;
    openvdb::tools::volumeToMesh(solid, result.points, result.triangles, result.quads, 0.0,
                                 adaptivity);
    return result;
}

TriMesh split_quads(const openvdb::FloatGrid& solid, const DualMesh& dual) {
    TriMesh mesh;
    mesh.positions.reserve(dual.points.size());
    for (const openvdb::Vec3s& p : dual.points)
        mesh.positions.push_back({p.x(), p.y(), p.z()});
    mesh.triangles.resize(2 * dual.quads.size());
    constexpr std::size_t kGrain = 8192;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, dual.quads.size(), kGrain), [&](const auto& range) {
            auto accessor = solid.getConstAccessor();
            const auto off_surface = [&](std::uint32_t i, std::uint32_t j) {
                const openvdb::Vec3d middle =
                    (openvdb::Vec3d(dual.points[i]) + openvdb::Vec3d(dual.points[j])) * 0.5;
                return std::abs(openvdb::tools::BoxSampler::sample(
                    accessor, solid.transform().worldToIndex(middle)));
            };
            for (std::size_t i = range.begin(); i < range.end(); ++i) {
                // OpenVDB's quads are clockwise from outside: read them backwards.
                const openvdb::Vec4I& q = dual.quads[i];
                const std::uint32_t a = q[3], b = q[2], c = q[1], d = q[0];
                const bool along_ac = off_surface(a, c) <= off_surface(b, d);
                mesh.triangles[2 * i] = along_ac ? Triangle{a, b, c} : Triangle{b, c, d};
                mesh.triangles[2 * i + 1] = along_ac ? Triangle{a, c, d} : Triangle{b, d, a};
            }
        });
    for (const openvdb::Vec3I& t : dual.triangles)
        mesh.triangles.push_back({t[2], t[1], t[0]});
    return mesh;
}

bool has_equal_positions(const TriMesh& mesh) {
    std::vector<Vec3> sorted = mesh.positions;
    tbb::parallel_sort(sorted.begin(), sorted.end(), [](const Vec3& a, const Vec3& b) {
        return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    });
    return std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end();
}

bool has_flat_triangles(const TriMesh& mesh) {
    return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
        const Vec3 ab = mesh.positions[t[1]] - mesh.positions[t[0]];
        const Vec3 ac = mesh.positions[t[2]] - mesh.positions[t[0]];
        constexpr double kRounding = 1e-12; // sine of the angle at a, far above double's error
        return length(cross(ab, ac)) <= kRounding * length(ab) * length(ac);
    });
}

/// Each directed edge exactly once, and once the other way.
bool closed_and_oriented(const TriMesh& mesh) {
    std::vector<std::uint64_t> ahead, back;
    ahead.reserve(3 * mesh.triangles.size());
    back.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint64_t from = t[k], to = t[(k + 1) % 3];
            ahead.push_back(from << 32 | to);
            back.push_back(to << 32 | from);
        }
    tbb::parallel_sort(ahead.begin(), ahead.end());
    tbb::parallel_sort(back.begin(), back.end());
    return ahead == back && std::adjacent_find(ahead.begin(), ahead.end()) == ahead.end();
}

/// A copy whose values keep `least` away from zero. A value of (nearly) zero puts all crossings
/// round its voxel into one point, and OpenVDB's vertices of the eight cells there may coincide in
/// it; with the zero moved by `least`, every vertex lies inside its own cell.
openvdb::FloatGrid::Ptr without_zeros(const openvdb::FloatGrid& solid, float least) {
    const openvdb::FloatGrid::Ptr copy = solid.deepCopy();
    for (auto value = copy->beginValueOn(); value; ++value)
        if (std::abs(*value) < least)
            value.setValue(*value < 0 ? -least : least);
    return copy;
}

} // namespace

void require_level_set(const openvdb::FloatGrid& solid) {
    const std::string name = "extract: grid '" + solid.getName() + "'";
    if (solid.getGridClass() != openvdb::GRID_LEVEL_SET)
        throw Error(Fault::bad_argument,
                    name + " is of class '" +
                        openvdb::GridBase::gridClassToString(solid.getGridClass()) +
                        "', must be a level set; convert it first");
    if (!solid.hasUniformVoxels())
        throw Error(Fault::bad_argument,
                    name + " has voxels that are not cubes; resample it to cubic ones");
}

void refuse_empty(const openvdb::FloatGrid& solid) {
    throw Error(Fault::bad_argument, "extract: grid '" + solid.getName() +
                                         "' has no surface: nothing is left of the solid; "
                                         "remove less from it or use smaller voxels");
}

void refuse_clipped(const openvdb::FloatGrid& solid) {
    throw Error(Fault::numeric, "extract: the surface of grid '" + solid.getName() +
                                    "' is open, so it leaves the narrow band; clip or rebuild "
                                    "the grid as a level set");
}

TriMesh extract_uniform(const openvdb::FloatGrid& solid, Progress* progress) {
    return extract_openvdb(solid, 0, progress);
}

TriMesh extract_openvdb(const openvdb::FloatGrid& solid, double adaptivity, Progress* progress) {
    require_level_set(solid);
    if (!(adaptivity >= 0 && adaptivity <= 1))
        throw Error(Fault::bad_argument,
                    "extract: an adaptivity of " + shortest(adaptivity) + ", must be 0..1");
    check_cancelled(progress);
    TriMesh mesh = split_quads(solid, dual_mesh(solid, adaptivity));
    // [voxels]; the smaller one is still well above what float resolves a thousand voxels out.
    for (const double least_vox : {1e-3, 1e-2}) {
        check_cancelled(progress);
        if (!has_equal_positions(mesh) && !has_flat_triangles(mesh))
            break;
        const auto clear =
            without_zeros(solid, static_cast<float>(least_vox * solid.voxelSize()[0]));
        mesh = split_quads(*clear, dual_mesh(*clear, adaptivity));
    }
    if (mesh.triangles.empty())
        refuse_empty(solid);
    if (!closed_and_oriented(mesh))
        refuse_clipped(solid);
    if (has_equal_positions(mesh) || has_flat_triangles(mesh))
        throw Error(Fault::numeric, "extract: grid '" + solid.getName() +
                                        "' has surface points that float cannot keep apart; move "
                                        "the solid nearer to the origin");
    check_cancelled(progress);
    return mesh;
}

std::vector<Vec3> surface_normals(const openvdb::FloatGrid& solid,
                                  const std::vector<Vec3>& points) {
    std::vector<Vec3> normals(points.size());
    const double voxel_m = solid.voxelSize()[0];
    constexpr std::size_t kGrain = 4096;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, points.size(), kGrain), [&](const auto& range) {
            auto accessor = solid.getConstAccessor();
            const auto field = [&](const Vec3& p) {
                return static_cast<double>(openvdb::tools::BoxSampler::sample(
                    accessor, solid.transform().worldToIndex(openvdb::Vec3d(p.x, p.y, p.z))));
            };
            for (std::size_t i = range.begin(); i < range.end(); ++i) {
                Vec3 gradient;
                // In the middle of a wall or a gap the differences cancel: then look farther out.
                for (const double reach_m : {0.5 * voxel_m, voxel_m, 2 * voxel_m}) {
                    for (int axis = 0; axis < 3; ++axis) {
                        Vec3 step;
                        step[axis] = reach_m;
                        gradient[axis] = field(points[i] + step) - field(points[i] - step);
                    }
                    if (length(gradient) > 1e-6 * reach_m)
                        break;
                }
                normals[i] = length(gradient) > 0 ? normalized(gradient) : Vec3{0, 1, 0};
            }
        });
    return normals;
}

} // namespace taihu
