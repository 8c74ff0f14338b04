#include "precompute/verify_dynamics.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "precompute/numerics/dynamics.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/lowest_modes.h"
#include "precompute/verify_matrix.h"

namespace palpate {
namespace {

using Vector = Eigen::VectorXd;

constexpr double residual_bound = 1e-6, mass_bound = 1e-6;
constexpr std::int64_t completed_modes = 4;  // whose interior is solved for

double relative_difference(const std::vector<double>& values, const std::vector<double>& reference) {
  if (values.size() != reference.size()) return INFINITY;
  double largest = 0.0, difference = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    largest = std::max(largest, std::abs(reference[k]));
    difference = std::max(difference, std::abs(values[k] - reference[k]));
  }
  return largest > 0.0 ? difference / largest : difference;
}

std::vector<Check> check_matrices(const Model& model, const Stiffness& stiffness, const SparseMatrix& M) {
  const MassAndDamping& stored = model.dynamics.matrices;
  const MassAndDamping expected =
      mass_and_damping(stiffness.K, M, model.dynamics.damping, stored_dofs_of(model, stiffness));
  Check mass{"mass", INFINITY, same_sum}, damping{"damping", INFINITY, same_sum};
  if (stored.start == expected.start && stored.row == expected.row) {
    mass.error = relative_difference(stored.mass, expected.mass);
    damping.error = relative_difference(stored.damping, expected.damping);
  }
  return {mass, damping};
}

std::vector<Check> check_inverse(const Model& model, const Stiffness& stiffness, const SparseMatrix& M,
                                 int samples) {
  const SparseMatrix K_bar =
      effective_stiffness(stiffness.K, M, model.dynamics.damping, model.dynamics.newmark);
  Factor factor(K_bar, stiffness.node_start);
  factor.factorize();
  const std::vector<std::int64_t> stored_dofs = stored_dofs_of(model, stiffness);
  return verify_matrix(model, model.dynamics.inverse, model.dynamics.force_errors, factor, K_bar, stored_dofs,
                       solver_error(factor, K_bar, stored_dofs, samples), "inverse ", samples);
}

/// Computes shapes at all dofs of K from those at the stored ones.
class Completion {
 public:
  Completion(const Stiffness& stiffness, const SparseMatrix& M, const std::vector<std::int64_t>& stored_dofs)
      : K_(stiffness.K), M_(M), inner_(static_cast<std::size_t>(K_.rows()), 0) {
    for (const std::int64_t dof : stored_dofs)
      if (dof >= 0) inner_[static_cast<std::size_t>(dof)] = -1;
    for (std::int64_t& number : inner_) number = number < 0 ? -1 : inner_count_++;
  }

  [[nodiscard]] bool is_needed() const { return inner_count_ > 0; }

  /// Completes u, which has the stored dofs and zeros.
  void complete(Vector& u, double omega) const {
    if (!is_needed()) return;
    SparseMatrix A = K_;  // in one pattern, as assembled
    for (std::int64_t k = 0; k < A.nonZeros(); ++k) A.valuePtr()[k] -= omega * omega * M_.valuePtr()[k];
    std::vector<Eigen::Triplet<double, std::int64_t>> entries;
    for (std::int64_t j = 0; j < A.cols(); ++j) {
      for (SparseMatrix::InnerIterator entry(A, j); entry; ++entry) {
        const std::int64_t row = inner_[static_cast<std::size_t>(entry.row())],
                           column = inner_[static_cast<std::size_t>(j)];
        if (row >= 0 && column >= 0) entries.emplace_back(row, column, entry.value());
      }
    }
    SparseMatrix A_aa(inner_count_, inner_count_);
    A_aa.setFromTriplets(entries.begin(), entries.end());
    const Vector A_u = A.selfadjointView<Eigen::Lower>() * u;
    Vector f_a(inner_count_);
    for (std::size_t dof = 0; dof < inner_.size(); ++dof)
      if (inner_[dof] >= 0) f_a[inner_[dof]] = -A_u[static_cast<Eigen::Index>(dof)];
    const Eigen::SimplicialLDLT<SparseMatrix, Eigen::Lower> factor(A_aa);
    const Vector u_a = factor.solve(f_a);
    for (std::size_t dof = 0; dof < inner_.size(); ++dof)
      if (inner_[dof] >= 0) u[static_cast<Eigen::Index>(dof)] = u_a[inner_[dof]];
  }

 private:
  const SparseMatrix& K_;
  const SparseMatrix& M_;
  std::vector<std::int64_t> inner_;  // [n] number among the dofs that are not stored, -1 for stored ones
  std::int64_t inner_count_ = 0;
};

std::vector<Check> check_modes(const Model& model, const Stiffness& stiffness, const SparseMatrix& M) {
  const StoredDynamics& dynamics = model.dynamics;
  const std::vector<std::int64_t> stored_dofs = stored_dofs_of(model, stiffness);
  const Completion completion(stiffness, M, stored_dofs);
  const std::int64_t modes = dynamics.modes(),
                     count = completion.is_needed() ? std::min(completed_modes, modes) : modes;
  Check residual{"modes", 0.0, residual_bound}, mass{"modal mass", 0.0, mass_bound};
  Eigen::MatrixXd shapes = Eigen::MatrixXd::Zero(stiffness.K.rows(), count), M_shapes = shapes;
  for (std::int64_t k = 0; k < count; ++k) {
    const std::int64_t i = count > 1 ? k * (modes - 1) / (count - 1) : 0;  // the first, the last, and some
                                                                           // between
    const double omega = dynamics.omega[static_cast<std::size_t>(i)];
    Vector phi = Vector::Zero(stiffness.K.rows());
    for (std::size_t s = 0; s < stored_dofs.size(); ++s)
      if (stored_dofs[s] >= 0)
        phi[stored_dofs[s]] = dynamics.shapes[static_cast<std::size_t>(i) * stored_dofs.size() + s];
    completion.complete(phi, omega);
    const Vector K_phi = stiffness.K.selfadjointView<Eigen::Lower>() * phi;
    const Vector M_phi = M.selfadjointView<Eigen::Lower>() * phi;
    const double error =
        (K_phi - omega * omega * M_phi).lpNorm<Eigen::Infinity>() / K_phi.lpNorm<Eigen::Infinity>();
    residual.error = std::isnan(error) ? INFINITY : std::max(residual.error, error);
    shapes.col(k) = phi;
    M_shapes.col(k) = M_phi;
  }
  mass.error =
      (shapes.transpose() * M_shapes - Eigen::MatrixXd::Identity(count, count)).lpNorm<Eigen::Infinity>();
  const bool all = none_left_out(Factor(stiffness.K, stiffness.node_start), stiffness.K, M, dynamics.omega);
  return {residual, mass, {"mode count", all ? 0.0 : INFINITY, 0.0}};
}

}  // namespace

std::vector<Check> verify_dynamics(const Model& model, const Stiffness& stiffness, int samples) {
  const SparseMatrix M = assemble_mass(stiffness_input(model), stiffness, model.dynamics.lumped);
  if (model.dynamics.method == DynamicsMethod::modal) return check_modes(model, stiffness, M);
  std::vector<Check> checks = check_matrices(model, stiffness, M);
  const std::vector<Check> inverse = check_inverse(model, stiffness, M, samples);
  checks.insert(checks.end(), inverse.begin(), inverse.end());
  return checks;
}

}  // namespace palpate
