// Cluster tree over the stored nodes, and its near and far pairs.
#pragma once

#include <span>
#include <vector>

#include "matrices/hierarchical.h"
#include "meshes/mesh.h"

namespace palpate {

/// Options for clustering nodes.
struct ClusterOptions {
  Index leaf = 32;   ///< most nodes of a leaf; one more if N is not a multiple of the leaves
  double eta = 2.0;  ///< clusters are far if the larger diameter is at most eta times their distance
};

/// Nodes in the order of a cluster tree, in which each cluster is halved across the longest side of its box.
struct ClusteredNodes {
  ClusterTree tree;
  std::vector<Index> order;                         ///< [N] numbers of the given points
  std::vector<HierarchicalMatrix::Pair> near_pair;  ///< as in HierarchicalMatrix
  std::vector<HierarchicalMatrix::Pair> far_pair;
};

/// Builds the tree and the pairs. Equal points give equal trees on any machine.
ClusteredNodes cluster_nodes(std::span<const Vec3> points, const ClusterOptions& options = {});

}  // namespace palpate
