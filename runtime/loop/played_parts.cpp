#include "runtime/loop/played_parts.h"

#include <algorithm>
#include <numeric>

namespace palpate {
namespace {

constexpr std::size_t most_rows = 10'000;

}  // namespace

void PlayedParts::add(const Part& part, const LoopReport& report) {
  if (rows_.empty()) report_.rate = report.rate;
  if (rows_.size() < most_rows) {
    rows_.push_back(
        {.part = part, .begun = static_cast<double>(report_.ticks) / static_cast<double>(report_.rate)});
    rows_.back().part.dropped = 0;
  }
  Row& row = rows_.back();
  ++row.sessions;
  row.part.dropped += part.dropped;
  row.ticks += report.ticks;
  row.ticks_in_contact += report.ticks_in_contact;
  row.misses += report.deadline_misses;
  row.faults += std::accumulate(report.faults.begin(), report.faults.end(), std::int64_t{0});
  row.largest_force = std::max(row.largest_force, report.largest_force);
  row.largest_shown = std::max(row.largest_shown, report.largest_shown);
  dropped_ += part.dropped;
  report_.add(report);
}

}  // namespace palpate
