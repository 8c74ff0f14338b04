#include "precompute/surfaces/surface_repair.h"

#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Polygon_mesh_processing/triangulate_faces.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/child_process.h"
#include "base/error.h"
#include "base/regular_file.h"
#include "precompute/surfaces/cgal_surface.h"
#include "precompute/surfaces/polygon_soup.h"
#include "precompute/surfaces/shells.h"
#include "precompute/surfaces/surface_bytes.h"
#include "precompute/surfaces/surface_file.h"
#include "precompute/surfaces/surface_mend.h"

namespace palpate {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using SurfaceMesh = CGAL::Surface_mesh<PolygonSoup::Point>;
using Face = SurfaceMesh::Face_index;
using Halfedge = SurfaceMesh::Halfedge_index;

constexpr std::size_t most_edges_without_delaunay = 300;  // CGAL takes cubic time in them
constexpr double most_change = 0.1;  // of the volume, by replacing triangles where a surface intersects
                                     // itself
constexpr double wrap_alpha = 0.5;   // of the edge
constexpr std::size_t bytes_per_triangle = 100;  // of a file
constexpr double least_share = 0.9;  // of area and volume: a smaller part of a file is not the body
constexpr const char* inside_out = "the surface was inside out and was turned";

std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

/// Removes non-triangles, orients neighbours consistently, and cuts where more than two polygons meet.
SurfaceMesh clean(PolygonSoup& soup, std::vector<std::string>& repairs) {
  const auto tell = [&](std::size_t count, const char* one, const char* many) {
    if (count != 0) repairs.push_back(counted(count, one, many));
  };
  tell(weld(soup), "polygon without area was removed", "polygons without area were removed");
  if (std::string seam = join_seams(soup); !seam.empty()) repairs.push_back(std::move(seam));
  const std::size_t polygons = soup.polygons.size();
  PMP::merge_duplicate_polygons_in_polygon_soup(
      soup.points, soup.polygons,
      CGAL::parameters::erase_all_duplicates(false).require_same_orientation(false));
  tell(polygons - soup.polygons.size(), "doubled polygon was removed", "doubled polygons were removed");
  const std::size_t points = soup.points.size();
  const std::vector<PolygonSoup::Polygon> before = soup.polygons;
  PMP::orient_polygon_soup(soup.points, soup.polygons);
  tell(soup.points.size() - points, "point was doubled, where more than one sheet meets",
       "points were doubled, where more than one sheet meets");
  if (soup.points.size() == points) {
    std::size_t turned = 0;
    for (std::size_t i = 0; i < before.size(); ++i) turned += before[i] == soup.polygons[i] ? 0 : 1;
    turned = std::min(turned, before.size() - turned);
    tell(turned, "polygon was turned to agree with its neighbours",
         "polygons were turned to agree with their neighbours");
  }
  SurfaceMesh mesh;
  PMP::polygon_soup_to_polygon_mesh(soup.points, soup.polygons, mesh);
  PMP::triangulate_faces(mesh);
  tell(PMP::stitch_borders(mesh), "open seam was closed", "open seams were closed");
  const std::size_t faces = mesh.number_of_faces();
  PMP::remove_degenerate_faces(mesh);
  if (mesh.number_of_faces() < faces)
    tell(faces - mesh.number_of_faces(), "triangle without area was removed",
         "triangles without area were removed");
  return mesh;
}

/// Edges around a hole, and its extent.
struct Hole {
  std::size_t edges = 0;
  double extent = 0.0;
};

Hole measure_hole(const SurfaceMesh& mesh, Halfedge border) {
  CGAL::Bbox_3 box;
  Hole hole;
  for (const Halfedge h : CGAL::halfedges_around_face(border, mesh)) {
    box += mesh.point(mesh.target(h)).bbox();
    ++hole.edges;
  }
  hole.extent = std::max({box.xmax() - box.xmin(), box.ymax() - box.ymin(), box.zmax() - box.zmin()});
  return hole;
}

void fill_holes(SurfaceMesh& mesh, std::vector<std::string>& repairs) {
  std::vector<Halfedge> borders;
  PMP::extract_boundary_cycles(mesh, std::back_inserter(borders));
  std::size_t filled = 0;
  Hole largest;
  for (const Halfedge border : borders) {
    const Hole hole = measure_hole(mesh, border);
    std::vector<Face> patch;
    PMP::triangulate_hole(mesh, border, std::back_inserter(patch),
                          CGAL::parameters::use_delaunay_triangulation(true));
    if (patch.empty() && hole.edges <= most_edges_without_delaunay)
      PMP::triangulate_hole(mesh, border, std::back_inserter(patch),
                            CGAL::parameters::use_delaunay_triangulation(false));
    if (patch.empty()) continue;
    ++filled;
    if (hole.extent > largest.extent) largest = hole;
  }
  if (filled != 0) {
    repairs.push_back(fmt::format("{} filled, the largest {:.3g} units wide with {} edges",
                                  filled == 1 ? "a hole was" : std::to_string(filled) + " holes were",
                                  largest.extent, largest.edges));
  }
}

/// Result from a child: a surface, and what was done or is still wrong.
struct Mended {
  TriangleSurface surface;
  std::vector<std::string> repairs, remarks;
  std::string problem;
};

ChildResult sent(const Mended& answer) {
  Bytes bytes;
  append_surface(bytes, answer.surface);
  append_text(bytes, answer.problem);
  append_lines(bytes, answer.repairs);
  append_lines(bytes, answer.remarks);
  return {0, std::move(bytes)};
}

Mended received(const ChildResult& result) {
  std::span<const std::byte> bytes = result.bytes;
  Mended answer;
  answer.surface = take_surface(bytes);
  answer.problem = take_text(bytes);
  answer.repairs = take_lines(bytes);
  answer.remarks = take_lines(bytes);
  return answer;
}

/// The body among the parts, with its holes filled.
TriangleSurface body_of(std::vector<TriangleSurface> shells, SurfaceParts parts, const std::string& where,
                        std::vector<std::string>& repairs) {
  const std::size_t count = shells.size();
  std::vector<std::string> filled;
  BodyShells found = body_shells(std::move(shells), [&](const TriangleSurface& outer) {
    SurfaceMesh mesh = mesh_of(outer);
    fill_holes(mesh, filled);
    mesh.collect_garbage();
    return surface_of(mesh);
  });
  const TriangleSurface others = together(found.others);
  if (parts == SurfaceParts::all) std::ranges::move(found.others, std::back_inserter(found.kept));
  TriangleSurface body = together(found.kept);
  if (parts != SurfaceParts::all && !others.triangles.empty()) {
    const double surface = area(body) / (area(body) + area(others)), volume = std::abs(enclosed_volume(body)),
                 inside = volume / (volume + enclosed_volume(others));
    const std::string share =
        fmt::format("{:.3g} % of the area and {:.3g} % of the volume", 100.0 * surface, 100.0 * inside);
    if (parts == SurfaceParts::most && std::min(surface, inside) < least_share) {
      throw Error(
          fmt::format("of {} parts the largest has only {}", count, share), where,
          "give palpate-precompute --parts all, which unites parts that overlap or nearly touch, or --parts "
          "largest for that part alone; or join them in a mesh editor");
    }
    repairs.push_back(fmt::format("of {} parts the largest was kept, {}", count, share));
  }
  repairs.insert(repairs.end(), filled.begin(), filled.end());
  if (found.turned) repairs.emplace_back(inside_out);
  return body;
}

/// Repairs everything except self-intersections.
Mended mend(const std::string& bytes, const std::filesystem::path& file, SurfaceParts parts) {
  Mended answer;
  PolygonSoup soup = read_polygon_soup(bytes, file);
  answer.remarks = soup.remarks;
  SurfaceMesh mesh = clean(soup, answer.repairs);
  mesh.collect_garbage();
  if (std::vector<TriangleSurface> shells = shells_of(surface_of(mesh)); shells.size() > 1) {
    mesh = mesh_of(body_of(std::move(shells), parts, file.string(), answer.repairs));
    if (parts == SurfaceParts::all) fill_holes(mesh, answer.repairs);
  } else {
    fill_holes(mesh, answer.repairs);
    if (CGAL::is_closed(mesh) && !PMP::is_outward_oriented(mesh)) {
      PMP::reverse_face_orientations(mesh);
      answer.repairs.emplace_back(inside_out);
    }
    mesh.collect_garbage();
  }
  answer.surface = surface_of(mesh);
  answer.problem = problem_of(answer.surface);
  return answer;
}

/// Runs `work` on a surface in a child; nullopt if the child fails.
template <class Work>
std::optional<Mended> attempt(const ChildTask& task, const Work& work) {
  try {
    return received(run_in_child(task, [&] { return sent(work()); }));
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// True if two surfaces enclose nearly the same volume.
bool is_about(const TriangleSurface& surface, const TriangleSurface& other) {
  const double volume = std::abs(enclosed_volume(other));
  return std::abs(std::abs(enclosed_volume(surface)) - volume) <= most_change * volume;
}

/// Throws Error if there is no body.
void check_filled(const TriangleSurface& surface, const std::string& where) {
  const double volume = std::abs(enclosed_volume(surface)), size = std::pow(area(surface), 1.5);
  if (volume < least_filling * size)
    throw Error("the surface encloses nothing: it is a sheet, with its holes filled still flat", where,
                "give it thickness in a mesh editor (\"solidify\", \"shell\")");
}

ChildLimits repair_limits(std::int64_t bytes) {
  ChildLimits limits = reading_limits(bytes);
  return child_limits(3 * limits.processor + std::chrono::seconds(60), 4 * limits.memory);
}

}  // namespace

RepairedSurface repair_surface(const std::filesystem::path& file, SurfaceParts parts, int wrap_nodes) {
  const std::string where = file.string();
  const std::string bytes = read_all(file, "Check the name of the surface");
  const ChildTask task = {.name = "CGAL",
                          .where = where,
                          .limits = repair_limits(std::ssize(bytes)),
                          .hint = "repair the surface in a mesh editor, or export it again"};
  Mended answer = received(run_in_child(task, [&] {
    try {
      return sent(mend(bytes, file, parts));
    } catch (const CGAL::Failure_exception&) {
      throw Error("CGAL cannot make a surface of what is in the file", where, task.hint);
    }
  }));
  check_filled(answer.surface, where);
  if (answer.problem.starts_with("intersects")) {
    std::optional<Mended> untangled = attempt(task, [&] {
      Mended result;
      result.surface = without_self_intersections(answer.surface);
      result.problem = problem_of(result.surface);
      return result;
    });
    // CGAL cuts out as much as it needs, and may leave only a small part of the body.
    if (untangled && untangled->problem.empty() && is_about(untangled->surface, answer.surface)) {
      answer.repairs.push_back("where it " + answer.problem + ", its triangles were replaced");
      answer.surface = std::move(untangled->surface);
      answer.problem.clear();
    }
  }
  if (!answer.problem.empty()) {
    const double edge = edge_for_nodes(area(answer.surface), wrap_nodes);
    answer.repairs.push_back(
        fmt::format("as it {}, it was wrapped: a new surface lies around it at {:.3g} units", answer.problem,
                    usual_wrap_offset * edge));
    answer.surface = wrapped_surface(answer.surface, edge, usual_wrap_offset, where);
  }
  return {std::move(answer.surface), std::move(answer.repairs), std::move(answer.remarks)};
}

TriangleSurface wrapped_surface(const TriangleSurface& surface, double edge, double offset,
                                const std::string& where) {
  const auto bytes = static_cast<std::int64_t>(surface.triangles.size() * bytes_per_triangle);
  const ChildTask task = {.name = "CGAL",
                          .where = where,
                          .limits = repair_limits(bytes),
                          .hint = "repair the surface in a mesh editor"};
  Mended answer = received(run_in_child(task, [&] {
    Mended wrap;
    wrap.surface = wrap_surface(surface, wrap_alpha * edge, offset * edge);
    wrap.problem = problem_of(wrap.surface);
    return sent(wrap);
  }));
  if (answer.problem.empty()) return std::move(answer.surface);
  const bool apart = answer.problem.ends_with(" parts");
  throw Error(
      "the surface " + answer.problem + (apart ? " that are apart" : "") + ", and no repair was found", where,
      apart ? "--parts largest keeps the largest part alone; or join the parts in a mesh editor"
            : "repair it in a mesh editor");
}

double edge_for_nodes(double area, double nodes) {
  return std::sqrt(2.0 * area / (std::sqrt(3.0) * nodes));
}

std::string off_text(const TriangleSurface& surface) {
  std::string text = fmt::format("OFF\n{} {} 0\n", surface.nodes.size(), surface.triangles.size());
  for (const Vec3& x : surface.nodes) text += fmt::format("{} {} {}\n", x[0], x[1], x[2]);
  for (const auto& [a, b, c] : surface.triangles) text += fmt::format("3 {} {} {}\n", a, b, c);
  return text;
}

}  // namespace palpate
