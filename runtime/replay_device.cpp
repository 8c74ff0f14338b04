#include "runtime/replay_device.h"

#include <cmath>
#include <cstring>

namespace palpate {

DeviceNews ReplayDevice::hear(const TickTime& tick) noexcept {
  const TickRecord& then = session_.ticks[static_cast<std::size_t>(tick.number)];
  const double* q = then.handle_orientation;
  DeviceNews news;
  news.state.pose = {.orientation = {q[0], q[1], q[2], q[3]},
                     .position = Vec3(then.handle_position),
                     .grab = then.grab != 0};
  news.state.velocity = Vec3(then.handle_velocity);
  news.state.buttons = then.buttons;
  news.state.sequence = then.sequence;
  const std::int64_t due = tick.number * 1'000'000'000 / session_.info.rate;  // since the start, as then
  news.state.arrived = tick.due - due + then.arrived_ns;
  news.begun = tick.due - due + then.begun_ns;
  news.events = static_cast<DeviceEvent>(then.event);
  return news;
}

void compare(const TickRecord& now, const TickRecord& then, ReplayDifference& difference) noexcept {
  const auto same = [](const auto& a, const auto& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; };
  ++difference.ticks;
  if (same(now.force, then.force) && same(now.torque, then.torque) &&
      same(now.shown_force, then.shown_force) && same(now.shown_torque, then.shown_torque))
    return;
  ++difference.different;
  const double change = std::max((Vec3(now.force) - Vec3(then.force)).norm(),
                                 (Vec3(now.shown_force) - Vec3(then.shown_force)).norm());
  if (change > difference.largest) {
    difference.largest = change;
    difference.largest_time = then.time;
  }
}

}  // namespace palpate
