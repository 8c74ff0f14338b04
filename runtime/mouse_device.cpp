#include "runtime/mouse_device.h"

#include <cmath>

namespace palpate {
namespace {

constexpr double follow_time = 0.015;                 // s
constexpr std::int64_t most_silence = 1'000'000'000;  // ns, while something is held

}  // namespace

MouseDevice::MouseDevice(const ToolPose& start, std::int64_t rate)
    : said_(Word{.pose = start}), period_(1.0 / static_cast<double>(rate)) {
  state_.pose = start;
}

void MouseDevice::point(const ToolPose& target) noexcept {
  said_.next() = {.pose = target, .number = ++words_};
  said_.publish();
  is_gone_ = false;
}

DeviceNews MouseDevice::hear(const TickTime& tick) noexcept {
  const Word& word = said_.read();
  if (word.number != heard_) {
    heard_ = word.number;
    heard_at_ = tick.begun;
  }
  // The exact solution over one tick, for any period.
  const double decay = std::exp(-period_ / follow_time);
  const Vec3 away = state_.pose.position - word.pose.position;
  const Vec3 drift = state_.velocity + away / follow_time;
  state_.pose.position = word.pose.position + decay * (away + period_ * drift);
  state_.velocity = decay * (drift - (away + period_ * drift) / follow_time);
  state_.pose.orientation = word.pose.orientation;
  state_.pose.grab = word.pose.grab;
  state_.buttons = word.pose.grab ? 1 : 0;
  state_.arrived = tick.begun;
  ++state_.sequence;

  const bool lost = is_gone_ || (word.pose.grab && tick.begun - heard_at_ > most_silence);
  DeviceNews news{.state = state_};
  if (lost && !is_lost_) news.events = DeviceEvent::input_lost;
  if (!lost && is_lost_) news.events = DeviceEvent::acknowledged;
  is_lost_ = lost;
  return news;
}

}  // namespace palpate
