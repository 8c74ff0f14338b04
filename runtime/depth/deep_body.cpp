#include "runtime/depth/deep_body.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/error.h"
#include "runtime/depth/coarse_parts.h"

namespace palpate {
namespace {

constexpr double least_step = 0.005;  // [s]
constexpr double most_step = 0.1;     // [s] of a hand: as long as the tick foresees its motion
// A step of the demo's liver takes 10 to 40 ms, of one with 20 000 surface nodes 30 to 80 ms, where coarse
// bodies have 400 dofs.
constexpr double of_coarse_body = 0.02, of_node = 2e-6;  // [s]

/// Time that a step takes [s].
double step_of(const Model& model) noexcept {
  const double dofs = static_cast<double>(model.dimension()) * static_cast<double>(model.mesh.nodes.size());
  const double coarse = std::min(1.0, 0.8 * dofs / most_coarse_dofs);
  const double seconds =
      of_coarse_body * coarse * coarse + of_node * static_cast<double>(model.stored_nodes.size());
  return least_step * std::ceil(seconds / least_step);
}

}  // namespace

bool goes_deep(const Model& model) noexcept {
  return model.dimension() == 3 && model.scope != Scope::none &&
         model.dynamics.method == DynamicsMethod::none && step_of(model) <= most_step;
}

Body deep_body(Model model, int refinement, bool local) {
  if (model.scope == Scope::none) {
    throw Error(
        "the file has no Green's functions: its scope is none", model.name,
        "leave out --depth and give it a --solver, or set another scope in [storage] and precompute it "
        "again");
  }
  auto coarse = std::make_shared<const CoarseParts>(make_coarse_parts(model));
  const double step = step_of(model);
  return {std::move(model), {.coarse = coarse, .nodes = coarse->nodes, .step = step}, refinement, local};
}

}  // namespace palpate
