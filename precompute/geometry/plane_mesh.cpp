#include "precompute/geometry/plane_mesh.h"

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_mesh_face_base_2.h>
#include <CGAL/Delaunay_mesh_vertex_base_2.h>
#include <CGAL/Delaunay_mesher_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_2/Face_badness.h>
#include <CGAL/Polygon_2_algorithms.h>
#include <CGAL/lloyd_optimize_mesh_2.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "base/child_process.h"
#include "base/error.h"
#include "precompute/geometry/mesh_bytes.h"
#include "precompute/geometry/mesh_size.h"
#include "precompute/geometry/polygon_check.h"

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_2;

/// Vertex with a number, by which CGAL orders handles; it would otherwise compare addresses, and Lloyd's
/// moves came in another order in every run.
template <typename Base = CGAL::Delaunay_mesh_vertex_base_2<Kernel>>
class NumberedVertex : public Base {
 public:
  // NOLINTBEGIN(readability-identifier-naming): CGAL's names
  using Has_timestamp = CGAL::Tag_true;
  template <typename DataStructure>
  struct Rebind_TDS {
    using Other = NumberedVertex<typename Base::template Rebind_TDS<DataStructure>::Other>;
  };
  // NOLINTEND(readability-identifier-naming)
  using Base::Base;

  [[nodiscard]] std::size_t time_stamp() const { return number_; }
  void set_time_stamp(std::size_t number) { number_ = number; }

 private:
  std::size_t number_ = static_cast<std::size_t>(-1);  // none yet
};

using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<NumberedVertex<>, CGAL::Delaunay_mesh_face_base_2<Kernel>>>;
using VertexHandle = Triangulation::Vertex_handle;
using FaceHandle = Triangulation::Face_handle;
using Line = std::vector<Point>;  // closed

constexpr std::size_t max_nodes = 2'000'000;
constexpr double elements_per_node = 2.0;
constexpr double unsure_of_grading = 3.0;  // the estimate is for a strip
constexpr double time_per_node = 1e-3;     // [s] meant to be far too much, smoothing included
constexpr double memory_per_node = 4e3;    // [byte]
constexpr double wanted_angle = 20.0;      // [degree] refinement ends for bounds up to 20.7 (Shewchuk)
constexpr double radius_per_edge = 0.73;   // measured: the mean edge is then the requested one
constexpr int lloyd_iterations = 20;       // with many more, graded meshes drift away from their sizes

enum MeshStatus : int { meshed = 0, no_mesh = 1, too_many_nodes = 2 };

/// Throws Error for too many elements; `nodes` is 0 if their number is unknown.
[[noreturn]] void throw_too_many(double nodes, const std::string& where) {
  throw Error(
      (nodes == 0.0 ? "the mesh would have" : "the mesh would have " + shown_count(nodes) + " nodes,") +
          fmt::format(" more than {} million{}", max_nodes / 1'000'000, nodes == 0.0 ? " nodes" : ""),
      where, "use a larger edge_length in [mesh], or check scale in [geometry]");
}

/// Target edge length at a place: that at the lines, growing with the distance from them.
class EdgeTarget {
 public:
  EdgeTarget(const std::vector<Line>& lines, double edge_length, double grading)
      : edge_length_(edge_length), grading_(grading) {
    const auto raised = [](const Point& p) { return Kernel::Point_3(p.x(), p.y(), 0.0); };
    for (const Line& line : lines) {
      for (std::size_t i = 0; i < line.size(); ++i) {
        segments_.emplace_back(raised(line[i]), raised(line[(i + 1) % line.size()]));
      }
    }
    tree_.insert(segments_.begin(), segments_.end());
  }

  double operator()(const Point& p) const {
    if (grading_ == 0.0) {
      return edge_length_;
    }
    return edge_length_ + grading_ * std::sqrt(tree_.squared_distance(Kernel::Point_3(p.x(), p.y(), 0.0)));
  }

 private:
  using Segments = std::vector<Kernel::Segment_3>;  // CGAL 5's trees are three-dimensional
  double edge_length_;
  double grading_;
  Segments segments_;
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_segment_primitive<Kernel, Segments::const_iterator>>>
      tree_;
};

/// Criteria for refining triangles (CGAL's MeshingCriteria_2): first those too large for their place, largest
/// first; then those with an angle below the bound, sharpest first.
class Criteria {
 public:
  struct Quality {
    double size = 0.0;         ///< squared circumradius over the squared bound on it
    double square_sine = 1.0;  ///< of the smallest angle

    bool operator<(const Quality& other) const {
      const bool large = size > 1.0, other_large = other.size > 1.0;
      if (large || other_large) {
        return large && (!other_large || size > other.size);
      }
      return square_sine < other.square_sine;
    }
  };

  class Is_bad {  // NOLINT(readability-identifier-naming): CGAL's name
   public:
    explicit Is_bad(const EdgeTarget& target) : target_(target) {}

    CGAL::Mesh_2::Face_badness operator()(const Quality& quality) const {
      static const double bound = std::pow(std::sin(wanted_angle * std::numbers::pi / 180.0), 2);
      return quality.size > 1.0            ? CGAL::Mesh_2::IMPERATIVELY_BAD
             : quality.square_sine < bound ? CGAL::Mesh_2::BAD
                                           : CGAL::Mesh_2::NOT_BAD;
    }

    CGAL::Mesh_2::Face_badness operator()(FaceHandle face, Quality& quality) const {
      const Point &a = face->vertex(0)->point(), &b = face->vertex(1)->point(), &c = face->vertex(2)->point();
      std::array<double, 3> edges = {CGAL::squared_distance(b, c), CGAL::squared_distance(c, a),
                                     CGAL::squared_distance(a, b)};
      std::sort(edges.begin(), edges.end());
      const double twice_area = 2.0 * CGAL::area(a, b, c);
      const double radius = radius_per_edge * target_(CGAL::centroid(a, b, c));
      quality.square_sine = twice_area * twice_area / (edges[1] * edges[2]);
      quality.size = edges[0] / (4.0 * quality.square_sine) / (radius * radius);  // R = a / (2 sin(alpha))
      return (*this)(quality);
    }

   private:
    const EdgeTarget& target_;
  };

  explicit Criteria(const EdgeTarget& target) : target_(&target) {}

  [[nodiscard]] Is_bad is_bad_object() const { return Is_bad(*target_); }

 private:
  const EdgeTarget* target_;
};

/// The outer line, then the holes, with the body on the left of each.
std::vector<Line> lines_around(const PolygonGeometry& polygon) {
  const auto turned = [](const std::vector<Vec3>& points, CGAL::Orientation sense) {
    Line line;
    for (const Vec3& x : points) {
      line.emplace_back(x[0], x[1]);
    }
    if (CGAL::orientation_2(line.begin(), line.end()) != sense) {
      std::reverse(line.begin(), line.end());
    }
    return line;
  };
  std::vector<Line> lines = {turned(polygon.points, CGAL::COUNTERCLOCKWISE)};
  for (const std::vector<Vec3>& hole : polygon.holes) {
    lines.push_back(turned(hole, CGAL::CLOCKWISE));
  }
  return lines;
}

/// Reports corners of the body that are sharper than the wanted angle, which no mesh can avoid.
void note_sharp_corners(const std::vector<Line>& lines, std::vector<std::string>& notes) {
  double sharpest = wanted_angle;  // [degree]
  Point place;
  int count = 0;
  for (const Line& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      const Point& p = line[i];
      const Kernel::Vector_2 onward = line[(i + 1) % line.size()] - p;
      const Kernel::Vector_2 back = line[(i + line.size() - 1) % line.size()] - p;
      const double angle =
          std::atan2(CGAL::determinant(onward, back), onward * back) * 180.0 / std::numbers::pi;
      if (angle < 0.0 || angle >= wanted_angle) {  // below 0: more than 180
        continue;
      }
      ++count;
      if (angle < sharpest) {
        sharpest = angle;
        place = p;
      }
    }
  }
  if (count != 0) {
    notes.push_back(fmt::format(
        "the polygon has {} corner(s) of less than {} degrees, the sharpest of {:.3g} at ({:.6g}, {:.6g}): "
        "the elements there are as sharp",
        count, wanted_angle, sharpest, place.x(), place.y()));
  }
}

/// Lines with each edge divided into equal parts of about edge_length.
std::vector<Line> divided(const std::vector<Line>& lines, double edge_length, const std::string& where) {
  const auto parts_of = [&](const Kernel::Vector_2& edge) {
    return std::max(1.0, std::round(std::sqrt(edge.squared_length()) / edge_length));
  };
  std::vector<Line> result;
  double total = 0.0;
  for (const Line& line : lines) {
    result.emplace_back();
    for (std::size_t i = 0; i < line.size(); ++i) {
      const Kernel::Vector_2 edge = line[(i + 1) % line.size()] - line[i];
      const double parts = parts_of(edge);
      total += parts;
      if (total > max_nodes) {
        throw_too_many(0.0, where);
      }
      for (int part = 0; part < static_cast<int>(parts); ++part) {
        result.back().push_back(line[i] + part / parts * edge);
      }
    }
  }
  return result;
}

/// Inserts the lines as constraints and returns a point in the body: the centroid of the largest triangle at
/// the outer line.
Point insert_lines(const std::vector<Line>& lines, Triangulation& triangulation) {
  std::vector<std::vector<VertexHandle>> vertices;
  for (const Line& line : lines) {
    vertices.emplace_back();
    for (const Point& p : line) {
      vertices.back().push_back(triangulation.insert(p));
    }
  }
  for (const std::vector<VertexHandle>& line : vertices) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      triangulation.insert_constraint(line[i], line[(i + 1) % line.size()]);
    }
  }

  const std::vector<VertexHandle>& outer = vertices[0];
  Kernel::Triangle_2 largest;
  for (std::size_t i = 0; i < outer.size(); ++i) {
    FaceHandle face;
    int opposite = 0;
    // backwards: is_edge gives the face on the right
    triangulation.is_edge(outer[(i + 1) % outer.size()], outer[i], face, opposite);
    const Kernel::Triangle_2 triangle = triangulation.triangle(face);
    if (i == 0 || triangle.area() > largest.area()) {
      largest = triangle;
    }
  }
  return CGAL::centroid(largest);
}

/// Refines the triangles. Returns false if there would be more than max_nodes.
bool refine(const EdgeTarget& target, const Point& seed, Triangulation& triangulation) {
  CGAL::Delaunay_mesher_2<Triangulation, Criteria> mesher(triangulation, Criteria(target));
  mesher.set_seeds(&seed, &seed + 1, true);
  mesher.init();
  while (mesher.step_by_step_refine_mesh()) {
    if (triangulation.number_of_vertices() > max_nodes) {
      return false;
    }
  }
  return true;
}

void smooth(const Point& seed, Triangulation& triangulation) {
  CGAL::lloyd_optimize_mesh_2(triangulation, CGAL::parameters::max_iteration_number = lloyd_iterations,
                              CGAL::parameters::seeds_begin = &seed, CGAL::parameters::seeds_end = &seed + 1,
                              CGAL::parameters::mark = true);
}

Mesh export_mesh(const Triangulation& triangulation) {
  Mesh mesh;
  mesh.element = ElementType::tri3;
  std::unordered_map<VertexHandle, Index> number;
  for (const FaceHandle face : triangulation.finite_face_handles()) {
    if (!face->is_in_domain()) {
      continue;
    }
    for (int i = 0; i < 3; ++i) {
      const auto [entry, is_new] = number.try_emplace(face->vertex(i), static_cast<Index>(mesh.nodes.size()));
      if (is_new) {
        const Point& p = face->vertex(i)->point();
        mesh.nodes.emplace_back(p.x(), p.y(), 0.0);
      }
      mesh.connectivity.push_back(entry->second);
    }
  }
  mesh.regions.assign(mesh.connectivity.size() / 3, 0);
  return mesh;
}

ChildResult make_mesh(const std::vector<Line>& lines, const MeshOptions& options) {
  try {
    const EdgeTarget target(lines, *options.edge_length, options.grading);
    Triangulation triangulation;
    const Point seed = insert_lines(lines, triangulation);
    if (!refine(target, seed, triangulation)) {
      return {too_many_nodes, {}};
    }
    if (options.lloyd) {
      smooth(seed, triangulation);
      const EdgeTarget any_length({}, std::numeric_limits<double>::infinity(), 0.0);
      refine(any_length, seed, triangulation);  // for angles that smoothing made too sharp
    }
    return {meshed, pack(export_mesh(triangulation))};
  } catch (const CGAL::Failure_exception&) {
    return {no_mesh, {}};
  }
}

/// Limits for the number of nodes that the lines and the area inside imply; refinement stops at max_nodes.
/// Throws Error (where = `where`) if they imply many more.
ChildLimits refinement_limits(const std::vector<Line>& lines, const MeshOptions& options,
                              const std::string& where) {
  double area = 0.0, length = 0.0, given = 0.0;
  for (const Line& line : lines) {
    area += CGAL::polygon_area_2(line.begin(), line.end(), Kernel());
    for (std::size_t i = 0; i < line.size(); ++i)
      length += std::sqrt(CGAL::squared_distance(line[i], line[(i + 1) % line.size()]));
    given += static_cast<double>(line.size());
  }
  const double wanted = expected_plane_nodes(area, length, *options.edge_length, options.grading);
  const double most = static_cast<double>(max_nodes);
  if (!(wanted <= (options.grading == 0.0 ? 1.0 : unsure_of_grading) * most)) throw_too_many(wanted, where);
  check_mesh_room(elements_per_node * std::min(wanted, most), ElementType::tri3, where);
  const double nodes = std::min(10.0 * given + wanted, most);
  return child_limits(std::chrono::seconds(5 + static_cast<int>(nodes * time_per_node)),
                      (512LL << 20) + static_cast<std::int64_t>(nodes * memory_per_node));
}

}  // namespace

Mesh mesh_polygon(const PolygonGeometry& polygon, const MeshOptions& options, const std::string& where,
                  std::vector<std::string>& notes) {
  if (options.element.value_or(ElementType::tri3) != ElementType::tri3) {
    throw Error(std::string("a polygon cannot be meshed with ") + traits(*options.element).name, where,
                "element = \"tri3\" is what polygons and pictures are meshed with; quad4 is for rectangles");
  }
  check_polygon(polygon, where);
  std::vector<Line> lines = lines_around(polygon);
  note_sharp_corners(lines, notes);
  lines = divided(lines, *options.edge_length, where);
  const ChildTask task = {.name = "CGAL's mesher",
                          .where = where,
                          .limits = refinement_limits(lines, options, where),
                          .hint = "use a larger edge_length in [mesh], or simplify the polygon"};
  const ChildResult result = run_in_child(task, [&] { return make_mesh(lines, options); });
  if (result.status == too_many_nodes) {
    throw_too_many(0.0, where);
  }
  if (result.status != meshed) {
    throw Error("CGAL found no mesh of the polygon with this edge length", where,
                "change edge_length in [mesh] a little, or simplify the polygon");
  }
  return unpack_mesh(result.bytes);
}

}  // namespace palpate
