#include "precompute/surfaces/cgal_surface.h"

#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>

namespace palpate {
namespace {

using SurfaceMesh = CGAL::Surface_mesh<PolygonSoup::Point>;

}  // namespace

PolygonSoup soup_of(const TriangleSurface& surface) {
  PolygonSoup soup;
  for (const Vec3& x : surface.nodes) soup.points.emplace_back(x[0], x[1], x[2]);
  for (const Triangle& t : surface.triangles) {
    auto& polygon = soup.polygons.emplace_back();
    for (const Index node : t) polygon.push_back(static_cast<std::size_t>(node));
  }
  return soup;
}

SurfaceMesh mesh_of(const TriangleSurface& surface) {
  const PolygonSoup soup = soup_of(surface);
  SurfaceMesh mesh;
  CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(soup.points, soup.polygons, mesh);
  return mesh;
}

TriangleSurface surface_of(const SurfaceMesh& mesh) {
  TriangleSurface surface;
  surface.nodes.reserve(mesh.number_of_vertices());
  for (const auto vertex : mesh.vertices()) {
    const PolygonSoup::Point& p = mesh.point(vertex);
    surface.nodes.emplace_back(p.x(), p.y(), p.z());
  }
  surface.triangles.reserve(mesh.number_of_faces());
  for (const auto face : mesh.faces()) {
    Triangle triangle{};
    std::size_t corner = 0;
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face)))
      triangle[corner++] = static_cast<Index>(static_cast<std::size_t>(vertex));
    surface.triangles.push_back(triangle);
  }
  return surface;
}

}  // namespace palpate
