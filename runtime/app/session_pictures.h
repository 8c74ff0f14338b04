// A recording as the viewer shows it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "formats/recording.h"
#include "runtime/background/surface_frames.h"
#include "runtime/loop/monitor.h"
#include "runtime/loop/recorded_pictures.h"
#include "runtime/scene/scene.h"

namespace palpate {

/// Consecutive samples of a recording's ticks, `stride` apart.
struct TickRun {
  std::vector<TickNote> notes;
  std::int64_t stride = 1;
};

/// The pictures, plots and words of a recording. One thread uses it at a time.
class SessionPictures {
 public:
  /// Throws Error when it is no recording, has no pictures, or lacks the model that computes them.
  explicit SessionPictures(const std::filesystem::path& path);
  SessionPictures(const SessionPictures&) = delete;
  SessionPictures& operator=(const SessionPictures&) = delete;

  [[nodiscard]] Scene scene() const { return make_scene(surface(), 1); }
  [[nodiscard]] std::int64_t frames() const noexcept { return std::ssize(file_.pictures()); }
  [[nodiscard]] std::vector<double> times() const;       ///< of all frames [s]
  [[nodiscard]] double time(std::int64_t frame) const {  ///< [s]
    return file_.pictures()[static_cast<std::size_t>(frame)].time;
  }
  [[nodiscard]] const RecordedSurface& surface() const noexcept { return file_.surface(); }
  [[nodiscard]] const RecordingFile& recording() const noexcept { return file_; }
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
  [[nodiscard]] std::optional<TickRecord> tick(std::int64_t number) const;

  RecordingFile file_;
  mutable RecordedPictures pictures_;  // its workspace changes
};

}  // namespace palpate
