// Cholesky factors of sparse matrices with a common pattern.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// P A P^T = L L^T of symmetric positive definite matrices, one after the other, with a fixed pattern: the
/// multifrontal method (Duff & Reid 1983; Liu 1992) in an approximate minimum degree order (Amestoy, Davis &
/// Duff 1996). Columns of L with nearly the same rows are supernodes, stored and computed as dense blocks.
class SparseCholesky {
 public:
  /// Finds the elimination order and the place of each entry of L. Reads the lower triangle of A. The last
  /// `kept` unknowns are not eliminated: of A = [A_ee A_ke^T; A_ke A_kk] only A_ee is factorised.
  void analyse(const Eigen::SparseMatrix<double>& A, int kept = 0);

  /// Factorises a compressed matrix with the analysed pattern. Returns false, without a factor, if it is not
  /// positive definite or not finite.
  bool factorise(const Eigen::SparseMatrix<double>& A);

  /// A^-1 b [n x columns] for the matrix factorised last.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;  ///< for one column

  /// A_kk - A_ke A_ee^-1 A_ke^T of the kept unknowns [kept x kept], its lower triangle.
  [[nodiscard]] Eigen::Map<const Eigen::MatrixXd> schur() const;
  /// -A_ee^-1 A_ke^T x of the eliminated unknowns, for x of the kept ones.
  [[nodiscard]] Eigen::VectorXd extended(const Eigen::VectorXd& x) const;

  [[nodiscard]] std::int64_t entries() const noexcept { return std::ssize(values_); }  ///< stored in L

 private:
  /// Dense block of columns of L; the first of its rows are its own columns.
  struct Supernode {
    int first = 0, columns = 0;  // by order of elimination
    int parent = -1;             // supernode that receives this one's update
    std::size_t rows_at = 0;     // in rows_ and in_parent_
    int rows = 0;
    std::size_t values_at = 0;  // [rows x columns] by columns

    [[nodiscard]] int below() const noexcept { return rows - columns; }
  };

  using ConstBlock = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  [[nodiscard]] ConstBlock diagonal_of(const Supernode& supernode) const;
  [[nodiscard]] ConstBlock lower_of(const Supernode& supernode) const;  // rows below the diagonal block

  std::vector<int> postordered_tree(std::vector<std::vector<int>>& before);
  [[nodiscard]] static std::vector<int> column_counts(const std::vector<std::vector<int>>& before,
                                                      const std::vector<int>& parent);
  void find_supernodes(const std::vector<int>& parent, const std::vector<int>& counts);
  void substitute_back(auto& y) const;
  [[nodiscard]] std::vector<int> supernode_of_column() const;
  void find_rows(const std::vector<std::vector<int>>& before);
  void find_places(const Eigen::SparseMatrix<double>& A);
  void find_room();
  void take(const Supernode& child, const double* left, Supernode& into, double* update) noexcept;
  bool eliminate(const Supernode& supernode, double* update);
  [[nodiscard]] std::size_t eliminated() const noexcept { return supernodes_.size() - (kept_ > 0 ? 1 : 0); }
  template <class Columns>
  [[nodiscard]] Columns solve_columns(const Columns& b) const;

  int kept_ = 0;
  std::vector<int> position_;  // [n] in the order of elimination
  std::vector<Supernode> supernodes_;
  std::vector<int> rows_;               // by supernode, ascending
  std::vector<int> in_parent_;          // row of the parent for each row below the block
  std::vector<std::ptrdiff_t> places_;  // [entries of A] in values_; -1 above the diagonal
  std::vector<double> values_;
  std::vector<double> stack_;  // updates from supernodes to their parents, [below x below] each
};

}  // namespace palpate
