#include "precompute/geometry/cgal_surface_mesh.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>
#include <CGAL/Random.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/make_mesh_3.h>

#include "base/child_process.h"
#include "base/error.h"
#include "precompute/geometry/mesh3.h"
#include "precompute/geometry/mesh_bytes.h"
#include "precompute/geometry/mesh_size.h"

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Polyhedron = CGAL::Surface_mesh<Point>;
using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel, Polyhedron>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex =
    CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index, Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
namespace parameters = CGAL::parameters;

constexpr double distance_per_edge = 0.05;  // for the boundary, if facet_distance is not given

Polyhedron as_polyhedron(const TriangleSurface& surface) {
  Polyhedron polyhedron;
  for (const Vec3& x : surface.nodes) {
    polyhedron.add_vertex(Point(x[0], x[1], x[2]));
  }
  for (const auto& [a, b, c] : surface.triangles) {
    polyhedron.add_face(Polyhedron::Vertex_index(static_cast<unsigned>(a)),
                        Polyhedron::Vertex_index(static_cast<unsigned>(b)),
                        Polyhedron::Vertex_index(static_cast<unsigned>(c)));
  }
  return polyhedron;
}

/// Bound on the circumradius of tetrahedra.
struct CellSize {
  using FT = Kernel::FT;
  std::function<double(const Vec3&)> depth;
  double surface_edge;
  double grading;

  template <typename AnyIndex>
  FT operator()(const Point& p, int /*dimension*/, const AnyIndex& /*index*/) const {
    const double below = grading == 0.0 ? 0.0 : grading * depth({p.x(), p.y(), p.z()});
    return mesh3::radius_per_edge * (surface_edge + below);
  }
};

Complex make_complex(const TriangleSurface& surface, const MeshOptions& options) {
  const double edge_length = options.edge_length.value_or(mean_edge_length(surface));
  CGAL::get_default_random() = CGAL::Random(0);
  CGAL::Random random(0);
  Domain domain(as_polyhedron(surface), &random);
  domain.detect_features(options.feature_angle);
  const Criteria criteria(
      parameters::edge_size = edge_length, parameters::facet_angle = mesh3::facet_angle,
      parameters::facet_size = mesh3::facet_size_per_edge * edge_length,
      parameters::facet_distance =
          options.facet_distance > 0.0 ? options.facet_distance : distance_per_edge * edge_length,
      parameters::cell_radius_edge_ratio = options.radius_edge,
      parameters::cell_size = CellSize{distance_to(surface), edge_length, options.grading});
  auto complex = CGAL::make_mesh_3<Complex>(domain, criteria, parameters::manifold(),
                                            parameters::no_perturb(), parameters::no_exude());
  mesh3::optimise(complex, domain, options);
  return complex;
}

}  // namespace

Mesh mesh_surface_with_cgal(const TriangleSurface& surface, const MeshOptions& options,
                            const std::string& where) {
  const ChildTask task = {
      .name = "CGAL's mesher",
      .where = where,
      .limits = meshing_limits(expected_size(surface, options), options, where),
      .hint = "use a larger edge_length or facet_distance in [mesh], or a simpler surface"};
  const ChildResult result = run_in_child(task, [&] {
    try {
      Mesh mesh = mesh3::with_other_edges_if_it_fails(options, [&](const MeshOptions& now) {
        return mesh3::export_mesh(make_complex(surface, now), [](int) { return 0; });
      });
      mesh.tagged_facets.clear();
      mesh.facet_tags.clear();
      return ChildResult{0, pack(mesh)};
    } catch (const CGAL::Failure_exception&) {
      return ChildResult{1, {}};
    }
  });
  if (result.status != 0) {
    throw Error("CGAL found no mesh inside the surface", where,
                "change edge_length or feature_angle in [mesh], or use mesher = \"tetgen\"");
  }
  Mesh mesh = unpack_mesh(result.bytes);
  if (mesh.connectivity.empty()) {
    throw Error("no tetrahedron fits into the surface", where, "use a smaller edge_length in [mesh]");
  }
  return mesh;
}

}  // namespace palpate
