#include "precompute/surfaces/surface_mend.h"

#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_self_intersections.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>
#include <CGAL/alpha_wrap_3.h>

#include <algorithm>

#include "precompute/surfaces/cgal_surface.h"
#include "precompute/surfaces/shells.h"

namespace palpate {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using SurfaceMesh = CGAL::Surface_mesh<PolygonSoup::Point>;

}  // namespace

std::string problem_of(const TriangleSurface& surface) {
  PolygonSoup soup = soup_of(surface);
  if (weld(soup) != 0) return "has triangles without area";
  const std::size_t points = soup.points.size();
  if (!PMP::orient_polygon_soup(soup.points, soup.polygons) || soup.points.size() != points)
    return "is not manifold";
  SurfaceMesh mesh;
  PMP::polygon_soup_to_polygon_mesh(soup.points, soup.polygons, mesh);
  if (!CGAL::is_closed(mesh)) return "is open";
  if (std::ranges::any_of(mesh.faces(),
                          [&](auto face) { return PMP::is_degenerate_triangle_face(face, mesh); }))
    return "has triangles without area";
  if (std::vector<TriangleSurface> shells = shells_of(surface); shells.size() > 1) {
    const std::size_t apart = body_shells(std::move(shells)).others.size();
    if (apart != 0) return "has " + std::to_string(apart + 1) + " parts";
  }
  std::vector<std::pair<SurfaceMesh::Face_index, SurfaceMesh::Face_index>> pairs;
  PMP::self_intersections(mesh, std::back_inserter(pairs));
  if (pairs.empty()) return "";
  return "intersects itself in " + std::to_string(pairs.size()) +
         (pairs.size() == 1 ? " pair of triangles" : " pairs of triangles");
}

TriangleSurface without_self_intersections(const TriangleSurface& surface) {
  SurfaceMesh mesh = mesh_of(surface);
  PMP::experimental::remove_self_intersections(mesh, CGAL::parameters::preserve_genus(false));
  mesh.collect_garbage();
  return surface_of(mesh);
}

TriangleSurface wrap_surface(const TriangleSurface& surface, double alpha, double offset) {
  const auto wrapped = [&](const TriangleSurface& shell) {
    const PolygonSoup soup = soup_of(shell);
    SurfaceMesh wrap;
    CGAL::alpha_wrap_3(soup.points, soup.polygons, alpha, offset, wrap);
    wrap.collect_garbage();
    return surface_of(wrap);
  };
  const std::vector<TriangleSurface> cavities = cavities_of(surface);
  std::vector<TriangleSurface> shells = shells_of(surface);
  if (cavities.empty() || cavities.size() == shells.size()) return wrapped(surface);
  std::erase_if(shells, [](const TriangleSurface& shell) { return enclosed_volume(shell) < 0.0; });
  shells = {wrapped(together(shells))};
  for (const TriangleSurface& cavity : cavities) turn(shells.emplace_back(wrapped(cavity)), false);
  return together(shells);
}

}  // namespace palpate
