#include "runtime/core/tick/assemble_contact.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"
#include "runtime/core/tick/contact_merging.h"
#include "runtime/core/tick/rolling.h"
#include "runtime/core/touch/contact_nodes.h"
#include "runtime/core/touch/tool_geometry.h"

namespace palpate {
namespace {

/// Returns the places of the contact's nodes in the near field.
std::array<Index, 3> places_of(const ElasticBody& body, const NearField& near,
                               const ContactPoint& contact) noexcept {
  std::array<Index, 3> places{-1, -1, -1};
  if (contact.aggregate >= 0) {
    places[0] = near.place_of(body.aggregate_node(contact.aggregate));
    return places;
  }
  for (std::size_t n = 0; n < 3; ++n) {
    if (contact.nodes[n] >= 0) places[n] = near.place_of(contact.nodes[n]);
  }
  return places;
}

ContactRow contact_row(const ElasticBody& body, const NearField& near, const ContactPoint& contact,
                       const Vec3& direction) noexcept {
  ContactRow row{.places = places_of(body, near, contact),
                 .body = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()},
                 .tool = contact.tool,
                 .force = direction,
                 .moment = contact.rolls ? Vec3::Zero() : Vec3(contact.arm.cross(direction))};
  for (std::size_t n = 0; n < 3; ++n) {
    if (row.places[n] >= 0) row.body[n] = contact.weights[n] * direction;
  }
  return row;
}

/// Row of the radius times the slope along a tangent; if the contact rolls, including the motion of the tool.
ContactRow tilt_row(const ElasticBody& body, const NearField& near, const ContactPoint& contact,
                    double radius, const Vec3& tangent) noexcept {
  ContactRow row;
  if (contact.rolls) row = contact_row(body, near, contact, tangent);
  row.places = places_of(body, near, contact);
  for (std::size_t n = 0; n < 3; ++n) {
    if (row.places[n] >= 0) row.body[n] -= radius * contact.slope[n].dot(tangent) * contact.frame.col(0);
  }
  return row;
}

/// Motion along a row if the body's surface returned to its position without forces.
double unloading(const NearField& near, const ContactRow& row) noexcept {
  double motion = 0.0;
  for (std::size_t n = 0; n < 3; ++n) {
    if (row.places[n] >= 0)
      motion += row.body[n].dot(near.displacement(row.places[n]) - near.offset(row.places[n]));
  }
  return motion;
}

/// Motion of the surface itself along a tangent since the last tick, which the initial positions of this tick
/// include: slip is that of the surface under the tool, whatever moves it.
double free_slip(const ElasticBody& body, const SurfaceState& surface, const ContactPoint& contact,
                 const Vec3& tangent) noexcept {
  if (!surface.motion.active()) return 0.0;
  double motion = 0.0;
  for_each_node(body, surface.near, contact, [&](Index node, double weight) {
    motion += weight * tangent.dot(surface.motion.change(node));
  });
  return motion;
}

/// Returns the same contact of the last tick; null if there is none.
const ContactPoint* same_contact(const LastContacts& remembered, const ContactPoint& contact) noexcept {
  const Index number = remembered.number_of(contact.feature);
  return number < 0 ? nullptr : &remembered.contacts[number];
}

/// Relative motion of a contact's tool and surface in the tick if no force changes, plus their distance; its
/// component along n is the gap.
Vec3 motion_of(const ElasticBody& body, const State& state, const Scratch& scratch,
               const ContactPoint& contact, const ContactPoint* last) noexcept {
  const ToolState& tool = state.tools[contact.tool];
  Vec3 motion = device_motion(tool.pose, tool.device, contact.arm);
  if (contact.held) return motion + tool.pose.position + contact.arm - contact.position;
  const Vec3 n = contact.frame.col(0);
  motion += contact.gap * n;
  Vec3 slip = Vec3::Zero();
  for (int i = 1; scratch.is_first_pass && i < scratch.problem.dimension; ++i)
    slip -= free_slip(body, state.surface, contact, contact.frame.col(i)) * contact.frame.col(i);
  if (last != nullptr) slip += last->carry - n.dot(last->carry) * n;
  return motion + slip;
}

/// Data of a contact before it is added to the problem.
UpcomingContact announce(const ElasticBody& body, const State& state, const Scratch& scratch,
                         const ContactPoint& contact, double least_gap) noexcept {
  UpcomingContact upcoming{.last = scratch.last.number_of(contact.feature)};
  const ContactPoint* last = upcoming.last < 0 ? nullptr : &scratch.last.contacts[upcoming.last];
  upcoming.motion = motion_of(body, state, scratch, contact, last);
  upcoming.stays_open = !contact.held && (last == nullptr || last->force.isZero(0.0)) &&
                        upcoming.motion.dot(contact.frame.col(0)) > least_gap;
  return upcoming;
}

/// Chooses the contact at each place after the held ones: contacts of the last tick keep their places, so
/// that their rows of W are kept; those that stay open come last.
void choose_order(const State& state, AssemblyScratch& assembly) noexcept {
  const Index begin = state.held_count;
  const Index count = state.contact_count;
  const auto upcoming = assembly.upcoming.begin();
  const auto stays_open = [](const UpcomingContact& contact) { return contact.stays_open; };
  Index end = count - static_cast<Index>(std::count_if(upcoming + begin, upcoming + count, stays_open));
  std::fill(assembly.order.begin() + begin, assembly.order.begin() + end, -1);
  for (Index k = begin; k < count; ++k) {
    UpcomingContact& contact = assembly.upcoming[k];
    if (contact.stays_open || contact.last < begin || contact.last >= end) continue;
    contact.has_place = assembly.order[contact.last] < 0;
    if (contact.has_place) assembly.order[contact.last] = k;
  }
  Index next = begin;
  for (Index k = begin; k < count; ++k) {
    const UpcomingContact& contact = assembly.upcoming[k];
    if (contact.has_place) continue;
    if (contact.stays_open) {
      assembly.order[end++] = k;
      continue;
    }
    while (assembly.order[next] >= 0) ++next;
    assembly.order[next] = k;
  }
}

/// Moves the contact at order[k] to k, along the cycles of the order, which is consumed.
void bring_into_order(State& state, AssemblyScratch& assembly) noexcept {
  for (Index first = state.held_count; first < state.contact_count; ++first) {
    if (assembly.order[first] == first) continue;
    const ContactPoint contact = state.contact_points[first];
    const UpcomingContact upcoming = assembly.upcoming[first];
    Index to = first;
    for (Index from = assembly.order[to]; from != first; from = assembly.order[to]) {
      state.contact_points[to] = state.contact_points[from];
      assembly.upcoming[to] = assembly.upcoming[from];
      assembly.order[to] = to;
      to = from;
    }
    state.contact_points[to] = contact;
    assembly.upcoming[to] = upcoming;
    assembly.order[to] = to;
  }
}

/// With many contacts, those with friction and held ones have a row per axis, so that their compliance is
/// that of their nodes and does not depend on the normals.
void add_one_of_many(const ElasticBody& body, const SurfaceState& surface, Scratch& scratch,
                     const ContactPoint& contact, const UpcomingContact& upcoming) noexcept {
  ContactProblem& problem = scratch.problem;
  const ContactPoint* last = upcoming.last < 0 ? nullptr : &scratch.last.contacts[upcoming.last];
  if (upcoming.stays_open) return problem.add_open();
  const Index first = problem.rows;
  const bool has_axes = contact.held || contact.friction > 0.0;
  problem.add(contact.friction, contact.held, has_axes ? Vec3(contact.frame.col(0)) : Vec3::UnitX());
  for (Index i = first; i < problem.rows; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3 direction = has_axes ? Vec3::Unit(i - first) : Vec3(contact.frame.col(0));
    scratch.rows[at] = contact_row(body, surface.near, contact, direction);
    problem.b[at] = direction.dot(upcoming.motion);
    if (last != nullptr) problem.lambda[at] = direction.dot(last->force);
  }
}

/// Brings the responses of the last tick into the order of this one.
void hand_on_responses(AssemblyScratch& assembly, Index count) noexcept {
  std::swap(assembly.response, assembly.last_response);
  for (Index k = 0; k < count; ++k) {
    const Index last = assembly.upcoming[k].last;
    if (last >= 0 && last < assembly.response_count) {
      assembly.response[k] = assembly.last_response[last];
    } else {
      assembly.response[k].setZero();
    }
  }
  assembly.response_count = count;
}

/// Predicts the change of the forces by the motion of the tools, to first order, from the results of
/// linearise.
void predict(const State& state, Scratch& scratch) noexcept {
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    const ToolState& tool = state.tools[contact.tool];
    const Vec3 change = scratch.assembly.response[k] * (tool.device.position - tool.last_device.position);
    const Index first = scratch.problem.first_row(k);
    for (Index i = first; i < first + scratch.problem.rows_of(k); ++i)
      scratch.problem.prediction[i] = scratch.rows[i].force.dot(change);
  }
}

void add_many(const ElasticBody& body, State& state, Scratch& scratch, double least_gap) noexcept {
  for (Index k = 0; k < state.contact_count; ++k)
    scratch.assembly.upcoming[k] = announce(body, state, scratch, state.contact_points[k], least_gap);
  choose_order(state, scratch.assembly);
  bring_into_order(state, scratch.assembly);
  for (Index k = 0; k < state.contact_count; ++k)
    add_one_of_many(body, state.surface, scratch, state.contact_points[k], scratch.assembly.upcoming[k]);
  hand_on_responses(scratch.assembly, state.contact_count);
  if (scratch.is_first_pass) predict(state, scratch);
}

void add_one_of_few(const ElasticBody& body, const State& state, Scratch& scratch,
                    const ContactPoint& contact) noexcept {
  ContactProblem& problem = scratch.problem;
  const ContactPoint* last = same_contact(scratch.last, contact);
  const Index first = problem.rows;
  problem.add(contact.friction, contact.held);
  const ToolState& tool = state.tools[contact.tool];
  Vec3 motion = device_motion(tool.pose, tool.device, contact.arm);
  if (contact.held) motion += tool.pose.position + contact.arm - contact.position;
  for (Index i = first; i < problem.rows; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3 direction = contact.frame.col(i - first);
    scratch.rows[at] = contact_row(body, state.surface.near, contact, direction);
    problem.b[at] = direction.dot(motion) + unloading(state.surface.near, scratch.rows[at]);
    if (i == first && !contact.held) problem.b[at] += contact.gap;
    if (i > first && !contact.held && scratch.is_first_pass)
      problem.b[at] -= free_slip(body, state.surface, contact, direction);
    if (last != nullptr) problem.lambda[at] = direction.dot(last->force);
  }
}

/// Normal force for a contact's tilt: its own in the last tick or, if it has just become another vertex, edge
/// or face, the mean of its tool's.
double normal_force(const LastContacts& remembered, const ContactPoint& contact, const ContactPoint* last,
                    double closed) noexcept {
  if (last != nullptr) return last->force.dot(last->frame.col(0));
  if (contact.gap > closed) return 0.0;
  double sum = 0.0;
  double count = 0.0;
  for (Index k = 0; k < remembered.count; ++k) {
    const ContactPoint& other = remembered.contacts[k];
    const double force = other.force.dot(other.frame.col(0));
    if (other.tool != contact.tool || other.held || force <= 0.0) continue;
    sum += force;
    count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

void add_tilt(const ElasticBody& body, const State& state, Scratch& scratch, Index number, double force,
              double edge) noexcept {
  const ContactPoint& contact = state.contact_points[number];
  const ToolState& tool = state.tools[contact.tool];
  const double radius = rolling_radius(tool.tool, edge);
  const auto nodes =
      std::count_if(contact.nodes.begin(), contact.nodes.end(), [](Index node) { return node >= 0; });
  if (contact.held || scratch.problem.rows_of(number) == 0 || nodes < 2 || !(force * radius > 0.0)) return;
  const auto add = [&](const Vec3& tangent) {
    const auto at = static_cast<std::size_t>(scratch.problem.rows);
    scratch.problem.add_held_row(number);
    scratch.rows[at] = tilt_row(body, state.surface.near, contact, radius, tangent);
    if (!scratch.problem.many) scratch.problem.b[at] = unloading(state.surface.near, scratch.rows[at]);
    if (contact.rolls) scratch.problem.b[at] += tangent.dot(tool.device.position - tool.pose.position);
    scratch.assembly.tilt_spring[at] = radius / force;
  };
  if (nodes == 3) {
    add(contact.frame.col(1));
    add(contact.frame.col(2));
  } else {
    const auto end =
        std::find_if(contact.nodes.begin(), contact.nodes.end(), [](Index node) { return node >= 0; });
    add(contact.slope[end - contact.nodes.begin()].normalized());
  }
}

/// Index of a row's node if it has exactly one; -1 otherwise.
int only_node(const ContactRow& row) noexcept {
  int only = -1;
  for (int n = 0; n < 3; ++n) {
    if (row.places[static_cast<std::size_t>(n)] < 0) continue;
    if (only >= 0) return -1;
    only = n;
  }
  return only;
}

/// Three numbers of a node, and a fourth one that is ignored.
using Four [[gnu::vector_size(4 * sizeof(double))]] = double;

void read(const double* numbers, Four& four) noexcept {
  std::memcpy(&four, numbers, sizeof(four));
}

/// W = J Xi J^T for rows with one node each: uses only the required entries of Xi.
template <int D>
void assemble_between_nodes(const NearField& near, Scratch& scratch) noexcept {
  ContactProblem& problem = scratch.problem;
  const auto rows = static_cast<std::size_t>(problem.rows);
  for (std::size_t i = 0; i < rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    const auto n = static_cast<std::size_t>(only_node(row));
    const Vec3& body = row.body[n];
    scratch.assembly.row_first[i] = std::ptrdiff_t{D} * row.places[n];
    scratch.assembly.row_body[i] = {body.x(), body.y(), D == 3 ? body.z() : 0.0, 0.0};
  }
  for (std::size_t j = 0; j < rows; ++j) {
    const std::array<double, 4>& f = scratch.assembly.row_body[j];
    std::array<const double*, D> c;
    for (std::size_t axis = 0; axis < D; ++axis)
      c[axis] = near.row(static_cast<Index>(scratch.assembly.row_first[j]) + static_cast<Index>(axis)).data();
    for (std::size_t i = j; i < rows; ++i) {
      const std::ptrdiff_t first = scratch.assembly.row_first[i];
      Four w{};
      Four numbers;
      for (std::size_t axis = 0; axis < D; ++axis) {
        read(c[axis] + first, numbers);
        w += f[axis] * numbers;
      }
      read(scratch.assembly.row_body[i].data(), numbers);
      w *= numbers;
      const double sum = D == 3 ? w[0] + w[1] + w[2] : w[0] + w[1];
      problem.w(static_cast<Index>(i), static_cast<Index>(j)) = sum;
      problem.w(static_cast<Index>(j), static_cast<Index>(i)) = sum;
    }
  }
}

/// W = J Xi J^T, by y = Xi J^T row by row; D is the number of dofs per node.
template <int D>
void assemble_body_compliance(const NearField& near, Scratch& scratch) noexcept {
  ContactProblem& problem = scratch.problem;
  const auto end = scratch.rows.begin() + problem.rows;
  if (std::all_of(scratch.rows.begin(), end, [](const ContactRow& row) { return only_node(row) >= 0; }))
    return assemble_between_nodes<D>(near, scratch);
  double* __restrict y = scratch.assembly.row_response.data();
  const std::ptrdiff_t width = std::ptrdiff_t{D} * near.count();
  for (Index j = 0; j < problem.rows; ++j) {
    const ContactRow& by = scratch.rows[j];
    std::fill_n(y, width, 0.0);
    for (std::size_t n = 0; n < 3; ++n) {
      if (by.places[n] < 0) continue;
      for (int axis = 0; axis < D; ++axis) {
        const double factor = by.body[n][axis];
        const double* __restrict c = near.row(D * by.places[n] + axis).data();
#pragma omp simd
        for (std::ptrdiff_t k = 0; k < width; ++k) y[k] += factor * c[k];
      }
    }
    for (Index i = j; i < problem.rows; ++i) {
      const ContactRow& at = scratch.rows[i];
      double w = 0.0;
      for (std::size_t n = 0; n < 3; ++n) {
        const double* u = y + D * std::ptrdiff_t{std::max<Index>(at.places[n], 0)};
        for (int axis = 0; axis < D; ++axis) w += at.body[n][axis] * u[axis];
      }
      problem.w(i, j) = w;
      problem.w(j, i) = w;
    }
  }
}

/// Compliance of the body at a contact along its normal; for a held one the smallest of its rows.
double least_give(const ContactProblem& problem, const ContactPoint& contact, Index k) noexcept {
  const Index first = problem.first_row(k);
  const Index rows = problem.rows_of(k);
  const auto diagonal = [&](Index i) { return problem.many ? problem.single_row(i)[i] : problem.w(i, i); };
  if (problem.many && !contact.held && rows > 1) {
    double give = 0.0;
    for (Index i = 0; i < rows; ++i) {
      for (Index j = 0; j < rows; ++j)
        give += problem.normal[k][i] * problem.normal[k][j] * problem.single_row(first + i)[first + j];
    }
    return give;
  }
  double give = diagonal(first);
  for (Index i = first + 1; contact.held && i < first + rows; ++i) give = std::min<double>(give, diagonal(i));
  return give;
}

/// Marks the contacts that press on or hold a rigid part of the body. Call before the couplings are added to
/// W.
void note_rigid_contacts(State& state, const ContactProblem& problem) noexcept {
  for (Index k = 0; k < state.contact_count; ++k) {
    ContactPoint& contact = state.contact_points[k];
    contact.rigid =
        problem.rows_of(k) > 0 && least_give(problem, contact, k) < state.surface.least_compliance;
  }
}

bool is_coupled(const Tool& tool) noexcept {
  return std::isfinite(tool.coupling_stiffness) || std::isfinite(tool.coupling_torsion);
}

/// Adds the compliance of the couplings: W += J_tool C_tool J_tool^T.
void add_coupling_compliance(const State& state, Scratch& scratch) noexcept {
  ContactProblem& problem = scratch.problem;
  for (Index j = 0; j < problem.rows; ++j) {
    const ContactRow& by = scratch.rows[j];
    if (by.tool < 0) continue;
    const Tool& tool = state.tools[by.tool].tool;
    if (!is_coupled(tool)) continue;
    for (Index i = 0; i < problem.rows; ++i) {
      const ContactRow& at = scratch.rows[i];
      if (at.tool != by.tool) continue;
      problem.w(i, j) +=
          at.force.dot(by.force) / tool.coupling_stiffness + at.moment.dot(by.moment) / tool.coupling_torsion;
    }
  }
}

/// Computes the forces and moments of a tool's rows, each multiplied by the root of the coupling's
/// compliance: one component after the other.
void fill_coupling(const Tool& tool, Index number, Scratch& scratch) noexcept {
  const double force_scale = 1.0 / std::sqrt(tool.coupling_stiffness);
  const double moment_scale = 1.0 / std::sqrt(tool.coupling_torsion);
  const Index rows = scratch.problem.rows;
  for (Index i = 0; i < rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    const double is_of_tool = row.tool == number ? 1.0 : 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      scratch.assembly.coupling[axis * rows + i] =
          static_cast<float>(is_of_tool * force_scale * row.force[axis]);
      scratch.assembly.coupling[(3 + axis) * rows + i] =
          static_cast<float>(is_of_tool * moment_scale * row.moment[axis]);
    }
  }
}

/// Adds the compliance of the couplings for many contacts, in a second W; that of the body is unchanged.
void couple_many(const State& state, Scratch& scratch) noexcept {
  ContactProblem& problem = scratch.problem;
  const Index rows = problem.rows;
  for (std::size_t k = 0; k < state.tools.size(); ++k) {
    const Tool& tool = state.tools[k].tool;
    if (!is_coupled(tool)) continue;
    fill_coupling(tool, static_cast<Index>(k), scratch);
    const float* __restrict c = scratch.assembly.coupling.data();
    for (Index j = 0; j < rows; ++j) {
      const float* from = problem.single_row(j);  // the sum so far, from the second tool on
      float* to = problem.single_W.data() + static_cast<std::ptrdiff_t>(j) * problem.single_stride;
      std::array<float, 6> by{};
      for (std::size_t axis = 0; axis < 6; ++axis) by[axis] = c[static_cast<Index>(axis) * rows + j];
#pragma omp simd
      for (Index i = 0; i < rows; ++i) {
        to[i] = from[i] + by[0] * c[i] + by[1] * c[rows + i] + by[2] * c[2 * rows + i] +
                by[3] * c[3 * rows + i] + by[4] * c[4 * rows + i] + by[5] * c[5 * rows + i];
      }
      std::fill(to + rows, to + problem.padded_rows(), 0.0F);
    }
    problem.coupled = true;
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

/// Nearly coincident contact points make W nearly singular; the rounding of Xi must not make it indefinite.
/// Where the compliance is almost zero, a rigid tool would get an unbounded force; there it presses on a wall
/// of small compliance. Along a tangent these compliances act relative to the force of the last tick;
/// otherwise sticking friction would creep in every tick.
void regularise(const ElasticBody& body, const State& state, Scratch& scratch) noexcept {
  const double rounding = body.greens().rounding();
  ContactProblem& problem = scratch.problem;
  for (Index k = 0; k < problem.contacts; ++k) {
    const Index first = problem.first_row(k);
    for (Index i = first; i < first + problem.rows_of(k); ++i) {
      const auto row = static_cast<std::size_t>(i);
      double& w = problem.w(i, i);
      const double exact = exact_compliance(body, state.surface.near, scratch.rows[row]);
      double give = 4.0 * (rounding * std::max(w - exact, 0.0) + exact_rounding * std::abs(exact)) +
                    state.surface.rigid_compliance;
      if (k < state.contact_count) give = std::max(give, state.surface.least_compliance - w);
      w += give + scratch.assembly.tilt_spring[row];
      if (i > first && problem.held[k] == 0) problem.b[row] -= give * problem.lambda[row];
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

/// Does the same as `regularise`, in single precision.
void regularise_many(const State& state, Scratch& scratch) noexcept {
  constexpr double rounding = 4.0 * std::numeric_limits<float>::epsilon();
  ContactProblem& problem = scratch.problem;
  for (Index k = 0; k < problem.contacts; ++k) {
    const Index first = problem.first_row(k);
    const Index rows = problem.rows_of(k);
    double give = state.surface.rigid_compliance;
    if (k < state.contact_count && rows > 0)
      give = std::max(give, state.surface.least_compliance - least_give(problem, state.contact_points[k], k));
    const double along_normal = problem.normal_part(k, problem.lambda);
    for (Index i = first; i < first + rows; ++i) {
      float& w = problem.single_row(i)[i];
      w += static_cast<float>(give + rounding * w + scratch.assembly.tilt_spring[i]);
      if (problem.held[k] == 0) problem.b[i] += give * along_normal * problem.normal[k][i - first];
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
  if (frictionless) return state.contact_count > tuning.many.few_frictionless;
  if (state.contact_count > tuning.many.few_contacts) return true;
  const auto last = std::span(remembered.contacts).first(static_cast<std::size_t>(remembered.count));
  const auto closed = std::count_if(last.begin(), last.end(), [](const ContactPoint& contact) {
    return !contact.held && !contact.force.isZero(0.0);
  });
  return closed > tuning.many.few_closed;
}

}  // namespace

void assemble_contact(const ElasticBody& body, State& state, Scratch& scratch) noexcept {
  hand_over_merged(body, state, scratch);
  scratch.problem.clear(are_many(state, scratch.last));
  std::fill(scratch.assembly.tilt_spring.begin(), scratch.assembly.tilt_spring.end(), 0.0);
  const std::span<const ContactPoint> contacts = state.contacts();
  const double edge = body.mean_surface_edge();
  if (scratch.problem.many) {
    add_many(body, state, scratch, tuning.many.open_gap * edge);
  } else {
    for (const ContactPoint& contact : contacts) add_one_of_few(body, state, scratch, contact);
  }
  const Index first_tilt_row = scratch.problem.rows;
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = contacts[k];
    const double force = normal_force(scratch.last, contact, same_contact(scratch.last, contact),
                                      tuning.assembly.closed_gap * edge);
    add_tilt(body, state, scratch, k, force, edge);
  }
  HighWater& most = scratch.high_water;
  most.contact_points = std::max(most.contact_points, state.contact_count);
  most.unknowns = std::max(most.unknowns, scratch.problem.rows);
  most.near_nodes = std::max(most.near_nodes, state.surface.near.count());
  if (scratch.problem.many) {
    scratch.assembly.compliance.assemble(state.surface.near, scratch.rows, first_tilt_row, scratch.problem);
    note_rigid_contacts(state, scratch.problem);
    couple_many(state, scratch);
    add_change_of_forces(state.surface.near, scratch);
    add_stretch(state, scratch);
    regularise_many(state, scratch);
    return;
  }
  scratch.assembly.compliance.forget();
  scratch.assembly.response_count = 0;
  if (body.dimension() == 3) {
    assemble_body_compliance<3>(state.surface.near, scratch);
  } else {
    assemble_body_compliance<2>(state.surface.near, scratch);
  }
  note_rigid_contacts(state, scratch.problem);
  add_coupling_compliance(state, scratch);
  regularise(body, state, scratch);
}

}  // namespace palpate
