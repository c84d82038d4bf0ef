#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// What follows each displacement of midpoints.
enum class Damping {
    none,          ///< nothing: 4 triangles a face
    interpolating, ///< 16 a face, on the quadratic patch through corners and midpoints
    approximating  ///< 16 a face, on the quadratic Bezier patch of them, inside their hull
};

/// Which way midpoints are moved. Along the radius no triangle crosses another with a base of 1 or
/// more, with 0 up to an amplitude of 0.4; along the normal, up to 0.3 (six seeds each, hurst 0.8
/// and 1.3). Beyond, the mesh is as closed as ever, and its solid what it winds around.
enum class DisplaceAlong {
    radius, ///< away from the middle: what is seen whole from the middle stays so
    normal  ///< across the edge: for bases of any form; may cross itself
};

std::string_view damping_name(Damping damping);
std::string_view along_name(DisplaceAlong along);
/// \throws Error bad_argument with the known names.
Damping damping_from_name(std::string_view name);
DisplaceAlong along_from_name(std::string_view name);

/// How rough a fractal rock is, and in which way. The defaults make stone of an icosahedron.
struct FractalSettings {
    int base = 1;       ///< the icosahedron in 20 * 4^base triangles on its sphere, 0..5
    int iterations = 3; ///< of displacement and damping, 0..8
    Damping damping = Damping::interpolating;
    DisplaceAlong along = DisplaceAlong::radius;
    double amplitude = 0.3;  ///< farthest displacement of an edge as long as the radius / radius,
                             ///< 0..1
    double hurst_up = 0.8;   ///< of what faces up (+Y): 0.05 rough .. 2 smooth
    double hurst_down = 1.3; ///< and of what faces down, the same range
    double corners = 0.6;    ///< how far corners of the base move, as a share of midpoints, 0..1
    double roundness = 0.5; ///< where midpoints start: 0 on the edge, 1 on the arc about the middle
};

/// \throws Error bad_argument naming the setting and its range; unsupported: more than 2^24
/// triangles.
void check_fractal(const FractalSettings& settings);

/// 4096 numbers in (-1, 1), of which the ends of an edge pick one: the same from both sides.
/// Source: Deix, "Real-time rendering of fractal rocks", Fig. 2 and 3, after Smith.
class DisplacementTable {
public:
    explicit DisplacementTable(std::uint64_t seed);
    double at(const Vec3& a, const Vec3& b) const;

private:
    std::vector<double> values_;
};

/// A mesh with its midpoints displaced: its own positions, then one a edge; face f became triangles
/// 4f .. 4f+3, three at its corners in turn and the one between its midpoints.
struct MidpointMesh {
    TriMesh mesh;
    std::uint32_t n_corners = 0; ///< positions of the mesh before
};

/// Midpoint displacement and subdivision damping of one closed mesh, step by step.
///
/// Displacement moves the midpoint of an edge by amplitude R (20 / F)^(H / 2) t: R is the farthest
/// position from the middle of the base's box, F the number of faces (so that the reach falls by
/// 2^-H where edges halve; their own lengths would grow with what they were displaced by), t the
/// edge's number in the table, and H between hurst_down and hurst_up by the height of the edge's
/// normal, the mean of its two faces' (which the source leaves open: a face's own H would tear its
/// edges). Damping replaces each face by 16 at the quarters of a quadratic patch, whose edges are
/// the source's splines through endpoint, midpoint, endpoint.
///
/// Corners of the base are moved by the same law before, which the source does not do (0: off): its
/// rocks keep twelve corners on a sphere. What comes out is a closed 2-manifold like what went in.
/// Nothing depends on the order of triangles and corners; the same bytes on every platform.
/// O(triangles) time, serial. Source: Deix, as above, sections 2 to 4 and 7, Fig. 1 to 8.
class FractalRefiner {
public:
    /// \throws Error as check_fractal(); bad_input: `base` is not a closed 2-manifold with all
    /// positions finite and an extent.
    FractalRefiner(const TriMesh& base, const FractalSettings& settings, std::uint64_t seed);

    /// The base with its corners moved.
    TriMesh start(TriMesh base) const;
    /// \throws Error bad_input as the constructor; unsupported: more than 2^24 triangles.
    MidpointMesh displace(const TriMesh& mesh) const;
    /// The displaced mesh as it is when the settings want no damping.
    TriMesh damp(const MidpointMesh& displaced) const;
    /// Displaced and damped `n` times. Interpolating or undamped, its first positions are those of
    /// `mesh`: simple and detailed models belong together.
    TriMesh iterate(TriMesh mesh, int n) const;

private:
    /// Farthest displacement where a mesh of `n_faces` faces (up +1, down -1).
    double reach_m(std::size_t n_faces, double facing) const;

    FractalSettings settings_;
    DisplacementTable table_;
    Vec3 middle_;
    double radius_m_ = 0;
};

/// What a rock begins with: icosphere(settings.base), turned by the seed, so that the edges of
/// rocks that stand side by side do not line up.
TriMesh fractal_base(const FractalSettings& settings, std::uint64_t seed);

/// A fractal rock about the origin, of radius 1 before displacement.
/// \throws Error as FractalRefiner.
TriMesh fractal_rock(const FractalSettings& settings, std::uint64_t seed);

/// The mean of the unit normals of the faces around each position, as the source has it.
std::vector<Vec3> averaged_normals(const TriMesh& mesh);

} // namespace taihu
