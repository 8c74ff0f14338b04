// Nodes of finer elements nested in the body's elements.
#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "meshes/subdivision.h"

namespace palpate {

/// Key of a node of a finer element, the same in all elements that contain it: corners of the body's elements
/// and their weights (Subdivision::Node), in the order of the corners.
using NodeKey = std::vector<std::pair<Index, int>>;

NodeKey key_of(const Subdivision::Node& node, std::span<const Index> corners);

/// Elements of one kind, each cut into r^d. Simplices rank their corners by node number, so that neighbours
/// match.
class Subdivisions {
 public:
  Subdivisions(ElementType type, int r) : type_(type), r_(r) {}

  [[nodiscard]] ElementType type() const noexcept { return type_; }
  [[nodiscard]] int refinement() const noexcept { return r_; }

  /// Subdivision of the element with these corners; the reference stays valid.
  const Subdivision& of(std::span<const Index> corners);

 private:
  ElementType type_;
  int r_;
  std::map<std::array<int, 4>, Subdivision> made_;  // by the corners' ranks
};

}  // namespace palpate
