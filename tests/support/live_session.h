// Live bodies as a tick meets them.
#pragma once

#include <memory>

#include "meshes/generate.h"
#include "runtime/body/body.h"
#include "runtime/live/live_model.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::test {

inline Body live_session(Model model, const LiveSettings& settings) {
  auto live = std::make_shared<const LiveParts>(make_live_parts(model, settings));
  model = live_model(std::move(model), *live, settings);
  return {std::move(model), std::move(live)};
}

/// A bar of 80 x 20 (x 20) mm, soft as tissue, clamped at x = 0 unless it is free; of tri3 or tet4.
inline Body live_bar(int dimension, const LiveSettings& settings) {
  Mesh mesh = dimension == 2
                  ? generate(RectangleShape{Vec3::Zero(), {0.08, 0.02, 0}, {12, 3}}, ElementType::tri3)
                  : generate(BoxShape{Vec3::Zero(), Vec3(0.08, 0.02, 0.02), {8, 2, 2}}, ElementType::tet4);
  Model model = bake(
      std::move(mesh), [](const Vec3& x) { return x.x() < 1e-9; }, Scope::surface,
      Precision::double_precision);
  model.materials[0].youngs_modulus = 5e3;
  return live_session(std::move(model), settings);
}

}  // namespace palpate::test
