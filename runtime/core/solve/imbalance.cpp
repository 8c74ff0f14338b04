#include "runtime/core/solve/imbalance.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

Vec3 at(const ContactLaw& contact, std::span<const double> of_rows) noexcept {
  Vec3 value = Vec3::Zero();
  for (int i = 0; i < contact.rows; ++i) value[i] = of_rows[contact.first + i];
  return value;
}

void set(const ContactLaw& contact, const Vec3& value, std::span<double> of_rows) noexcept {
  for (int i = 0; i < contact.rows; ++i) of_rows[contact.first + i] = value[i];
}

/// y += W x.
template <typename Real>
void add_product(MatrixRows<const Real> W, const double* __restrict x, double* __restrict y,
                 Index rows) noexcept {
  for (Index i = 0; i < rows; ++i) {
    const Real* __restrict row = W[i];
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (Index j = 0; j < rows; ++j) sum += static_cast<double>(row[j]) * x[j];
    y[i] += sum;
  }
}

void add_motion(const ContactProblem& problem, const std::vector<double>& forces,
                std::vector<double>& motion) noexcept {
  problem.with_w([&](auto w) { add_product(w, forces.data(), motion.data(), problem.rows); });
}

}  // namespace

Imbalance::Imbalance(Index max_contacts, Index max_rows)
    : change_(static_cast<std::size_t>(max_rows)),
      motion_(change_.size()),
      step_(change_.size()),
      contacts_(static_cast<std::size_t>(max_contacts)) {}

/// Computes r for the forces.
void Imbalance::find_motion(const ContactProblem& problem) noexcept {
  for (Index i = 0; i < problem.rows; ++i) {
    motion_[i] = problem.b[i];
    step_[i] = problem.lambda[i] - problem.base[i];
  }
  add_motion(problem, step_, motion_);
}

void Imbalance::choose_mode(const ContactProblem& problem, ContactLaw& contact) noexcept {
  const Vec3 f = at(contact, problem.lambda);
  const Vec3 r = at(contact, motion_);
  const bool is_there = contact.kind != ContactLaw::Kind::absent &&
                        (contact.owner < 0 || contacts_[contact.owner].mode != ContactLaw::Mode::open);
  contact.mode = ContactLaw::Mode::open;
  if (is_there) contact.choose_mode(f, r);
  residual_ += (is_there ? contact.difference(f, r) : f).squaredNorm();
  const double normal = contact.n.dot(f);
  Vec3 to = f;
  if (contact.mode == ContactLaw::Mode::open) {
    to.setZero();
  } else if (contact.kind != ContactLaw::Kind::held && !(normal > 0.0)) {
    contact.mode = ContactLaw::Mode::stick;
    to = (normal - contact.n.dot(r) / contact.w) * contact.n;
  } else if (contact.mode == ContactLaw::Mode::slip) {
    to = normal * (contact.n + contact.mu * contact.e);
  }
  set(contact, to - f, change_);
}

/// Keeps the part of the motion that violates the contact's equations: all of it if it sticks; the normal
/// part if it slips, which is corrected along the edge of the cone.
void Imbalance::keep_equations(const ContactLaw& contact) noexcept {
  if (contact.mode == ContactLaw::Mode::stick) return;
  Vec3 left = Vec3::Zero();
  if (contact.mode == ContactLaw::Mode::slip) {
    const Vec3 edge = contact.n + contact.mu * contact.e;
    left = contact.n.dot(at(contact, motion_)) / edge.squaredNorm() * edge;
  }
  set(contact, left, motion_);
}

void Imbalance::find(const ContactProblem& problem) noexcept {
  find_motion(problem);
  residual_ = 0.0;
  for (Index k = 0; k < problem.contacts; ++k) {
    problem.with_w([&](auto w) { contacts_[k] = ContactLaw(problem, k, w); });
    choose_mode(problem, contacts_[k]);
  }
  residual_ = std::sqrt(residual_);
  const auto rows = change_.begin() + problem.rows;
  if (std::any_of(change_.begin(), rows, [](double by) { return by != 0.0; }))
    add_motion(problem, change_, motion_);
  for (Index k = 0; k < problem.contacts; ++k) keep_equations(contacts_[k]);
}

}  // namespace palpate
