// Pictures with what they are drawn on.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "runtime/scene/scene.h"

namespace palpate {

/// A picture and what it is drawn on.
struct DrawnPicture {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const ScenePatch> patch;  ///< null: none
  SurfacePicture picture;                   ///< without its patch
};

/// Draws the overlay of pictures anew where it is another one than the last picture's.
class PictureDrawing {
 public:
  /// All pictures from now on are of this scene.
  void set_scene(std::shared_ptr<const Scene> scene) { scene_ = std::move(scene); }
  /// Nothing where the picture has no values for all nodes, or there is no scene. `body`, which the scene is
  /// of, is used during the call only: null for no overlay.
  [[nodiscard]] std::optional<DrawnPicture> draw(SurfacePicture picture, const Body* body);

 private:
  std::shared_ptr<const Scene> scene_;
  // The last picture's. The patch is kept so that no other one can have its address.
  std::shared_ptr<const Scene> patch_scene_;
  std::shared_ptr<const Patch> patch_;
  std::shared_ptr<const ScenePatch> drawn_patch_;
  std::uint32_t patches_ = 0;
};

}  // namespace palpate
