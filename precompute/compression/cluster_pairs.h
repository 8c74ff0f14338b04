// The tree of clusters over the stored nodes, and which pairs of them are far.
#pragma once

#include <span>
#include <vector>

#include "matrices/hierarchical.h"
#include "meshes/mesh.h"

namespace palpate {

/// How nodes are put into clusters.
struct ClusterOptions {
  Index leaf = 32;   ///< most nodes of a leaf; one more where N is not a multiple of the leaves
  double eta = 2.0;  ///< clusters are far when the larger diameter is at most eta times their distance
};

/// Nodes in the order of a tree of clusters, each halved across the longest side of its box.
struct ClusteredNodes {
  ClusterTree tree;
  std::vector<Index> order;                         ///< [N] numbers of the given points
  std::vector<HierarchicalMatrix::Pair> near_pair;  ///< as HierarchicalMatrix has them
  std::vector<HierarchicalMatrix::Pair> far_pair;
};

/// Equal points give equal trees, whatever the machine.
ClusteredNodes cluster_nodes(std::span<const Vec3> points, const ClusterOptions& options = {});

}  // namespace palpate
