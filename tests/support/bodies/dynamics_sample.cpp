#include "tests/support/bodies/dynamics_sample.h"

#include <algorithm>
#include <span>

#include "tests/support/bodies/make_dynamics.h"

namespace palpate::test {

Model swinging_model(ElementType element, const DynamicsOptions& options, Precision precision) {
  Model model = unit_model(element, 3, Scope::full, precision);
  model.materials.front().density = 1e-4;
  DynamicsOptions possible = options;
  if (options.modes) possible.modes = std::min(*options.modes, static_cast<Index>(model.stored_dofs()));
  model.dynamics = make_dynamics(model, possible, precision);
  return model;
}

DynamicsOptions all_modes() {
  DynamicsOptions options;
  options.method = DynamicsMethod::modal;
  options.damping = {.mass = 2.0, .stiffness = 1e-4};
  options.modes = 10000;
  return options;
}

DynamicsOptions packed() {
  DynamicsOptions options = all_modes();
  options.method = DynamicsMethod::packed;
  options.modes.reset();
  return options;
}

SparseRoute::SparseRoute(const Model& model) : newmark(model.dynamics.newmark) {
  const StiffnessInput elastic = stiffness_input(model);
  const Stiffness stiffness = assemble_stiffness(elastic);
  equation.K = stiffness.K;
  equation.M = assemble_mass(elastic, stiffness, model.dynamics.lumped);
  equation.C = damping_matrix(equation.M, equation.K, model.dynamics.damping);
  stored_dofs = stored_dofs_of(model, stiffness);
}

Eigen::VectorXd SparseRoute::from_stored(const Eigen::VectorXd& stored) const {
  Eigen::VectorXd free = Eigen::VectorXd::Zero(equation.K.rows());
  for (std::size_t k = 0; k < stored_dofs.size(); ++k) {
    if (stored_dofs[k] >= 0) free[stored_dofs[k]] = stored[static_cast<Eigen::Index>(k)];
  }
  return free;
}

Eigen::VectorXd SparseRoute::to_stored(const Eigen::VectorXd& free) const {
  Eigen::VectorXd stored = Eigen::VectorXd::Zero(std::ssize(stored_dofs));
  for (std::size_t k = 0; k < stored_dofs.size(); ++k) {
    if (stored_dofs[k] >= 0) stored[static_cast<Eigen::Index>(k)] = free[stored_dofs[k]];
  }
  return stored;
}

NewmarkIntegrator SparseRoute::start(const Eigen::VectorXd& u, const Eigen::VectorXd& v) const {
  return {equation, newmark, from_stored(u), from_stored(v)};
}

Eigen::VectorXd displacement(const Body& body, const State& state) {
  Eigen::VectorXd u(body.greens().order());
  surface_displacement(body, state, {u.data(), static_cast<std::size_t>(u.size())});
  return u;
}

}  // namespace palpate::test
