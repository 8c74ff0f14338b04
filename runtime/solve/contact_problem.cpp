#include "runtime/solve/contact_problem.h"

#include <algorithm>

namespace palpate {

ContactProblem::ContactProblem(int d, Index max_contacts, Index max_rows)
    : dimension(d),
      stride((max_rows + 7) / 8 * 8),
      first(static_cast<std::size_t>(max_contacts) + 1),
      friction(max_contacts),
      held(max_contacts),
      owner(max_contacts),
      W(static_cast<std::size_t>(stride) * static_cast<std::size_t>(stride)),
      b(stride),
      lambda(stride) {}

void ContactProblem::clear() noexcept {
  contacts = 0;
  rows = 0;
  frictionless = true;
}

void ContactProblem::add(double mu, bool is_held) noexcept {
  frictionless = frictionless && (is_held || mu == 0.0);
  append(mu, is_held, -1, is_held || mu > 0.0 ? dimension : 1);
}

void ContactProblem::add_held_row(Index owner_of) noexcept {
  append(0.0, true, owner_of, 1);
}

void ContactProblem::append(double mu, bool is_held, Index owner_of, Index count) noexcept {
  const auto k = static_cast<std::size_t>(contacts++);
  friction[k] = mu;
  held[k] = is_held ? 1 : 0;
  owner[k] = owner_of;
  first[k] = rows;
  first[k + 1] = rows + count;
  for (Index i = rows; i < rows + count; ++i) {
    b[i] = 0.0;
    lambda[i] = 0.0;
  }
  rows += count;
}

}  // namespace palpate
