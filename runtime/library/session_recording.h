// Recording of a session in a loop outside the programs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "runtime/background/surface_frames.h"
#include "runtime/core/tick/state.h"
#include "runtime/loop/recorder.h"
#include "runtime/loop/settings.h"

namespace palpate {

/// Recording of one tool of a session, in the format of palpate-runtime.
class SessionRecording {
 public:
  struct Options {
    std::filesystem::path file;
    std::filesystem::path model;  ///< file that the body was loaded from
    Settings settings;            ///< settings that a replay needs
    std::size_t tool = 0;
    double pictures = 60.0;  ///< surface pictures per second; 0: none
  };

  /// `body` and `state`, which must be untouched, must outlive this. Throws Error if the file cannot be
  /// created.
  SessionRecording(const Body& body, const State& state, const Options& options);

  /// Records the tick that `state` has just done in `compute_ns` [ns]. `wanted` is the tool pose requested by
  /// the device, `centre` the stored node of its overlay or -1. Real-time safe.
  void note(const ToolPose& wanted, Index centre, std::int64_t compute_ns) noexcept;

  /// Ends the recording. Throws Error if it could not be written.
  void finish();

  /// Number of ticks and pictures missing from the recording.
  [[nodiscard]] std::int64_t dropped() const noexcept {
    return recorder_.dropped() + recorder_.dropped_pictures();
  }

 private:
  const Body& body_;
  const State& state_;
  std::size_t tool_;
  std::int64_t rate_;
  std::int64_t start_;  // time of the start [ns]
  std::int64_t ticks_ = 0;
  Recorder recorder_;
  std::optional<SurfaceFrames> frames_;  // last member: its thread feeds the recorder
};

}  // namespace palpate
