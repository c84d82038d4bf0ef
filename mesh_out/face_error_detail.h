#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "mesh_out/face_rules_detail.h"
#include "mesh_out/labelled_mesh.h"

namespace taihu {

/// What a field says of a mesh near its surface, prepared for very many questions about faces:
/// which primitives come near (lists per cell of a lattice), closed forms of balls, label sets as
/// numbers. Thread-safe.
class FaceErrors {
public:
    using Corners = FaceCorners;
    using CornerValues = FaceValues;
    using Labels = std::array<std::uint32_t, 3>; ///< numbers of label sets, one per corner
    using Range = FaceRange;
    using Rules = FaceRules;
    static constexpr std::uint32_t kNone = FaceSlope::kNone;
    static constexpr double kFar = 1e300;

    /// \param bound_m  the distances asked about are at most twice this.
    /// \param spacing_m  of the mesh that `mesh` comes from: nothing finer is looked for.
    FaceErrors(const LabelledMesh& mesh, const FieldProbe& field, double bound_m, double spacing_m);

    /// The number of the label set of each vertex of the mesh.
    const std::vector<std::uint32_t>& labels() const { return labels_; }
    std::size_t n_primitives(std::uint32_t label) const { return sets_[label].size(); }
    bool within(std::uint32_t a, std::uint32_t b) const {
        return a == b || sets_[a].within(sets_[b]);
    }
    /// The set of primitives, as the field numbers them.
    PrimitiveSet primitives(std::uint32_t label) const;
    /// The number of a set of shapes, a new one if need be; not for several threads at once.
    std::uint32_t label_of(const PrimitiveSet& shapes);
    const FieldProbe& field() const { return field_; }

    /// How far the primitives at least are that a vertex does not lie on.
    struct Clearance {
        double sampled = 0; ///< those without a closed form
        double any = 0;
    };
    Clearance clearance(const Vec3& p, std::uint32_t label) const;
    /// Whether a face with its corners on one ball, and nothing else near, surely keeps `rules`:
    /// told by its plane. \param normal  of any length.
    bool fits_ball(std::uint32_t shape, const Vec3& corner, const Vec3& normal,
                   const Rules& rules) const;
    /// How far a face may be from its primitive to keep `rules`, and still touch nothing else.
    double reach_m(const Rules& rules) const;
    /// An upper bound of the distance from the points of a face to the surface of the solid, as far
    /// as `rules` ask: infinite when it breaks them. Balls by closed forms, other primitives by
    /// samples with a margin of their second differences; past a rim, the distance to the rim.
    double bound(const Corners& face, const Labels& labels, const Rules& rules) const;

    /// As bound(), of a face on a known primitive with a known range.
    double bound_beside(std::uint32_t shape, const Range& range, const Corners& face,
                        const Labels& labels, const Rules& rules) const;

    /// The shapes that all three corners lie on.
    PrimitiveSet shared(const Labels& labels) const;
    /// Of these the nearest to the face, or kNone. Values beyond `give_up_m` may end the search.
    std::uint32_t own(const Corners& face, const Labels& labels, bool exact_corners, Range& range,
                      double give_up_m = kFar) const;
    Range range(std::uint32_t shape, const Corners& face, const CornerValues* known = nullptr,
                double give_up_m = kFar) const;
    /// How many steps along an edge of a face samples of a primitive take.
    std::size_t n_steps(const Corners& face) const;
    /// Values at (n + 1)(n + 2) / 2 points: f1 x + f2 y + f0 (1 - x - y), y from 0 to 1 - x for
    /// each x from 0 to 1, in steps of 1 / n.
    void samples(std::uint32_t shape, const Corners& face, std::size_t n, float* out) const;
    FieldProbe::Value of(std::uint32_t shape, const Vec3& p) const;
    const PrimitiveSet& set(std::uint32_t label) const { return sets_[label]; }
    std::span<const std::uint32_t> shapes(std::uint32_t label) const { return sets_[label].all(); }

    /// An upper bound of the distances of all points of a face, by the closed forms of its parts or
    /// surface points found near them; slow, and right whatever the labels. Parts are not divided
    /// where it is at most `enough_m`; where it is found to be beyond `give_up_m` the search ends.
    double searched(const Corners& face, double enough_m, double give_up_m = kFar) const;
    bool has_closed_form(std::uint32_t shape) const { return shapes_[shape].is_ball; }

private:
    static constexpr double kHalfDiagonal = 0.8660254037844386; ///< of a cell of edge 1
    struct Shape {
        Primitive primitive = 0;
        bool is_ball = false;
        double sign = 1; ///< of the value outside of the ball
        Vec3 center;
        double radius = 0;
    };
    /// Two primitives over a face, values turned so that the second is negative where it is far.
    struct Meeting {
        std::uint32_t own = 0, other = 0;
        double turn = 1;
        Rules rules;
    };

    void find_shapes(const LabelledMesh& mesh);
    void find_center_values();
    std::array<int, 3> coordinates(std::size_t cell) const;
    void find_near(const LabelledMesh& mesh, std::vector<std::vector<Primitive>>& near);
    double sample(Primitive primitive, const Vec3& p, Range& range) const;
    Range sampled_range(const Shape& shape, const Corners& face, const CornerValues* known,
                        double give_up_m, double step) const;
    double past_rim(const Meeting& meeting, const Corners& face, double own, double other) const;
    double meeting(const Meeting& meeting, const Corners& face, const Range& own,
                   const Range& other, int depth) const;
    Range range_beside(std::uint32_t shape, const Corners& face, const CornerValues& corners,
                       const std::array<Vec3, 3>& gradients, const Rules& rules) const;
    std::uint32_t shape_of(Primitive primitive) const;
    bool is_sure_of_side(std::uint32_t own, const CornerValues& other, const Corners& face) const;
    double against(std::uint32_t own, const Range& own_range, std::uint32_t other,
                   const Corners& face, const Labels& labels, const Rules& rules) const;
    std::span<const std::uint32_t> near(const std::array<int, 3>& cell) const {
        const std::uint32_t list = cells_[cell_of(cell)];
        if (list == kNone)
            return {};
        return std::span(near_).subspan(first_[list], first_[list + 1] - first_[list]);
    }
    /// From the centre of a cell: what is nearer is in its list.
    double list_reach() const { return kHalfDiagonal * cell_ + pad_; }
    std::size_t cell_of(const std::array<int, 3>& c) const;
    int coordinate(double x, int axis) const;
    Vec3 center_of(const std::array<int, 3>& c) const {
        return origin_ + Vec3{c[0] + .5, c[1] + .5, c[2] + .5} * cell_;
    }

    const FieldProbe& field_;
    double spacing_, pad_, cell_ = 0;
    Vec3 origin_;
    std::array<std::size_t, 3> n_{};
    std::vector<std::uint32_t> cells_;        ///< number of the list of a cell, kNone far away
    std::vector<std::uint32_t> first_, near_; ///< shapes near each listed cell
    std::vector<float> center_values_;        ///< of these at the cell's centre, of balls 0
    std::vector<Shape> shapes_;
    std::vector<PrimitiveSet> sets_; ///< of shapes, by label number
    std::size_t n_sorted_sets_ = 0;
    std::map<std::vector<std::uint32_t>, std::uint32_t> more_sets_; ///< numbers of the others
    std::vector<std::uint32_t> labels_;
};

/// A point of the solid's surface near `p`, found by projecting onto the primitives that decide one
/// after another; none when that leads nowhere within `farthest_m`.
std::optional<Vec3> surface_point_near(const FieldProbe& field, const Vec3& p, double farthest_m);

} // namespace taihu
