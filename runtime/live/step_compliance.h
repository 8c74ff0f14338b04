// Compliance of a body within a time step.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "matrices/packed.h"
#include "runtime/live/live_stepper.h"

namespace palpate {

/// The compliance W [m/N] of one step between all dofs of some nodes: by how much the step's end moves with
/// the forces in it. By implicit Euler (M / h^2 + C_d / h + K)^-1 with the tangent at some positions; by
/// semi-implicit Euler h^2 M^-1. Found some columns at a time, so that the caller can spread the
/// work over several steps.
class StepCompliance {
 public:
  /// `body` must outlive this; `nodes`: mesh nodes.
  StepCompliance(const LiveBody& body, const StepperOptions& stepper, std::span<const Index> nodes);

  /// Factorises the matrix of a step at positions x [d N] with plastic strain (empty: none). False if it is
  /// not positive definite.
  bool begin(const Eigen::VectorXd& x, std::span<const Mat3> plastic);
  /// Computes the given number of further columns. True once all are computed.
  bool go_on(Index columns);
  /// Computes all columns on several threads, with the same bits as `go_on` in pieces of 64.
  void find_all(int jobs);
  /// Returns W, once all columns are computed.
  [[nodiscard]] PackedGreens take() noexcept;

 private:
  void find(Eigen::Index first, Eigen::Index count);

  const LiveBody& body_;
  StepperOptions stepper_;
  std::vector<Index> free_;  // [n] free dof of each dof, -1 if held
  LiveMatrix A_;
  double scale_ = 1.0;  // W = scale A^-1
  TangentSolver solver_;
  std::shared_ptr<double[]> packed_;
  Eigen::Index found_ = 0;  // computed columns
};

/// Q W Q^T: compliance of a body rotated by Q, in blocks of d dofs. In double precision.
PackedGreens turned(const PackedGreens& W, const Mat3& Q, int d);

}  // namespace palpate
