// Small bodies that swing, and the sparse route beside them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/numerics/dynamics.h"
#include "runtime/body/body.h"
#include "runtime/core/tick/step.h"
#include "tests/integrators/integrators.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::test {

/// A tick [s].
inline constexpr double tick = 0.001;

/// The unit cube or square of 3 cells, E = 1 Pa, as light as makes its first frequency some 10 Hz; all of it
/// is stored. More modes than there are: all.
Model swinging_model(ElementType element, const DynamicsOptions& options,
                     Precision precision = Precision::double_precision);

/// Every mode that there is; damped.
DynamicsOptions all_modes();
/// The packed inverse; damped.
DynamicsOptions packed();

/// M, K and C of a model's free dofs, and how its stored dofs are numbered among them.
struct SparseRoute {
  explicit SparseRoute(const Model& model);
  [[nodiscard]] Eigen::VectorXd from_stored(const Eigen::VectorXd& stored) const;
  [[nodiscard]] Eigen::VectorXd to_stored(const Eigen::VectorXd& free) const;
  /// Newmark by a sparse solve in each step from u and v of the stored dofs.
  [[nodiscard]] NewmarkIntegrator start(const Eigen::VectorXd& u, const Eigen::VectorXd& v) const;

  Equation equation;
  Newmark newmark;
  std::vector<std::int64_t> stored_dofs;  // dof of K of each
};

/// Displacement of all stored nodes as the tick has it.
Eigen::VectorXd displacement(const Body& body, const State& state);

}  // namespace palpate::test
