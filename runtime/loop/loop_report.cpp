#include "runtime/loop/loop_report.h"

#include <algorithm>

namespace palpate {
namespace {

template <std::size_t size>
void add_each(std::array<std::int64_t, size>& counts, const std::array<std::int64_t, size>& later) {
  for (std::size_t k = 0; k < size; ++k) counts[k] += later[k];
}

}  // namespace

void LoopReport::add(const LoopReport& later) {
  const double begun = static_cast<double>(ticks) / static_cast<double>(rate);  // [s]
  if (later.largest_force > largest_force) {
    largest_force_depth = later.largest_force_depth;
    largest_force_stiffening = later.largest_force_stiffening;
  }
  note_largest(later.largest_force, begun + later.largest_force_time, largest_force, largest_force_time);
  note_largest(later.largest_jump, begun + later.largest_jump_time, largest_jump, largest_jump_time);
  note_largest(later.largest_greens_error, begun + later.largest_greens_error_time, largest_greens_error,
               largest_greens_error_time);
  best_effort.add(later.best_effort, begun);
  replay.add(later.replay, ticks, begun);
  ticks += later.ticks;
  ticks_in_contact += later.ticks_in_contact;
  ticks_begun_inside += later.ticks_begun_inside;
  most_contacts = std::max(most_contacts, later.most_contacts);
  deadline_misses += later.deadline_misses;
  lateness.add(later.lateness);
  compute.add(later.compute);
  largest_shown = std::max(largest_shown, later.largest_shown);
  add_each(status_ticks, later.status_ticks);
  add_each(faults, later.faults);
  opened_again += later.opened_again;
  interrupted = interrupted || later.interrupted;
}

}  // namespace palpate
