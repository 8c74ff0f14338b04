#include "runtime/body/packed_newmark.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr int most_iterations = 200;
constexpr double tolerance = 1e-14;  // relative residual of M a = b
constexpr double still = 1e-40;      // smaller numbers would become denormal, which is slow

/// y += A x for a matrix given by the entries of its lower triangle.
void add_product(const MassAndDamping& pattern, const std::vector<double>& entries, std::span<const double> x,
                 std::span<double> y) noexcept {
  for (std::size_t j = 0; j + 1 < pattern.start.size(); ++j) {
    double sum = 0.0;
    for (auto k = static_cast<std::size_t>(pattern.start[j]);
         k < static_cast<std::size_t>(pattern.start[j + 1]); ++k) {
      const auto i = static_cast<std::size_t>(pattern.row[k]);
      sum += entries[k] * x[i];
      if (i != j) y[i] += entries[k] * x[j];
    }
    y[j] += sum;
  }
}

std::vector<double> diagonal(const MassAndDamping& pattern, const std::vector<double>& entries) {
  std::vector<double> result(pattern.start.size() - 1, 0.0);
  for (std::size_t j = 0; j < result.size(); ++j) {
    const auto k = static_cast<std::size_t>(pattern.start[j]);
    if (pattern.start[j] < pattern.start[j + 1] && static_cast<std::size_t>(pattern.row[k]) == j)
      result[j] = entries[k];
  }
  return result;
}

const StoredDynamics& checked(const StoredDynamics& dynamics) {
  if (dynamics.method != DynamicsMethod::packed ||
      std::ssize(dynamics.matrices.start) != dynamics.inverse.order() + 1) {
    throw Error("the dynamics are not packed", "dynamics",
                "precompute with method = \"packed\" in [dynamics]");
  }
  return dynamics;
}

}  // namespace

PackedNewmark::PackedNewmark(const StoredDynamics& dynamics, int jobs)
    : dynamics_(checked(dynamics)), product_(dynamics.inverse, jobs) {
  for (std::vector<double>* of_dofs : {&u_, &v_, &a_, &predicted_, &with_M_, &with_C_, &f_bar_})
    of_dofs->resize(static_cast<std::size_t>(dynamics.inverse.order()));
}

void PackedNewmark::rest() noexcept {
  for (std::vector<double>* motion : {&u_, &v_, &a_, &predicted_})
    std::fill(motion->begin(), motion->end(), 0.0);
}

void PackedNewmark::damp(double share) noexcept {
  for (std::vector<double>* motion : {&u_, &v_, &a_}) {
    for (double& value : *motion) value *= share;
  }
}

double PackedNewmark::kinetic_energy(std::span<const double> v) noexcept {
  std::fill(with_M_.begin(), with_M_.end(), 0.0);
  add_product(dynamics_.matrices, dynamics_.matrices.mass, v, with_M_);
  return 0.5 * dot(v.data(), with_M_.data(), std::ssize(v));
}

void PackedNewmark::let_go(std::span<const double> f, std::span<const double> u,
                           std::span<const double> v) noexcept {
  std::fill(f_bar_.begin(), f_bar_.end(), 0.0);
  add_product(dynamics_.matrices, dynamics_.matrices.damping, v, f_bar_);
  for (std::size_t i = 0; i < f.size(); ++i) f_bar_[i] = -f[i] - f_bar_[i];
  solve_mass(f_bar_);
  for (std::size_t i = 0; i < u.size(); ++i) {
    u_[i] += u[i];
    v_[i] += v[i];
    a_[i] += with_M_[i];
  }
}

/// Computes with_M = M^-1 b by conjugate gradients with diagonal scaling, by which a mass matrix is well
/// conditioned (Wathen 1987). Held dofs have no mass and do not move.
void PackedNewmark::solve_mass(std::span<double> b) noexcept {
  const std::vector<double> scale = diagonal(dynamics_.matrices, dynamics_.matrices.mass);
  const std::size_t n = b.size();
  std::vector<double>& x = with_M_;
  std::vector<double> p(n), q(n);
  std::fill(x.begin(), x.end(), 0.0);
  const auto precondition = [&](std::size_t i) { return scale[i] > 0.0 ? b[i] / scale[i] : 0.0; };
  double rho = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    if (scale[i] == 0.0) b[i] = 0.0;
    p[i] = precondition(i);
    rho += b[i] * p[i];
  }
  const double small = tolerance * tolerance * rho;
  for (int iteration = 0; iteration < most_iterations && rho > small && rho > 0.0; ++iteration) {
    std::fill(q.begin(), q.end(), 0.0);
    add_product(dynamics_.matrices, dynamics_.matrices.mass, p, q);
    const double alpha = rho / dot(p.data(), q.data(), static_cast<std::ptrdiff_t>(n));
    double next = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      x[i] += alpha * p[i];
      b[i] -= alpha * q[i];
      next += b[i] * precondition(i);
    }
    for (std::size_t i = 0; i < n; ++i) p[i] = precondition(i) + next / rho * p[i];
    rho = next;
  }
}

void PackedNewmark::predict() noexcept {
  const Newmark& h = dynamics_.newmark;
  for (std::size_t i = 0; i < u_.size(); ++i) {
    with_M_[i] = h.a0() * u_[i] + h.a2() * v_[i] + h.a3() * a_[i];
    with_C_[i] = h.a1() * u_[i] + h.a4() * v_[i] + h.a5() * a_[i];
  }
  std::fill(f_bar_.begin(), f_bar_.end(), 0.0);
  add_product(dynamics_.matrices, dynamics_.matrices.mass, with_M_, f_bar_);
  add_product(dynamics_.matrices, dynamics_.matrices.damping, with_C_, f_bar_);
  product_.multiply(f_bar_, predicted_);
}

void PackedNewmark::advance() noexcept {
  end_step();
}

void PackedNewmark::advance(std::span<const double> u, std::span<const std::int64_t> touched) noexcept {
  for (std::size_t i = 0; i < u.size(); ++i) predicted_[i] += u[i];
  const double per_step = 1.0 / dynamics_.newmark.time_step;
  driven_.clear();
  for (const std::int64_t dof : touched) {
    const auto i = static_cast<std::size_t>(dof);
    driven_.push_back(per_step * (predicted_[i] - u_[i]));
    driven_.push_back(per_step * (driven_.back() - v_[i]));
  }
  end_step();
  for (std::size_t k = 0; k < touched.size(); ++k) {
    const auto i = static_cast<std::size_t>(touched[k]);
    v_[i] = driven_[2 * k];
    a_[i] = driven_[2 * k + 1];
  }
}

void PackedNewmark::end_step() noexcept {
  const Newmark& h = dynamics_.newmark;
  double largest = 0.0;
  for (std::size_t i = 0; i < u_.size(); ++i) {
    const double a = h.a0() * (predicted_[i] - u_[i]) - h.a2() * v_[i] - h.a3() * a_[i];
    v_[i] += h.time_step * ((1.0 - h.delta) * a_[i] + h.delta * a);
    a_[i] = a;
    u_[i] = predicted_[i];
    largest = std::max({largest, std::abs(u_[i]), std::abs(v_[i])});
  }
  if (largest < still) rest();
}

}  // namespace palpate
