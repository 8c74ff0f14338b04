#include "runtime/tick/scratch.h"

#include <algorithm>

#include "runtime/solve/tick_tuning.h"

namespace palpate {
namespace {

constexpr std::size_t most_simplices_left_out = 2048;  // that are kept: what is beyond is counted alone

/// A contact has up to d rows, and d - 1 for the tilt of its face.
Index most_rows(const Body& body, Index max_contacts) {
  return (2 * body.dimension() - 1) * max_contacts;
}

std::size_t size(Index count) {
  return static_cast<std::size_t>(count);
}

Index few(Index max_contacts) {
  return std::min(max_contacts, tuning.many.few_contacts);
}

/// Rows of the direct solvers' problems: those of few contacts, or of more without friction, which have one
/// row and those of its tilt.
Index few_rows(const Body& body, Index max_contacts) {
  return std::max(most_rows(body, few(max_contacts)),
                  body.dimension() * std::min(max_contacts, tuning.many.few_frictionless));
}

/// None where contacts are always few.
Index many(Index max_contacts) {
  return max_contacts > tuning.many.few_closed ? max_contacts : 0;
}

}  // namespace

RollingScratch::RollingScratch(int dimension, Index max_contacts, Index max_rows)
    : turning(size(max_contacts)),
      following(size(max_rows)),
      T(size(dimension * tuning.hand.most_turning) * size(dimension * tuning.hand.most_turning)),
      B(size(tuning.hand.most_following) * size(dimension * tuning.hand.most_turning)),
      turning_force(size(dimension * max_contacts)),
      next_force(turning_force.size()),
      row_force(following.size()),
      device_change(following.size()) {}

Scratch::Scratch(const Body& body, Index tools, Index max_contacts, Index near_nodes)
    : last_contacts(size(max_contacts)),
      found(body.surface_friction().size()),
      found_distance(body.surface_friction().size()),
      pairs(size(2 * max_contacts)),
      candidates(size(3 * tools) * pairs.size()),
      left_out(candidates.size() + std::min(most_simplices_left_out, found.size())),
      problem(body.dimension(), body.dimension() * max_contacts, few_rows(body, max_contacts),
              most_rows(body, many(max_contacts))),
      rows(size(most_rows(body, max_contacts))),
      row_response(size(body.dimension() * near_nodes)),
      guess_force(row_response.size()),
      pattern(most_rows(body, many(max_contacts)), body.dimension() * near_nodes),
      tilt_spring(rows.size()),
      active_set(few_rows(body, max_contacts)),
      cone_solver(body.dimension() * few(max_contacts), most_rows(body, few(max_contacts))),
      newton_krylov(body.dimension() * many(max_contacts), most_rows(body, many(max_contacts))),
      imbalance(body.dimension() * max_contacts, most_rows(body, max_contacts)),
      missing_force(size(tools), Vec3::Zero()),
      left_out_nodes(most_sampled),
      left_out_blocks(size(body.dimension() * body.dimension()) * most_sampled),
      row_change(size(body.dimension()) * rows.size()),
      force_change(row_change.size()),
      rolling(body.dimension(), max_contacts, static_cast<Index>(rows.size())),
      far_displacement(size(body.dimension() * tuning.far.nodes)) {}

}  // namespace palpate
