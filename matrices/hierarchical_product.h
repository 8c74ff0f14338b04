// Rows and products of a matrix in nested low-rank form, for a tick.
#pragma once

#include <span>

#include "matrices/hierarchical.h"
#include "matrices/node_range.h"

namespace palpate {

/// Greens::gather for this form. Each far column costs its leaf's part of V, and each leaf of columns one
/// pass through the tree.
void gather_blocks(const HierarchicalMatrix& matrix, Index row, std::span<const Index> columns,
                   std::span<double> blocks) noexcept;

/// Greens::displacement of ranges of nodes for this form: up the tree from the loaded nodes, once for all
/// ranges, across the far pairs, and down to the requested nodes.
void displace(const HierarchicalMatrix& matrix, std::span<const Index> nodes, std::span<const double> f,
              std::span<const NodeRange> ranges, std::span<double> u) noexcept;

}  // namespace palpate
