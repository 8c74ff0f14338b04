// Pictures together with the scene and overlay that they belong to.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "runtime/scene/scene.h"

namespace palpate {

/// Picture with its scene and overlay.
struct DrawnPicture {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const ScenePatch> patch;  ///< null: no overlay
  SurfacePicture picture;                   ///< without its own patch
};

/// Attaches scene and overlay to pictures; the overlay's drawing is rebuilt when it differs from the last
/// picture's.
class PictureDrawing {
 public:
  /// Sets the scene of all pictures from now on.
  void set_scene(std::shared_ptr<const Scene> scene) { scene_ = std::move(scene); }
  /// Returns nothing if the picture lacks values for some nodes, or there is no scene. `body`, to which the
  /// scene belongs, is used only during the call; null for no overlay.
  [[nodiscard]] std::optional<DrawnPicture> draw(SurfacePicture picture, const Body* body);

 private:
  std::shared_ptr<const Scene> scene_;
  // Cache for the last picture. The patch is kept alive so that no other one can get its address.
  std::shared_ptr<const Scene> patch_scene_;
  std::shared_ptr<const Patch> patch_;
  std::shared_ptr<const ScenePatch> drawn_patch_;
  std::uint32_t patches_ = 0;
};

}  // namespace palpate
