#include "runtime/core/solve/imbalance.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

Vec3 at_contact(const ContactProblem& problem, Index contact, std::span<const double> of_rows) noexcept {
  Vec3 value = Vec3::Zero();
  const Index first = problem.first_row(contact);
  for (Index i = 0; i < problem.rows_of(contact); ++i) value[i] = of_rows[first + i];
  return value;
}

void set_contact(const ContactProblem& problem, Index contact, const Vec3& value,
                 std::span<double> of_rows) noexcept {
  const Index first = problem.first_row(contact);
  for (Index i = 0; i < problem.rows_of(contact); ++i) of_rows[first + i] = value[i];
}

/// Mean of the diagonal of W at a contact [m/N].
double own_compliance(const ContactProblem& problem, Index contact) noexcept {
  double sum = 0.0;
  for (Index i = problem.first_row(contact); i < problem.first_row(contact + 1); ++i)
    sum += problem.many ? static_cast<double>(problem.single_row(i)[i]) : problem.w(i, i);
  return sum / problem.rows_of(contact);
}

/// y += W x.
template <typename Real>
void add_product(const Real* __restrict W, std::ptrdiff_t stride, const double* __restrict x,
                 double* __restrict y, std::ptrdiff_t rows) noexcept {
  for (std::ptrdiff_t i = 0; i < rows; ++i) {
    const Real* __restrict row = W + i * stride;
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (std::ptrdiff_t j = 0; j < rows; ++j) sum += static_cast<double>(row[j]) * x[j];
    y[i] += sum;
  }
}

void add_motion(const ContactProblem& problem, const std::vector<double>& forces,
                std::vector<double>& motion) noexcept {
  if (problem.many) {
    add_product(problem.single_row(0), problem.single_stride, forces.data(), motion.data(), problem.rows);
  } else {
    add_product(problem.row(0), problem.stride, forces.data(), motion.data(), problem.rows);
  }
}

/// Alart and Curnier's projection: a normal part of at least 0, the tangential part inside the disc that it
/// allows.
Vec3 nearest_in_cone(const Vec3& n, const Vec3& force, const Vec3& tangent, double friction) noexcept {
  const double normal = std::max(0.0, n.dot(force));
  const double length = tangent.norm();
  const double share = length > friction * normal ? friction * normal / length : 1.0;
  return normal * n + share * tangent;
}

}  // namespace

Imbalance::Imbalance(Index max_contacts, Index max_rows)
    : change_(static_cast<std::size_t>(max_rows)),
      motion_(change_.size()),
      step_(change_.size()),
      mode_(static_cast<std::size_t>(max_contacts)),
      edge_(mode_.size(), Vec3::Zero()) {}

/// Computes r for the forces.
void Imbalance::find_motion(const ContactProblem& problem) noexcept {
  for (Index i = 0; i < problem.rows; ++i) {
    motion_[i] = problem.b[i];
    step_[i] = problem.many ? problem.lambda[i] - problem.guess[i] : problem.lambda[i];
  }
  add_motion(problem, step_, motion_);
}

void Imbalance::choose_mode(const ContactProblem& problem, Index contact) noexcept {
  const Vec3 f = at_contact(problem, contact, problem.lambda);
  const Vec3 r = at_contact(problem, contact, motion_) / own_compliance(problem, contact);
  Mode& mode = mode_[contact];
  mode = Mode::stick;
  Vec3 to = f;
  if (problem.held[contact] != 0) {
    const Index owner = problem.owner[contact];
    if (owner >= 0 && mode_[owner] == Mode::open) mode = Mode::open;
    residual_ += (mode == Mode::open ? f : r).squaredNorm();
  } else {
    const Vec3 n = problem.normal[contact];
    const Vec3 wanted = f - r;
    const Vec3 tangent = wanted - n.dot(wanted) * n;
    residual_ += (nearest_in_cone(n, wanted, tangent, problem.friction[contact]) - f).squaredNorm();
    const double normal = n.dot(f) > 0.0 ? n.dot(f) : n.dot(wanted);
    const double bound = problem.friction[contact] * normal;
    if (n.dot(wanted) <= 0.0) {
      mode = Mode::open;
    } else if (!(n.dot(f) > 0.0)) {
      to = n.dot(wanted) * n;
    } else if (problem.rows_of(contact) > 1 && tangent.norm() > bound) {
      mode = Mode::slip;
      edge_[contact] = n + problem.friction[contact] * tangent.normalized();
      to = normal * edge_[contact];
    }
  }
  if (mode == Mode::open) to.setZero();
  set_contact(problem, contact, to - f, change_);
}

/// Keeps the part of the motion that violates the contact's equations: all of it if it sticks; the normal
/// part if it slips, which is corrected along the edge of the cone.
void Imbalance::keep_equations(const ContactProblem& problem, Index contact) noexcept {
  if (mode_[contact] == Mode::stick) return;
  Vec3 left = Vec3::Zero();
  if (mode_[contact] == Mode::slip) {
    const Vec3& edge = edge_[contact];
    const Vec3 r = at_contact(problem, contact, motion_);
    left = problem.normal[contact].dot(r) / edge.squaredNorm() * edge;
  }
  set_contact(problem, contact, left, motion_);
}

void Imbalance::find(const ContactProblem& problem) noexcept {
  find_motion(problem);
  residual_ = 0.0;
  for (Index k = 0; k < problem.contacts; ++k) {
    mode_[k] = Mode::open;
    if (problem.rows_of(k) > 0) choose_mode(problem, k);
  }
  residual_ = std::sqrt(residual_);
  const auto rows = change_.begin() + problem.rows;
  if (std::any_of(change_.begin(), rows, [](double by) { return by != 0.0; }))
    add_motion(problem, change_, motion_);
  for (Index k = 0; k < problem.contacts; ++k) keep_equations(problem, k);
}

}  // namespace palpate
