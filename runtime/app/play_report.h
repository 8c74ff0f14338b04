// What is told of a run when it is over.
#pragma once

#include <optional>
#include <string>

#include "base/error.h"
#include "runtime/app/play_options.h"
#include "runtime/loop/device_link.h"
#include "runtime/loop/loop.h"
#include "runtime/loop/played_parts.h"

namespace palpate {

/// A run and its parts; the pointers may be null.
struct PlayedRun {
  const PlayOptions& options;
  const Settings& settings;  ///< as they were in the end
  const Body& body;
  const Tool& tool;
  const State& state;                  ///< after the last tick
  const LoopReport& report;            ///< of all of it
  const PlayedParts* parts = nullptr;  ///< where it may have been begun anew; the state is the last one's
  const PatchSource* overlays = nullptr;
  const MotionSource* motion = nullptr;
  const DeviceLink* link = nullptr;
  std::int64_t dropped = 0;                     ///< ticks that the recording lacks
  std::int64_t dropped_frames = 0;              ///< and frames
  std::optional<Error> recording_failure = {};  ///< why it is not whole
};

/// A few lines for a person, and warnings, on the error stream.
void print_report(const PlayedRun& run);

/// All of it for programs.
std::string json_report(const PlayedRun& run);

}  // namespace palpate
