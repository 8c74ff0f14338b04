#include "tests/integrators/integrators.h"

#include <stdexcept>
#include <type_traits>
#include <utility>

namespace palpate::test {

using Eigen::VectorXd;

namespace {

VectorXd product(const SparseMatrix& lower, const VectorXd& x) {
  return lower.selfadjointView<Eigen::Lower>() * x;
}

/// of_M M + of_C C + of_K K: what implicit steps solve with.
SparseMatrix combined(const Equation& equation, double of_M, double of_C, double of_K) {
  SparseMatrix A = of_M * equation.M + of_K * equation.K;
  if (equation.C.rows() > 0) A += of_C * equation.C;
  return A;
}

/// Those that need the acceleration of any state: they factor M once.
class ExplicitIntegrator : public Integrator {
 public:
  ExplicitIntegrator(Equation of, VectorXd u, VectorXd v, double time_step)
      : Integrator(std::move(of), std::move(u), std::move(v), time_step), M_(equation().M) {}

 protected:
  [[nodiscard]] VectorXd acceleration(double at, const VectorXd& u, const VectorXd& v) const {
    return M_.solve(equation().force_left(at, u, v));
  }

 private:
  SparseSolver M_;
};

class ExplicitEuler final : public ExplicitIntegrator {
 public:
  using ExplicitIntegrator::ExplicitIntegrator;

 private:
  void advance() override {
    const double Dt = time_step();
    u_ += Dt * v_;
    v_ += Dt * a_;
    a_ = acceleration(time() + Dt, u_, v_);
  }
};

class SemiImplicitEuler final : public ExplicitIntegrator {
 public:
  using ExplicitIntegrator::ExplicitIntegrator;

 private:
  void advance() override {
    const double Dt = time_step();
    v_ += Dt * a_;
    u_ += Dt * v_;
    a_ = acceleration(time() + Dt, u_, v_);
  }
};

class RungeKutta2 final : public ExplicitIntegrator {
 public:
  using ExplicitIntegrator::ExplicitIntegrator;

 private:
  void advance() override {
    const double Dt = time_step();
    const VectorXd v_mid = v_ + 0.5 * Dt * a_;
    const VectorXd a_mid = acceleration(time() + 0.5 * Dt, u_ + 0.5 * Dt * v_, v_mid);
    u_ += Dt * v_mid;
    v_ += Dt * a_mid;
    a_ = acceleration(time() + Dt, u_, v_);
  }
};

class RungeKutta4 final : public ExplicitIntegrator {
 public:
  using ExplicitIntegrator::ExplicitIntegrator;

 private:
  void advance() override {
    const double Dt = time_step(), mid = time() + 0.5 * Dt, end = time() + Dt;
    const VectorXd v2 = v_ + 0.5 * Dt * a_, a2 = acceleration(mid, u_ + 0.5 * Dt * v_, v2);
    const VectorXd v3 = v_ + 0.5 * Dt * a2, a3 = acceleration(mid, u_ + 0.5 * Dt * v2, v3);
    const VectorXd v4 = v_ + Dt * a3, a4 = acceleration(end, u_ + Dt * v3, v4);
    u_ += Dt / 6.0 * (v_ + 2.0 * v2 + 2.0 * v3 + v4);
    v_ += Dt / 6.0 * (a_ + 2.0 * a2 + 2.0 * a3 + a4);
    a_ = acceleration(end, u_, v_);
  }
};

class Verlet final : public Integrator {
 public:
  Verlet(Equation of, VectorXd u, VectorXd v, double time_step)
      : Integrator(std::move(of), std::move(u), std::move(v), time_step),
        M_and_damping_(combined(equation(), 1.0, 0.5 * time_step, 0.0)) {}

 private:
  void advance() override {
    const double Dt = time_step();
    v_ += 0.5 * Dt * a_;
    u_ += Dt * v_;
    a_ = M_and_damping_.solve(equation().force_left(time() + Dt, u_, v_));
    v_ += 0.5 * Dt * a_;
  }

  SparseSolver M_and_damping_;
};

class ImplicitEuler final : public Integrator {
 public:
  ImplicitEuler(Equation of, VectorXd u, VectorXd v, double time_step)
      : Integrator(std::move(of), std::move(u), std::move(v), time_step),
        A_(combined(equation(), 1.0, time_step, time_step * time_step)) {}

 private:
  // M (v' - v) = Dt (f - C v' - K (u + Dt v'))
  void advance() override {
    const double Dt = time_step();
    const VectorXd v_before = v_;
    v_ = A_.solve(product(equation().M, v_) +
                  Dt * (equation().force(time() + Dt) - product(equation().K, u_)));
    u_ += Dt * v_;
    a_ = (v_ - v_before) / Dt;
  }

  SparseSolver A_;
};

}  // namespace

VectorXd Equation::force(double time) const {
  return f ? f(time) : VectorXd::Zero(M.rows());
}

VectorXd Equation::force_left(double time, const VectorXd& u, const VectorXd& v) const {
  VectorXd left = force(time) - product(K, u);
  if (C.rows() > 0) left -= product(C, v);
  return left;
}

double Equation::energy(const VectorXd& u, const VectorXd& v) const {
  return 0.5 * v.dot(product(M, v)) + 0.5 * u.dot(product(K, u));
}

SparseMatrix damping_matrix(const SparseMatrix& M, const SparseMatrix& K, const Rayleigh& damping) {
  return damping.mass * M + damping.stiffness * K;
}

SparseSolver::SparseSolver(const SparseMatrix& A) {
  factor_.compute(SparseMatrix(A.pruned(0.0, 0.0)));
  if (factor_.info() != Eigen::Success) throw std::invalid_argument("the matrix is singular");
}

Integrator::Integrator(Equation equation, VectorXd u, VectorXd v, double time_step)
    : u_(std::move(u)), v_(std::move(v)), equation_(std::move(equation)), time_step_(time_step) {
  a_ = SparseSolver(equation_.M).solve(equation_.force_left(0.0, u_, v_));
}

void Integrator::step() {
  advance();
  ++steps_;
}

NewmarkIntegrator::NewmarkIntegrator(Equation of, const Newmark& newmark, VectorXd u, VectorXd v)
    : Integrator(std::move(of), std::move(u), std::move(v), newmark.time_step),
      newmark_(newmark),
      K_bar_(combined(equation(), newmark.a0(), newmark.a1(), 1.0)) {}

void NewmarkIntegrator::advance() {
  const Newmark& n = newmark_;
  VectorXd f_bar =
      equation().force(time() + time_step()) + product(equation().M, n.a0() * u_ + n.a2() * v_ + n.a3() * a_);
  if (equation().C.rows() > 0) f_bar += product(equation().C, n.a1() * u_ + n.a4() * v_ + n.a5() * a_);
  const VectorXd u_after = K_bar_.solve(f_bar);
  const VectorXd a_after = n.a0() * (u_after - u_) - n.a2() * v_ - n.a3() * a_;
  v_ += time_step() * ((1.0 - n.delta) * a_ + n.delta * a_after);
  u_ = u_after;
  a_ = a_after;
}

std::string name_of(Method method) {
  switch (method) {
    case Method::explicit_euler:
      return "explicit Euler";
    case Method::semi_implicit_euler:
      return "semi-implicit Euler";
    case Method::rk2:
      return "RK2";
    case Method::rk4:
      return "RK4";
    case Method::verlet:
      return "Verlet";
    case Method::implicit_euler:
      return "implicit Euler";
    case Method::newmark:
      return "Newmark";
  }
  return "";
}

std::unique_ptr<Integrator> make_integrator(Method method, Equation equation, VectorXd u, VectorXd v,
                                            double time_step) {
  const auto make = [&]<class T>(std::type_identity<T>) {
    return std::make_unique<T>(std::move(equation), std::move(u), std::move(v), time_step);
  };
  switch (method) {
    case Method::explicit_euler:
      return make(std::type_identity<ExplicitEuler>());
    case Method::semi_implicit_euler:
      return make(std::type_identity<SemiImplicitEuler>());
    case Method::rk2:
      return make(std::type_identity<RungeKutta2>());
    case Method::rk4:
      return make(std::type_identity<RungeKutta4>());
    case Method::verlet:
      return make(std::type_identity<Verlet>());
    case Method::implicit_euler:
      return make(std::type_identity<ImplicitEuler>());
    case Method::newmark:
      break;
  }
  return std::make_unique<NewmarkIntegrator>(std::move(equation), Newmark{.time_step = time_step},
                                             std::move(u), std::move(v));
}

}  // namespace palpate::test
