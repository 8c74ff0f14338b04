// One run of the loop, from the untouched body to its report.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "base/error.h"
#include "runtime/app/input_source.h"
#include "runtime/app/play_options.h"
#include "runtime/body/body.h"
#include "runtime/loop/loop.h"
#include "runtime/loop/played_parts.h"

namespace palpate {

/// The name of a report that goes to the standard output.
constexpr const char* standard_output = "-";

/// Who looks on, and may steer it. Without a viewer nothing is set.
struct SessionViewer {
  LoopControl* control = nullptr;
  TickFeed::Sink ticks;
  SurfaceFrames::Sink pictures;
  Recorder::OnFailure recording_failed;
};

/// Everything that works beside the loop in one run: overlays, motion, recording, frames, monitor.
class PlaySession {
 public:
  /// `options` of this session, with defaults applied for `input`; `body` and `input`
  /// must live as long. Throws Error.
  PlaySession(PlayOptions options, const Body& body, const InputSource& input,
              const SessionViewer& viewer = {});
  PlaySession(const PlaySession&) = delete;
  PlaySession& operator=(const PlaySession&) = delete;

  /// Begins with a fault that was latched before and that nobody has acknowledged yet. Before `run`.
  void latch(Fault fault) noexcept {
    if (safety_) safety_->fail(fault);
  }
  /// What is latched, none without safety rules. Not during `run`.
  [[nodiscard]] Fault fault() const noexcept { return safety_ ? safety_->fault() : Fault::none; }

  /// To the end, to `stop` or until the viewer's control says `leave`. What was recorded has its index
  /// then, unless that failed.
  const LoopReport& run(const std::atomic<bool>& stop);

  /// Why the recording of the run that is over is not whole; nothing where it is, or there is none.
  [[nodiscard]] const std::optional<Error>& recording_failure() const noexcept { return recording_failure_; }

  /// Ticks that the recording lacks.
  [[nodiscard]] std::int64_t dropped() const { return recorder_ ? recorder_->dropped() : 0; }

  /// The report, and the files that the options ask for. `parts`: of the run that this session was the last
  /// one of. Throws Error for the first that cannot be written, after all others are.
  void tell(const PlayedParts* parts = nullptr) const;

 private:
  LoopReport run_with_rights(const std::atomic<bool>& stop);
  void finish_recording();

  std::optional<Safety> safety_;
  const Body& body_;
  const InputSource& input_;
  LoopControl* control_;
  Tool tool_;
  std::optional<TickFeed> feed_;
  std::optional<Recorder> recorder_;
  std::optional<Monitor> monitor_;
  LoopReport report_;
  std::optional<Error> recording_failure_;
  std::optional<SurfaceFrames> frames_;  // after the recorder, which it feeds to its end
  std::optional<SurfaceFrames> viewed_;
  PlayOptions options_;
  std::optional<MotionSource> motion_;
  std::optional<PatchSource> overlays_;
  State state_;
};

}  // namespace palpate
