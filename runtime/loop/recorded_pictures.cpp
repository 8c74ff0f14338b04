#include "runtime/loop/recorded_pictures.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/background/surface_frames.h"
#include "runtime/loop/loading.h"
#include "runtime/loop/settings.h"

namespace palpate {
namespace {

/// Finds the model of a recording. Throws Error if it is missing.
std::filesystem::path find_model(const RecordingFile& recording) {
  const std::filesystem::path was = recording.info().model_path;
  const std::filesystem::path beside = recording.path().parent_path();
  const std::string& hash = recording.info().content_hash;
  std::filesystem::path other;
  for (const std::filesystem::path& file : {was, beside / was, beside / was.filename()}) {
    std::error_code failed;
    if (!std::filesystem::is_regular_file(file, failed)) continue;
    if (stored_content_hash(file) == hash) return file;
    other = file;
  }
  const std::string needed = "pictures are computed from contact forces by the model " + was.string();
  if (!other.empty()) {
    throw Error(needed + ", and " + other.string() + " is another one or another precomputation of it",
                recording.path().string(),
                "put the one that was recorded there, whose content hash is " + hash);
  }
  throw Error(needed + ", which is not there", recording.path().string(),
              "put it there, or beside the recording; ticks are read without it");
}

}  // namespace

RecordedPictures::RecordedPictures(const RecordingFile& recording) : recording_(recording) {
  if (recording.stores_pictures()) return;
  const Settings settings = read_settings(split_settings(recording.info().options));
  std::unique_ptr<const Body> body(new Body(load_body(find_model(recording), {}, settings.body())));
  body_ = std::move(body);
  if (!pictures_follow_from_contacts(*body_) ||
      recorded_surface(*body_).pressed_nodes() != recording.surface().pressed_nodes())
    throw Error("has contact forces of another body than its model is", recording.path().string(),
                "copy the file again, or record the session again");
  maker_ = std::make_unique<PictureMaker>(*body_);
}

SurfaceFrame RecordedPictures::frame(std::int64_t number) {
  return maker_ ? maker_->picture(recording_.loads(number)) : recording_.frame(number);
}

}  // namespace palpate
