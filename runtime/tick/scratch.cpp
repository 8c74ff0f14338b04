#include "runtime/tick/scratch.h"

#include "runtime/solve/tick_tuning.h"

namespace palpate {
namespace {

/// A contact has up to d rows, and d - 1 for the tilt of its face.
Index most_rows(const Body& body, Index max_contacts) {
  return (2 * body.dimension() - 1) * max_contacts;
}

std::size_t size(Index count) {
  return static_cast<std::size_t>(count);
}

}  // namespace

Scratch::Scratch(const Body& body, Index tools, Index max_contacts, Index near_nodes)
    : last_contacts(size(max_contacts)),
      found(body.surface_friction().size()),
      found_distance(body.surface_friction().size()),
      pairs(size(2 * max_contacts)),
      candidates(size(3 * tools) * pairs.size()),
      problem(body.dimension(), body.dimension() * max_contacts, most_rows(body, max_contacts)),
      rows(size(most_rows(body, max_contacts))),
      row_response(size(body.dimension() * near_nodes)),
      tilt_spring(rows.size()),
      active_set(most_rows(body, max_contacts)),
      cone_solver(body.dimension() * max_contacts, most_rows(body, max_contacts)),
      row_change(rows.size()),
      force_change(rows.size()),
      rolling_number(size(near_nodes)),
      rolling_places(size(tuning.hand.rolling_places)),
      rolling_response(size(body.dimension() * tuning.hand.rolling_places) *
                       size(body.dimension() * tuning.hand.rolling_places)),
      rolling_load(size(body.dimension() * tuning.hand.rolling_places)),
      rolling_motion(rolling_load.size()),
      device_change(rows.size()),
      far_displacement(size(body.dimension() * tuning.far.nodes)) {}

}  // namespace palpate
