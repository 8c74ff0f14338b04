// A recording as the viewer shows it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/recording.h"
#include "runtime/background/surface_frames.h"
#include "runtime/loop/monitor.h"
#include "runtime/scene/scene.h"

namespace palpate {

/// Consecutive samples of a recording's ticks, `stride` apart.
struct TickRun {
  std::vector<TickNote> notes;
  std::int64_t stride = 1;
};

/// The pictures, plots and words of a recording. Needs no model.
class SessionPictures {
 public:
  /// Reads all except the frames' values. Throws Error when it is no recording or has no frames.
  explicit SessionPictures(const std::filesystem::path& path);

  [[nodiscard]] Scene scene() const { return make_scene(recording().frames.surface, 1); }
  [[nodiscard]] std::int64_t frames() const noexcept { return std::ssize(recording().frames.tick); }
  /// Times of all frames [s].
  [[nodiscard]] const std::vector<double>& times() const noexcept { return recording().frames.time; }
  [[nodiscard]] double time(std::int64_t frame) const {  ///< [s]
    return recording().frames.time[static_cast<std::size_t>(frame)];
  }
  [[nodiscard]] const RecordedSurface& surface() const noexcept { return recording().frames.surface; }
  [[nodiscard]] std::string name() const;  ///< of the model
  [[nodiscard]] Tool tool() const;         ///< that touched it at the start
  /// The picture of frame 0 .. frames() - 1, with the tool as it was in its tick. Throws Error when it cannot
  /// be read.
  [[nodiscard]] SurfacePicture picture(std::int64_t frame) const;
  /// The members of the message `state` that are the run's, for frames at these times, the first of which is
  /// shown.
  [[nodiscard]] nlohmann::json state(const std::vector<double>& times) const;
  /// All ticks, thinned out to some 100 000 samples: a run for each stretch without a gap.
  [[nodiscard]] std::vector<TickRun> ticks() const;

 private:
  [[nodiscard]] const TickRecord* tick(std::int64_t number) const;

  [[nodiscard]] const Recording& recording() const noexcept { return file_.recording(); }

  RecordingFile file_;
  std::string name_;  // of the file
};

}  // namespace palpate
