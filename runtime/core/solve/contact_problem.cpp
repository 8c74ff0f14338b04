#include "runtime/core/solve/contact_problem.h"

#include <algorithm>

namespace palpate {

ContactProblem::ContactProblem(int d, Index max_contacts, Index max_rows, Index max_single_rows)
    : dimension(d),
      stride((max_rows + 7) / 8 * 8),
      single_stride((max_single_rows + 15) / 16 * 16),
      first(static_cast<std::size_t>(max_contacts) + 1),
      friction(max_contacts),
      normal(max_contacts, Vec3::UnitX()),
      held(max_contacts),
      owner(max_contacts),
      W(static_cast<std::size_t>(stride) * static_cast<std::size_t>(stride)),
      single_W(static_cast<std::size_t>(single_stride) * static_cast<std::size_t>(single_stride)),
      b(std::max(stride, single_stride)),
      base(b.size()),
      lambda(b.size()),
      guess(b.size()),
      prediction(b.size()) {}

void ContactProblem::clear(bool is_single) noexcept {
  contacts = 0;
  rows = 0;
  frictionless = true;
  single = is_single;
}

void ContactProblem::add(double mu, bool is_held, const Vec3& n) noexcept {
  frictionless = frictionless && (is_held || mu == 0.0);
  append(mu, is_held, -1, n, is_held || mu > 0.0 ? dimension : 1);
}

void ContactProblem::add_open() noexcept {
  append(0.0, false, -1, Vec3::UnitX(), 0);
}

void ContactProblem::add_held_row(Index owner_of) noexcept {
  append(0.0, true, owner_of, Vec3::UnitX(), 1);
}

void ContactProblem::append(double mu, bool is_held, Index owner_of, const Vec3& n, Index count) noexcept {
  const auto k = static_cast<std::size_t>(contacts++);
  friction[k] = mu;
  held[k] = is_held ? 1 : 0;
  owner[k] = owner_of;
  normal[k] = n;
  first[k] = rows;
  first[k + 1] = rows + count;
  for (Index i = rows; i < rows + count; ++i) {
    b[i] = 0.0;
    base[i] = 0.0;
    lambda[i] = 0.0;
    prediction[i] = 0.0;
  }
  rows += count;
}

double ContactProblem::normal_part(Index contact, std::span<const double> of_rows) const noexcept {
  const Vec3& n = normal[contact];
  double sum = 0.0;
  for (Index i = 0; i < rows_of(contact); ++i) sum += n[i] * of_rows[first_row(contact) + i];
  return sum;
}

double ContactProblem::gap(Index contact) const noexcept {
  const Vec3& n = normal[contact];
  double sum = 0.0;
  for (Index i = 0; i < rows_of(contact); ++i) {
    const Index at = first_row(contact) + i;
    if (n[i] == 0.0) continue;
    double r = b[at];
    with_w([&](auto w) {
      for (Index j = 0; j < rows; ++j) r += w[at][j] * (lambda[j] - base[j]);
    });
    sum += n[i] * r;
  }
  return sum;
}

}  // namespace palpate
