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
  const auto take_larger = [begun](double& value, double& time, double later_value, double later_time) {
    if (!(later_value > value)) return;
    value = later_value;
    time = begun + later_time;
  };
  if (later.largest_force > largest_force) {
    largest_force_depth = later.largest_force_depth;
    largest_force_stiffening = later.largest_force_stiffening;
  }
  take_larger(largest_force, largest_force_time, later.largest_force, later.largest_force_time);
  take_larger(largest_jump, largest_jump_time, later.largest_jump, later.largest_jump_time);
  take_larger(largest_greens_error, largest_greens_error_time, later.largest_greens_error,
              later.largest_greens_error_time);
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
