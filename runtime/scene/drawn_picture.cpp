#include "runtime/scene/drawn_picture.h"

#include <utility>

namespace palpate {

std::optional<DrawnPicture> PictureDrawing::draw(SurfacePicture picture, const Body* body) {
  if (scene_ == nullptr) return std::nullopt;
  if (picture.patch != patch_ || scene_ != patch_scene_) {
    patch_ = picture.patch;
    patch_scene_ = scene_;
    drawn_patch_.reset();
    if (picture.patch != nullptr && body != nullptr) {
      auto drawn = std::make_shared<ScenePatch>(make_scene_patch(*body, *scene_, *picture.patch));
      drawn->number = ++patches_;
      drawn_patch_ = std::move(drawn);
    }
  }
  picture.patch.reset();
  if (!fits(picture, *scene_, drawn_patch_.get())) return std::nullopt;
  return DrawnPicture{scene_, drawn_patch_, std::move(picture)};
}

}  // namespace palpate
