// Pictures of a recording, stored or computed.
#pragma once

#include <memory>

#include "formats/recording.h"
#include "runtime/background/picture_maker.h"
#include "runtime/body/body.h"

namespace palpate {

/// Provides the surface at the times of a recording: as stored, or computed from the contact forces with the
/// model of the recording. For one thread at a time.
class RecordedPictures {
 public:
  /// `recording` must outlive this. If pictures are computed, the model is searched at its original path and
  /// beside the recording; the first file with its content hash is loaded. Throws Error if there is none, or
  /// it cannot be loaded.
  explicit RecordedPictures(const RecordingFile& recording);

  /// Returns picture 0 .. pictures().size() - 1. Throws Error if it cannot be read.
  [[nodiscard]] SurfaceFrame frame(std::int64_t number);

 private:
  const RecordingFile& recording_;
  std::unique_ptr<const Body> body_;  // null if pictures are stored
  std::unique_ptr<PictureMaker> maker_;
};

}  // namespace palpate
