#include "runtime/exports/ticks_table.h"

#include <fmt/format.h>

namespace palpate {

std::string_view ticks_names() noexcept {
  return "time,device_x,device_y,device_z,device_qw,device_qx,device_qy,device_qz,tool_x,tool_y,tool_z,tool_"
         "qw,"
         "tool_qx,tool_qy,tool_qz,force_x,force_y,force_z,torque_x,torque_y,torque_z,shown_force_x,shown_"
         "force_y,"
         "shown_force_z,contacts,grab,status,compute_ns,force_error,left_out\n";
}

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
