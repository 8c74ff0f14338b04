#include "runtime/library/session_recording.h"

#include <algorithm>
#include <utility>

#include "runtime/loop/loading.h"
#include "runtime/loop/tick_record.h"
#include "runtime/safety/monotonic_clock.h"
#include "runtime/safety/safety.h"

namespace palpate {
namespace {

SessionInfo info_of(const SessionRecording::Options& options, const Body& body) {
  return {.model_path = options.model.string(),
          .content_hash = body.model().content_hash,
          .device = "library",
          .rate = options.settings.rate,
          .options = to_text(options.settings)};
}

}  // namespace

SessionRecording::SessionRecording(const Body& body, const State& state, const Options& options)
    : body_(body),
      state_(state),
      tool_(options.tool),
      rate_(options.settings.rate),
      start_(monotonic_now()),
      recorder_(options.file, info_of(options, body), recorded_surface(body)) {
  if (!(options.pictures > 0.0)) return;
  // A surface that is fine for another tool than the recorded one is not made again from its settings.
  const bool contacts_only =
      pictures_follow_from_contacts(body) &&
      met_surface(body.model(), options.settings.body()).refinement == body.refinement();
  frames_.emplace(body, state,
                  SurfaceFramesOptions{.ticks_per_frame = ticks_per_frame(rate_, options.pictures),
                                       .contacts_only = contacts_only},
                  [this, contacts_only](SurfacePicture picture) {
                    keep_recorded(body_, picture.frame);
                    recorder_.push_picture(contacts_only ? RecordedPicture(std::move(picture.loads))
                                                         : RecordedPicture(std::move(picture.frame)));
                  });
}

void SessionRecording::note(const ToolPose& wanted, Index centre, std::int64_t compute_ns) noexcept {
  const ToolState& tool = state_.tools[tool_];
  TickRecord record;
  record.time = static_cast<double>(ticks_) / static_cast<double>(rate_);
  record_tool(record, body_, state_, tool, wanted, centre);
  record.compute_ns = static_cast<std::uint32_t>(std::clamp<std::int64_t>(compute_ns, 0, UINT32_MAX));
  set(record.handle_position, wanted.position);
  set(record.handle_orientation, wanted.orientation);
  record.sequence = static_cast<std::uint32_t>(ticks_);
  record.arrived_ns = record.begun_ns = monotonic_now() - start_ - compute_ns;
  set(record.shown_force, tool.wrench.force);
  set(record.shown_torque, tool.wrench.torque);
  record.phase = static_cast<std::uint8_t>(SafetyPhase::active);
  recorder_.push(record);
  if (frames_) frames_->post(state_, ticks_, record.time);
  ++ticks_;
}

void SessionRecording::finish() {
  frames_.reset();  // waits until the last picture is in the recording
  recorder_.finish();
}

}  // namespace palpate
