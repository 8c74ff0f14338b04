#include "runtime/loop/replay_device.h"

#include <algorithm>
#include <bit>
#include <iterator>

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
  const auto same_bits = [](double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  };
  const auto same = [&](const double(&a)[3], const double(&b)[3]) {
    return std::equal(std::begin(a), std::end(a), std::begin(b), same_bits);
  };
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
