#include "runtime/igtl/igtl_broadcast.h"

#include <utility>

#include "runtime/igtl/igtl_messages.h"

namespace palpate {
namespace {

constexpr double surface_period = 1.0 / 30.0 - 1e-9;  // [s] less the rounding of the ticks' times
constexpr auto quiet = std::chrono::milliseconds(100);

}  // namespace

void IgtlBroadcast::set_picture(DrawnPicture picture, Clock::time_point now) {
  newest_ = std::make_shared<const DrawnPicture>(std::move(picture));
  came_ = now;
  ++pictures_;
  hand_message_.reset();
  if (surface_ != nullptr && surface_->scene == newest_->scene) {
    const double since = newest_->picture.frame.time - surface_->picture.frame.time;
    if (since >= 0.0 && since < surface_period) return;  // negative: another run, whose time starts again
  }
  catch_up();
}

void IgtlBroadcast::catch_up(Clock::time_point now) {
  if (now - came_ >= quiet) catch_up();
}

void IgtlBroadcast::catch_up() {
  if (surface_ == newest_) return;
  surface_ = newest_;
  ++surfaces_;
  surface_message_.reset();
}

const IgtlBroadcast::Bytes& IgtlBroadcast::surface_message() {
  if (!surface_message_) surface_message_ = std::make_shared<const std::string>(igtl_surface(*surface_));
  return surface_message_;
}

const IgtlBroadcast::Bytes& IgtlBroadcast::hand_message() {
  if (!hand_message_) {
    hand_message_ =
        std::make_shared<const std::string>(igtl_tool(newest_->picture) + igtl_force(newest_->picture));
  }
  return hand_message_;
}

}  // namespace palpate
