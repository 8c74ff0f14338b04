#include "runtime/core/solve/contact_part.h"

#include <algorithm>
#include <cmath>

#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr double least_pivot = 1e-12;  // relative to the row's own compliance; smaller: linearly dependent

bool is_held(const ContactProblem& whole, Index contact) noexcept {
  return whole.held[contact] != 0;
}

}  // namespace

ContactPart::ContactPart(Index max_contacts, Index max_rows)
    : problem(3, max_contacts, max_rows),
      stride_((std::ptrdiff_t{max_rows} + 7) / 8 * 8),
      in_(max_contacts),
      row_(max_rows),
      held_row_(max_rows),
      L_(static_cast<std::size_t>(max_rows) * static_cast<std::size_t>(stride_)),
      inverse_(max_rows),
      X_(L_.size()),
      y_(max_rows) {}

bool ContactPart::choose_closed(const ContactProblem& whole) noexcept {
  bool any = false;
  for (Index k = 0; k < whole.contacts; ++k) {
    const bool closed = !is_held(whole, k) && whole.lambda[whole.first_row(k)] > 0.0;
    in_[k] = closed ? 1 : 0;
    any = any || closed;
  }
  return any;
}

void ContactPart::choose_all(const ContactProblem& whole) noexcept {
  std::fill_n(in_.begin(), whole.contacts, 1);
}

bool ContactPart::take_in_penetrated(const ContactProblem& whole, double force) noexcept {
  bool any = false;
  for (Index k = 0; k < whole.contacts; ++k) {
    if (is_held(whole, k) || in_[k] != 0) continue;
    const Index row = whole.first_row(k);
    const double gap = whole.b[row] + dot(whole.row(row), whole.lambda.data(), whole.rows);
    if (-gap <= force * whole.w(row, row)) continue;
    in_[k] = 1;
    any = true;
  }
  return any;
}

void ContactPart::gather(const ContactProblem& whole, bool with_friction) noexcept {
  problem.clear();
  problem.dimension = whole.dimension;
  held_rows_ = 0;
  for (Index k = 0; k < whole.contacts; ++k) {
    const auto contact = static_cast<std::size_t>(k);
    const Index first = whole.first_row(k);
    if (is_held(whole, k)) {
      const Index owner = whole.owner[contact];
      if (owner >= 0 && in_[owner] == 0) continue;
      for (Index i = 0; i < whole.rows_of(k); ++i) held_row_[held_rows_++] = first + i;
      continue;
    }
    if (in_[contact] == 0) continue;
    const Index begin = problem.rows;
    problem.add(with_friction ? whole.friction[contact] : 0.0, false);
    for (Index i = begin; i < problem.rows; ++i) row_[i] = first + i - begin;
  }
  for (Index i = 0; i < problem.rows; ++i) {
    const Index row = row_[i];
    const double* w = whole.row(row);
    for (Index j = 0; j < problem.rows; ++j) problem.w(i, j) = w[row_[j]];
    problem.b[i] = whole.b[row];
    problem.lambda[i] = whole.lambda[row];
  }
  eliminate_held(whole);
}

/// Eliminates row by row of L; the Schur complement at the end.
void ContactPart::eliminate_held(const ContactProblem& whole) noexcept {
  for (Index i = 0; i < held_rows_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double* w = whole.row(held_row_[at]);
    double* l = factor_row(i);
    double* x = coupling_row(i);
    for (Index j = 0; j < i; ++j) {
      l[j] = (w[held_row_[j]] - dot(l, factor_row(j), j)) * inverse_[j];
    }
    const double own = w[held_row_[at]];
    const double pivot = own - dot(l, l, i);
    inverse_[at] = pivot > least_pivot * own ? 1.0 / std::sqrt(pivot) : 0.0;
    for (Index j = 0; j < problem.rows; ++j) x[j] = w[row_[j]];
    double y = whole.b[held_row_[at]];
    for (Index j = 0; j < i; ++j) {
      subtract(coupling_row(j), l[j], x, problem.rows);
      y -= l[j] * y_[j];
    }
    for (Index j = 0; j < problem.rows; ++j) x[j] *= inverse_[at];
    y_[at] = y * inverse_[at];
    subtract(x, y_[at], problem.b.data(), problem.rows);
    for (Index j = 0; j < problem.rows; ++j)
      subtract(x, x[j], problem.W.data() + std::ptrdiff_t{j} * problem.stride, problem.rows);
  }
}

/// Computes lambda_h = -L^-T (y + X lambda_c).
void ContactPart::solve_held(std::span<const double> change, std::span<double> lambda) noexcept {
  for (Index i = 0; i < held_rows_; ++i) y_[i] += dot(coupling_row(i), change.data(), problem.rows);
  for (Index i = held_rows_; i-- > 0;) {
    const auto at = static_cast<std::size_t>(i);
    const double value = y_[at] * inverse_[at];
    lambda[held_row_[at]] = -value;
    subtract(factor_row(i), value, y_.data(), i);
  }
}

void ContactPart::spread(ContactProblem& whole) noexcept {
  std::fill_n(whole.lambda.begin(), whole.rows, 0.0);
  for (Index i = 0; i < problem.rows; ++i) {
    whole.lambda[row_[i]] = problem.lambda[i];
  }
  solve_held(problem.lambda, whole.lambda);
}

void ContactPart::gather_change(std::span<const double> db, std::span<double> change) noexcept {
  for (Index i = 0; i < problem.rows; ++i) change[i] = db[row_[i]];
  for (Index i = 0; i < held_rows_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    y_[at] = (db[held_row_[at]] - dot(factor_row(i), y_.data(), i)) * inverse_[at];
    subtract(coupling_row(i), y_[at], change.data(), problem.rows);
  }
}

void ContactPart::spread_change(std::span<const double> change, std::span<double> dlambda) noexcept {
  for (Index i = 0; i < problem.rows; ++i) dlambda[row_[i]] = change[i];
  solve_held(change, dlambda);
}

}  // namespace palpate
