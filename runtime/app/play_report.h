// Report of a run at its end.
#pragma once

#include <numbers>
#include <optional>
#include <string>

#include "base/error.h"
#include "runtime/app/play_options.h"
#include "runtime/loop/device_link.h"
#include "runtime/loop/loop.h"
#include "runtime/loop/played_parts.h"

namespace palpate {

constexpr double degrees_a_radian = 180.0 / std::numbers::pi;

class LiveMotion;
class TwoLevelMotion;

/// Run and its parts; the pointers may be null.
struct PlayedRun {
  const PlayOptions& options;
  const Settings& settings;  ///< settings at the end
  const Body& body;
  const Tool& tool;
  const State& state;                  ///< after the last tick
  const LoopReport& report;            ///< report on the whole run
  const PlayedParts* parts = nullptr;  ///< if it may have been restarted; the state is the last session's
  const PatchSource* overlays = nullptr;
  const MotionSource* motion = nullptr;
  const DeviceLink* link = nullptr;
  std::int64_t dropped = 0;                     ///< ticks missing from the recording
  std::int64_t dropped_frames = 0;              ///< frames that the recording lacks
  std::optional<Error> recording_failure = {};  ///< reason if the recording is incomplete

  [[nodiscard]] const LiveMotion* live() const;      ///< of `motion`, null where it is another
  [[nodiscard]] const TwoLevelMotion* deep() const;  ///< likewise
};

/// Prints a few lines for a person, and warnings, to the error stream.
void print_report(const PlayedRun& run);

/// Returns the complete report for programs.
std::string json_report(const PlayedRun& run);

}  // namespace palpate
