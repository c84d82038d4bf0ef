#include "vdb_ops/closed_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>

#include "stats/core/error.h"

namespace taihu {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = ~Index{0};

/// Shells of a repaired mesh: their measures and roles.
class Shells {
public:
    explicit Shells(RepairedMesh mesh) : faces_(std::move(mesh.triangles)) {
        out_.positions = std::move(mesh.positions);
        out_.shell_of = std::move(mesh.shell_of);
        out_.diagnosis = std::move(mesh.diagnosis);
        for (const double area_m2 : mesh.cap_area_m2)
            out_.shells.emplace_back().cap_area_m2 = area_m2;
    }

    ClosedMesh run() {
        measure_shells();
        assign_roles();
        collect();
        return std::move(out_);
    }

private:
    void measure_shells() {
        if (faces_.empty())
            return;
        const Vec3 origin = out_.positions[faces_[0][0]];
        for (std::size_t f = 0; f < faces_.size(); ++f) {
            Shell& s = out_.shells[out_.shell_of[f]];
            const Vec3 a = out_.positions[faces_[f][0]] - origin,
                       b = out_.positions[faces_[f][1]] - origin,
                       c = out_.positions[faces_[f][2]] - origin;
            s.volume_m3 += dot(a, cross(b, c)) / 6;
            s.area_m2 += 0.5 * length(cross(b - a, c - a));
            ++s.n_faces;
            for (const Index v : faces_[f])
                s.box.include(out_.positions[v]);
        }
    }

    /// Winding number of a shell about `p`: sum of solid angles (Van Oosterom & Strackee 1983).
    double winding(Index shell, const Vec3& p) const {
        double sum = 0;
        for (std::size_t f = 0; f < faces_.size(); ++f) {
            if (out_.shell_of[f] != shell)
                continue;
            const Vec3 a = out_.positions[faces_[f][0]] - p, b = out_.positions[faces_[f][1]] - p,
                       c = out_.positions[faces_[f][2]] - p;
            const double la = length(a), lb = length(b), lc = length(c);
            sum += 2 * std::atan2(dot(a, cross(b, c)),
                                  la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
        }
        return sum / (4 * std::numbers::pi);
    }

    void assign_roles() {
        // Caps as large as the shell itself, or nothing held: no inside.
        for (Shell& s : out_.shells)
            if (s.cap_area_m2 > 0.45 * s.area_m2 ||
                36 * std::numbers::pi * s.volume_m3 * s.volume_m3 <=
                    1e-12 * s.area_m2 * s.area_m2 * s.area_m2)
                s.role = Shell::Role::sheet;
        renumber_by_volume();
        std::vector<Index> first_face(out_.shells.size(), kNone);
        for (Index f = static_cast<Index>(faces_.size()); f-- > 0;)
            first_face[out_.shell_of[f]] = f;
        // Larger shells come first, so the last one that holds a shell is the innermost.
        for (Index i = 0; i < out_.shells.size(); ++i) {
            Shell& inner = out_.shells[i];
            for (Index j = i; inner.role == Shell::Role::solid && j-- > 0;) {
                const Shell& outer = out_.shells[j];
                if (outer.role == Shell::Role::sheet || !outer.box.contains(inner.box.lo) ||
                    !outer.box.contains(inner.box.hi) ||
                    std::fabs(winding(j, out_.positions[faces_[first_face[i]][0]])) <= 0.5)
                    continue;
                const bool turned = (inner.volume_m3 < 0) != (outer.volume_m3 < 0);
                if (turned && outer.role == Shell::Role::solid)
                    inner.role = Shell::Role::cavity;
                break;
            }
        }
    }

    void renumber_by_volume() {
        std::vector<Index> order(out_.shells.size()), number(out_.shells.size());
        std::iota(order.begin(), order.end(), Index{0});
        std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
            return std::fabs(out_.shells[a].volume_m3) > std::fabs(out_.shells[b].volume_m3);
        });
        std::vector<Shell> shells;
        for (Index n = 0; n < order.size(); ++n) {
            shells.push_back(out_.shells[order[n]]);
            number[order[n]] = n;
        }
        out_.shells = std::move(shells);
        for (Index& s : out_.shell_of)
            s = number[s];
    }

    /// Faces sorted by shell, sheets left out; totals of the diagnosis.
    void collect() {
        MeshDiagnosis& d = out_.diagnosis;
        for (const Shell& s : out_.shells) {
            d.area_m2 += s.area_m2;
            d.cap_area_m2 += s.cap_area_m2;
            d.n_solids += s.role == Shell::Role::solid;
            d.n_cavities += s.role == Shell::Role::cavity;
            d.n_inverted += s.role == Shell::Role::solid && s.volume_m3 < 0;
            if (s.role == Shell::Role::sheet) {
                ++d.n_sheets;
                d.sheet_area_m2 += s.area_m2 - s.cap_area_m2;
            }
        }
        std::vector<Index> order;
        for (Index f = 0; f < faces_.size(); ++f)
            if (out_.shells[out_.shell_of[f]].role != Shell::Role::sheet)
                order.push_back(f);
        std::stable_sort(order.begin(), order.end(),
                         [&](Index a, Index b) { return out_.shell_of[a] < out_.shell_of[b]; });
        std::vector<Index> shell_of;
        for (const Index f : order) {
            out_.triangles.push_back(faces_[f]);
            shell_of.push_back(out_.shell_of[f]);
        }
        out_.shell_of = std::move(shell_of);
    }

    ClosedMesh out_;
    std::vector<Triangle> faces_;
};

} // namespace

ClosedMesh close_mesh(const TriMesh& mesh, const std::string& where, CloseRule rule,
                      Progress* progress) {
    Box box;
    for (const Vec3& p : mesh.positions)
        if (is_finite(p))
            box.include(p);
    const double diagonal = length(box.size());
    ClosedMesh closed;
    for (const double tolerance : {0.0, 1e-6, 1e-5, 1e-4}) {
        check_cancelled(progress);
        closed = Shells(repair_mesh(mesh, tolerance * diagonal, rule)).run();
        if (closed.diagnosis.n_solids > 0 || closed.diagnosis.n_open_edges == 0)
            break;
    }
    const MeshDiagnosis& d = closed.diagnosis;
    if (rule == CloseRule::none && d.n_open_edges > 0) {
        const auto loops = repair_mesh(mesh, 0, CloseRule::loops).diagnosis.loops.size();
        throw Error(Fault::bad_input, where + ": open: " + std::to_string(d.n_open_edges) +
                                          " open edges in " + std::to_string(loops) +
                                          " loops; close them, or cap them with --close loops");
    }
    if (d.n_solids == 0) {
        char share[32];
        std::snprintf(share, sizeof share, "%.0f",
                      d.area_m2 > 0 ? 100 * d.cap_area_m2 / d.area_m2 : 0);
        throw Error(Fault::bad_input,
                    where + ": no inside: " + std::to_string(d.n_sheets) +
                        " sheets without one (caps would be " + share +
                        " % of the surface); give the mesh a thickness or a closed surface");
    }
    return closed;
}

} // namespace taihu
