#include "precompute/numerics/inertia.h"

#include <cblas.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "base/error.h"
#include "precompute/numerics/supernodal_sweeps.h"

namespace palpate {
namespace {

using Matrix = Eigen::MatrixXd;

constexpr std::int64_t panel = 64;  // columns that are eliminated together

/// Entries of A by the supernode of their column in P A P^T.
class EntriesBySupernode {
 public:
  struct Entry {
    std::int64_t row, column;  // positions, row >= column
    double value;
  };

  EntriesBySupernode(const SupernodalTree& tree, const SparseMatrix& A) {
    const std::span<const std::int64_t> order = tree.factor().permutation();
    std::vector<std::int64_t> position(order.size());
    for (std::size_t p = 0; p < order.size(); ++p)
      position[static_cast<std::size_t>(order[p])] = static_cast<std::int64_t>(p);
    const auto for_each = [&](auto&& take) {
      for (std::int64_t j = 0; j < A.cols(); ++j) {
        for (SparseMatrix::InnerIterator entry(A, j); entry; ++entry) {
          const std::int64_t a = position[static_cast<std::size_t>(entry.row())],
                             b = position[static_cast<std::size_t>(j)];
          const Entry moved{std::max(a, b), std::min(a, b), entry.value()};
          take(static_cast<std::size_t>(tree.supernode_of(moved.column)), moved);
        }
      }
    };
    start_.assign(tree.supernodes().size() + 1, 0);
    for_each([&](std::size_t s, const Entry&) { ++start_[s + 1]; });
    for (std::size_t s = 1; s < start_.size(); ++s) start_[s] += start_[s - 1];
    entries_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for_each([&](std::size_t s, const Entry& entry) { entries_[next[s]++] = entry; });
  }

  [[nodiscard]] std::span<const Entry> of(std::size_t s) const {
    return std::span(entries_).subspan(start_[s], start_[s + 1] - start_[s]);
  }

 private:
  std::vector<std::size_t> start_;
  std::vector<Entry> entries_;
};

/// Factorises D = L D L^T in the lower triangle of a block of a front; returns the number of negative pivots.
std::int64_t eliminate_block(Eigen::Ref<Matrix, 0, Eigen::OuterStride<>> D) {
  std::int64_t negative = 0;
  for (Eigen::Index k = 0; k < D.rows(); ++k) {
    const double pivot = D(k, k);
    if (pivot == 0.0)
      throw Error("a pivot is zero", "count of modes", "This is a mistake in the program; please report it");
    negative += pivot < 0.0 ? 1 : 0;
    const Eigen::Index below = D.rows() - k - 1;
    const Eigen::VectorXd column = D.col(k).tail(below);
    D.col(k).tail(below) /= pivot;
    for (Eigen::Index j = 0; j < below; ++j)
      D.col(k + 1 + j).tail(below - j) -= column[j] * D.col(k).tail(below - j);
  }
  return negative;
}

/// Eliminates the first `columns` of a front F, given by its lower triangle; the rest below and to the right
/// becomes their Schur complement. Returns the number of negative pivots.
std::int64_t eliminate(Matrix& F, std::int64_t columns) {
  std::int64_t negative = 0;
  Matrix scaled;  // L D of the panel's rows below
  for (std::int64_t k = 0; k < columns; k += panel) {
    const std::int64_t width = std::min(panel, columns - k), first = k + width, below = F.rows() - first;
    negative += eliminate_block(F.block(k, k, width, width));
    if (below == 0) continue;
    double* rows = F.data() + first + k * F.rows();
    cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasUnit, blas(below), blas(width), 1.0,
                F.data() + k + k * F.rows(), blas(F.rows()), rows, blas(F.rows()));
    scaled = F.block(first, k, below, width);
    for (std::int64_t c = 0; c < width; ++c) F.col(k + c).tail(below) /= F(k + c, k + c);
    for (std::int64_t j = 0; j < below; j += panel) {
      const std::int64_t some = std::min(panel, below - j);
      cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, blas(below - j), blas(some), blas(width), -1.0,
                  rows + j, blas(F.rows()), scaled.data() + j, blas(below), 1.0,
                  F.data() + (first + j) + (first + j) * F.rows(), blas(F.rows()));
    }
  }
  return negative;
}

}  // namespace

std::int64_t negative_pivots(const Factor& analysed, const SparseMatrix& A) {
  const SupernodalTree tree(analysed);
  const EntriesBySupernode entries(tree, A);
  const std::span<const Supernode> supernodes = tree.supernodes();
  std::vector<std::vector<std::size_t>> children(supernodes.size());
  std::vector<Matrix> complements(supernodes.size());  // of supernodes whose parent is to come
  std::vector<std::int64_t> place(static_cast<std::size_t>(A.rows()));  // in the front, of each position
  std::int64_t negative = 0;
  for (std::size_t s = 0; s < supernodes.size(); ++s) {
    const Supernode& node = supernodes[s];
    const std::span<const std::int64_t> rows = tree.rows(node);
    for (std::size_t r = 0; r < rows.size(); ++r)
      place[static_cast<std::size_t>(rows[r])] = static_cast<std::int64_t>(r);
    Matrix front = Matrix::Zero(std::ssize(rows), std::ssize(rows));
    for (const auto& [row, column, value] : entries.of(s))
      front(place[static_cast<std::size_t>(row)], place[static_cast<std::size_t>(column)]) += value;
    for (const std::size_t child : children[s]) {
      const Matrix complement = std::move(complements[child]);
      const std::span<const std::int64_t> from =
          tree.rows(supernodes[child]).subspan(static_cast<std::size_t>(supernodes[child].columns));
      for (Eigen::Index j = 0; j < complement.cols(); ++j) {
        const std::int64_t column = place[static_cast<std::size_t>(from[static_cast<std::size_t>(j)])];
        for (Eigen::Index i = j; i < complement.rows(); ++i)
          front(place[static_cast<std::size_t>(from[static_cast<std::size_t>(i)])], column) +=
              complement(i, j);
      }
    }
    negative += eliminate(front, node.columns);
    if (node.parent < 0) continue;
    complements[s] = front.bottomRightCorner(node.below, node.below);
    children[static_cast<std::size_t>(node.parent)].push_back(s);
  }
  return negative;
}

std::int64_t inertia_bytes(const Factor& analysed) {
  const SupernodalTree tree(analysed);
  const std::span<const Supernode> supernodes = tree.supernodes();
  std::vector<std::int64_t> of_children(supernodes.size(), 0);
  std::int64_t waiting = 0, largest = 0;
  for (std::size_t s = 0; s < supernodes.size(); ++s) {
    const Supernode& node = supernodes[s];
    const std::int64_t rows = node.columns + node.below,
                       complement = node.parent < 0 ? 0 : node.below * node.below;
    largest = std::max(largest, waiting + rows * rows + complement + rows * panel);
    waiting += complement - of_children[s];
    if (node.parent >= 0) of_children[static_cast<std::size_t>(node.parent)] += complement;
  }
  return largest * static_cast<std::int64_t>(sizeof(double));
}

}  // namespace palpate
