#include "mesh_out/texture_coordinates.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "stats/core/error.h"

namespace taihu {
namespace {

using Corners = std::array<TexturePoint, 3>;
using Positions = std::array<Vec3, 3>;

void check(const TriMesh& mesh, const Box& frame) {
    if (frame.empty() || !is_finite(frame.lo) || !is_finite(frame.hi) || !(frame.volume() > 0))
        throw Error(Fault::bad_argument, "texture coordinates: the frame has no finite volume; "
                                         "give one with three extents");
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t v : mesh.triangles[i])
            if (v >= mesh.positions.size() || !is_finite(mesh.positions[v]))
                throw Error(Fault::bad_argument, "texture coordinates: triangles[" +
                                                     std::to_string(i) +
                                                     "] has no finite position " +
                                                     std::to_string(v) + "; mend the mesh first");
}

/// 0 at lo, 1 at hi.
double share(const Box& frame, const Vec3& p, int axis) {
    return (p[axis] - frame.lo[axis]) / frame.size()[axis];
}

/// Longitudes of the corners about the upright axis through `middle`, on one side of the seam.
void set_longitudes(const Positions& p, const Vec3& middle, double tiny, Corners& out) {
    std::array<bool, 3> on_axis{};
    double least = 2, most = -1;
    for (std::size_t k = 0; k < 3; ++k) {
        const double x = p[k].x - middle.x, z = p[k].z - middle.z;
        on_axis[k] = std::hypot(x, z) <= tiny;
        if (on_axis[k])
            continue;
        out[k].u = 0.5 + std::atan2(x, z) / (2 * std::numbers::pi);
        least = std::min(least, out[k].u);
        most = std::max(most, out[k].u);
    }
    double sum = 0;
    int n = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        if (on_axis[k])
            continue;
        if (most - least > 0.5 && out[k].u < 0.5)
            out[k].u += 1;
        sum += out[k].u;
        ++n;
    }
    for (std::size_t k = 0; k < 3; ++k)
        if (on_axis[k])
            out[k].u = n > 0 ? sum / n : 0.5;
}

std::uint8_t side_of(const Positions& p) {
    const Vec3 normal = cross(p[1] - p[0], p[2] - p[0]);
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (std::fabs(normal[a]) > std::fabs(normal[axis]))
            axis = a;
    return static_cast<std::uint8_t>(2 * axis + (normal[axis] < 0));
}

TexturePoint on_side(const Box& frame, const Vec3& p, std::uint8_t side) {
    const double x = share(frame, p, 0), y = share(frame, p, 1), z = share(frame, p, 2);
    switch (side) {
    case 0:
        return {1 - z, y};
    case 1:
        return {z, y};
    case 2:
        return {x, 1 - z};
    case 3:
        return {x, z};
    case 4:
        return {x, y};
    default:
        return {1 - x, y};
    }
}

} // namespace

TextureCoordinates texture_coordinates(const TriMesh& mesh, TextureMap map, const Box& frame) {
    check(mesh, frame);
    const Vec3 middle = frame.center();
    const double tiny = 1e-9 * frame.longest();
    TextureCoordinates out;
    out.corners.resize(mesh.triangles.size());
    if (map == TextureMap::cubic)
        out.sides.resize(mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        Positions p;
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = mesh.positions[mesh.triangles[i][k]];
        Corners& corners = out.corners[i];
        if (map == TextureMap::cubic)
            out.sides[i] = side_of(p);
        if (map == TextureMap::spherical || map == TextureMap::cylindrical)
            set_longitudes(p, middle, tiny, corners);
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 from_middle = p[k] - middle;
            switch (map) {
            case TextureMap::planar:
                corners[k] = {share(frame, p[k], 0), share(frame, p[k], 1)};
                break;
            case TextureMap::spherical:
                corners[k].v =
                    0.5 + std::atan2(from_middle.y, std::hypot(from_middle.x, from_middle.z)) /
                              std::numbers::pi;
                break;
            case TextureMap::cylindrical:
                corners[k].v = share(frame, p[k], 1);
                break;
            case TextureMap::cubic:
                corners[k] = on_side(frame, p[k], out.sides[i]);
                break;
            }
        }
    }
    return out;
}

} // namespace taihu
