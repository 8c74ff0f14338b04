#include "statics/tangent_pattern.h"

#include <algorithm>

namespace palpate {
namespace {

/// Rows from the diagonal down in which some cell has an entry, of each column, ascending.
std::vector<std::vector<Index>> rows_of_columns(std::size_t cells, Index columns, std::vector<Index>& free,
                                                const auto& gather) {
  std::vector<std::vector<Index>> rows(static_cast<std::size_t>(columns));
  for (std::size_t cell = 0; cell < cells; ++cell) {
    gather(cell);
    for (const Index a : free) {
      for (const Index b : free) {
        if (b >= 0 && a >= b) rows[b].push_back(a);
      }
    }
  }
  for (std::size_t column = 0; column < rows.size(); ++column) {
    std::vector<Index>& of = rows[column];
    of.push_back(static_cast<Index>(column));
    std::sort(of.begin(), of.end());
    of.erase(std::unique(of.begin(), of.end()), of.end());
  }
  return rows;
}

}  // namespace

TangentPattern::TangentPattern(std::span<const Index> cells, int nodes_per_cell, int dimension,
                               std::span<const Index> free_of_dof, Index free_dofs) {
  const auto width = static_cast<std::size_t>(nodes_per_cell), d = static_cast<std::size_t>(dimension),
             dofs = width * d, count = cells.size() / width;
  entries_ = dofs * (dofs + 1) / 2;
  std::vector<Index> free(dofs);
  const auto gather = [&](std::size_t cell) {
    for (std::size_t p = 0; p < dofs; ++p)
      free[p] = free_of_dof[d * static_cast<std::size_t>(cells[cell * width + p / d]) + p % d];
  };
  const std::vector<std::vector<Index>> rows = rows_of_columns(count, free_dofs, free, gather);
  std::size_t total = 0;
  for (const std::vector<Index>& of : rows) total += of.size();
  zero_.resize(free_dofs, free_dofs);
  zero_.reserve(static_cast<Eigen::Index>(total));
  for (std::size_t column = 0; column < rows.size(); ++column) {
    zero_.startVec(static_cast<Eigen::Index>(column));
    for (const Index row : rows[column]) zero_.insertBack(row, static_cast<Eigen::Index>(column)) = 0.0;
  }
  zero_.finalize();
  diagonal_.assign(zero_.outerIndexPtr(), zero_.outerIndexPtr() + free_dofs);  // the first of its column
  places_.reserve(count * entries_);
  for (std::size_t cell = 0; cell < count; ++cell) {
    gather(cell);
    for (std::size_t p = 0; p < dofs; ++p) {
      for (std::size_t q = 0; q <= p; ++q) {
        const auto [column, row] = std::minmax(free[p], free[q]);
        if (column < 0) {
          places_.push_back(-1);
          continue;
        }
        const std::vector<Index>& of = rows[column];
        const auto at = std::lower_bound(of.begin(), of.end(), row) - of.begin();
        places_.push_back(zero_.outerIndexPtr()[column] + static_cast<Index>(at));
      }
    }
  }
}

}  // namespace palpate
