// Sparse Cholesky factor of a stiffness matrix, by CHOLMOD.
#pragma once

#include <cholmod.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "precompute/numerics/assembly.h"
#include "precompute/numerics/spread_numbers.h"

namespace palpate {

/// P K P^T = L L^T, supernodal, ordered by METIS on the graph of the nodes, so that the dofs of a node stay
/// together. The constructor analyses (no numbers yet: enough to plan and to estimate), `factorize` computes.
/// If one process cannot hold the numbers, `spread` distributes them over several, which then factorise and
/// solve together.
class Factor {
 public:
  /// K: lower triangle with complete blocks of nodes, as made by assemble_stiffness; node a has the dofs
  /// node_start[a] .. node_start[a + 1] - 1. Keeps a reference to K.
  Factor(const SparseMatrix& K, std::span<const std::int64_t> node_start);
  ~Factor();
  Factor(const Factor&) = delete;
  Factor& operator=(const Factor&) = delete;

  /// Leaves the numbers, which are not computed yet, to several processes.
  void spread(std::unique_ptr<SpreadNumbers> numbers) { spread_ = std::move(numbers); }
  [[nodiscard]] SpreadNumbers* spread_numbers() const noexcept { return spread_.get(); }  ///< may be null

  /// Numeric factorisation. Throws Error if K is not positive definite or memory is short.
  void factorize();

  /// x = K^-1 b for `columns` right-hand sides, column-major [n, columns], by plain cholmod_solve or the
  /// processes that hold the numbers.
  [[nodiscard]] std::vector<double> solve(std::span<const double> b, std::int64_t columns = 1) const;

  [[nodiscard]] std::int64_t order() const noexcept { return K_.rows(); }  ///< n
  [[nodiscard]] std::int64_t entries() const noexcept;                     ///< stored entries of L
  [[nodiscard]] double flops() const noexcept;  ///< multiplications and additions of `factorize`
  [[nodiscard]] std::span<const std::int64_t> permutation()
      const noexcept;  ///< dof of K at each position of L
  [[nodiscard]] const cholmod_factor& supernodal() const noexcept { return *factor_; }
  [[nodiscard]] cholmod_common& common() const noexcept { return common_; }

 private:
  const SparseMatrix& K_;
  mutable cholmod_common common_{};  // CHOLMOD takes its settings and workspace by pointer even to solve
  cholmod_factor* factor_ = nullptr;
  std::unique_ptr<SpreadNumbers> spread_;
};

}  // namespace palpate
