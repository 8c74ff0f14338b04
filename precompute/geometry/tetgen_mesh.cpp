#include "precompute/geometry/tetgen_mesh.h"

#define TETLIBRARY  // as the library was compiled: errors are thrown, not exit()
#include <tetgen.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <set>

#include "base/child_process.h"
#include "base/error.h"
#include "meshes/check.h"
#include "precompute/geometry/mesh_bytes.h"
#include "precompute/surfaces/shells.h"

/// Replaces TetGen's own function of this name: that of 1.5.0 frees its memory, throws, and frees it again,
/// so that every error becomes a crash.
[[noreturn, gnu::visibility("default")]] void stop_tetgen(tetgenmesh* mesh, int code) __asm__(
    "_Z15terminatetetgenP10tetgenmeshi");
void stop_tetgen(tetgenmesh* /*mesh*/, int code) {
  throw code;
}

namespace palpate {
namespace {

/// Data of TetGen's callback, which has no user argument. Set in the child only.
const std::function<double(const Vec3&)>* target_edge = nullptr;

/// True if a tetrahedron is larger than the regular one of the target edge length at its centroid.
bool too_large(REAL* a, REAL* b, REAL* c, REAL* d, REAL* /*unused*/, REAL /*unused*/) {
  const Eigen::Map<const Vec3> xa(a), xb(b), xc(c), xd(d);
  const double volume = std::abs((xb - xa).cross(xc - xa).dot(xd - xa)) / 6.0;
  const double h = (*target_edge)((xa + xb + xc + xd) / 4.0);
  return volume > h * h * h / (6.0 * std::sqrt(2.0));
}

void copy_surface(const TriangleSurface& surface, tetgenio& io) {
  io.numberofpoints = static_cast<int>(surface.nodes.size());
  io.pointlist = new REAL[3 * surface.nodes.size()];
  for (std::size_t i = 0; i < surface.nodes.size(); ++i) {
    Eigen::Map<Vec3>(io.pointlist + 3 * i) = surface.nodes[i];
  }
  io.numberoffacets = static_cast<int>(surface.triangles.size());
  io.facetlist = new tetgenio::facet[surface.triangles.size()];
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    tetgenio::facet& facet = io.facetlist[i];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    facet.polygonlist[0].numberofvertices = 3;
    facet.polygonlist[0].vertexlist = new int[3];
    std::copy(surface.triangles[i].begin(), surface.triangles[i].end(), facet.polygonlist[0].vertexlist);
  }
}

void copy_regions(const std::vector<RegionPoint>& points, tetgenio& io) {
  io.numberofregions = static_cast<int>(points.size());
  io.regionlist = new REAL[5 * points.size()];
  for (std::size_t i = 0; i < points.size(); ++i) {
    REAL* region = io.regionlist + 5 * i;
    std::copy_n(points[i].x.data(), 3, region);
    region[3] = static_cast<REAL>(points[i].region);
    region[4] = -1.0;  // no bound on volumes
  }
}

/// Sets the holes: TetGen empties everything that it can reach from a hole's point.
void copy_holes(const TriangleSurface& surface, tetgenio& io) {
  const std::vector<TriangleSurface> cavities = cavities_of(surface);
  io.numberofholes = static_cast<int>(cavities.size());
  io.holelist = new REAL[3 * cavities.size()];
  for (std::size_t i = 0; i < cavities.size(); ++i)
    Eigen::Map<Vec3>(io.holelist + 3 * i) = point_inside(cavities[i]);
}

Mesh copy_mesh(const tetgenio& io, const std::vector<RegionPoint>& points) {
  Mesh mesh;
  for (int i = 0; i < io.numberofpoints; ++i) {
    mesh.nodes.emplace_back(Eigen::Map<const Vec3>(io.pointlist + std::ptrdiff_t{3} * i));
  }
  std::set<Index> wanted;
  for (const RegionPoint& point : points) {
    wanted.insert(point.region);
  }
  for (int i = 0; i < io.numberoftetrahedra; ++i) {
    const Index region = points.empty() ? 0 : static_cast<Index>(io.tetrahedronattributelist[i]);
    if (!points.empty() && !wanted.contains(region)) {
      continue;  // TetGen gives parts without a point numbers beyond the points' regions
    }
    const int* corners = io.tetrahedronlist + std::ptrdiff_t{4} * i;
    mesh.connectivity.insert(mesh.connectivity.end(), corners, corners + 4);
    mesh.regions.push_back(region);
  }
  remove_unused_nodes(mesh);
  return mesh;
}

/// Runs TetGen. Status 0: the mesh; otherwise TetGen's error code.
ChildResult tetrahedralise(const TriangleSurface& surface, const std::vector<RegionPoint>& points,
                           const MeshOptions& options, const std::function<double(const Vec3&)>& edge_at) {
  tetgenio in, out;
  copy_surface(surface, in);
  if (points.empty())
    copy_holes(surface, in);
  else
    copy_regions(points, in);
  target_edge = &edge_at;
  in.tetunsuitable = too_large;

  tetgenbehavior behavior;
  std::string switches = points.empty()
                             ? "pYqQ"
                             : "pYqAQ";  // the bounds are set below: as text they would be read by the locale
  behavior.parse_commandline(switches.data());
  behavior.minratio = options.radius_edge;
  behavior.mindihedral = options.min_dihedral;
  ChildResult result;
  try {
    ::tetrahedralize(&behavior, &in, &out);
  } catch (int code) {
    result.status = code;
    return result;
  }
  result.bytes = pack(copy_mesh(out, points));
  return result;
}

std::string meaning(int code) {
  switch (code) {
    case 1:
      return "it ran out of memory";
    case 3:
      return "the surface intersects itself";
    case 4:
      return "the surface has features that are too small";
    case 5:
      return "two facets lie too close together";
    case 10:
      return "it does not accept the surface";
    default:
      return "internal error";
  }
}

}  // namespace

Mesh mesh_surface(const TriangleSurface& surface, const MeshOptions& options, const std::string& where) {
  return mesh_regions(surface, {}, options, expected_size(surface, options), where);
}

Mesh mesh_regions(const TriangleSurface& walls, const std::vector<RegionPoint>& points,
                  const MeshOptions& options, const MeshSize& size, const std::string& where) {
  const double surface_edge = options.edge_length.value_or(mean_edge_length(walls));
  const auto distance = distance_to(walls);
  const std::function<double(const Vec3&)> edge_at = [&](const Vec3& x) {
    return options.grading == 0.0 ? surface_edge : surface_edge + options.grading * distance(x);
  };
  const ChildTask task = {
      .name = "TetGen",
      .where = where,
      .limits = meshing_limits(size, options, where),
      .hint =
          "use a larger edge_length, relax radius_edge and min_dihedral, or set mesher = \"cgal\" in [mesh]"};
  const ChildResult result =
      run_in_child(task, [&] { return tetrahedralise(walls, points, options, edge_at); });
  if (result.status != 0) {
    throw Error(
        "TetGen stopped with code " + std::to_string(result.status) + ": " + meaning(result.status), where,
        "repair or remesh the surface (edge_length and remesh = true in [mesh]), or set mesher = \"cgal\"; "
        "for an image, change edge_length");
  }
  Mesh mesh = unpack_mesh(result.bytes);
  if (mesh.connectivity.empty()) {
    throw Error("TetGen found no inside of the surface", where, "close the surface's holes");
  }
  return mesh;
}

}  // namespace palpate
