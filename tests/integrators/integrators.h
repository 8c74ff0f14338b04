// Time integrators of M u'' + C u' + K u = f, all behind one interface: those that Sito (2019, section 3.3)
// compares, and Newmark's (theory.md section 5). A study and a reference for tests; the runtime has its own
// Newmark step.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "matrices/newmark.h"
#include "precompute/numerics/assembly.h"

namespace palpate::test {

/// M u'' + C u' + K u = f(t) of n free dofs. Matrices [n, n] are lower triangles, as assembly leaves them.
struct Equation {
  SparseMatrix M;                            ///< [kg]; consistent or lumped
  SparseMatrix K;                            ///< [N/m]
  SparseMatrix C;                            ///< [N s/m]; 0 x 0: none
  std::function<Eigen::VectorXd(double)> f;  ///< [n] at the time [s]: force [N]; empty: none

  [[nodiscard]] Eigen::VectorXd force(double time) const;  ///< f(t), zero where there is none
  /// f(t) - C v - K u [N]
  [[nodiscard]] Eigen::VectorXd force_left(double time, const Eigen::VectorXd& u,
                                           const Eigen::VectorXd& v) const;
  /// 1/2 v^T M v + 1/2 u^T K u [J]
  [[nodiscard]] double energy(const Eigen::VectorXd& u, const Eigen::VectorXd& v) const;
};

/// C = mass M + stiffness K.
SparseMatrix damping_matrix(const SparseMatrix& M, const SparseMatrix& K, const Rayleigh& damping);

/// A^-1 b by a sparse factor, for A given by its lower triangle. Entries that are zero are left out, so that
/// a lumped M costs a division a dof.
class SparseSolver {
 public:
  explicit SparseSolver(const SparseMatrix& A);  ///< throws std::invalid_argument when A is singular
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const { return factor_.solve(b); }

 private:
  Eigen::SimplicialLDLT<SparseMatrix> factor_;
};

/// A body in motion. Begins at time 0 with the acceleration that solves M a = f - C v - K u.
class Integrator {
 public:
  virtual ~Integrator() = default;
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;

  void step();  ///< one time step further

  [[nodiscard]] const Eigen::VectorXd& u() const noexcept { return u_; }  ///< [n] displacement [m]
  [[nodiscard]] const Eigen::VectorXd& v() const noexcept { return v_; }  ///< [n] velocity [m/s]
  [[nodiscard]] const Eigen::VectorXd& a() const noexcept { return a_; }  ///< [n] acceleration [m/s^2]
  [[nodiscard]] double time() const noexcept { return static_cast<double>(steps_) * time_step_; }  ///< [s]
  [[nodiscard]] double energy() const { return equation_.energy(u_, v_); }                         ///< [J]

 protected:
  Integrator(Equation equation, Eigen::VectorXd u, Eigen::VectorXd v, double time_step);
  virtual void advance() = 0;  ///< u, v, a from time() to time() + time_step()

  [[nodiscard]] double time_step() const noexcept { return time_step_; }
  [[nodiscard]] const Equation& equation() const noexcept { return equation_; }

  Eigen::VectorXd u_, v_, a_;

 private:
  Equation equation_;
  double time_step_;
  std::int64_t steps_ = 0;
};

/// Newmark's method by a sparse solve of K_bar = K + a0 M + a1 C in every step.
class NewmarkIntegrator final : public Integrator {
 public:
  /// u, v [n] at time 0. alpha > 0; stable or not.
  NewmarkIntegrator(Equation equation, const Newmark& newmark, Eigen::VectorXd u, Eigen::VectorXd v);

 private:
  void advance() override;

  Newmark newmark_;
  SparseSolver K_bar_;
};

enum class Method : std::uint8_t {
  explicit_euler,
  semi_implicit_euler,  ///< or symplectic
  rk2,                  ///< the midpoint rule
  rk4,
  verlet,  ///< velocity Verlet; C at the new velocity, which keeps order and limit: Newmark's alpha = 0
  implicit_euler,
  newmark,  ///< alpha = 1/4, delta = 1/2
};

inline const std::vector<Method> all_methods = {
    Method::explicit_euler, Method::semi_implicit_euler, Method::rk2,    Method::rk4,
    Method::verlet,         Method::implicit_euler,      Method::newmark};

std::string name_of(Method method);

/// u, v [n] at time 0; time_step [s].
std::unique_ptr<Integrator> make_integrator(Method method, Equation equation, Eigen::VectorXd u,
                                            Eigen::VectorXd v, double time_step);

}  // namespace palpate::test
