#include "precompute/geometry/image_mesh.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_domain_with_polyline_features_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Random.h>
#include <CGAL/make_mesh_3.h>
#include <fmt/format.h>

#include <array>
#include <map>

#include "base/child_process.h"
#include "base/error.h"
#include "meshes/element.h"
#include "precompute/geometry/distance_field.h"
#include "precompute/geometry/interface_crossings.h"
#include "precompute/geometry/mesh3.h"
#include "precompute/geometry/mesh_bytes.h"
#include "precompute/geometry/mesh_parts.h"
#include "precompute/geometry/mesh_size.h"
#include "precompute/geometry/tetgen_mesh.h"
#include "precompute/images/labelled_image.h"

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Domain = CGAL::Mesh_domain_with_polyline_features_3<CGAL::Labeled_mesh_domain_3<Kernel>>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex =
    CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index, Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
namespace parameters = CGAL::parameters;

constexpr double relative_error = 1e-4;  // relative to the body's size: for locating boundary and interfaces
constexpr double sharp_edge_per_edge = 1.3;  // bound on a sharp edge's parts: nodes as dense as on faces
constexpr double seed_spacing = 1.5;         // [edge_length] largest between the first points on interfaces

Vec3 as_vector(const Point& p) {
  return {p.x(), p.y(), p.z()};
}

Point as_point(const Vec3& x) {
  return {x[0], x[1], x[2]};
}

/// Bound on the circumradius of tetrahedra.
struct CellSize {
  using FT = Kernel::FT;
  const LabelField* field;
  double surface_edge;
  double grading;

  template <typename AnyIndex>
  FT operator()(const Point& p, int /*dimension*/, const AnyIndex& /*index*/) const {
    return mesh3::radius_per_edge * (surface_edge + grading * (*field)(as_vector(p)).depth);
  }
};

CGAL::Bbox_3 bounding_box(const VoxelGrid& grid) {
  const Vec3 low = grid.origin, high = grid.center(grid.voxels() - 1);
  return {low[0], low[1], low[2], high[0], high[1], high[2]};
}

Domain make_domain(const VoxelGrid& grid, const LabelField& field, const SharpEdges& sharp) {
  CGAL::get_default_random() = CGAL::Random(0);
  Domain domain(
      parameters::function = [&field](const Point& p) { return field(as_vector(p)).number; },
      parameters::bounding_object = bounding_box(grid), parameters::relative_error_bound = relative_error);
  std::vector<std::vector<Point>> lines;
  for (const auto& [from, to] : sharp.edges) lines.push_back({as_point(from), as_point(to)});
  domain.add_features(lines.begin(), lines.end());
  return domain;
}

void insert(Complex& complex, const Point& point, const Domain::Index& index) {
  const Complex::Vertex_handle vertex = complex.triangulation().insert(Triangulation::Point(point));
  if (vertex == Complex::Vertex_handle()) return;  // hidden by a node of a sharp edge
  complex.set_dimension(vertex, 2);                // on a surface
  complex.set_index(vertex, index);
}

/// Inserts the first points on the boundary.
void seed_boundary(Complex& complex, const Domain& domain) {
  std::vector<std::pair<Point, Domain::Index>> seeds;
  domain.construct_initial_points_object()(std::back_inserter(seeds));
  for (const auto& [point, index] : seeds) {
    insert(complex, point, index);
  }
}

/// Inserts points on the interfaces between labels: refinement alone finds those that are large compared with
/// the elements, but not every vessel.
void seed_interfaces(Complex& complex, const Domain& domain, const VoxelBody& body, const LabelField& field,
                     double edge_length) {
  for (const auto& [from, to] : interface_crossings(body, field, seed_spacing * edge_length)) {
    const auto [point, index, dimension] =
        domain.construct_intersection_object()(Kernel::Segment_3(as_point(from), as_point(to)));
    insert(complex, point, index);
  }
}

/// Delaunay refinement of sharp edges, of the surfaces and, unless `hollow`, of the inside.
Complex refine(const Domain& domain, const VoxelBody& body, const LabelField& field,
               const MeshOptions& options, bool hollow) {
  const double facet_distance =
      options.facet_distance > 0.0 ? options.facet_distance : body.spacing.maxCoeff();
  const double size_per_edge = hollow ? mesh3::hollow_facet_size_per_edge : mesh3::facet_size_per_edge;
  const Criteria::Facet_criteria facets(mesh3::facet_angle, size_per_edge * *options.edge_length,
                                        facet_distance);
  const CellSize cell_size{&field, *options.edge_length, options.grading};
  const Criteria::Cell_criteria cells =
      hollow ? Criteria::Cell_criteria(0.0, 0.0) : Criteria::Cell_criteria(options.radius_edge, cell_size);

  const Criteria criteria(Criteria::Edge_criteria(sharp_edge_per_edge * *options.edge_length), facets, cells);
  Complex complex;
  CGAL::Mesh_3::internal::init_c3t3_with_features(complex, domain, criteria);
  seed_boundary(complex, domain);
  const bool one_label = field.labels().size() == 1;
  if (!one_label) {
    seed_interfaces(complex, domain, body, field, *options.edge_length);
  }
  // three labels may meet in an edge, so that only a single one has manifold surfaces
  CGAL::refine_mesh_3(complex, domain, criteria, parameters::no_reset_c3t3(),
                      one_label ? parameters::manifold() : parameters::non_manifold(),
                      parameters::no_perturb(), parameters::no_exude());
  return complex;
}

/// Meshes with Mesh_3 in a child process; `hollow`: the surfaces alone.
Mesh run_mesh3(const VoxelBody& body, const SharpEdges& sharp, const LabelField& field,
               const MeshOptions& options, const std::string& where, bool hollow) {
  const ChildTask task = {.name = "CGAL's mesher",
                          .where = where,
                          .limits = meshing_limits(expected_size(body, options), options, where),
                          .hint = "use a larger edge_length or facet_distance in [mesh]"};
  const ChildResult result = run_in_child(task, [&] {
    try {
      return ChildResult{0, pack(mesh3::with_other_edges_if_it_fails(options, [&](const MeshOptions& now) {
                           const Domain domain = make_domain(body, field, sharp);
                           Complex complex = refine(domain, body, field, now, hollow);
                           if (!hollow) mesh3::optimise(complex, domain, now);
                           return mesh3::export_mesh(complex, [&](int number) {
                             return field.labels()[static_cast<std::size_t>(number) - 1];
                           });
                         }))};
    } catch (const CGAL::Failure_exception&) {
      return ChildResult{1, {}};
    }
  });
  if (result.status != 0) {
    throw Error("CGAL found no mesh of the image's body with this edge length", where,
                "change edge_length in [mesh] a little, or smooth the segmentation");
  }
  Mesh mesh = unpack_mesh(result.bytes);
  if (mesh.connectivity.empty()) {
    throw Error("no tetrahedron fits into the image's body", where, "use a smaller edge_length in [mesh]");
  }
  return mesh;
}

Mesh fill_with_tetgen(const Mesh& hollow, const MeshOptions& options, const MeshSize& size,
                      const std::string& where) {
  TriangleSurface walls{hollow.nodes, {}};
  for (Index t = 0; t < static_cast<Index>(hollow.facet_tags.size()); ++t) {
    const auto corners = hollow.tagged_facet(t);
    walls.triangles.push_back({corners[0], corners[1], corners[2]});
  }
  return mesh_regions(walls, region_points(hollow), options, size, where);
}

constexpr double most_lost = 0.1;         // of the voxels
constexpr double most_smoothed = 0.03;    // of the volume
constexpr std::size_t told_part = 8;      // [voxels] of a lost part that is reported
constexpr double told_difference = 0.05;  // of the volume
const char* const finer_voxels =
    "resample the segmentation to voxels a third as large, without interpolation (3D Slicer: Resample Scalar "
    "Volume, nearest neighbour; unu resample -k box -s x3 x3 x3), or make the part thicker there";

/// Reports parts that smoothing removes because they are one voxel thick. Throws Error if they are much of
/// the body, as no mesher finds the rest in reasonable time. Returns the number of remaining voxels.
double check_thickness(const VoxelBody& body, const LabelField& field, const std::string& where,
                       std::vector<std::string>& notes) {
  std::vector<std::uint8_t> lost(body.inside.size(), 0);
  double voxels = 0.0;
  for (std::size_t v = 0; v < body.inside.size(); ++v) {
    if (body.inside[v] == 0) continue;
    voxels += 1.0;
    lost[v] = field.holds(body.center(v)) ? 0 : 1;
  }
  const std::size_t lost_voxels = voxels_of_parts(body, lost, told_part);
  if (static_cast<double>(lost_voxels) > most_lost * voxels) {
    throw Error(
        fmt::format("the image's body is too thin for a mesh: {} of its {:.0f} voxels are in parts that "
                    "are one voxel thick",
                    lost_voxels, voxels),
        where, finer_voxels);
  }
  if (lost_voxels > 0) {
    notes.push_back(
        fmt::format("a thin part of the image, {} voxels and one voxel thick, is lost; to keep it, {}",
                    lost_voxels, finer_voxels));
  }
  return voxels - static_cast<double>(lost_voxels);
}

/// Reports differences between the mesh and the image's body.
void note_volume(const Mesh& mesh, const VoxelBody& body, std::vector<std::string>& notes) {
  double voxels = 0.0, elements = 0.0;
  for (const std::uint8_t inside : body.inside) voxels += inside;
  for (Index e = 0; e < mesh.elements(); ++e)
    elements += std::abs(element_volume(mesh.element, element_nodes(mesh, e)));
  const double difference = elements / (voxels * body.spacing.prod()) - 1.0;
  if (std::abs(difference) > told_difference) {
    notes.push_back(
        fmt::format("the mesh has {:.1f} % {} volume than the image's body: use a smaller edge_length "
                    "or facet_distance in [mesh]; where the body is few voxels thick, {}",
                    100.0 * std::abs(difference), difference < 0.0 ? "less" : "more", finer_voxels));
  }
}

/// Reports each label's volume in the mesh and in the image.
void report_volumes(const Mesh& mesh, const VoxelBody& body, std::vector<std::string>& notes) {
  std::map<Index, std::array<double, 2>> volumes;
  for (const Index label : body.labels) {
    if (label != VoxelBody::no_label) {
      volumes[label][0] += body.spacing.prod();
    }
  }
  for (Index e = 0; e < mesh.elements(); ++e) {
    volumes[mesh.regions[static_cast<std::size_t>(e)]][1] +=
        std::abs(element_volume(mesh.element, element_nodes(mesh, e)));
  }
  for (const auto& [label, volume] : volumes) {
    notes.push_back(fmt::format("label {}: volume {:.4g} in the image, {:.4g} in the mesh ({:+.1f} %)", label,
                                volume[0], volume[1], 100.0 * (volume[1] / volume[0] - 1.0)));
  }
}

}  // namespace

Mesh mesh_image(const ImageGeometry& image, const MeshOptions& options, std::vector<std::string>& notes) {
  const std::string where = image.file.string();
  const VoxelBody body = read_labelled_image(image, *options.edge_length, notes);
  const SharpEdges sharp = sharp_edges(body);
  LabelField field(body, sharp);
  // Smoothing shrinks everything convex: a ball nine voxels thick by 10 %.
  field.grow_to((1.0 - most_smoothed) * check_thickness(body, field, where, notes));
  const bool by_tetgen = options.mesher == Mesher::tetgen;
  Mesh mesh = run_mesh3(body, sharp, field, options, where, by_tetgen);
  if (by_tetgen) {
    mesh = fill_with_tetgen(mesh, options, expected_size(body, options), where);
  }
  mesh.tagged_facets.clear();
  mesh.facet_tags.clear();
  if (const Index crumbs = remove_crumbs(mesh); crumbs != 0) {
    notes.push_back(
        fmt::format("removed {} element(s) that hung on the body by an edge or a corner", crumbs));
  }
  for (Vec3& node : mesh.nodes) node = body.in_space(node);
  note_volume(mesh, body, notes);
  if (image.regions) {
    report_volumes(mesh, body, notes);
  }
  return mesh;
}

}  // namespace palpate
