#include "precompute/picture.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_plus_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polyline_simplification_2/Squared_distance_cost.h>
#include <CGAL/Polyline_simplification_2/simplify.h>

#include <algorithm>

#include "precompute/picture_reader.h"
#include "precompute/pixel_body.h"
#include "precompute/plane_mesh.h"

namespace palpate {
namespace {

namespace simplification = CGAL::Polyline_simplification_2;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_2;
using Triangulation = CGAL::Constrained_triangulation_plus_2<CGAL::Constrained_Delaunay_triangulation_2<
    Kernel,
    CGAL::Triangulation_data_structure_2<simplification::Vertex_base_2<Kernel>,
                                         CGAL::Constrained_triangulation_face_base_2<Kernel>>,
    CGAL::Exact_predicates_tag>>;

constexpr std::size_t corner_run = 3;   // pixels; shorter runs are steps of a slanted line
constexpr double step_tolerance = 0.6;  // pixels: a step of one pixel leaves the middle of its line by 0.5
constexpr double tolerance_per_edge = 0.05;

/// A line through the middles of the pixel sides, which turns its staircases into slanted lines, and through
/// the corners between long runs, which are meant.
std::vector<Point> without_steps(const std::vector<LatticePoint>& outline) {
  const std::size_t n = outline.size();
  const auto is_corner = [&](std::size_t p) {
    return outline[(p + n - 1) % n][0] != outline[(p + 1) % n][0] &&
           outline[(p + n - 1) % n][1] != outline[(p + 1) % n][1];
  };
  std::vector<std::size_t> corners;
  for (std::size_t p = 0; p < n; ++p) {
    if (is_corner(p)) {
      corners.push_back(p);
    }
  }
  const auto run_after = [&](std::size_t c) {
    return (corners[(c + 1) % corners.size()] + n - corners[c]) % n;
  };
  const auto middle_after = [&](std::size_t p) {
    const LatticePoint &a = outline[p % n], &b = outline[(p + 1) % n];
    return Point(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]));
  };
  std::vector<Point> line;
  for (std::size_t c = 0; c < corners.size(); ++c) {
    const std::size_t p = corners[c], run = run_after(c);
    if (run >= corner_run && run_after((c + corners.size() - 1) % corners.size()) >= corner_run) {
      line.emplace_back(outline[p][0], outline[p][1]);
    }
    line.push_back(middle_after(p));
    if (run > 1) {
      line.push_back(middle_after(p + run - 1));
    }
  }
  return line;
}

/// The lines around the body, simplified together so that they do not cross.
PolygonGeometry outline(const PixelBody& body, double edge_length) {
  Triangulation triangulation;
  std::vector<Triangulation::Constraint_id> ids;
  for (const std::vector<LatticePoint>& line : trace_outlines(body)) {
    const std::vector<Point> points = without_steps(line);
    ids.push_back(triangulation.insert_constraint(points.begin(), points.end(), true));
  }
  const double tolerance = std::max(step_tolerance, tolerance_per_edge * edge_length);
  simplification::simplify(triangulation, simplification::Squared_distance_cost(),
                           simplification::Stop_above_cost_threshold(tolerance * tolerance));
  PolygonGeometry polygon;
  for (const Triangulation::Constraint_id id : ids) {
    std::vector<Vec3>& points = id == ids[0] ? polygon.points : polygon.holes.emplace_back();
    for (const auto vertex : triangulation.vertices_in_constraint(id)) {
      points.emplace_back(vertex->point().x(), vertex->point().y(), 0.0);
    }
    points.pop_back();  // the first again
  }
  return polygon;
}

}  // namespace

Mesh mesh_picture(const PictureGeometry& picture, const MeshOptions& options,
                  std::vector<std::string>& notes) {
  const std::string where = picture.file.string();
  PixelBody body = read_picture(picture.file);
  keep_one_body(body, where, notes);
  return mesh_polygon(outline(body, *options.edge_length), options, where, notes);
}

}  // namespace palpate
