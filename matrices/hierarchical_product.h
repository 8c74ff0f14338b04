// What a tick asks of a matrix in nested low-rank form.
#pragma once

#include <span>

#include "matrices/hierarchical.h"
#include "matrices/node_range.h"

namespace palpate {

/// As Greens::gather. Each far column costs its leaf's part of V, and each leaf of columns one way through
/// the tree.
void gather_blocks(const HierarchicalMatrix& matrix, Index row, std::span<const Index> columns,
                   std::span<double> blocks) noexcept;

/// As Greens::displacement of ranges of nodes: up the tree from the nodes that carry force, once for all
/// ranges, across, and down to those that are asked for.
void displace(const HierarchicalMatrix& matrix, std::span<const Index> nodes, std::span<const double> f,
              std::span<const NodeRange> ranges, std::span<double> u) noexcept;

}  // namespace palpate
