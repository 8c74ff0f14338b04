// By how much a body moves within a time step with the forces in it.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "formats/packed.h"
#include "runtime/live/live_stepper.h"

namespace palpate {

/// The compliance W [m/N] of one step between all dofs of some nodes: by how much the step's end moves with
/// the forces in it. By implicit Euler (M / h^2 + C_d / h + K)^-1 with the tangent at some positions; by an
/// explicit integrator what it makes of forces at the step's begin, a multiple of h^2 M^-1. Found some
/// columns at a time, so that whoever steps a body can spread the work over steps.
class StepCompliance {
 public:
  /// `body` must live as long; `nodes`: of the mesh.
  StepCompliance(const LiveBody& body, const StepperOptions& stepper, std::span<const Index> nodes);

  /// Factors the matrix of a step at positions x [d N] with plastic strain (empty: none). False where it is
  /// not positive definite.
  bool begin(const Eigen::VectorXd& x, std::span<const Mat3> plastic);
  /// Finds so many columns more. True where all are found.
  bool go_on(Index columns);
  /// Finds all columns by so many threads, with the bits that `go_on` gives in pieces of 64.
  void find_all(int jobs);
  /// W, once all columns are found.
  [[nodiscard]] PackedGreens take() noexcept;

 private:
  void find(Eigen::Index first, Eigen::Index count);

  const LiveBody& body_;
  StepperOptions stepper_;
  std::vector<Index> free_;  // [n] free dof of each dof, -1 where it is held
  LiveMatrix A_;
  double scale_ = 1.0;  // W = scale A^-1
  TangentSolver solver_;
  std::shared_ptr<double[]> packed_;
  Eigen::Index found_ = 0;  // columns
};

/// Whether a tool can be felt with the integrator: its steps end elsewhere by the forces in them.
bool answers_within_step(Integrator integrator) noexcept;

/// Q W Q^T: the compliance of a body that has turned by Q, blocks of d dofs each. In double precision.
PackedGreens turned(const PackedGreens& W, const Mat3& Q, int d);

}  // namespace palpate
