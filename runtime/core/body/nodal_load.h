// List of forces on stored nodes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// Forces on stored nodes; a node may occur several times. Calls allocate nothing.
class NodalLoad {
 public:
  NodalLoad(int dimension, Index most_nodes)
      : dimension_(dimension),
        node_(most_nodes),
        force_(static_cast<std::size_t>(dimension) * node_.size()) {}

  NodalLoad(const NodalLoad&) = default;
  NodalLoad(NodalLoad&&) = default;
  NodalLoad& operator=(NodalLoad&&) = default;
  ~NodalLoad() = default;
  /// Assigns from a load of the same capacity: copies the entries without allocating.
  NodalLoad& operator=(const NodalLoad& other) {
    if (node_.size() != other.node_.size() || dimension_ != other.dimension_) return *this = NodalLoad(other);
    clear();
    add(other.nodes(), other.forces(), 1.0);
    return *this;
  }

  void clear() noexcept { count_ = 0; }

  /// Adds `factor` times forces [dm] on m nodes. False, and nothing is added, if the capacity is exceeded.
  bool add(std::span<const Index> nodes, std::span<const double> forces, double factor) noexcept {
    if (std::ssize(nodes) > std::ssize(node_) - count_) return false;
    std::copy(nodes.begin(), nodes.end(), node_.begin() + count_);
    double* force = force_.data() + std::ptrdiff_t{dimension_} * count_;
    for (const double f : forces) *force++ = factor * f;
    count_ += static_cast<Index>(nodes.size());
    return true;
  }

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  [[nodiscard]] std::span<const Index> nodes() const noexcept {
    return {node_.data(), static_cast<std::size_t>(count_)};
  }
  [[nodiscard]] std::span<const double> forces() const noexcept {
    return {force_.data(), static_cast<std::size_t>(dimension_) * static_cast<std::size_t>(count_)};
  }

 private:
  int dimension_;
  Index count_ = 0;
  std::vector<Index> node_;
  std::vector<double> force_;
};

}  // namespace palpate
