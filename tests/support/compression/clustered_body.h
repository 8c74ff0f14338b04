// Stored dofs in the order of a tree of clusters, for tests and benchmarks of compressed Green's functions.
#pragma once

#include <span>
#include <vector>

#include "precompute/compression/cluster_pairs.h"
#include "precompute/numerics/assembly.h"

namespace palpate::test {

/// The stored nodes of a body.
struct ClusteredBody {
  ClusteredNodes clusters;
  std::vector<std::int64_t> dofs;  ///< [d N] of K, -1 where held
  std::vector<Vec3> points;        ///< [N]
  std::vector<Index> touchable;    ///< those that are free along every axis

  /// `stored`: marks of the dofs of K, as stored_dof_marks gives them.
  ClusteredBody(const Mesh& mesh, const Stiffness& stiffness, const std::vector<std::uint8_t>& stored,
                const ClusterOptions& options) {
    const std::int64_t d = mesh.dimension();
    std::vector<Index> nodes;
    for (std::size_t k = 0; k < stored.size(); ++k) {
      const auto node = static_cast<Index>(stiffness.free_dofs[k] / d);
      if (stored[k] != 0 && (nodes.empty() || nodes.back() != node)) nodes.push_back(node);
    }
    std::vector<Vec3> in_mesh_order;
    in_mesh_order.reserve(nodes.size());
    for (const Index node : nodes) in_mesh_order.push_back(mesh.nodes[static_cast<std::size_t>(node)]);
    clusters = cluster_nodes(in_mesh_order, options);
    for (const Index k : clusters.order) {
      bool free = true;
      for (std::int64_t axis = 0; axis < d; ++axis) {
        const std::int64_t dof = d * nodes[static_cast<std::size_t>(k)] + axis;
        dofs.push_back(stiffness.free_of_dof[static_cast<std::size_t>(dof)]);
        free = free && dofs.back() >= 0;
      }
      if (free) touchable.push_back(static_cast<Index>(points.size()));
      points.push_back(in_mesh_order[static_cast<std::size_t>(k)]);
    }
  }
};

}  // namespace palpate::test
