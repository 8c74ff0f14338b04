// Recording as shown by the viewer.
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

/// Pictures, plots and state of a recording. For one thread at a time.
class SessionPictures {
 public:
  /// Throws Error if it is not a recording, has no pictures, or its model for computing them is missing.
  explicit SessionPictures(const std::filesystem::path& path);
  SessionPictures(const SessionPictures&) = delete;
  SessionPictures& operator=(const SessionPictures&) = delete;

  [[nodiscard]] Scene scene() const { return make_scene(surface(), 1); }
  [[nodiscard]] std::int64_t frames() const noexcept { return std::ssize(file_.pictures()); }
  [[nodiscard]] std::vector<double> times() const;       ///< times of all frames [s]
  [[nodiscard]] double time(std::int64_t frame) const {  ///< [s]
    return file_.pictures()[static_cast<std::size_t>(frame)].time;
  }
  [[nodiscard]] const RecordedSurface& surface() const noexcept { return file_.surface(); }
  [[nodiscard]] const RecordingFile& recording() const noexcept { return file_; }
  [[nodiscard]] std::string name() const;  ///< name of the model
  [[nodiscard]] Tool tool() const;         ///< tool at the start
  /// Returns the picture of frame 0 .. frames() - 1, with the tool pose of its tick. Throws Error if it
  /// cannot be read.
  [[nodiscard]] SurfacePicture picture(std::int64_t frame) const;
  /// Returns the common members of the message `state`, for frames at these times, the first of which is
  /// shown.
  [[nodiscard]] nlohmann::json state(const std::vector<double>& times) const;
  /// Returns all ticks, thinned out to about 100 000 samples: a run for each range without a gap.
  [[nodiscard]] std::vector<TickRun> ticks() const;

 private:
  [[nodiscard]] std::optional<TickRecord> tick(std::int64_t number) const;

  RecordingFile file_;
  mutable RecordedPictures pictures_;  // mutable: it has a workspace
};

}  // namespace palpate
