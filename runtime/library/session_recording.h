// What somebody else's loop does, recorded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "runtime/background/surface_frames.h"
#include "runtime/loop/recorder.h"
#include "runtime/loop/settings.h"
#include "runtime/tick/state.h"

namespace palpate {

/// A recording of one tool of a session, as palpate-runtime makes them.
class SessionRecording {
 public:
  struct Options {
    std::filesystem::path file;
    std::filesystem::path model;  ///< that the body was loaded from
    Settings settings;            ///< that a replay needs
    std::size_t tool = 0;
    double pictures = 60.0;  ///< of the surface a second; 0: none
  };

  /// `body` and `state`, which is untouched, must live as long. Throws Error where the file cannot be made.
  SessionRecording(const Body& body, const State& state, const Options& options);

  /// The tick that `state` has just done, in `compute_ns`: `wanted` is where the device wanted the tool, and
  /// `centre` the stored node of its overlay, -1 for none. Real-time safe.
  void note(const ToolPose& wanted, Index centre, std::int64_t compute_ns) noexcept;

  /// Ends it. Throws Error where it could not be written.
  void finish();

  /// Ticks and pictures that are not in it.
  [[nodiscard]] std::int64_t dropped() const noexcept {
    return recorder_.dropped() + recorder_.dropped_pictures();
  }

 private:
  const Body& body_;
  const State& state_;
  std::size_t tool_;
  std::int64_t rate_;
  std::int64_t start_;  // [ns]
  std::int64_t ticks_ = 0;
  Recorder recorder_;
  std::optional<SurfaceFrames> frames_;  // last: its thread feeds the recorder
};

}  // namespace palpate
