#include "runtime/viewer/broadcast.h"

#include <utility>

#include "runtime/viewer/wire.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto state_period = std::chrono::milliseconds(500);
constexpr double seconds_of_ticks = 2.0;  // span of ticks sent to a slow page
constexpr std::size_t most_recorded_ticks = 1U << 18U;

Message binary_message(std::string bytes) {
  return {std::make_shared<const std::string>(std::move(bytes)), false};
}

}  // namespace

Message text_message(std::string text) {
  return {std::make_shared<const std::string>(std::move(text)), true};
}

void Broadcast::set_scene(std::shared_ptr<const Scene> scene) {
  scene_ = std::move(scene);
  scene_message_ = binary_message(encode_scene(*scene_));
  picture_.reset();
  forget_frames();
  ticks_.clear();
  ++scenes_;
  touch_state();  // it contains the scene's number
}

void Broadcast::set_picture(DrawnPicture picture) {
  if (picture.scene != scene_) return;  // belongs to the previous body
  if (!picture_ || picture_->patch != picture.patch) patch_message_ = {};
  picture_ = std::move(picture);
  forget_frames();
  ++pictures_;
}

void Broadcast::add_ticks(const std::vector<TickNote>& ticks, std::int64_t stride, bool replay) {
  const double rate = state_ ? state_->rate() : usual_rate;
  ticks_.append(ticks, stride,
                replay ? most_recorded_ticks : static_cast<std::size_t>(seconds_of_ticks * rate));
}

void Broadcast::set_state(StateWord state) {
  state_ = std::move(state);
  touch_state();
}

void Broadcast::touch_state() {
  ++states_;
  state_touched_ = Clock::now();
}

void Broadcast::repeat_state() {
  if (state_ && Clock::now() - state_touched_ >= state_period) touch_state();
}

const Message& Broadcast::patch_message() {
  if (!patch_message_) patch_message_ = binary_message(encode_patch(scene_->number, *picture_->patch));
  return patch_message_;
}

const std::shared_ptr<const WireValues>& Broadcast::values() {
  if (!values_) {
    values_ = std::make_shared<const WireValues>(wire_values(
        picture_->picture, *scene_, picture_->patch.get(), static_cast<std::uint32_t>(pictures_)));
  }
  return values_;
}

const Message& Broadcast::frame_message(const WireValues* base) {
  const std::uint32_t number = base == nullptr ? 0 : base->number;
  for (const Frame& frame : frames_) {
    if (frame.base == number) return frame.message;
  }
  frames_.push_back({number, binary_message(encode_frame(picture_->picture, *scene_, picture_->patch.get(),
                                                         *values(), base))});
  return frames_.back().message;
}

void Broadcast::forget_frames() {
  values_.reset();
  frames_.clear();
}

Message Broadcast::ticks_message(std::int64_t& place) {
  if (!run_message_ || run_begin_ != place || run_last_ != ticks_.end()) {
    const TickHistory::Run run = ticks_.run_from(place);
    run_begin_ = place;
    run_last_ = ticks_.end();
    run_end_ = run.end;
    run_message_ = binary_message(encode_ticks(scene_ ? scene_->number : 0, run.ticks, run.stride));
  }
  place = run_end_;
  return run_message_;
}

Message Broadcast::state_message(const PageRole& role, bool is_first) const {
  return text_message(
      state_->for_page(scene_ ? scene_->number : 0, role, is_first ? times_ : nlohmann::json()));
}

}  // namespace palpate
