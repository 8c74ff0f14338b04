#include "precompute/geometry/mesh_size.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/error.h"
#include "precompute/machine/check_room.h"

namespace palpate {
namespace {

constexpr double most_elements = 5e7;  // against mistakes of scale

// Estimates meant to be far above the needs of a mesher, not measurements. Elements beyond the expected ones
// are at small details of the boundary, of which there are no more than facets.
constexpr double elements_per_facet = 10.0;
constexpr std::chrono::seconds least_time{5};
constexpr double time_per_element = 2e-3;  // [s]
constexpr double optimisation = 20.0;      // factor on the time with odt or lloyd
constexpr std::int64_t least_memory = 512LL << 20;
constexpr double memory_per_element = 4e3;  // [byte]

// Least memory of a bake per element until its plan is known [byte]: below the measured use of --dry-run
// beyond 50 MB for a box of 24^3 cells (tet4 209, hex8 2974), one of 14^3 (tet10 5100) and a rectangle of
// 200^2 (tri3 164, quad4 514).
constexpr double bytes_per_tet4 = 200.0;
constexpr double bytes_per_tet10 = 4000.0;
constexpr double bytes_per_hex8 = 2500.0;
constexpr double bytes_per_plane_element = 150.0;

/// Area and number of the faces between voxels of different values.
template <typename Value>
std::array<double, 2> walls(const VoxelBody& body, const std::vector<Value>& values) {
  const std::array<double, 3> face = {body.spacing[1] * body.spacing[2], body.spacing[2] * body.spacing[0],
                                      body.spacing[0] * body.spacing[1]};
  const std::array<std::size_t, 3> step = {1, body.at(0, 1, 0), body.at(0, 0, 1)};
  std::array<double, 2> result{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double faces = 0.0;
    for (std::size_t v = step[axis]; v < values.size(); ++v) {
      faces += values[v] != values[v - step[axis]] ? 1.0 : 0.0;
    }
    result[0] += faces * face[axis];
    result[1] += faces;
  }
  return result;
}

}  // namespace

double expected_elements(double volume, double area, double edge_length, double grading) {
  const double per_volume = 6.0 * std::sqrt(2.0);                   // of regular tetrahedra of edge 1
  const double inner_edge = edge_length + grading * volume / area;  // in the slab's middle
  // the integral of (edge_length + grading d)^-3 over the depth d
  const double per_edge = 1.0 / edge_length, per_inner_edge = 1.0 / inner_edge;
  return per_volume * volume * (per_edge + per_inner_edge) * per_edge * per_inner_edge / 2.0;
}

double expected_plane_nodes(double area, double length, double edge_length, double grading) {
  const double per_area = 2.0 / std::sqrt(3.0);                     // of regular triangles of edge 1
  const double inner_edge = edge_length + grading * area / length;  // in the strip's middle
  // the integral of (edge_length + grading d)^-2 over the depth d
  return per_area * area / edge_length / inner_edge;
}

std::string shown_count(double count) {
  return std::isfinite(count) ? fmt::format("some {:.1g}", count) : "countless";
}

void check_mesh_room(double elements, ElementType element, const std::string& where) {
  const auto bytes_of = [&] {
    switch (element) {
      case ElementType::tet10:
        return bytes_per_tet10;
      case ElementType::hex8:
        return bytes_per_hex8;
      case ElementType::tri3:
      case ElementType::quad4:
        return bytes_per_plane_element;
      default:
        return bytes_per_tet4;
    }
  };
  check_room(elements * bytes_of(), "a mesh of " + shown_count(elements) + " elements", where,
             "use larger elements: a larger edge_length in [mesh], or fewer cells in [geometry]");
}

MeshSize expected_size(const TriangleSurface& surface, const MeshOptions& options) {
  const double edge_length = options.edge_length.value_or(mean_edge_length(surface));
  return {expected_elements(std::abs(enclosed_volume(surface)), area(surface), edge_length, options.grading),
          static_cast<double>(surface.triangles.size())};
}

MeshSize expected_size(const VoxelBody& body, const MeshOptions& options) {
  double voxels = 0.0;
  for (const std::uint8_t inside : body.inside) {
    voxels += inside;
  }
  const auto [area, faces] = body.labels.empty() ? walls(body, body.inside) : walls(body, body.labels);
  return {expected_elements(voxels * body.spacing.prod(), area, *options.edge_length, options.grading),
          faces};
}

ChildLimits meshing_limits(const MeshSize& size, const MeshOptions& options, const std::string& where) {
  if (!(size.elements <= most_elements)) {
    throw Error(fmt::format("the mesh would have {} elements; {:.1g} are too many",
                            shown_count(size.elements), most_elements),
                where, "use a larger edge_length in [mesh], or check scale in [geometry]");
  }
  check_mesh_room(size.elements, options.element.value_or(ElementType::tet4), where);
  const double elements = size.elements + elements_per_facet * size.facets;
  const double seconds = elements * time_per_element * (options.odt || options.lloyd ? optimisation : 1.0);
  return child_limits(least_time + std::chrono::seconds(static_cast<std::int64_t>(seconds)),
                      least_memory + static_cast<std::int64_t>(elements * memory_per_element));
}

}  // namespace palpate
