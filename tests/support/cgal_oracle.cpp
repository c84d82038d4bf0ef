#include "tests/support/cgal_oracle.h"

#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

namespace taihu {
namespace {

namespace processing = CGAL::Polygon_mesh_processing;
using Exact = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Exact::Point_3>;
using Plain = CGAL::Simple_cartesian<double>;

template <class Point>
Point to_cgal(const Vec3& p) {
    return Point(p.x, p.y, p.z);
}

} // namespace

CgalVerdict cgal_verdict(const TriMesh& mesh) {
    std::vector<Exact::Point_3> points;
    for (const Vec3& p : mesh.positions)
        points.push_back(to_cgal<Exact::Point_3>(p));
    std::vector<std::array<std::size_t, 3>> faces;
    for (const Triangle& t : mesh.triangles)
        faces.push_back({t[0], t[1], t[2]});
    processing::merge_duplicate_points_in_polygon_soup(points, faces);
    CgalVerdict verdict;
    verdict.manifold = processing::is_polygon_soup_a_polygon_mesh(faces);
    if (!verdict.manifold)
        return verdict;
    Mesh surface;
    processing::polygon_soup_to_polygon_mesh(points, faces, surface);
    verdict.closed = CGAL::is_closed(surface);
    std::vector<Mesh::Face_index> degenerate;
    processing::degenerate_faces(surface, std::back_inserter(degenerate));
    verdict.n_degenerate = degenerate.size();
    std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
    processing::self_intersections(surface, std::back_inserter(pairs));
    verdict.n_self_intersections = pairs.size();
    verdict.bounds_volume =
        verdict.closed && pairs.empty() && processing::does_bound_a_volume(surface);
    return verdict;
}

struct CgalDistance::Tree {
    using Triangles = std::vector<Plain::Triangle_3>;
    using Primitive = CGAL::AABB_triangle_primitive<Plain, Triangles::const_iterator>;

    Triangles triangles;
    CGAL::AABB_tree<CGAL::AABB_traits<Plain, Primitive>> boxes;
};

CgalDistance::CgalDistance(const TriMesh& mesh) : tree_(std::make_unique<Tree>()) {
    const auto corner = [&](std::uint32_t i) { return to_cgal<Plain::Point_3>(mesh.positions[i]); };
    for (const Triangle& t : mesh.triangles)
        tree_->triangles.emplace_back(corner(t[0]), corner(t[1]), corner(t[2]));
    tree_->boxes.insert(tree_->triangles.cbegin(), tree_->triangles.cend());
    tree_->boxes.build();
    tree_->boxes.accelerate_distance_queries();
}
CgalDistance::CgalDistance(CgalDistance&&) noexcept = default;
CgalDistance::~CgalDistance() = default;

double CgalDistance::operator()(const Vec3& point) const {
    return std::sqrt(tree_->boxes.squared_distance(to_cgal<Plain::Point_3>(point)));
}

} // namespace taihu
