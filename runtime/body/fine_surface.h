// The body's surface, as fine as overlays make it.
#pragma once

#include <array>
#include <map>
#include <span>
#include <vector>

#include "formats/model.h"
#include "overlay/nested_nodes.h"

namespace palpate {

/// The surface of all elements cut into r^d: the nodes on it, and how they follow the body's where no overlay
/// is. Nodes of the body come first, ascending.
struct FineSurface {
  std::vector<Index> simplices;     ///< [F * d] outward as Model::surface, in this numbering
  std::vector<Index> element;       ///< [F] of the body, that each is on
  std::vector<Index> mesh_nodes;    ///< [nodes of the body] their numbers in the mesh
  std::vector<Index> first;         ///< [S + 1] of each node in `parents` and `weights`
  std::vector<Index> parents;       ///< mesh nodes whose shape functions are not zero there
  std::vector<double> weights;      ///< and their values
  std::map<NodeKey, Index> number;  ///< of every node that is not one of the body's

  [[nodiscard]] Index nodes() const noexcept { return static_cast<Index>(first.size()) - 1; }
};

/// Numbers the nodes that are not the body's anew: the k-th of them becomes the one that was order[k]-th.
void reorder(FineSurface& surface, std::span<const Index> order);

/// Throws Error unless r >= 2.
FineSurface make_fine_surface(const Model& model, int r);

}  // namespace palpate
