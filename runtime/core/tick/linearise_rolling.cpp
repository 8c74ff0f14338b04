#include "runtime/core/tick/linearise_rolling.h"

#include <algorithm>
#include <limits>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

/// Collects the closed contacts with rotating normals, and the closed rows including tilt.
void gather_contacts(const State& state, Scratch& scratch, Index number, double radius) noexcept {
  const ContactProblem& problem = scratch.problem;
  RollingScratch& rolling = scratch.changes.rolling;
  for (Index k = 0; k < problem.contacts; ++k) {
    const bool is_tilt = k >= state.contact_count;
    const ContactPoint& contact = state.contact_points[is_tilt ? problem.owner[k] : k];
    if (contact.force.isZero(0.0)) continue;
    const Index first = problem.first_row(k);
    for (Index i = first; i < problem.first_row(k + 1); ++i) rolling.following[rolling.following_count++] = i;
    if (is_tilt || !contact.rolls || contact.tool != number) continue;
    rolling.turning[rolling.turning_count++] = {.row = first,
                                                .weights = contact.weights,
                                                .normal = contact.frame.col(0),
                                                .spring = problem.lambda[first] / radius};
  }
}

/// Displacement of the near nodes by a force along an axis at a contact with a rotating normal.
template <int D>
const double* response(const NearField& near, Scratch& scratch, const RollingScratch::Turning& turning,
                       int axis) noexcept {
  const std::array<Index, 3>& places = scratch.rows[turning.row].places;
  for (std::size_t n = 0; n < 3; ++n) {
    if (turning.weights[n] == 1.0 && places[n] >= 0) return near.row(D * places[n] + axis).data();
  }
  double* y = scratch.assembly.row_response.data();
  const std::ptrdiff_t width = std::ptrdiff_t{D} * near.count();
  std::fill_n(y, width, 0.0);
  for (std::size_t n = 0; n < 3; ++n) {
    if (places[n] >= 0) add(near.row(D * places[n] + axis).data(), turning.weights[n], y, width);
  }
  return y;
}

/// Computes T and B.
template <int D>
void gather_response(const NearField& near, Scratch& scratch) noexcept {
  RollingScratch& rolling = scratch.changes.rolling;
  const std::ptrdiff_t width = std::ptrdiff_t{D} * rolling.turning_count;
  for (std::ptrdiff_t j = 0; j < width; ++j) {
    const double* y = response<D>(near, scratch, rolling.turning[j / D], static_cast<int>(j % D));
    double* to = rolling.T.data() + j * width;
    for (Index k = 0; k < rolling.turning_count; ++k, to += D) {
      const RollingScratch::Turning& turning = rolling.turning[k];
      const std::array<Index, 3>& places = scratch.rows[turning.row].places;
      std::fill_n(to, D, 0.0);
      for (std::size_t n = 0; n < 3; ++n) {
        for (int axis = 0; places[n] >= 0 && axis < D; ++axis)
          to[axis] += turning.weights[n] * y[D * places[n] + axis];
      }
    }
    for (Index k = 0; k < rolling.following_count; ++k) {
      const ContactRow& row = scratch.rows[rolling.following[k]];
      double motion = 0.0;
      for (std::size_t n = 0; n < 3; ++n) {
        for (int axis = 0; row.places[n] >= 0 && axis < D; ++axis)
          motion += row.body[n][axis] * y[D * row.places[n] + axis];
      }
      rolling.B[k * width + j] = motion;
    }
  }
}

VectorLanes zero() noexcept {
  return {Lanes::Zero(), Lanes::Zero(), Lanes::Zero()};
}

Lanes along(const VectorLanes& vectors, const Vec3& direction) noexcept {
  return vectors[0] * direction[0] + vectors[1] * direction[1] + vectors[2] * direction[2];
}

void add(const VectorLanes& vectors, VectorLanes& to) noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis) to[axis] += vectors[axis];
}

Lanes squared(const VectorLanes& vectors) noexcept {
  return vectors[0].square() + vectors[1].square() + vectors[2].square();
}

/// Motion of the tool for a unit motion of the device along each axis: that motion plus the coupling's
/// response to the change of force.
VectorLanes tool_motion(const VectorLanes& change, double coupling) noexcept {
  VectorLanes motion;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    motion[axis] = change[axis] / coupling;
    motion[axis][static_cast<Eigen::Index>(axis)] += 1.0;
  }
  return motion;
}

/// Motion of the surface relative to the tool at a contact with a rotating normal, by the changes of force so
/// far; `tool` is the tool's motion.
template <int D>
VectorLanes relative_motion(const RollingScratch& rolling, Index contact, const VectorLanes& tool) noexcept {
  VectorLanes motion = tool;
  if (!rolling.answers) return motion;
  const std::ptrdiff_t width = std::ptrdiff_t{D} * rolling.turning_count;
  const double* T = rolling.T.data() + std::ptrdiff_t{D} * contact;
  const double* B = rolling.B.data() + std::ptrdiff_t{D} * contact;
  for (std::ptrdiff_t j = 0; j < width; ++j, T += width) {
    for (std::size_t axis = 0; axis < D; ++axis) motion[axis] += T[axis] * rolling.turning_force[j];
  }
  for (Index k = 0; k < rolling.following_count; ++k, B += width) {
    for (std::size_t axis = 0; axis < D; ++axis) motion[axis] += B[axis] * rolling.row_force[k];
  }
  return motion;
}

/// Computes the forces by which normals rotate; returns their sum on the tool.
template <int D>
VectorLanes turn_normals(RollingScratch& rolling, const VectorLanes& tool) noexcept {
  VectorLanes sum = zero();
  for (Index k = 0; k < rolling.turning_count; ++k) {
    const RollingScratch::Turning& turning = rolling.turning[k];
    VectorLanes force = relative_motion<D>(rolling, k, tool);
    const Lanes normal = along(force, turning.normal);
    for (std::size_t axis = 0; axis < 3; ++axis)
      force[axis] = turning.spring * (force[axis] - turning.normal[axis] * normal);
    add(force, sum);
    for (std::size_t axis = 0; axis < D; ++axis)
      rolling.next_force[static_cast<std::size_t>(D) * static_cast<std::size_t>(k) + axis] = force[axis];
  }
  std::swap(rolling.turning_force, rolling.next_force);
  return sum;
}

/// Adds to the rows the motions of the device, and those of surface and tool by the rotation of normals.
template <int D>
void add_motion_to_rows(Scratch& scratch, const VectorLanes& given_way, Index number) noexcept {
  const RollingScratch& rolling = scratch.changes.rolling;
  const std::ptrdiff_t width = std::ptrdiff_t{D} * rolling.turning_count;
  for (Index k = 0; k < rolling.following_count; ++k) {
    const Index i = rolling.following[k];
    Lanes change = rolling.device_change[k];
    if (scratch.rows[i].tool == number) change += along(given_way, scratch.rows[i].force);
    const double* B = rolling.B.data() + k * width;
    for (std::ptrdiff_t j = 0; rolling.answers && j < width; ++j) change += B[j] * rolling.turning_force[j];
    for (int s = 0; s < D; ++s) scratch.changes.of_rows[s * scratch.problem.rows + i] = change[s];
  }
}

/// Stores the change of the contact forces; returns its sum on the tool.
template <int D>
VectorLanes take_forces(Scratch& scratch, Index number) noexcept {
  RollingScratch& rolling = scratch.changes.rolling;
  VectorLanes sum = zero();
  for (Index k = 0; k < rolling.following_count; ++k) {
    const Index i = rolling.following[k];
    Lanes by = Lanes::Zero();
    for (int s = 0; s < D; ++s) by[s] = scratch.changes.of_forces[s * scratch.problem.rows + i];
    rolling.row_force[k] = by;
    if (scratch.rows[i].tool != number) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += scratch.rows[i].force[axis] * by;
  }
  return sum;
}

/// Replaces series by their limits, assuming that they continue to shrink at the rate of the last two steps.
void go_to_limit(const VectorLanes& step, const VectorLanes& last_step, VectorLanes& change) noexcept {
  const Lanes both = step[0] * last_step[0] + step[1] * last_step[1] + step[2] * last_step[2];
  const Lanes before = squared(last_step).max(std::numeric_limits<double>::min());
  const Lanes rate = (both / before).max(-0.5).min(0.5);
  for (std::size_t axis = 0; axis < 3; ++axis) change[axis] += rate / (1.0 - rate) * step[axis];
}

template <int D>
void begin_changes(Scratch& scratch) noexcept {
  RollingScratch& rolling = scratch.changes.rolling;
  for (Index k = 0; k < rolling.following_count; ++k) {
    rolling.row_force[k].setZero();
    rolling.device_change[k].setZero();
    for (int s = 0; s < D; ++s)
      rolling.device_change[k][s] = scratch.changes.of_rows[s * scratch.problem.rows + rolling.following[k]];
  }
  for (Index j = 0; j < D * rolling.turning_count; ++j) rolling.turning_force[j].setZero();
}

template <int D>
VectorLanes change_by_rolling(Scratch& scratch, Index number, double coupling) noexcept {
  RollingScratch& rolling = scratch.changes.rolling;
  const double tolerance = tuning.hand.rolling_tolerance * tuning.hand.rolling_tolerance;
  begin_changes<D>(scratch);
  VectorLanes change = zero();
  VectorLanes step = change;
  for (int pass = 1;; ++pass) {
    const VectorLanes turned = turn_normals<D>(rolling, tool_motion(change, coupling));
    VectorLanes given_way = turned;
    for (Lanes& value : given_way) value /= coupling;
    add_motion_to_rows<D>(scratch, given_way, number);
    scratch.solver.derivative(scratch.problem, D, scratch.changes.of_rows, scratch.changes.of_forces);
    const VectorLanes last_step = step;
    step = take_forces<D>(scratch, number);
    for (std::size_t axis = 0; axis < 3; ++axis) step[axis] += turned[axis] - change[axis];
    add(step, change);
    if (!rolling.answers || (squared(step) <= tolerance * squared(change)).all()) return change;
    if (pass < tuning.hand.rolling_passes) continue;
    go_to_limit(step, last_step, change);
    return change;
  }
}

}  // namespace

bool begin_rolling(const State& state, Scratch& scratch, Index number, double radius) noexcept {
  RollingScratch& rolling = scratch.changes.rolling;
  rolling.turning_count = 0;
  rolling.following_count = 0;
  const auto contacts = state.contacts();
  if (std::none_of(contacts.begin(), contacts.end(), [&](const ContactPoint& contact) {
        return contact.rolls && contact.tool == number && !contact.force.isZero(0.0);
      }))
    return false;
  gather_contacts(state, scratch, number, radius);
  rolling.answers = rolling.turning_count <= tuning.hand.most_turning &&
                    rolling.following_count <= tuning.hand.most_following;
  if (!rolling.answers) return true;
  if (state.surface.near.dimension() == 3) {
    gather_response<3>(state.surface.near, scratch);
  } else {
    gather_response<2>(state.surface.near, scratch);
  }
  return true;
}

Eigen::Matrix3d force_change_by_rolling(const State& state, Scratch& scratch, Index number) noexcept {
  const double coupling = state.tools[number].tool.coupling_stiffness;
  const VectorLanes change = scratch.problem.dimension == 3 ? change_by_rolling<3>(scratch, number, coupling)
                                                            : change_by_rolling<2>(scratch, number, coupling);
  Eigen::Matrix3d by_motion = Eigen::Matrix3d::Zero();
  for (int s = 0; s < scratch.problem.dimension; ++s) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      by_motion(static_cast<Eigen::Index>(axis), s) = change[axis][s];
  }
  return by_motion;
}

}  // namespace palpate
