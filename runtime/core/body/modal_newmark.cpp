#include "runtime/core/body/modal_newmark.h"

#include <cmath>

namespace palpate {
namespace {

constexpr double still = 1e-40;  // smaller numbers would become denormal, which is slow

}  // namespace

ModalNewmark::ModalNewmark(std::span<const double> omega, const Rayleigh& damping, const Newmark& newmark)
    : newmark_(newmark), q_(omega.size()), v_(omega.size()), a_(omega.size()), predicted_(omega.size()) {
  for (const double w : omega) {
    omega2_.push_back(w * w);
    c_.push_back(damping.mass + damping.stiffness * w * w);
    k_bar_.push_back(w * w + newmark.a0() + newmark.a1() * c_.back());
  }
}

void ModalNewmark::let_go(std::span<const double> g, std::span<const double> rate) noexcept {
  for (std::size_t i = 0; i < q_.size(); ++i) {
    const double v = rate[i] / omega2_[i];
    q_[i] += g[i] / omega2_[i];
    v_[i] += v;
    a_[i] -= g[i] + c_[i] * v;
  }
}

void ModalNewmark::predict() noexcept {
  const double a0 = newmark_.a0(), a1 = newmark_.a1(), a2 = newmark_.a2(), a3 = newmark_.a3(),
               a4 = newmark_.a4(), a5 = newmark_.a5();
  for (std::size_t i = 0; i < q_.size(); ++i) {
    predicted_[i] =
        (a0 * q_[i] + a2 * v_[i] + a3 * a_[i] + c_[i] * (a1 * q_[i] + a4 * v_[i] + a5 * a_[i])) / k_bar_[i];
  }
}

void ModalNewmark::advance(std::span<const double> g) noexcept {
  for (std::size_t i = 0; i < q_.size(); ++i) predicted_[i] += g[i] / k_bar_[i];
  advance();
}

void ModalNewmark::advance() noexcept {
  const double a0 = newmark_.a0(), a2 = newmark_.a2(), a3 = newmark_.a3();
  const double before = newmark_.time_step * (1.0 - newmark_.delta),
               after = newmark_.time_step * newmark_.delta;
  for (std::size_t i = 0; i < q_.size(); ++i) {
    const double a = a0 * (predicted_[i] - q_[i]) - a2 * v_[i] - a3 * a_[i];
    v_[i] += before * a_[i] + after * a;
    a_[i] = a;
    q_[i] = predicted_[i];
    if (std::abs(q_[i]) < still && std::abs(v_[i]) < still) q_[i] = v_[i] = a_[i] = 0.0;
  }
}

void ModalNewmark::damp(double share) noexcept {
  for (std::vector<double>* motion : {&q_, &v_, &a_}) {
    for (double& value : *motion) value *= share;
  }
}

}  // namespace palpate
