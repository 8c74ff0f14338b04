// Single run of the loop, from the untouched body to its report.
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

/// Name of a report to the standard output.
constexpr const char* standard_output = "-";

/// Viewer of a session, which may control it; all empty without a viewer.
struct SessionViewer {
  LoopControl* control = nullptr;
  TickFeed::Sink ticks;
  SurfaceFrames::Sink pictures;
  Recorder::OnFailure recording_failed;
};

/// Loop and all that works beside it in one run: overlays, motion, recording, frames, monitor.
class PlaySession {
 public:
  /// `options` of this session, with defaults applied for `input`; `body` and `input` must outlive this.
  /// Throws Error.
  PlaySession(PlayOptions options, const Body& body, const InputSource& input,
              const SessionViewer& viewer = {});
  PlaySession(const PlaySession&) = delete;
  PlaySession& operator=(const PlaySession&) = delete;

  /// Latches a fault of an earlier session that is not yet acknowledged. Call before `run`.
  void latch(Fault fault) noexcept {
    if (safety_) safety_->fail(fault);
  }
  /// Latched fault; none without safety rules. Must not be called during `run`.
  [[nodiscard]] Fault fault() const noexcept { return safety_ ? safety_->fault() : Fault::none; }

  /// Runs to the end, to `stop` or until the viewer's control requests `leave`. The recording then has its
  /// index, unless it failed.
  const LoopReport& run(const std::atomic<bool>& stop);

  /// Reason if the recording of the finished run is incomplete; empty if it is complete, or there is none.
  [[nodiscard]] const std::optional<Error>& recording_failure() const noexcept { return recording_failure_; }

  /// Number of ticks missing from the recording.
  [[nodiscard]] std::int64_t dropped() const { return recorder_ ? recorder_->dropped() : 0; }

  /// Writes the report and the files requested by the options. `parts`: all sessions of the run of which this
  /// is the last. Throws Error for the first that cannot be written, after writing all others.
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
