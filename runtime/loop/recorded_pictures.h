// The pictures of a recording, whether they are stored or not.
#pragma once

#include <memory>

#include "formats/recording.h"
#include "runtime/background/picture_maker.h"
#include "runtime/body/body.h"

namespace palpate {

/// Shows the surface at the moments of a recording: as it is stored, or computed from the forces of its
/// contacts by the model that it was recorded with. One thread uses it at a time.
class RecordedPictures {
 public:
  /// `recording` must live as long. Where pictures are computed the model is looked for where it was, and
  /// beside the recording; the first file with its content hash is loaded. Throws Error where there is none,
  /// or it cannot be loaded.
  explicit RecordedPictures(const RecordingFile& recording);

  /// Picture 0 .. pictures().size() - 1. Throws Error when it cannot be read.
  [[nodiscard]] SurfaceFrame frame(std::int64_t number);

 private:
  const RecordingFile& recording_;
  std::unique_ptr<const Body> body_;  // null: pictures are stored
  std::unique_ptr<PictureMaker> maker_;
};

}  // namespace palpate
