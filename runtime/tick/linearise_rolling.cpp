#include "runtime/tick/linearise_rolling.h"

#include <algorithm>

#include "runtime/solve/tick_tuning.h"

namespace palpate {
namespace {

bool is_closed(const State& state, const ContactProblem& problem, Index contact) noexcept {
  return problem.rows_of(contact) > 0 &&
         (state.contact_points[contact].held || problem.normal_part(contact, problem.lambda) > 0.0);
}

/// Numbers the near nodes under closed contacts; false when they are too many.
bool number_places(const State& state, Scratch& scratch) noexcept {
  std::fill_n(scratch.rolling_number.begin(), state.surface.near.count(), Index{-1});
  scratch.rolling_count = 0;
  for (Index k = 0; k < state.contact_count; ++k) {
    if (!is_closed(state, scratch.problem, k)) continue;
    for (const Index place : scratch.rows[scratch.problem.first_row(k)].places) {
      if (place < 0 || scratch.rolling_number[place] >= 0) continue;
      if (scratch.rolling_count == tuning.hand.rolling_places) return false;
      scratch.rolling_number[place] = scratch.rolling_count;
      scratch.rolling_places[scratch.rolling_count++] = place;
    }
  }
  return true;
}

void gather_response(const NearField& near, Scratch& scratch) noexcept {
  const int d = near.dimension();
  double* to = scratch.rolling_response.data();
  for (Index i = 0; i < scratch.rolling_count; ++i) {
    for (int axis = 0; axis < d; ++axis) {
      const double* from = near.row(d * scratch.rolling_places[i] + axis).data();
      for (Index j = 0; j < scratch.rolling_count; ++j)
        to = std::copy_n(from + std::ptrdiff_t{d} * scratch.rolling_places[j], d, to);
    }
  }
}

/// rolling_motion = sign Xi rolling_load.
void respond(Scratch& scratch, int dimension, double sign) noexcept {
  const std::ptrdiff_t width = std::ptrdiff_t{dimension} * scratch.rolling_count;
  double* __restrict u = scratch.rolling_motion.data();
  std::fill_n(u, width, 0.0);
  for (std::ptrdiff_t j = 0; j < width; ++j) {
    const double load = sign * scratch.rolling_load[static_cast<std::size_t>(j)];
    const double* __restrict c = scratch.rolling_response.data() + j * width;
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < width; ++i) u[i] += load * c[i];
  }
}

/// Adds factor * vector to the entries of a near node in `to`.
void add_at(const Scratch& scratch, int dimension, Index place, const Vec3& vector,
            std::vector<double>& to) noexcept {
  const Index number = place < 0 ? -1 : scratch.rolling_number[place];
  if (number < 0) return;
  for (int axis = 0; axis < dimension; ++axis) to[dimension * number + axis] += vector[axis];
}

Vec3 motion_at(const Scratch& scratch, int dimension, Index place) noexcept {
  Vec3 motion = Vec3::Zero();
  const Index number = place < 0 ? -1 : scratch.rolling_number[place];
  if (number < 0) return motion;
  for (int axis = 0; axis < dimension; ++axis)
    motion[axis] = scratch.rolling_motion[dimension * number + axis];
  return motion;
}

}  // namespace

bool begin_rolling(const State& state, Scratch& scratch, Index number) noexcept {
  const auto rolls = [&](Index k) {
    const ContactPoint& contact = state.contact_points[k];
    return contact.rolls && contact.tool == number && is_closed(state, scratch.problem, k);
  };
  bool any = false;
  for (Index k = 0; k < state.contact_count; ++k) any = any || rolls(k);
  if (!any) return false;
  if (!number_places(state, scratch)) {
    std::fill_n(scratch.rolling_number.begin(), state.surface.near.count(), Index{-1});
    scratch.rolling_count = 0;
  }
  gather_response(state.surface.near, scratch);
  return true;
}

void begin_derivative(const State& state, Scratch& scratch) noexcept {
  std::copy_n(scratch.row_change.begin(), scratch.problem.rows, scratch.device_change.begin());
  std::fill_n(scratch.rolling_motion.begin(), state.surface.near.dimension() * scratch.rolling_count, 0.0);
}

Vec3 turn_normals(const State& state, Scratch& scratch, Index number, const Vec3& motion,
                  double radius) noexcept {
  const ContactProblem& problem = scratch.problem;
  const int d = state.surface.near.dimension();
  Vec3 sum = Vec3::Zero();
  std::fill_n(scratch.rolling_load.begin(), d * scratch.rolling_count, 0.0);
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    if (!contact.rolls || contact.tool != number || !is_closed(state, problem, k)) continue;
    const ContactRow& row = scratch.rows[problem.first_row(k)];
    Vec3 relative = motion;
    for (std::size_t n = 0; n < 3; ++n) relative -= contact.weights[n] * motion_at(scratch, d, row.places[n]);
    const Vec3 normal = contact.frame.col(0);
    const Vec3 force =
        problem.lambda[problem.first_row(k)] / radius * (relative - relative.dot(normal) * normal);
    sum += force;
    for (std::size_t n = 0; n < 3; ++n)
      add_at(scratch, d, row.places[n], contact.weights[n] * force, scratch.rolling_load);
  }
  respond(scratch, d, 1.0);
  const Vec3 given_way = sum / state.tools[number].tool.coupling_stiffness;
  for (Index i = 0; i < problem.rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    double change = scratch.device_change[i];
    for (std::size_t n = 0; n < 3; ++n) change += row.body[n].dot(motion_at(scratch, d, row.places[n]));
    if (row.tool == number) change += row.force.dot(given_way);
    scratch.row_change[i] = change;
  }
  return sum;
}

void follow_forces(const State& state, Scratch& scratch) noexcept {
  const int d = state.surface.near.dimension();
  for (Index i = 0; i < scratch.problem.rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    if (scratch.force_change[i] == 0.0) continue;
    for (std::size_t n = 0; n < 3; ++n)
      add_at(scratch, d, row.places[n], scratch.force_change[i] * row.body[n], scratch.rolling_load);
  }
  respond(scratch, d, -1.0);
}

}  // namespace palpate
