#pragma once
#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "mesh_out/surface_distance.h"
#include "mesh_out/textured_mesh.h"
#include "stats/core/image.h"
#include "stats/core/progress.h"
#include "vdb_ops/field.h"

namespace taihu {

enum class NormalsOf {
    field,  ///< gradients
    surface ///< the mesh's own, interpolated: a field made of faces has theirs alone
};

struct BakeSourceSettings {
    double voxel_m = 0; ///< size of the finest detail, > 0: the step of curvatures
    double reach_m = 0; ///< the most that any coarse mesh is off the fine surface, > 0
    int n_rays = 64;    ///< of openness(), 1..4096
    NormalsOf normals = NormalsOf::field;
};

/// The fine surface that maps are baked from: a field, and a mesh of it that knows how much of the
/// sky each place sees. One for all levels. Thread-safe to ask.
class BakeSource {
public:
    /// What a place of a coarse mesh stands for.
    struct Place {
        Vec3 point, normal;  ///< on the fine surface; the normal of length 1
        double offset_m = 0; ///< of the point along the coarse normal
        Primitive primitive = 0;
        bool is_traced = false; ///< else nothing was met along the normal, and it is the nearest
    };

    /// \param field  outlives this. \param surface  a fine mesh of it, with normals; openness is
    /// worked out where it has none.
    /// \throws Error bad_argument: a length out of range, a mesh without normals, or as openness();
    /// cancelled.
    BakeSource(const Field& field, TriMesh surface, const BakeSourceSettings& settings,
               Progress* progress = nullptr);

    /// Along the normal, outwards from inside of the solid and inwards from outside, by steps as
    /// long as the field says. \param reach_m  how far, at most that of the source.
    Place meet(const Vec3& p, const Vec3& normal, double reach_m) const;
    /// Share of the sky seen from the surface near p, 0..1.
    double openness_at(const Vec3& p) const;
    /// Mean curvature [1/m] at a point of the surface, positive where the solid is convex: half the
    /// Laplacian of the field by differences of a voxel, at most 1 / voxel_m either way.
    double curvature_at(const Vec3& p) const;
    double reach_m() const { return reach_m_; }

private:
    /// The nearest triangle of the surface, and the weights of its corners.
    std::pair<Triangle, std::array<double, 3>> nearest_weights(const Vec3& p) const;

    std::unique_ptr<const FieldProbe> probe_;
    TriMesh surface_;
    SurfaceDistance nearest_;
    double voxel_m_, reach_m_;
    NormalsOf normals_;
};

struct BakeSettings {
    double reach_m = 0;          ///< cage: how far along a normal the fine surface is sought, > 0
    int side_px = 2048;          ///< of the maps, 1..8192: what the texture points were made for
    int gutter_px = 3;           ///< texels beyond the faces that are filled too, 0..16
    bool masters = true;         ///< false: what a GLB holds alone
    double grain_m = 0;          ///< size of the grains that the colour shows; 0: none
    double grain_contrast = 0.4; ///< how much darker the darkest is than the brightest, 0..1
};

/// Maps of one mesh; square, the first row is v = 1. Beyond the gutter the surface is flat: normal
/// (0, 0, 1), occlusion 1, else 0.
struct BakedMaps {
    Image normal;              ///< 3 channels: the fine normal along tangent, bitangent, normal
    Image object_normal;       ///< 3: the same along x, y, z
    Image displacement;        ///< 1: from the coarse surface along its normal [m]
    Image occlusion;           ///< 1: share of the sky that is seen, 0..1
    Image curvature;           ///< 1: mean curvature, positive where convex [1/m]
    Image colour;              ///< 1: share of the base colour that a grain has, or empty
    Image part;                ///< 1: number of the field's primitive, as holes and base have them
    std::size_t n_texels = 0;  ///< whose middle lies on a face
    std::size_t n_nearest = 0; ///< of those, where nothing was met along the normal
    double rms_displacement_m = 0, most_displacement_m = 0; ///< of those
};

/// Bake what the coarse mesh lost: each texel's place on it, by the weights of its face, meets the
/// fine surface along the interpolated normal. Tangent-space normals are such that the frame of
/// interpolated, then normalised tangent, bitangent and normal gives the fine normal back exactly,
/// as three.js builds it. Gutter texels take the nearest place of a face beside them. Same bytes on
/// any number of threads; O(texels).
/// \throws Error bad_argument: as texel_faces(), no normals or tangents, a setting out of range;
/// cancelled: within a row.
BakedMaps bake(const TexturedMesh& coarse, const BakeSource& fine, const BakeSettings& settings,
               Progress* progress = nullptr);

/// The bytes of an 8-bit PNG for glTF's normalTexture, (n + 1) / 2, occlusionTexture, or
/// baseColorTexture.
std::string normal_png(const BakedMaps& maps);
std::string occlusion_png(const BakedMaps& maps);
std::string colour_png(const BakedMaps& maps);

/// How far normals are off those of the fine surface, on average over the texels: as lit through
/// an 8-bit normal map, read with bilinear filter at corners of texels, where that is worst, and by
/// the coarse mesh's own normals.
struct RelitError {
    double mean_deg = 0, plain_mean_deg = 0;
    std::size_t n_samples = 0;
};
RelitError relit_error(const TexturedMesh& coarse, const BakeSource& fine, const BakedMaps& maps,
                       double reach_m, Progress* progress = nullptr);

/// Master maps as EXR: STEM_normal, STEM_object_normal, STEM_occlusion (half), STEM_displacement,
/// STEM_curvature, STEM_part (float), and STEM_colour (half) where there is one; channels R, G, B
/// or Y; of parts `part`, and R, G, B as colours that tell them apart. Attributes say what the
/// numbers are: `quantity`, `unit`, `frame`. \throws Error bad_argument: maps baked without
/// masters; io.
void write_maps(const std::filesystem::path& folder, const std::string& stem,
                const BakedMaps& maps);

} // namespace taihu
