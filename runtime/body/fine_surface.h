// Surface of the body, refined as in the overlays.
#pragma once

#include <array>
#include <map>
#include <span>
#include <vector>

#include "formats/model.h"
#include "overlay/nested_nodes.h"
#include "overlay/rounding.h"

namespace palpate {

/// Surface of the mesh with all elements divided into r^d: its nodes, and the body's nodes that they follow
/// outside overlays. The body's own nodes come first, ascending.
struct FineSurface {
  std::vector<Index> simplices;   ///< [F * d] oriented outward as Model::surface, in this numbering
  std::vector<Index> element;     ///< [F] element of the body of each simplex
  std::vector<Index> mesh_nodes;  ///< [nodes of the body] mesh nodes
  std::vector<Index> first;       ///< [S + 1] begin of each node's entries in `parents` and `weights`
  std::vector<Index> parents;     ///< mesh nodes whose shape functions are not zero at the node
  std::vector<double> weights;    ///< values of these shape functions
  int denominator = 1;            ///< sum of the weights in a key
  std::vector<std::array<Index, 4>>
      corners{};                    ///< [S] corners of the least side that each node is on; -1: no more
  std::vector<Vec3> rise{};         ///< [S] offset of each node from where its parents are [m]; empty: none
  std::map<NodeKey, Index> number;  ///< numbers of the nodes

  [[nodiscard]] Index nodes() const noexcept { return static_cast<Index>(first.size()) - 1; }
};

/// Renumbers the nodes that are not the body's: the k-th new one is the order[k]-th old one.
void reorder(FineSurface& surface, std::span<const Index> order);

/// Builds the refined surface, with nodes moved onto `rounding` unless it is null. Throws Error unless r
/// >= 2.
FineSurface make_fine_surface(const Model& model, int r, const Rounding* rounding = nullptr);

}  // namespace palpate
