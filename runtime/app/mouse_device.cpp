#include "runtime/app/mouse_device.h"

#include <cmath>

namespace palpate {
namespace {

constexpr double follow_time = 0.015;  // s
// For a pressed pointer: a browser that draws on a busy processor may send nothing for seconds.
constexpr std::int64_t most_silence = 5'000'000'000;  // ns

}  // namespace

MouseDevice::MouseDevice(const PointerPose& start, std::int64_t rate)
    : said_(Word{.pointer = start, .landing = start.pose}),
      last_word_(said_.read()),
      period_(1.0 / static_cast<double>(rate)) {
  state_.pose = start.pose;
}

void MouseDevice::point(const PointerPose& target) noexcept {
  last_word_.pointer = target;
  ++last_word_.number;
  if (target.lifted) {
    last_word_.landing = target.pose;
    ++last_word_.lifts;
  }
  said_.next() = last_word_;
  said_.publish();
  is_gone_ = false;
}

DeviceNews MouseDevice::poll(const TickTime& tick) noexcept {
  const Word& word = said_.read();
  if (word.number != heard_) {
    heard_ = word.number;
    heard_at_ = tick.begun;
  }
  const bool is_pressed = !word.pointer.lifted;
  const bool lost = is_pressed && (is_gone_ || tick.begun - heard_at_ > most_silence);
  // It may have been lifted and pressed again since the last tick.
  const bool lands = lost || !is_pressed || word.lifts != heard_lifts_;
  heard_lifts_ = word.lifts;
  if (lands) {
    land(word.landing);
  } else {
    follow(word.pointer.pose);
  }
  state_.arrived = tick.begun;
  ++state_.sequence;

  DeviceNews news{.state = state_};
  if (lands) news.events |= DeviceEvent::lifted;
  if (lost && !is_lost_) news.events |= DeviceEvent::input_lost;
  if (!lost && is_lost_) news.events |= DeviceEvent::acknowledged;
  is_lost_ = lost;
  return news;
}

void MouseDevice::land(const ToolPose& at) noexcept {
  state_.pose = at;
  state_.pose.grab = false;
  state_.buttons = 0;
  state_.velocity.setZero();
}

void MouseDevice::follow(const ToolPose& target) noexcept {
  // Exact solution over one tick, for any period.
  const double decay = std::exp(-period_ / follow_time);
  const Vec3 away = state_.pose.position - target.position;
  const Vec3 drift = state_.velocity + away / follow_time;
  state_.pose.position = target.position + decay * (away + period_ * drift);
  state_.velocity = decay * (drift - (away + period_ * drift) / follow_time);
  state_.pose.orientation = target.orientation;
  state_.pose.grab = target.grab;
  state_.buttons = target.grab ? 1 : 0;
}

}  // namespace palpate
