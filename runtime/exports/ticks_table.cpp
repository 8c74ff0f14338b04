#include "runtime/exports/ticks_table.h"

#include <fmt/format.h>

namespace palpate {

std::string ticks_line(const TickRecord& tick) {
  std::string text = fmt::format("{}", tick.time);
  const auto add = [&](const auto& numbers) { text += fmt::format(",{}", fmt::join(numbers, ",")); };
  add(tick.device_position);
  add(tick.device_orientation);
  add(tick.tool_position);
  add(tick.tool_orientation);
  add(tick.force);
  add(tick.torque);
  add(tick.shown_force);
  return text + fmt::format(",{},{},{},{},{},{}\n", tick.contacts, tick.grab, tick.status, tick.compute_ns,
                            tick.force_error, tick.left_out);
}

}  // namespace palpate
