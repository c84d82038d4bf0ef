#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/sphere.h"
#include "stats/core/vec3.h"

namespace taihu {

/// Number of one of the smooth surfaces that bound a solid: a ball, a face of a box, a blend, a
/// level set. Every field counts its own from 0, those of an operand after those of the operands
/// before it, whatever the region that is probed.
using Primitive = std::uint32_t;

/// At most three primitives, ascending: one on a face of a solid, two on a rim, three in a corner.
class PrimitiveSet {
public:
    static constexpr std::size_t kMost = 3;

    PrimitiveSet() = default;
    explicit PrimitiveSet(Primitive one) { add(one); }

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    std::span<const Primitive> all() const { return {ids_.data(), size_}; }
    Primitive operator[](std::size_t i) const { return ids_[i]; }
    bool has(Primitive p) const;
    /// False when it is full and `p` not in it.
    bool add(Primitive p);
    bool within(const PrimitiveSet& other) const;
    PrimitiveSet common(const PrimitiveSet& other) const;
    friend bool operator==(const PrimitiveSet&, const PrimitiveSet&) = default;

private:
    std::array<Primitive, kMost> ids_{};
    std::size_t size_ = 0;
};

/// A field asked point by point inside a box, for surfaces that are sharp where primitives meet.
/// Values are those of the solid: negative inside, holes negated. Thread-safe.
class FieldProbe {
public:
    struct Nearest {
        double value_m = 0; ///< the field's own, not held to a half width within `reach_m`
        Primitive primitive = 0;
    };
    struct Value {
        double value_m = 0;
        Vec3 gradient; ///< of length 1 but for blends and level sets; 0 where there is none
    };

    virtual ~FieldProbe() = default;
    /// The field at a point of the box and the primitive that decides it, among equals the first.
    /// Beyond the reach of the probe the value is at least that reach, of the right sign.
    virtual Nearest at(const Vec3& p) const = 0;
    /// One primitive, anywhere. Where at() decides for it on the surface both are 0; off the
    /// surface they may differ, as past the edge of a box.
    virtual Value of(Primitive primitive, const Vec3& p) const = 0;
    /// The value of of() alone.
    virtual double value_of(Primitive primitive, const Vec3& p) const {
        return of(primitive, p).value_m;
    }
    /// What at() gives, and its own gradient: here by differences over `step_m`, by which the box
    /// of the probe has to reach farther. Fields of fields hand the question on: differences of
    /// differences would take six times as long at every depth.
    virtual Value slope(const Vec3& p, double step_m) const;
    /// Appends the primitives whose surface may come within `reach_m` of `p`, at most that of the
    /// probe, where the solid's surface may be theirs; ascending, each once.
    virtual void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const = 0;
    /// The ball whose surface a primitive is, inside or out: distances to it have closed forms.
    virtual std::optional<Sphere> ball(Primitive primitive) const = 0;
};

/// x such that all primitives of `set` are 0: Newton's method by the shortest step, from `p`.
/// \param farthest_m  from `p`.
/// \return none when it does not get there: surfaces that are parallel, or do not meet nearby.
std::optional<Vec3> onto(const FieldProbe& field, const PrimitiveSet& set, const Vec3& p,
                         double farthest_m);

} // namespace taihu
