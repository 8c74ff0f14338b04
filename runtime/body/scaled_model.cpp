#include "runtime/body/scaled_model.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "matrices/hierarchical.h"

namespace palpate {
namespace {

/// True if some vector is not zero along an axis that is held (`held`) or free according to `fixed`.
bool has_any(const std::vector<Vec3>& vectors, const std::vector<std::uint8_t>& fixed, bool held) {
  for (std::size_t node = 0; node < vectors.size(); ++node) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      const bool is_held = ((fixed[node] >> axis) & 1U) != 0;
      if (is_held == held && vectors[node][axis] != 0.0) return true;
    }
  }
  return false;
}

bool has_initial_strain(const Model& model) {
  return std::any_of(model.materials.begin(), model.materials.end(), [](const Material& material) {
    return material.initial_strain != std::array<double, 6>{};
  });
}

/// Scales the displacement at rest: by forces it is proportional to 1 / E, by prescribed displacements it is
/// unchanged.
void scale_rest(Model& model, double scale) {
  const bool prescribed = has_any(model.rest_displacement, model.fixed, true);
  const bool loaded = has_any(model.rest_force, model.fixed, false);
  if (loaded && (prescribed || has_initial_strain(model))) {
    throw Error(
        "the body rests under forces as well as prescribed displacements or initial strains, and what each "
        "of "
        "them does is not in the file",
        "--stiffness-scale",
        "give --load-scale 0 beside it, or change youngs_modulus in the model.toml and precompute it again");
  }
  if (!loaded) return;
  for (Vec3& u : model.rest_displacement) u /= scale;
}

}  // namespace

void scale_loads(Model& model, double scale) {
  for (Vec3& force : model.rest_force) force *= scale;
  for (Vec3& u : model.rest_displacement) u *= scale;
  for (Material& material : model.materials) {
    for (double& strain : material.initial_strain) strain *= scale;
  }
}

void scale_stiffness(Model& model, double scale) {
  if (scale == 1.0) return;
  if (model.dynamics.method == DynamicsMethod::packed) {
    throw Error("packed dynamics are of one stiffness: the inverse of K + a0 M + a1 C does not scale with K",
                "--stiffness-scale",
                "precompute the model with method = \"modal\" in [dynamics], or with another youngs_modulus");
  }
  scale_rest(model, scale);
  for (Material& material : model.materials) material.youngs_modulus *= scale;
  model.greens = model.greens.scaled(1.0 / scale);
  if (model.compressed != nullptr) {
    auto scaled = std::make_shared<HierarchicalMatrix>(*model.compressed);  // sharing its arrays
    scaled->scale /= scale;
    model.compressed = scaled;
  }
  for (Probe& probe : model.probes) {
    for (double& u : probe.displacement) u /= scale;
  }
  for (CondensedPatch& patch : model.overlay.patches) {
    patch.G *= scale;
    patch.compliance /= scale;
  }
  for (double& omega : model.dynamics.omega) omega *= std::sqrt(scale);
}

}  // namespace palpate
