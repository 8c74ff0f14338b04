#include "runtime/loop/replay_device.h"

#include <algorithm>
#include <bit>
#include <iterator>

namespace palpate {
namespace {

bool same_bits(double a, double b) noexcept {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

template <std::size_t n>
bool same(const double (&a)[n], const double (&b)[n]) noexcept {
  return std::equal(std::begin(a), std::end(a), std::begin(b), same_bits);
}

/// Returns the first field, in order of computation, that differs between two ticks; null if all are equal.
const char* first_different_field(const TickRecord& now, const TickRecord& then) noexcept {
  if (now.motion_step != then.motion_step) return "motion_step";
  if (now.patch != then.patch) return "patch";
  if (!same(now.tool_position, then.tool_position)) return "tool_position";
  if (!same(now.tool_orientation, then.tool_orientation)) return "tool_orientation";
  if (now.contacts != then.contacts) return "contacts";
  if (!same(now.force, then.force)) return "force";
  if (!same(now.torque, then.torque)) return "torque";
  if (!same(now.stiffness, then.stiffness)) return "stiffness";
  if (now.status != then.status) return "status";
  if (now.phase != then.phase) return "phase";
  if (!same(now.shown_force, then.shown_force)) return "shown_force";
  if (!same(now.shown_torque, then.shown_torque)) return "shown_torque";
  return nullptr;
}

}  // namespace

void ReplayDifference::add(const ReplayDifference& later, std::int64_t ticks_before, double time_before) {
  ticks += later.ticks;
  different += later.different;
  if (later.largest > largest) {
    largest = later.largest;
    largest_time = time_before + later.largest_time;
  }
  if (first_tick >= 0 || later.first_tick < 0) return;
  first_tick = ticks_before + later.first_tick;
  first_field = later.first_field;
}

void ReplayDevice::check() const {
  if (failure_) std::rethrow_exception(failure_);
}

DeviceNews ReplayDevice::poll(const TickTime& tick) noexcept {
  DeviceNews news;
  try {
    then_ = session_.tick(tick.number);
  } catch (...) {
    failure_ = std::current_exception();
    return news;
  }
  const TickRecord& then = then_;
  const double* q = then.handle_orientation;
  news.state.pose = {.orientation = {q[0], q[1], q[2], q[3]},
                     .position = Vec3(then.handle_position),
                     .grab = then.grab != 0};
  news.state.velocity = Vec3(then.handle_velocity);
  news.state.buttons = then.buttons;
  news.state.sequence = then.sequence;
  const std::int64_t due = tick.number * 1'000'000'000 / session_.info().rate;  // from the start, as then
  news.state.arrived = tick.due - due + then.arrived_ns;
  news.begun = tick.due - due + then.begun_ns;
  news.events = static_cast<DeviceEvent>(then.event);
  return news;
}

void compare(const TickRecord& now, const TickRecord& then, ReplayDifference& difference) noexcept {
  if (difference.first_tick < 0) {
    if (const char* field = first_different_field(now, then)) {
      difference.first_tick = difference.ticks;
      difference.first_field = field;
    }
  }
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
