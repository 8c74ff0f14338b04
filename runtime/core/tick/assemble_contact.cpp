#include "runtime/core/tick/assemble_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"
#include "runtime/core/tick/contact_merging.h"
#include "runtime/core/tick/contact_rows.h"

namespace palpate {
namespace {

/// Compliance of the body at a contact along its normal; for a held one the smallest of its rows.
template <typename Real>
double least_give(const ContactProblem& problem, MatrixRows<Real> W, Index k) noexcept {
  const Index first = problem.first_row(k);
  const Index rows = problem.rows_of(k);
  double give = 0.0;
  if (problem.held[k] != 0) {
    give = W[first][first];
    for (Index i = first + 1; i < first + rows; ++i) give = std::min<double>(give, W[i][i]);
    return give;
  }
  const Vec3& n = problem.normal[k];
  for (Index i = 0; i < rows; ++i) {
    for (Index j = 0; j < rows; ++j) give += n[i] * n[j] * W[first + i][first + j];
  }
  return give;
}

/// Marks the contacts that press on or hold a rigid part of the body. Call before the couplings are added to
/// W.
template <typename Real>
void note_rigid_contacts(State& state, const ContactProblem& problem, MatrixRows<Real> W) noexcept {
  for (Index k = 0; k < state.contact_count; ++k) {
    ContactPoint& contact = state.contact_points[k];
    contact.rigid = problem.rows_of(k) > 0 && least_give(problem, W, k) < state.surface.least_compliance;
  }
}

bool is_coupled(const Tool& tool) noexcept {
  return std::isfinite(tool.coupling_stiffness) || std::isfinite(tool.coupling_torsion);
}

/// Computes the forces and moments of a tool's rows, each multiplied by the root of the coupling's
/// compliance: one component after the other.
template <typename Real>
void fill_coupling(const Tool& tool, Index number, const Scratch& scratch, Real* coupling) noexcept {
  const double force_scale = 1.0 / std::sqrt(tool.coupling_stiffness);
  const double moment_scale = 1.0 / std::sqrt(tool.coupling_torsion);
  const Index rows = scratch.problem.rows;
  for (Index i = 0; i < rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    const double is_of_tool = row.tool == number ? 1.0 : 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      coupling[axis * rows + i] = static_cast<Real>(is_of_tool * force_scale * row.force[axis]);
      coupling[(3 + axis) * rows + i] = static_cast<Real>(is_of_tool * moment_scale * row.moment[axis]);
    }
  }
}

/// Compliance of the couplings: W = W of the body + J_tool C_tool J_tool^T.
template <typename Real>
void couple(const State& state, Scratch& scratch, MatrixRows<Real> W) noexcept {
  const Index rows = scratch.problem.rows;
  MatrixRows<Real> body = scratch.assembly.compliance.body(W);
  auto& coupling = std::get<std::vector<Real>>(scratch.assembly.coupling);
  for (std::size_t k = 0; k < state.tools.size(); ++k) {
    const Tool& tool = state.tools[k].tool;
    if (!is_coupled(tool)) continue;
    fill_coupling(tool, static_cast<Index>(k), scratch, coupling.data());
    const Real* __restrict c = coupling.data();
    for (Index j = 0; j < rows; ++j) {
      const Real* from = body[j];
      Real* to = W[j];
      std::array<Real, 6> by{};
      for (std::size_t axis = 0; axis < 6; ++axis) by[axis] = c[static_cast<Index>(axis) * rows + j];
#pragma omp simd
      for (Index i = 0; i < rows; ++i) {
        to[i] = from[i] + by[0] * c[i] + by[1] * c[rows + i] + by[2] * c[2 * rows + i] +
                by[3] * c[3 * rows + i] + by[4] * c[4 * rows + i] + by[5] * c[5 * rows + i];
      }
      std::fill(to + rows, to + std::min<std::ptrdiff_t>(scratch.problem.padded_rows(), W.stride), Real{0});
    }
    body = W;
  }
}

/// Part of a row's own compliance that is in double for split precision: e^T left right^T e.
double exact_compliance(const ElasticBody& body, const NearField& near, const ContactRow& row) noexcept {
  const Greens& greens = body.greens();
  const ExactTerms* exact = greens.exact_terms();
  if (exact == nullptr || greens.precision() != Precision::split_precision) return 0.0;
  const auto terms = static_cast<std::ptrdiff_t>(exact->count);
  std::array<double, most_exact_terms> left, right;
  std::fill_n(left.begin(), terms, 0.0);
  std::fill_n(right.begin(), terms, 0.0);
  const auto add_node = [&](Index node, const Vec3& e) {
    const SurfaceParts parts = body.surface_parts(node);
    for (std::size_t k = 0; k < parts.stored.size(); ++k) {
      for (int axis = 0; axis < greens.dimension(); ++axis) {
        const std::int64_t dof = std::int64_t{greens.dimension()} * parts.stored[k] + axis;
        const double factor = parts.weights[k] * e[axis];
        add(exact->left_row(dof), factor, left.data(), terms);
        add(exact->right_row(dof), factor, right.data(), terms);
      }
    }
  };
  for (std::size_t n = 0; n < 3; ++n) {
    if (row.places[n] < 0) continue;
    if (near.is_group(row.places[n])) {
      near.for_each_member(row.places[n], [&](Index node, double, const Eigen::Matrix3d& map) {
        add_node(node, map * row.body[n]);
      });
    } else {
      add_node(near.node(row.places[n]), row.body[n]);
    }
  }
  return dot(left.data(), right.data(), terms);
}

constexpr double exact_rounding = std::numeric_limits<double>::epsilon();

/// Largest effect of rounding on a row's own compliance.
double rounding_of(const ElasticBody& body, const NearField& near, const ContactRow& row, double w) noexcept {
  const double exact = exact_compliance(body, near, row);
  return 4.0 * (body.greens().rounding() * std::max(w - exact, 0.0) + exact_rounding * std::abs(exact));
}
double rounding_of(const ElasticBody& /*body*/, const NearField& /*near*/, const ContactRow& /*row*/,
                   float w) noexcept {
  return 4.0 * std::numeric_limits<float>::epsilon() * w;
}

/// Contact points that nearly coincide make W nearly singular; rounding must not make it indefinite. Where
/// next to nothing gives way a rigid tool would be given a force beyond all measure: there it presses on a
/// wall that gives way a little. What all that gives way along a tangent it gives from the guess: friction
/// that sticks would creep by it in every tick.
template <typename Real>
void regularise(const ElasticBody& body, const State& state, Scratch& scratch, MatrixRows<Real> W) noexcept {
  ContactProblem& problem = scratch.problem;
  for (Index k = 0; k < problem.contacts; ++k) {
    const Index first = problem.first_row(k);
    const Index rows = problem.rows_of(k);
    double give = state.surface.rigid_compliance;
    if (k < state.contact_count && rows > 0)
      give = std::max(give, state.surface.least_compliance - least_give(problem, W, k));
    double rounding = 0.0;  // alike along all axes: what acts along the normal is not to move the tangents
    for (Index i = first; i < first + rows; ++i)
      rounding = std::max(rounding, rounding_of(body, state.surface.near, scratch.rows[i], W[i][i]));
    give += rounding;
    const double along_normal = problem.normal_part(k, problem.lambda);
    for (Index i = first; i < first + rows; ++i) {
      W[i][i] += static_cast<Real>(give + scratch.assembly.tilt_spring[i]);
      if (problem.held[k] == 0)
        problem.b[i] +=
            give * (problem.base[i] - problem.lambda[i] + along_normal * problem.normal[k][i - first]);
    }
  }
}

/// Motion of the surface along the rows as it goes back to where it is without forces.
void add_unloading(const NearField& near, Scratch& scratch) noexcept {
  for (Index i = 0; i < scratch.problem.rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    for (std::size_t n = 0; n < 3; ++n) {
      if (row.places[n] < 0) continue;
      scratch.problem.b[i] += row.body[n].dot(near.displacement(row.places[n]) - near.offset(row.places[n]));
    }
  }
}

/// Adds the motion of the surface along the rows by the change from the forces that act on it to the guess:
/// contact points have vanished, or act on other nodes.
void add_change_of_forces(const NearField& near, Scratch& scratch) noexcept {
  ContactProblem& problem = scratch.problem;
  const int d = near.dimension();
  const std::ptrdiff_t width = std::ptrdiff_t{d} * near.count();
  std::fill_n(scratch.assembly.guess_force.begin(), width, 0.0);
  for (Index i = 0; i < problem.rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    for (std::size_t n = 0; n < 3; ++n) {
      if (row.places[n] < 0) continue;
      for (int axis = 0; axis < d; ++axis)
        scratch.assembly.guess_force[d * row.places[n] + axis] -= problem.lambda[i] * row.body[n][axis];
    }
  }
  std::fill_n(scratch.assembly.row_response.begin(), width, 0.0);
  bool changed = false;
  for (Index place = 0; place < near.count(); ++place) {
    const Vec3 force = near.force(place);
    for (int axis = 0; axis < d; ++axis) {
      const double change = scratch.assembly.guess_force[d * place + axis] - force[axis];
      if (std::abs(change) <= 1e-12 * force.lpNorm<1>()) continue;
      add(near.row(d * place + axis).data(), change, scratch.assembly.row_response.data(), width);
      changed = true;
    }
  }
  for (Index i = 0; changed && i < problem.rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    for (std::size_t n = 0; n < 3; ++n) {
      for (int axis = 0; row.places[n] >= 0 && axis < d; ++axis)
        problem.b[i] -= row.body[n][axis] * scratch.assembly.row_response[d * row.places[n] + axis];
    }
  }
}

/// Adds the stretch of the couplings by the guess.
void add_stretch(const State& state, Scratch& scratch) noexcept {
  ContactProblem& problem = scratch.problem;
  for (std::size_t k = 0; k < state.tools.size(); ++k) {
    const Tool& tool = state.tools[k].tool;
    Vec3 force = Vec3::Zero();
    Vec3 torque = Vec3::Zero();
    const auto is_of_tool = [&](Index i) { return scratch.rows[i].tool == static_cast<Index>(k); };
    for (Index i = 0; i < problem.rows; ++i) {
      if (!is_of_tool(i)) continue;
      force += problem.lambda[i] * scratch.rows[i].force;
      torque += problem.lambda[i] * scratch.rows[i].moment;
    }
    force /= tool.coupling_stiffness;
    torque /= tool.coupling_torsion;
    for (Index i = 0; i < problem.rows; ++i) {
      if (is_of_tool(i))
        problem.b[i] += scratch.rows[i].force.dot(force) + scratch.rows[i].moment.dot(torque);
    }
  }
}

/// True if there are more contacts than the direct solvers take, by the number of contact points and of those
/// that carried force.
bool are_many(const State& state, const LastContacts& remembered) noexcept {
  const std::span<const ContactPoint> contacts = state.contacts();
  const bool frictionless = std::all_of(contacts.begin(), contacts.end(), [](const ContactPoint& contact) {
    return contact.held || contact.friction == 0.0;
  });
  const auto last = std::span(remembered.contacts).first(static_cast<std::size_t>(remembered.count));
  const auto closed = std::count_if(last.begin(), last.end(), [](const ContactPoint& contact) {
    return !contact.held && !contact.force.isZero(0.0);
  });
  return ContactSolver::are_many(state.contact_count, static_cast<Index>(closed), frictionless);
}

}  // namespace

void assemble_contact(const ElasticBody& body, State& state, Scratch& scratch, Pass pass) noexcept {
  ContactProblem& problem = scratch.problem;
  const NearField& near = state.surface.near;
  hand_over_merged(body, state, scratch);
  problem.clear(are_many(state, scratch.last));
  std::fill(scratch.assembly.tilt_spring.begin(), scratch.assembly.tilt_spring.end(), 0.0);
  const double edge = body.mean_surface_edge();
  add_contacts(body, state, scratch, edge, pass);
  const Index first_tilt_row = problem.rows;
  add_tilts(body, state, scratch, edge);
  std::copy_n(problem.lambda.begin(), problem.rows, problem.guess.begin());
  if (problem.single) {
    std::copy_n(problem.lambda.begin(), problem.rows, problem.base.begin());
    add_change_of_forces(near, scratch);
    add_stretch(state, scratch);
  } else {
    add_unloading(near, scratch);
  }
  const bool coupled = std::any_of(state.tools.begin(), state.tools.end(),
                                   [](const ToolState& tool) { return is_coupled(tool.tool); });
  BodyCompliance& compliance = scratch.assembly.compliance;
  compliance.assemble(near, scratch.rows, first_tilt_row, coupled, problem);
  problem.with_w([&](auto W) {
    note_rigid_contacts(state, problem, compliance.body(W));
    couple(state, scratch, W);
    regularise(body, state, scratch, W);
  });
  HighWater& most = scratch.high_water;
  most.contact_points = std::max(most.contact_points, state.contact_count);
  most.unknowns = std::max(most.unknowns, problem.rows);
  most.near_nodes = std::max(most.near_nodes, near.count());
}

}  // namespace palpate
