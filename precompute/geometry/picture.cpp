#include "precompute/geometry/picture.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_plus_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polyline_simplification_2/Squared_distance_cost.h>
#include <CGAL/Polyline_simplification_2/simplify.h>

#include <algorithm>
#include <cmath>

#include "precompute/geometry/picture_reader.h"
#include "precompute/geometry/pixel_body.h"
#include "precompute/geometry/plane_mesh.h"

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

constexpr double corner_run = 3.0;      // pixels; shorter runs are steps of a slanted line
constexpr double step_tolerance = 0.5;  // pixels
constexpr double tolerance_per_edge = 0.05;
constexpr double area_tolerance = 0.02;

/// Straight piece of an outline.
struct Run {
  Vec3 from, to;
  bool turns_left;  ///< at `from`

  [[nodiscard]] double length() const { return (to - from).norm(); }
};

std::vector<Run> runs_of(const std::vector<LatticePoint>& outline) {
  const auto at = [&](std::size_t p) {
    const LatticePoint& corner = outline[p % outline.size()];
    return Vec3(corner[0], corner[1], 0.0);
  };
  std::vector<Run> runs;
  for (std::size_t p = 0; p < outline.size(); ++p) {
    const Vec3 in = at(p) - at(p + outline.size() - 1), out = at(p + 1) - at(p);
    const double turn = in[0] * out[1] - in[1] * out[0];
    if (turn != 0.0) {
      runs.push_back({at(p), {}, turn > 0.0});
    }
  }
  for (std::size_t r = 0; r < runs.size(); ++r) {
    runs[r].to = runs[(r + 1) % runs.size()].from;
  }
  return runs;
}

/// Replaces the staircases of an outline by slanted lines: through the middle of each step, half a pixel
/// inside the ends of the runs at its extremes, and through real corners: those between long runs or without
/// steps beside them.
std::vector<Point> without_steps(const std::vector<LatticePoint>& outline) {
  const std::vector<Run> runs = runs_of(outline);
  const auto run_at = [&](std::size_t r) -> const Run& { return runs[r % runs.size()]; };
  const auto is_step = [&](std::size_t r) { return run_at(r).turns_left != run_at(r + 1).turns_left; };
  std::vector<Point> line;
  const auto add = [&](const Vec3& x) { line.emplace_back(x[0], x[1]); };
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Run& run = runs[r];
    const std::size_t before = r + runs.size() - 1;
    if (std::min(run.length(), run_at(before).length()) >= corner_run || (!is_step(r) && !is_step(before))) {
      add(run.from);
    }
    if (is_step(r) || run.length() == 1.0) {
      add((run.from + run.to) / 2.0);
    } else {
      const Vec3 half_a_pixel = (run.to - run.from) / (2.0 * run.length());
      add(run.from + half_a_pixel);
      add(run.to - half_a_pixel);
    }
  }
  return line;
}

/// Closed lines, simplified together so that they do not cross and no point moves further than `tolerance`.
PolygonGeometry simplified(const std::vector<std::vector<Point>>& lines, double tolerance) {
  Triangulation triangulation;
  std::vector<Triangulation::Constraint_id> ids;
  ids.reserve(lines.size());
  for (const std::vector<Point>& points : lines)
    ids.push_back(triangulation.insert_constraint(points.begin(), points.end(), true));
  simplification::simplify(triangulation, simplification::Squared_distance_cost(),
                           simplification::Stop_above_cost_threshold(tolerance * tolerance));
  PolygonGeometry polygon;
  for (const Triangulation::Constraint_id id : ids) {
    std::vector<Vec3>& points = id == ids[0] ? polygon.points : polygon.holes.emplace_back();
    for (const auto vertex : triangulation.vertices_in_constraint(id)) {
      points.emplace_back(vertex->point().x(), vertex->point().y(), 0.0);
    }
    points.pop_back();  // repeats the first
  }
  return polygon;
}

template <typename Points>
double signed_area(const Points& points) {
  double twice = 0.0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const auto &a = points[p], &b = points[(p + 1) % points.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return twice / 2.0;
}

/// Outlines of the body, as simple as the mesh's edge length and the enclosed area allow: strokes thinner
/// than an edge lose their ends, and half of their width, within what an edge cannot resolve.
PolygonGeometry outline(const PixelBody& body, double edge_length) {
  std::vector<std::vector<Point>> lines;
  double area = 0.0;
  for (const std::vector<LatticePoint>& line : trace_outlines(body)) {
    lines.push_back(without_steps(line));
    area += signed_area(lines.back());
  }
  for (double tolerance = std::max(step_tolerance, tolerance_per_edge * edge_length);;
       tolerance = std::max(step_tolerance, tolerance / 2.0)) {
    PolygonGeometry polygon = simplified(lines, tolerance);
    double left = signed_area(polygon.points);
    for (const std::vector<Vec3>& hole : polygon.holes) left += signed_area(hole);
    if (tolerance == step_tolerance || std::abs(left - area) <= area_tolerance * std::abs(area))
      return polygon;
  }
}

}  // namespace

Mesh mesh_picture(const PictureGeometry& picture, const MeshOptions& options,
                  std::vector<std::string>& notes) {
  const std::string where = picture.file.string();
  PixelBody body = read_picture(picture);
  keep_one_body(body, where, notes);
  return mesh_polygon(outline(body, *options.edge_length), options, where, notes);
}

}  // namespace palpate
