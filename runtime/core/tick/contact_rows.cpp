#include "runtime/core/tick/contact_rows.h"

#include <algorithm>
#include <array>
#include <limits>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/touch/contact_nodes.h"
#include "runtime/core/touch/rolling.h"
#include "runtime/core/touch/tool_geometry.h"

namespace palpate {
namespace {

Vec3 tangential(const Vec3& v, const Vec3& n) noexcept {
  return v - n.dot(v) * n;
}

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

/// Motion along the tangents of the surface itself since the tick before, which the places where the tick
/// begins have in them already: what slides is the surface under the tool, by whatever it moves.
Vec3 free_slip(const ElasticBody& body, const SurfaceState& surface, const ContactPoint& contact) noexcept {
  Vec3 motion = Vec3::Zero();
  if (!surface.motion.active()) return motion;
  for_each_node(body, surface.near, contact,
                [&](Index node, double weight) { motion += weight * surface.motion.change(node); });
  return tangential(motion, contact.frame.col(0));
}

/// Relative motion of a contact's tool and surface in the tick if no force changes, plus their distance; its
/// component along n is the gap.
Vec3 motion_of(const ElasticBody& body, const State& state, const ContactPoint& contact,
               const ContactPoint* last, Pass pass) noexcept {
  const ToolState& tool = state.tools[contact.tool];
  Vec3 motion = device_motion(tool.pose, tool.device, contact.arm);
  if (contact.held) return motion + tool.pose.position + contact.arm - contact.position;
  const Vec3 n = contact.frame.col(0);
  motion += contact.gap * n;
  if (pass == Pass::first) motion -= free_slip(body, state.surface, contact);
  if (last != nullptr) motion += tangential(last->carry, n);
  return motion;
}

/// Data of a contact before it is added to the problem.
UpcomingContact announce(const ElasticBody& body, const State& state, const Scratch& scratch,
                         const ContactPoint& contact, double least_gap, Pass pass) noexcept {
  UpcomingContact upcoming{.last = scratch.last.number_of(contact.feature)};
  const ContactPoint* last = upcoming.last < 0 ? nullptr : &scratch.last.contacts[upcoming.last];
  upcoming.motion = motion_of(body, state, contact, last, pass);
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

/// Rows along the contact's normal and tangents, or, where W is kept and there are more than one, along the
/// axes: then a row is the same however the normal turns.
void add_contact(const ElasticBody& body, const SurfaceState& surface, Scratch& scratch,
                 const ContactPoint& contact, const UpcomingContact& upcoming) noexcept {
  ContactProblem& problem = scratch.problem;
  const ContactPoint* last = upcoming.last < 0 ? nullptr : &scratch.last.contacts[upcoming.last];
  if (upcoming.stays_open) return problem.add_open();
  const Index first = problem.rows;
  const bool has_axes = problem.single && (contact.held || contact.friction > 0.0);
  problem.add(contact.friction, contact.held, has_axes ? Vec3(contact.frame.col(0)) : Vec3::UnitX());
  for (Index i = first; i < problem.rows; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3 direction = has_axes ? Vec3::Unit(i - first) : Vec3(contact.frame.col(i - first));
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
  for (Index k = 0; k < scratch.assembly.response_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    const ToolState& tool = state.tools[contact.tool];
    const Vec3 change = scratch.assembly.response[k] * (tool.device.position - tool.last_device.position);
    const Index first = scratch.problem.first_row(k);
    for (Index i = first; i < first + scratch.problem.rows_of(k); ++i)
      scratch.problem.prediction[i] = scratch.rows[i].force.dot(change);
  }
}

/// Normal force for a contact's tilt: its own in the last tick or, if it has just become another vertex, edge
/// or face, the mean of its tool's.
double normal_force(const LastContacts& remembered, const ContactPoint& contact, Index last,
                    double closed) noexcept {
  if (last >= 0) return remembered.contacts[last].force.dot(remembered.contacts[last].frame.col(0));
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

}  // namespace

void add_contacts(const ElasticBody& body, State& state, Scratch& scratch, double edge, Pass pass) noexcept {
  AssemblyScratch& assembly = scratch.assembly;
  const double least_gap =
      scratch.problem.single ? tuning.many.open_gap * edge : std::numeric_limits<double>::infinity();
  for (Index k = 0; k < state.contact_count; ++k)
    assembly.upcoming[k] = announce(body, state, scratch, state.contact_points[k], least_gap, pass);
  if (scratch.problem.single) {
    choose_order(state, assembly);
    bring_into_order(state, assembly);
    hand_on_responses(assembly, state.contact_count);
  } else {
    assembly.response_count = 0;
  }
  for (Index k = 0; k < state.contact_count; ++k)
    add_contact(body, state.surface, scratch, state.contact_points[k], assembly.upcoming[k]);
  if (pass == Pass::first) predict(state, scratch);
}

void add_tilts(const ElasticBody& body, const State& state, Scratch& scratch, double edge) noexcept {
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    const double force = normal_force(scratch.last, contact, scratch.assembly.upcoming[k].last,
                                      tuning.assembly.closed_gap * edge);
    add_tilt(body, state, scratch, k, force, edge);
  }
}

}  // namespace palpate
