#pragma once
#include <cstdint>
#include <vector>

#include <openvdb/openvdb.h>

#include "mesh_out/labelled_mesh.h"
#include "vdb_ops/field_probe.h"

namespace taihu {

/// A rough ball minus balls, in voxels of 1 m: primitive 0 is the base (eight sine waves on a
/// ball, distance to first order; none when `rough` is false: then an exact ball), primitive i + 1
/// is hole i.
class HoledBall final : public FieldProbe {
public:
    HoledBall(double radius, std::vector<Sphere> holes, bool rough);
    /// Exponential diameters by count and Boolean porosity in a cube of `dim`; holes below 1 are
    /// left out.
    static HoledBall random(double dim, std::size_t n_holes, double porosity, std::uint64_t seed);

    Nearest at(const Vec3& p) const override;
    Value of(Primitive primitive, const Vec3& p) const override;
    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override;
    std::optional<Sphere> ball(Primitive primitive) const override;

    double half_extent() const { return half_; } ///< the solid lies in the cube of +- this
    const std::vector<Sphere>& holes() const { return holes_; }

private:
    struct Wave {
        Vec3 k;       ///< [turns / m]
        double phase; ///< [turns]
        double amplitude;
    };
    enum class State : std::uint8_t { air, solid, near_base };

    Value base(const Vec3& p) const;
    double hole(std::size_t i, const Vec3& p) const {
        return holes_[i].radius_m - length(p - holes_[i].center);
    }
    std::size_t block(const Vec3& p) const;

    double radius_, half_;
    std::vector<Wave> waves_;
    std::vector<Sphere> holes_;
    int n_ = 0;
    std::vector<State> states_;
    std::vector<std::uint32_t> first_, entries_; ///< holes near each block of 8
};

/// Its level set, half band 3 voxels of `spacing`.
openvdb::FloatGrid::Ptr level_set_of(const HoledBall& solid, double spacing);

/// A sharp surface of it: OpenVDB's dual mesh at a spacing, vertices moved onto the primitives that
/// meet in their cells; those that make faces cross go back.
LabelledMesh sharp_surface(const HoledBall& solid, double spacing);

} // namespace taihu
