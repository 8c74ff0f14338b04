// Cholesky factors of sparse matrices of one pattern.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// P A P^T = L L^T of symmetric positive definite matrices, one after the other, whose pattern stays: the
/// multifrontal method (Duff & Reid 1983; Liu 1992) in an order of approximate minimum degree (Amestoy, Davis
/// & Duff 1996). Columns of L with nearly the same rows are supernodes, stored and computed as dense blocks.
class SparseCholesky {
 public:
  /// Finds the order of elimination and where each entry of L lies. Of A the lower triangle is read.
  void analyse(const Eigen::SparseMatrix<double>& A);

  /// Factorises a matrix of the pattern that was analysed, compressed as it was. False when it is not
  /// positive definite or not finite: there is no factor then.
  bool factorise(const Eigen::SparseMatrix<double>& A);

  /// A^-1 b [n x columns] of the last matrix that was factorised.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;  ///< of one column

  [[nodiscard]] std::int64_t entries() const noexcept { return std::ssize(values_); }  ///< stored, of L

 private:
  /// Columns of L, dense: its own columns first among its rows.
  struct Supernode {
    int first = 0, columns = 0;  // by order of elimination
    int parent = -1;             // supernode that takes what this one leaves
    std::size_t rows_at = 0;     // in rows_ and in_parent_
    int rows = 0;
    std::size_t values_at = 0;  // [rows x columns] by columns

    [[nodiscard]] int below() const noexcept { return rows - columns; }
  };

  std::vector<int> postordered_tree(std::vector<std::vector<int>>& before);
  [[nodiscard]] static std::vector<int> column_counts(const std::vector<std::vector<int>>& before,
                                                      const std::vector<int>& parent);
  void find_supernodes(const std::vector<int>& parent, const std::vector<int>& counts);
  [[nodiscard]] std::vector<int> supernode_of_column() const;
  void find_rows(const std::vector<std::vector<int>>& before);
  void find_places(const Eigen::SparseMatrix<double>& A);
  void find_room();
  void take(const Supernode& child, const double* left, Supernode& into, double* update) noexcept;
  bool eliminate(const Supernode& supernode, double* update);
  template <class Columns>
  [[nodiscard]] Columns solve_columns(const Columns& b) const;

  std::vector<int> position_;  // [n] in the order of elimination
  std::vector<Supernode> supernodes_;
  std::vector<int> rows_;               // by supernode, ascending
  std::vector<int> in_parent_;          // row of the parent that each row below is
  std::vector<std::ptrdiff_t> places_;  // [entries of A] in values_; -1 above the diagonal
  std::vector<double> values_;
  std::vector<double> stack_;  // what supernodes leave for their parents, [below x below] each
};

}  // namespace palpate
