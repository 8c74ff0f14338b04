#include "runtime/exports/ticks_table.h"

#include <fmt/format.h>

namespace palpate {
namespace {

constexpr const char* names =
    "time,device_x,device_y,device_z,device_qw,device_qx,device_qy,device_qz,tool_x,tool_y,tool_z,tool_qw,"
    "tool_qx,tool_qy,tool_qz,force_x,force_y,force_z,torque_x,torque_y,torque_z,shown_force_x,shown_force_y,"
    "shown_force_z,contacts,grab,status,compute_ns,force_error,left_out\n";

}  // namespace

std::string ticks_table(std::span<const TickRecord> ticks) {
  std::string text = names;
  const auto add = [&](const auto& numbers) { text += fmt::format(",{}", fmt::join(numbers, ",")); };
  for (const TickRecord& tick : ticks) {
    text += fmt::format("{}", tick.time);
    add(tick.device_position);
    add(tick.device_orientation);
    add(tick.tool_position);
    add(tick.tool_orientation);
    add(tick.force);
    add(tick.torque);
    add(tick.shown_force);
    text += fmt::format(",{},{},{},{},{},{}\n", tick.contacts, tick.grab, tick.status, tick.compute_ns,
                        tick.force_error, tick.left_out);
  }
  return text;
}

}  // namespace palpate
