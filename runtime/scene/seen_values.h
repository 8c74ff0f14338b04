// Values of a picture at the drawn nodes.
#pragma once

#include <cmath>
#include <limits>

#include "runtime/scene/scene.h"

namespace palpate {

/// Values at node k of the scene or, from S on, of the patch. Keeps references: all arguments must outlive
/// it. The picture fits.
class SeenValues {
 public:
  SeenValues(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch)
      : picture_(picture), scene_(scene), patch_(patch) {}

  [[nodiscard]] std::size_t scene_nodes() const { return scene_.nodes.size(); }
  [[nodiscard]] std::size_t patch_nodes() const { return patch_ == nullptr ? 0 : patch_->nodes.size(); }

  /// Displacement x, y, z of node k from its position without loads [m].
  [[nodiscard]] const float* displacement(std::size_t k) const {
    const bool of_plane = scene_.is_plane && k < scene_nodes();
    return (of_plane ? picture_.plane_displacement : picture_.frame.displacement).data() + 3 * value(k);
  }
  /// Von Mises stress; NaN where unknown [Pa].
  [[nodiscard]] float von_mises(std::size_t k) const {
    const bool of_plane = scene_.is_plane && k < scene_nodes();
    return at(of_plane ? picture_.plane_von_mises : picture_.frame.von_mises, value(k));
  }
  /// Contact pressure [Pa] at a surface node.
  struct Pressure {
    Index node;  ///< node of the scene, or from S on of the patch
    float value;
  };
  [[nodiscard]] std::vector<Pressure> pressures() const {
    std::vector<Pressure> found;
    const std::size_t of_body =
        scene_.is_plane ? scene_.surface_nodes.size() : scene_nodes();  // surface nodes of the body
    const auto add = [&](std::size_t node, std::size_t surface_node) {
      const float p = at(picture_.frame.pressure, surface_node);
      if (std::isfinite(p) && p != 0.0F) found.push_back({static_cast<Index>(node), p});
    };
    for (std::size_t k = 0; k < of_body; ++k)
      add(scene_.is_plane ? static_cast<std::size_t>(scene_.surface_nodes[k]) : k, k);
    for (std::size_t k = 0; k < patch_nodes(); ++k)
      add(scene_nodes() + k, static_cast<std::size_t>(patch_->surface_nodes[k]));
    return found;
  }

 private:
  [[nodiscard]] std::size_t value(std::size_t k) const {
    return patch_ == nullptr || k < scene_nodes()
               ? k
               : static_cast<std::size_t>(patch_->surface_nodes[k - scene_nodes()]);
  }
  [[nodiscard]] static float at(const std::vector<float>& values, std::size_t k) {
    return k < values.size() ? values[k] : std::numeric_limits<float>::quiet_NaN();
  }

  const SurfacePicture& picture_;
  const Scene& scene_;
  const ScenePatch* patch_;
};

}  // namespace palpate
