// Steps of CGAL's Mesh_3 common to images and surfaces.
#pragma once

#include <CGAL/exude_mesh_3.h>
#include <CGAL/lloyd_optimize_mesh_3.h>
#include <CGAL/odt_optimize_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>

#include <unordered_map>

#include "meshes/mesh.h"
#include "precompute/description/description.h"

namespace palpate::mesh3 {

/// Largest bound on the surface triangles' angles that Mesh_3 guarantees to reach [degree].
constexpr double facet_angle = 25.0;
/// Angle at which sliver removal stops [degree].
constexpr double wanted_dihedral = 12.0;
/// Bounds on circumradii relative to the edge length. With them, as measured on organs, the mean edge is the
/// requested one on the surface and, without grading, inside. A hollow mesh has no cells that make its facets
/// smaller.
constexpr double facet_size_per_edge = 1.2;
constexpr double hollow_facet_size_per_edge = 0.77;
constexpr double radius_per_edge = 0.73;
/// Length of the edges of a second try, of those asked for.
constexpr double other_edges = 0.97;
/// Largest number of iterations of a global optimisation; most converge earlier.
constexpr int most_iterations = 50;

/// Moves the nodes of a refined complex for better elements, as requested in the options. CGAL's own time
/// limits would make the mesh differ in every run: 0 means none.
template <typename Complex, typename Domain>
void optimise(Complex& complex, const Domain& domain, const MeshOptions& options) {
  namespace parameters = CGAL::parameters;
  if (options.odt) {
    CGAL::odt_optimize_mesh_3(complex, domain, parameters::time_limit = 0.0,
                              parameters::max_iteration_number = most_iterations);
  }
  if (options.lloyd) {
    CGAL::lloyd_optimize_mesh_3(complex, domain, parameters::time_limit = 0.0,
                                parameters::max_iteration_number = most_iterations);
  }
  if (options.perturb) {
    CGAL::perturb_mesh_3(complex, domain, parameters::time_limit = 0.0,
                         parameters::sliver_bound = wanted_dihedral);
  }
  if (options.exude) {
    CGAL::exude_mesh_3(complex, parameters::time_limit = 0.0, parameters::sliver_bound = wanted_dihedral);
  }
}

/// Returns make(options), or with edges a little shorter where CGAL gives up: on meshes as regular as those
/// of boxes its perturbation at times cannot take back a move.
template <typename Make>
Mesh with_other_edges_if_it_fails(MeshOptions options, const Make& make) {
  try {
    return make(options);
  } catch (const CGAL::Failure_exception&) {
    if (!options.edge_length) throw;
    *options.edge_length *= other_edges;
    return make(options);
  }
}

/// Mesh of a complex: region_of(subdomain index) is the region of a cell; facets between different subdomains
/// are tagged (tag 0), in no particular sense.
template <typename Complex, typename RegionOf>
Mesh export_mesh(const Complex& complex, const RegionOf& region_of) {
  Mesh mesh;
  std::unordered_map<typename Complex::Vertex_handle, Index> number;
  const auto node = [&](typename Complex::Vertex_handle vertex) {
    const auto [entry, is_new] = number.try_emplace(vertex, static_cast<Index>(mesh.nodes.size()));
    if (is_new) {
      const auto& p = vertex->point();
      mesh.nodes.emplace_back(p.x(), p.y(), p.z());
    }
    return entry->second;
  };
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    for (int i = 0; i < 4; ++i) {
      mesh.connectivity.push_back(node(cell->vertex(i)));
    }
    mesh.regions.push_back(region_of(complex.subdomain_index(cell)));
  }
  for (auto facet = complex.facets_in_complex_begin(); facet != complex.facets_in_complex_end(); ++facet) {
    for (int i = 0; i < 4; ++i) {
      if (i != facet->second) {
        mesh.tagged_facets.push_back(node(facet->first->vertex(i)));
      }
    }
    mesh.facet_tags.push_back(0);
  }
  return mesh;
}

}  // namespace palpate::mesh3
