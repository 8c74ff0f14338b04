// Forward and backward substitution, one supernode at a time.
#pragma once

#include <cblas.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "precompute/numerics/factor.h"

namespace palpate {

/// A size in BLAS's integer type.
inline blasint blas(std::int64_t size) {
  return static_cast<blasint>(size);
}

/// Block of columns of a supernodal factor with the same rows.
struct Supernode {
  std::int64_t first;    ///< position of its first column
  std::int64_t columns;  ///< number of columns
  std::int64_t below;    ///< rows under the diagonal block
  std::int64_t rows;     ///< offset of its row positions in the factor's
  std::int64_t values;   ///< offset of its entries in the factor
  std::int64_t parent;   ///< supernode of the first row below, -1 for a root
  std::int64_t subtree;  ///< position of the first column of its subtree
  [[nodiscard]] std::int64_t end() const noexcept { return first + columns; }
};

/// Elimination tree of the supernodes of a factor, which may be only analysed.
class SupernodalTree {
 public:
  explicit SupernodalTree(const Factor& factor);

  [[nodiscard]] const Factor& factor() const noexcept { return factor_; }
  [[nodiscard]] std::span<const Supernode> supernodes() const noexcept { return supernodes_; }
  /// Supernode that contains a position.
  [[nodiscard]] std::int64_t supernode_of(std::int64_t position) const noexcept {
    return supernode_of_[static_cast<std::size_t>(position)];
  }

  /// Positions of a supernode's rows, its own columns first.
  [[nodiscard]] std::span<const std::int64_t> rows(const Supernode& s) const noexcept;

  /// Rows below the supernode that has most.
  [[nodiscard]] std::int64_t most_below() const noexcept { return most_below_; }

  /// Marks [supernodes] the supernodes from a position to the root.
  void mark_path(std::int64_t position, std::vector<std::uint8_t>& marks) const;

 private:
  const Factor& factor_;
  std::vector<Supernode> supernodes_;
  std::vector<std::int64_t> supernode_of_;  // [n]
  std::int64_t most_below_ = 0;
};

/// Substitution with right-hand sides contiguous per dof, so that gathering the rows of a supernode copies
/// whole cache lines: X [n, width] row-major, row p is the dof at position p of the factor. The caller
/// selects the supernodes that a solve needs. Const: any number of threads may sweep. Products take a third
/// of the time of triangular solves, so that the diagonal blocks of a factor that has numbers are inverted.
/// In single precision (`Real` float) the other numbers are copies too.
template <class Real>
class SupernodalSweeps : public SupernodalTree {
 public:
  /// Scratch of one thread.
  struct Workspace {
    std::vector<Real> X;                // [n, width]
    std::vector<Real> below;            // [rows below the largest supernode, width]
    std::vector<std::uint8_t> on_path;  // [supernodes]
  };

  /// In double precision `factor` may be only analysed as long as no sweep is run, and then has no inverted
  /// blocks. `jobs`: threads that invert.
  explicit SupernodalSweeps(const Factor& factor, int jobs = 1);

  /// Allocates memory for so many right-hand sides.
  void prepare(Workspace& workspace, std::int64_t width) const;
  [[nodiscard]] std::int64_t workspace_bytes(std::int64_t width) const;

  /// X_s := L_ss^-1 X_s, then X_below -= L_bs X_s, for the first `active` of `width` right-hand sides.
  void forward(const Supernode& s, std::int64_t active, std::int64_t width, Workspace& workspace) const;

  /// As above, for right-hand sides [begin, end) of X [rows, width], which has rows of some supernodes only:
  /// `row` [supernodes] is the first of each. All supernodes from s to the root must be among them.
  void forward(const Supernode& s, std::span<const std::int64_t> row, std::int64_t begin, std::int64_t end,
               std::int64_t width, Real* X, std::vector<Real>& below) const;

  /// X_s := L_ss^-T (X_s - L_bs^T X_below); X_s counts as zero if the supernode is not on the path.
  void backward(const Supernode& s, bool on_path, std::int64_t active, std::int64_t width,
                Workspace& workspace) const;

 private:
  template <class RowOf>
  void forward_rows(const Supernode& s, std::int64_t active, std::int64_t width, Real* X, Real* update,
                    const RowOf& row_of) const;
  /// X_s := X_s op(L_ss^-1), of the transpose that BLAS sees.
  void divide(const Supernode& s, CBLAS_TRANSPOSE op, std::int64_t active, std::int64_t width, Real* X) const;
  /// Entries below the diagonal block, in columns as long as the supernode has rows.
  [[nodiscard]] const Real* below(const Supernode& s) const noexcept;

  std::unique_ptr<Real[]> inverse_;       // of the diagonal blocks, one after the other, column-major
  std::vector<std::int64_t> inverse_at_;  // [supernodes]
  std::unique_ptr<Real[]> copy_;          // in single precision, as the factor's
};

}  // namespace palpate
