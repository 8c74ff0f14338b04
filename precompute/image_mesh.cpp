#include "precompute/image_mesh.h"

#define CGAL_USE_ZLIB 1  // .inr.gz
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Image_3.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Random.h>
#include <CGAL/make_mesh_3.h>

#include <cstring>
#include <map>
#include <set>
#include <span>
#include <unordered_map>

#include "meshes/error.h"
#include "precompute/child_process.h"
#include "precompute/voxel_body.h"

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
namespace parameters = CGAL::parameters;

constexpr std::chrono::seconds read_time_limit{600};
constexpr std::chrono::seconds mesh_time_limit{3600};
constexpr double facet_angle =
    25.0;  // [degree] bound on the surface triangles' angles that Mesh_3 can promise
constexpr double wanted_dihedral = 12.0;     // [degree] sliver removal stops here
constexpr double facet_size_per_edge = 1.2;  // measured on organs: the mean edge is then the one asked for,
constexpr double radius_per_edge = 0.73;     // on the surface and, without grading, inside
constexpr double relative_error = 1e-4;      // of the body's size: where the boundary is found

enum ReadStatus : int { read_ok = 0, not_an_image = 1, not_scalar = 2 };

struct ImageHeader {
  std::array<Index, 3> size{};
  std::array<double, 3> spacing{};
  std::array<double, 3> origin{};
};

/// Reads the image and sends its header and its voxels as labels.
ChildResult read_labels(const std::string& file) {
  CGAL::Image_3 image;
  if (!image.read(file) || image.size() == 0) {
    return {not_an_image, {}};
  }
  if (image.image()->vdim != 1) {
    return {not_scalar, {}};
  }
  ImageHeader header;
  header.size = {static_cast<Index>(image.xdim()), static_cast<Index>(image.ydim()),
                 static_cast<Index>(image.zdim())};
  header.spacing = {image.vx(), image.vy(), image.vz()};
  header.origin = {static_cast<double>(image.tx()), static_cast<double>(image.ty()),
                   static_cast<double>(image.tz())};
  std::vector<std::int32_t> labels;
  labels.reserve(image.size());
  for (std::size_t k = 0; k < image.zdim(); ++k) {
    for (std::size_t j = 0; j < image.ydim(); ++j) {
      for (std::size_t i = 0; i < image.xdim(); ++i) {
        labels.push_back(static_cast<std::int32_t>(std::lround(image.value(i, j, k))));
      }
    }
  }
  ChildResult result;
  append_bytes(result.bytes, std::span<const ImageHeader>(&header, 1));
  append_bytes(result.bytes, std::span<const std::int32_t>(labels));
  return result;
}

/// Marks the voxels that carry one of the labels (all but 0 where none are listed).
VoxelBody select(const Bytes& bytes, const std::vector<int>& wanted, const std::string& where) {
  ImageHeader header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  VoxelBody body;
  body.size = header.size;
  body.spacing = Vec3(header.spacing[0], header.spacing[1], header.spacing[2]);
  body.origin = Vec3(header.origin[0], header.origin[1], header.origin[2]);
  std::vector<std::int32_t> labels((bytes.size() - sizeof(header)) / sizeof(std::int32_t));
  std::memcpy(labels.data(), bytes.data() + sizeof(header), labels.size() * sizeof(std::int32_t));

  std::map<std::int32_t, std::uint8_t> selected;  // of the labels that occur
  body.inside.reserve(labels.size());
  for (const std::int32_t label : labels) {
    const auto [entry, is_new] = selected.try_emplace(label, 0);
    if (is_new) {
      entry->second =
          wanted.empty() ? label != 0 : std::find(wanted.begin(), wanted.end(), label) != wanted.end();
    }
    body.inside.push_back(entry->second);
  }
  std::string occurring;
  for (const auto& [label, is_body] : selected) {
    occurring += (occurring.empty() ? "" : ", ") + std::to_string(label);
  }
  for (const int label : wanted) {
    if (!selected.contains(label)) {
      throw Error("no voxel of the image has label " + std::to_string(label), where,
                  "its labels are " + occurring);
    }
  }
  if (wanted.empty() && selected.size() == 1 && selected.contains(0)) {
    throw Error("the image is empty: all its voxels are 0", where, "give a segmented image");
  }
  return body;
}

VoxelBody read_body(const ImageGeometry& image, std::vector<std::string>& notes) {
  const std::string where = image.file.string();
  if (!std::filesystem::is_regular_file(image.file)) {
    throw Error("there is no such image file", where, "check image = \"...\" in [geometry]");
  }
  // in a child: CGAL's reader prints on the screen, and crashes on some damaged files
  const std::string path = std::filesystem::absolute(image.file).string();
  const ChildResult read =
      run_in_child("the image reader", where, read_time_limit, [&] { return read_labels(path); });
  if (read.status != read_ok) {
    throw Error(
        read.status == not_scalar ? "the image has several values a voxel" : "this is not a readable image",
        where, "use a complete INR file (.inr, .inr.gz) with one label a voxel and positive VX, VY, VZ");
  }
  VoxelBody body = crop(select(read.bytes, image.labels, where), 2);
  keep_one_part(body, where, notes);
  if (const std::size_t filled = join_across_edges(body); filled != 0) {
    notes.push_back("filled " + std::to_string(filled) +
                    " voxel(s) of the image where voxels touched along an edge only");
  }
  return body;
}

Vec3 as_vector(const Point& p) {
  return {p.x(), p.y(), p.z()};
}

/// Bound on the circumradius of tetrahedra.
struct CellSize {
  using FT = Kernel::FT;
  const DistanceField* distance;
  double surface_edge;
  double grading;

  template <typename AnyIndex>
  FT operator()(const Point& p, int /*dimension*/, const AnyIndex& /*index*/) const {
    const double depth = std::max(0.0, (*distance)(as_vector(p)));
    return radius_per_edge * (surface_edge + grading * depth);
  }
};

CGAL::Bbox_3 bounding_box(const VoxelBody& body) {
  const Vec3 low = body.origin;
  const Vec3 high =
      low + Vec3(body.size[0] - 1, body.size[1] - 1, body.size[2] - 1).cwiseProduct(body.spacing);
  return {low[0], low[1], low[2], high[0], high[1], high[2]};
}

Complex make_complex(const VoxelBody& body, const MeshOptions& options) {
  const DistanceField distance(body);
  CGAL::get_default_random() = CGAL::Random(0);
  const Domain domain = Domain::create_implicit_mesh_domain(
      [&](const Point& p) { return -distance(as_vector(p)); }, bounding_box(body),
      parameters::relative_error_bound = relative_error);
  const CellSize cell_size{&distance, *options.edge_length, options.grading};
  const double facet_distance =
      options.facet_distance > 0.0 ? options.facet_distance : body.spacing.maxCoeff();
  const Criteria criteria(parameters::facet_angle = facet_angle,
                          parameters::facet_size = facet_size_per_edge * *options.edge_length,
                          parameters::facet_distance = facet_distance,
                          parameters::cell_radius_edge_ratio = options.radius_edge,
                          parameters::cell_size = cell_size);
  // time limit 0 is none; left out, it is the time that refinement took, which gives another mesh every run
  const auto perturb =
      parameters::perturb(parameters::time_limit = 0.0, parameters::sliver_bound = wanted_dihedral);
  const auto exude =
      parameters::exude(parameters::time_limit = 0.0, parameters::sliver_bound = wanted_dihedral);
  return CGAL::make_mesh_3<Complex>(domain, criteria, parameters::manifold(), perturb, exude);
}

Mesh export_mesh(const Complex& complex) {
  Mesh mesh;
  std::unordered_map<Complex::Vertex_handle, Index> number;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    Tet tet{};
    for (int i = 0; i < 4; ++i) {
      const auto [entry, is_new] = number.try_emplace(cell->vertex(i), static_cast<Index>(mesh.nodes.size()));
      if (is_new) {
        const auto& p = cell->vertex(i)->point();
        mesh.nodes.emplace_back(p.x(), p.y(), p.z());
      }
      tet[static_cast<std::size_t>(i)] = entry->second;
    }
    mesh.tets.push_back(tet);
  }
  mesh.regions.assign(mesh.tets.size(), 0);
  return mesh;
}

}  // namespace

Mesh mesh_image(const ImageGeometry& image, const MeshOptions& options, std::vector<std::string>& notes) {
  const VoxelBody body = read_body(image, notes);
  const std::string where = image.file.string();
  const ChildResult result = run_in_child("CGAL's mesher", where, mesh_time_limit, [&] {
    try {
      return ChildResult{0, pack(export_mesh(make_complex(body, options)))};
    } catch (const CGAL::Failure_exception&) {
      return ChildResult{1, {}};
    }
  });
  if (result.status != 0) {
    throw Error("CGAL found no mesh of the image's body with this edge length", where,
                "change edge_length in [mesh] a little, or smooth the segmentation");
  }
  Mesh mesh = unpack_mesh(result.bytes);
  if (mesh.tets.empty()) {
    throw Error("no tetrahedron fits into the image's body", where, "use a smaller edge_length in [mesh]");
  }
  return mesh;
}

}  // namespace palpate
