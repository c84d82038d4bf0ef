#include "vdb_ops/closed_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>

#include "stats/core/error.h"
#include "vdb_ops/columns_detail.h"

namespace taihu {
namespace {

using Index = std::uint32_t;

/// Shells of a repaired mesh: their measures and roles.
class Shells {
public:
    Shells(RepairedMesh mesh, ShellRule rule) : faces_(std::move(mesh.triangles)) {
        out_.rule = rule;
        out_.positions = std::move(mesh.positions);
        out_.shell_of = std::move(mesh.shell_of);
        out_.diagnosis = std::move(mesh.diagnosis);
        for (const double area_m2 : mesh.cap_area_m2)
            out_.shells.emplace_back().cap_area_m2 = area_m2;
    }

    ClosedMesh run() {
        measure_shells();
        find_sheets();
        renumber_by_volume();
        sort_faces();
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
        for (std::size_t f = first_[shell]; f < first_[shell + 1]; ++f) {
            const Vec3 a = out_.positions[faces_[f][0]] - p, b = out_.positions[faces_[f][1]] - p,
                       c = out_.positions[faces_[f][2]] - p;
            const double la = length(a), lb = length(b), lc = length(c);
            sum += 2 * std::atan2(dot(a, cross(b, c)),
                                  la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
        }
        return sum / (4 * std::numbers::pi);
    }

    /// Caps as large as the shell itself, or nothing held: no inside.
    void find_sheets() {
        const bool caps_count = out_.diagnosis.rule != CloseRule::plane;
        for (Shell& s : out_.shells)
            if ((caps_count && s.cap_area_m2 > 0.45 * s.area_m2) ||
                36 * std::numbers::pi * s.volume_m3 * s.volume_m3 <=
                    1e-12 * s.area_m2 * s.area_m2 * s.area_m2)
                s.role = Shell::Role::sheet;
    }

    bool holds(Index outer, Index inner) const {
        const Shell &a = out_.shells[outer], &b = out_.shells[inner];
        return a.role != Shell::Role::sheet && a.box.contains(b.box.lo) &&
               a.box.contains(b.box.hi) &&
               std::fabs(winding(outer, out_.positions[faces_[first_[inner]][0]])) > 0.5;
    }

    void assign_roles() {
        // Larger shells come first, so the last one that holds a shell is the innermost.
        for (Index i = 0; i < out_.shells.size(); ++i) {
            Shell& inner = out_.shells[i];
            bool cavity = false;
            for (Index j = i; inner.role == Shell::Role::solid && j-- > 0;) {
                if (!holds(j, i))
                    continue;
                const Shell& outer = out_.shells[j];
                if (out_.rule == ShellRule::parity) {
                    cavity = !cavity;
                    continue;
                }
                const bool turned = (inner.volume_m3 < 0) != (outer.volume_m3 < 0);
                cavity = turned && outer.role == Shell::Role::solid;
                break;
            }
            if (cavity)
                inner.role = Shell::Role::cavity;
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

    void sort_faces() {
        std::vector<Index> order(faces_.size());
        std::iota(order.begin(), order.end(), Index{0});
        std::stable_sort(order.begin(), order.end(),
                         [&](Index a, Index b) { return out_.shell_of[a] < out_.shell_of[b]; });
        std::vector<Triangle> faces;
        std::vector<Index> shell_of;
        first_.assign(out_.shells.size() + 1, 0);
        for (const Index f : order) {
            faces.push_back(faces_[f]);
            shell_of.push_back(out_.shell_of[f]);
            ++first_[shell_of.back() + 1];
        }
        std::partial_sum(first_.begin(), first_.end(), first_.begin());
        faces_ = std::move(faces);
        out_.shell_of = std::move(shell_of);
    }

    /// Sheets left out; totals of the diagnosis.
    void collect() {
        MeshDiagnosis& d = out_.diagnosis;
        for (const Shell& s : out_.shells) {
            d.area_m2 += s.area_m2;
            d.cap_area_m2 += s.cap_area_m2;
            d.n_solids += s.role == Shell::Role::solid;
            d.n_cavities += s.role == Shell::Role::cavity;
            if (s.role == Shell::Role::solid)
                d.thickness_m.push_back(2 * std::fabs(s.volume_m3) / s.area_m2);
            d.n_inverted += s.role == Shell::Role::solid && s.volume_m3 < 0;
            if (s.role == Shell::Role::sheet) {
                ++d.n_sheets;
                d.sheet_area_m2 += s.area_m2 - s.cap_area_m2;
            }
        }
        std::vector<Index> shell_of;
        for (Index f = 0; f < faces_.size(); ++f)
            if (out_.shells[out_.shell_of[f]].role != Shell::Role::sheet) {
                out_.triangles.push_back(faces_[f]);
                shell_of.push_back(out_.shell_of[f]);
            }
        out_.shell_of = std::move(shell_of);
        find_overlaps();
    }

    /// Shells that cross themselves, as a coarse set of columns sees it.
    void find_overlaps() {
        constexpr double kColumns = 64; // along the longest axis
        const Box box = bounds({out_.positions, out_.triangles, {}});
        if (!(box.longest() > 0))
            return;
        std::vector<Vec3> points(out_.positions.size());
        for (std::size_t i = 0; i < points.size(); ++i) // caps of sheets may lie outside
            points[i] =
                (min(max(out_.positions[i], box.lo), box.hi) - box.lo) * (kColumns / box.longest());
        const Columns columns(out_, points,
                              openvdb::CoordBBox(openvdb::Coord(-1), openvdb::Coord(66)));
        for (Index s = 0; s < out_.shells.size(); ++s)
            out_.diagnosis.n_overlapping +=
                out_.shells[s].role != Shell::Role::sheet && columns.overlaps_itself(s);
    }

    ClosedMesh out_;
    std::vector<Triangle> faces_;
    std::vector<std::size_t> first_; ///< faces of shell s: faces_[first_[s] .. first_[s + 1])
};

std::string counted(std::size_t n, const char* what) {
    return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

[[noreturn]] void refuse_open(const TriMesh& mesh, const std::string& where,
                              const MeshDiagnosis& d) {
    const auto loops = repair_mesh(mesh, 0, CloseRule::loops).diagnosis.loops.size();
    throw Error(Fault::bad_input, where + ": open: " + std::to_string(d.n_open_edges) +
                                      " open edges in " + std::to_string(loops) +
                                      " loops; close them, or cap them with --close loops");
}

[[noreturn]] void refuse_flat(const std::string& where, const MeshDiagnosis& d) {
    std::string what;
    if (d.n_faces == 0)
        what = "it has no face; export it with its faces";
    else if (d.n_sheets == 0)
        what = "none of its " + counted(d.n_faces, "face") +
               " has three corners that are there, finite and different; export it again";
    else if (d.rule == CloseRule::plane || d.n_open_edges == 0 || !(d.area_m2 > 0))
        what = counted(d.n_sheets, "sheet") + " without volume; give the mesh a thickness";
    else {
        char share[32];
        std::snprintf(share, sizeof share, "%.0f", 100 * d.cap_area_m2 / d.area_m2);
        what = counted(d.n_sheets, "open sheet") + " (caps would be " + share +
               " % of the surface); give the mesh a thickness, or try --close plane, which puts a "
               "base under it, or --close winding";
    }
    throw Error(Fault::bad_input, where + ": no inside: " + what);
}

} // namespace

ClosedMesh close_mesh(const TriMesh& mesh, const std::string& where, const CloseSettings& settings,
                      Progress* progress) {
    if (settings.rule == CloseRule::winding)
        throw Error(Fault::bad_argument,
                    where + ": 'winding' makes no closed mesh; use loops, plane or none");
    RepairedMesh repaired = repair_mesh(mesh, std::nullopt, settings.rule);
    const double share = repaired.diagnosis.weld_share;
    ClosedMesh closed = Shells(std::move(repaired), settings.shells).run();
    for (const double wider : weld_shares()) {
        if (closed.diagnosis.n_solids > 0 || closed.diagnosis.n_open_edges == 0)
            break;
        check_cancelled(progress);
        if (wider > share)
            closed = Shells(repair_mesh(mesh, wider, settings.rule), settings.shells).run();
    }
    if (settings.rule == CloseRule::none && closed.diagnosis.n_open_edges > 0)
        refuse_open(mesh, where, closed.diagnosis);
    if (closed.diagnosis.n_solids == 0)
        refuse_flat(where, closed.diagnosis);
    return closed;
}

} // namespace taihu
