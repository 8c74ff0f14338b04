#include "precompute/surfaces/surface_input.h"

#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>
#include <CGAL/Polygon_mesh_processing/triangulate_faces.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <set>
#include <sstream>

#include "base/child_process.h"
#include "base/error.h"
#include "base/regular_file.h"
#include "base/write_file.h"
#include "formats/outputs/output_paths.h"
#include "precompute/surfaces/cgal_surface.h"
#include "precompute/surfaces/polygon_soup.h"
#include "precompute/surfaces/shells.h"
#include "precompute/surfaces/surface_bytes.h"
#include "precompute/surfaces/surface_file.h"
#include "precompute/surfaces/surface_mend.h"

namespace palpate {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = PolygonSoup::Kernel;
using Point = PolygonSoup::Point;
using Polygon = PolygonSoup::Polygon;
using SurfaceMesh = CGAL::Surface_mesh<Point>;
using Face = SurfaceMesh::Face_index;

constexpr double sharp_edge_degrees = 60.0;
constexpr int remesh_iterations = 5;
constexpr double remesh_time = 1e-3;    // [s] per triangle, meant to be far too much
constexpr double remesh_memory = 4e3;   // [byte] per triangle, likewise
constexpr double most_triangles = 2e7;  // after remeshing; a body's boundary has about 1e5 at most

/// Number of connected groups of open edges.
std::size_t count_holes(const std::vector<SoupEdge>& open_edges, std::size_t points) {
  std::vector<std::size_t> group(points);
  std::iota(group.begin(), group.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (group[i] != i) {
      i = group[i] = group[group[i]];
    }
    return i;
  };
  for (const auto& [a, b] : open_edges) {
    group[root(a)] = root(b);
  }
  std::set<std::size_t> holes;
  for (const auto& edge : open_edges) {
    holes.insert(root(edge[0]));
  }
  return holes.size();
}

void check_edges(const PolygonSoup& soup, const std::string& where) {
  const std::vector<SoupEdge> edges = sorted_edges(soup);
  std::vector<SoupEdge> open_edges;
  for (auto edge = edges.begin(); edge != edges.end();) {
    const auto end = std::find_if(edge, edges.end(), [&](const SoupEdge& other) { return other != *edge; });
    if (end - edge > 2) {
      throw Error(
          fmt::format("the surface is not manifold: {} triangles meet in the edge from {} to {} (file units)",
                      end - edge, shown(soup.points[(*edge)[0]]), shown(soup.points[(*edge)[1]])),
          where, "remove inner walls and doubled triangles in a mesh editor");
    }
    if (end - edge == 1) open_edges.push_back(*edge);
    edge = end;
  }
  if (open_edges.empty()) {
    return;
  }
  const auto& [a, b] = open_edges.front();
  throw Error("the surface is open: " + std::to_string(count_holes(open_edges, soup.points.size())) +
                  " hole(s), " + std::to_string(open_edges.size()) + " open edges, the first from " +
                  shown(soup.points[a]) + " to " + shown(soup.points[b]) + " (file units)",
              where, "close the holes in a mesh editor (\"fill holes\")");
}

/// Orients all polygons consistently.
SurfaceMesh connect(PolygonSoup& soup, const std::string& where, std::vector<std::string>& notes) {
  const std::size_t points = soup.points.size();
  const std::vector<Polygon> as_given = soup.polygons;
  PMP::orient_polygon_soup(soup.points, soup.polygons);
  if (soup.points.size() > points) {
    throw Error("the surface is not manifold: parts of it touch in the point " + shown(soup.points[points]) +
                    " (file units), or it is one-sided there",
                where, "separate the parts in a mesh editor");
  }
  std::size_t turned = 0;
  for (std::size_t i = 0; i < as_given.size(); ++i) {
    turned += as_given[i] == soup.polygons[i] ? 0 : 1;
  }
  if (turned != 0 && turned != as_given.size()) {
    notes.push_back(std::to_string(turned) + " of " + std::to_string(as_given.size()) +
                    " polygons of the surface were turned to agree with their neighbours");
  }
  SurfaceMesh mesh;
  PMP::polygon_soup_to_polygon_mesh(soup.points, soup.polygons, mesh);
  PMP::triangulate_faces(mesh);
  return mesh;
}

const Point& first_corner(const SurfaceMesh& mesh, Face face) {
  return mesh.point(target(halfedge(face, mesh), mesh));
}

void check_triangles(const SurfaceMesh& mesh, const std::string& where) {
  for (const Face face : mesh.faces()) {
    if (PMP::is_degenerate_triangle_face(face, mesh)) {
      throw Error("a triangle at " + shown(first_corner(mesh, face)) + " (file units) has no area", where,
                  "remove degenerate triangles in a mesh editor");
    }
  }
}

/// Orients the surface of a body outwards, and those of its cavities inwards. Throws Error for anything else.
void orient_outwards(SurfaceMesh& mesh, const std::string& where, std::vector<std::string>& notes) {
  std::vector<TriangleSurface> shells = shells_of(surface_of(mesh));
  bool turned = false;
  if (shells.size() == 1) {
    turned = !PMP::is_outward_oriented(mesh);
    if (turned) PMP::reverse_face_orientations(mesh);
  } else {
    const BodyShells body = body_shells(std::move(shells));
    if (!body.others.empty()) {
      std::string places = shown(body.kept.front().nodes.front());
      for (std::size_t i = 0; i < std::min<std::size_t>(body.others.size(), 2); ++i)
        places += ", " + shown(body.others[i].nodes.front());
      throw Error(
          fmt::format("the surface has {} disconnected parts, at {} (file units)", body.others.size() + 1,
                      places),
          where, "a body is one closed shell, and others in it around cavities: keep one part, or join them");
    }
    mesh = mesh_of(together(body.kept));
    turned = body.turned;
  }
  if (turned) notes.emplace_back("the surface was oriented inwards and has been turned");
}

using FacePair = std::pair<Face, Face>;
using Corners = std::array<Vec3, 3>;

std::vector<Corners> corners_of(const SurfaceMesh& mesh, const std::vector<FacePair>& pairs) {
  std::vector<Face> faces;
  for (const auto& [a, b] : pairs) {
    faces.insert(faces.end(), {a, b});
  }
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  std::vector<Corners> result;
  for (const Face face : faces) {
    Corners& corners = result.emplace_back();
    std::size_t i = 0;
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face))) {
      const Point& p = mesh.point(vertex);
      corners.at(i++) = Vec3(p.x(), p.y(), p.z());
    }
  }
  return result;
}

/// Writes the triangles; returns an empty path if that is not allowed or fails, since the defect is reported
/// all the same.
std::filesystem::path write_bad_faces(const std::vector<Corners>& faces, const std::string& stem, bool keep) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(17);
  out << "OFF\n" << 3 * faces.size() << " " << faces.size() << " 0\n";
  for (const Corners& corners : faces) {
    for (const Vec3& p : corners) {
      out << p.x() << " " << p.y() << " " << p.z() << "\n";
    }
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    out << "3 " << 3 * i << " " << 3 * i + 1 << " " << 3 * i + 2 << "\n";
  }
  try {
    std::filesystem::path file =
        OutputPaths({}, keep).add(stem + ".bad-faces.off", OutputKind::faces, "self-intersections");
    (keep ? write_new_file : write_file)(file, out.str());
    return file;
  } catch (const Error&) {
    return {};
  }
}

Point center(const SurfaceMesh& mesh, Face face) {
  const auto h = mesh.halfedge(face);
  return CGAL::centroid(mesh.point(mesh.source(h)), mesh.point(mesh.target(h)),
                        mesh.point(mesh.target(mesh.next(h))));
}

/// Places and number of self-intersections.
struct SelfIntersections {
  std::string problem;  // empty: nowhere
  std::vector<Corners> triangles;
};

SelfIntersections find_self_intersections(const SurfaceMesh& mesh) {
  std::vector<FacePair> pairs;
  PMP::self_intersections(mesh, std::back_inserter(pairs));
  if (pairs.empty()) {
    return {};
  }
  std::sort(pairs.begin(), pairs.end());
  return {"intersects itself: " + std::to_string(pairs.size()) + " pair(s) of triangles, the first near " +
              shown(center(mesh, pairs.front().first)) + " (file units)",
          corners_of(mesh, pairs)};
}

void remesh(SurfaceMesh& mesh, double edge_length) {
  auto sharp = mesh.add_property_map<SurfaceMesh::Edge_index, bool>("e:sharp", false).first;
  PMP::detect_sharp_edges(mesh, sharp_edge_degrees, sharp);
  PMP::isotropic_remeshing(
      mesh.faces(), edge_length, mesh,
      CGAL::parameters::number_of_iterations(remesh_iterations).edge_is_constrained_map(sharp));
  mesh.collect_garbage();
}

/// Data that a child sends.
struct Answer {
  TriangleSurface surface;
  std::vector<std::string> notes;
  SelfIntersections crossings;
};

Bytes pack(const Answer& answer) {
  Bytes bytes;
  append_surface(bytes, answer.surface);
  append_text(bytes, answer.crossings.problem);
  append_array(bytes, std::span(answer.crossings.triangles));
  append_lines(bytes, answer.notes);
  return bytes;
}

Answer unpack(std::span<const std::byte> bytes) {
  Answer answer;
  answer.surface = take_surface(bytes);
  answer.crossings.problem = take_text(bytes);
  answer.crossings.triangles = take_array<Corners>(bytes);
  answer.notes = take_lines(bytes);
  return answer;
}

/// Surface of a file, closed and oriented outwards; it may still intersect itself.
SurfaceMesh read_mesh(const std::string& bytes, const std::filesystem::path& file,
                      std::vector<std::string>& notes) {
  const std::string where = file.string();
  PolygonSoup soup = read_polygon_soup(bytes, file);
  weld(soup);
  if (std::string seam = join_seams(soup); !seam.empty()) notes.push_back(std::move(seam));
  check_edges(soup, where);
  SurfaceMesh mesh = connect(soup, where, notes);
  check_triangles(mesh, where);
  orient_outwards(mesh, where, notes);
  return mesh;
}

Answer read_in_child(const std::string& bytes, const std::filesystem::path& file, const ChildLimits& limits,
                     const char* hint, const std::function<void(SurfaceMesh&, Answer&)>& finish) {
  const std::string where = file.string();
  const ChildResult result =
      run_in_child({.name = "CGAL", .where = where, .limits = limits, .hint = hint}, [&] {
        Answer answer;
        try {
          SurfaceMesh mesh = read_mesh(bytes, file, answer.notes);
          finish(mesh, answer);
        } catch (const CGAL::Failure_exception&) {
          throw Error("CGAL cannot make a surface of what is in the file", where, hint);
        }
        return ChildResult{0, pack(answer)};
      });
  return unpack(result.bytes);
}

std::string bytes_of(const std::filesystem::path& file) {
  return read_all(file, "Check surface = \"...\" in [geometry]");
}

}  // namespace

TriangleSurface read_surface(const std::filesystem::path& file, std::vector<std::string>& notes, bool keep) {
  const std::string bytes = bytes_of(file);
  Answer answer = read_in_child(bytes, file, reading_limits(std::ssize(bytes)),
                                "repair the surface in a mesh editor, or export it again",
                                [](SurfaceMesh& mesh, Answer& into) {
                                  into.crossings = find_self_intersections(mesh);
                                  into.surface = surface_of(mesh);
                                });
  if (!answer.crossings.problem.empty()) {
    const std::filesystem::path bad_faces =
        write_bad_faces(answer.crossings.triangles, file.stem().string(), keep);
    throw Error("the surface " + answer.crossings.problem, file.string(),
                bad_faces.empty()
                    ? "repair it in a mesh editor"
                    : "repair it in a mesh editor; the triangles were written to " + bad_faces.string());
  }
  notes.insert(notes.end(), answer.notes.begin(), answer.notes.end());
  return std::move(answer.surface);
}

Remeshing remesh_surface(const std::filesystem::path& file, const TriangleSurface& surface,
                         double edge_length) {
  const double triangles = area(surface) / (std::sqrt(0.1875) * edge_length * edge_length);
  if (!(triangles <= most_triangles)) {
    throw Error("remeshed to this edge_length the surface has " +
                    (std::isfinite(triangles) ? fmt::format("some {:.2g}", triangles) : "countless") +
                    " triangles",
                file.string(), "use a larger edge_length in [mesh], or check scale in [geometry]");
  }
  const std::string bytes = bytes_of(file);
  ChildLimits limits = reading_limits(std::ssize(bytes));
  limits = child_limits(limits.processor + std::chrono::seconds(static_cast<int>(triangles * remesh_time)),
                        limits.memory + static_cast<std::int64_t>(triangles * remesh_memory));
  Answer answer = read_in_child(bytes, file, limits,
                                R"(use another edge_length, or mesher = "cgal" without remesh in [mesh])",
                                [&](SurfaceMesh& mesh, Answer& into) {
                                  remesh(mesh, edge_length);
                                  try {
                                    check_triangles(mesh, file.string());
                                  } catch (const Error& error) {
                                    into.crossings.problem = std::string("is degenerate: ") + error.what();
                                    return;
                                  }
                                  into.crossings = find_self_intersections(mesh);
                                  into.surface = surface_of(mesh);
                                });
  return {std::move(answer.surface), std::move(answer.crossings.problem)};
}

}  // namespace palpate
