// Vectors of an eigenvalue solver, and parallel operations on them.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/parallel.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/sharing.h"
#include "precompute/numerics/supernodal_sweeps.h"

namespace palpate {

/// K^-1 and M applied to blocks of vectors [n, any] by threads. The bytes do not depend on the number of
/// threads. Once `stopped`, results are not valid.
class SharedPencil {
 public:
  /// `factor`: of K, computed. M: lower triangle. Keeps references.
  SharedPencil(const Factor& factor, const SparseMatrix& M, Sharing& sharing);

  [[nodiscard]] std::int64_t order() const { return M_.rows(); }
  [[nodiscard]] bool stopped() const { return stopped_; }

  [[nodiscard]] Eigen::MatrixXd inverse_times(Eigen::MatrixXd B);                             ///< K^-1 B
  [[nodiscard]] Eigen::MatrixXd mass_times(const Eigen::MatrixXd& W);                         ///< M W
  [[nodiscard]] Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);  ///< A^T B

  /// Runs `work` on items by threads, unless stopped.
  void share(std::int64_t items, const std::function<void(std::int64_t item, int worker)>& work);
  /// Calls work(item) for each item, stopped or not.
  template <class Work>
  void repeat(std::int64_t count, Work&& work) {
    parallel_for(count, sharing_.jobs(), [&](std::int64_t item, int) { work(item); });
  }

 private:
  const Factor& factor_;
  SupernodalSweeps sweeps_;
  std::vector<SupernodalSweeps::Workspace> workspaces_;  // per thread
  SparseMatrix M_;                                       // without the zeros of K's pattern
  Sharing& sharing_;
  bool stopped_ = false;
};

/// V [n, size]: vectors that are orthonormal in M.
class KrylovSpace {
 public:
  KrylovSpace(SharedPencil& pencil, std::int64_t capacity);

  [[nodiscard]] std::int64_t size() const { return size_; }

  void append(const Eigen::MatrixXd& Q);
  [[nodiscard]] Eigen::MatrixXd coefficients(const Eigen::MatrixXd& M_W);  ///< V^T M W
  void remove(const Eigen::MatrixXd& coefficients, Eigen::MatrixXd& W);    ///< W - V coefficients
  [[nodiscard]] Eigen::MatrixXd combine(const Eigen::MatrixXd& Y);         ///< V Y
  void replace(const Eigen::MatrixXd& Y);                                  ///< V := V Y

 private:
  SharedPencil& pencil_;
  std::vector<Eigen::MatrixXd> blocks_;  // blocks of rows of V, [rows, capacity]
  std::int64_t size_ = 0;
};

}  // namespace palpate
