#include "runtime/depth/deep_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "runtime/depth/two_levels.h"

namespace palpate {
namespace {

constexpr double least_step = 0.005;  // [s]
// A step of the demo's liver takes 40 ms, of one with 20 000 surface nodes 100 ms, where coarse bodies have
// 400 dofs.
constexpr double of_coarse_body = 0.02, of_node = 4e-6;  // [s]

}  // namespace

Model deep_model(Model model) {
  if (model.scope == Scope::none) {
    throw Error(
        "the file has no Green's functions: its scope is none", model.name,
        "leave out --depth and give it a --solver, or set another scope in [storage] and precompute it "
        "again");
  }
  model.overlay = {};
  model.dynamics = {};
  model.dynamics.method = DynamicsMethod::packed;
  model.dynamics.lumped = true;
  const double dofs = static_cast<double>(model.dimension()) * static_cast<double>(model.mesh.nodes.size());
  const double coarse = std::min(1.0, 0.8 * dofs / most_coarse_dofs);
  const double seconds =
      of_coarse_body * coarse * coarse + of_node * static_cast<double>(model.stored_nodes.size());
  model.dynamics.newmark.time_step = least_step * std::ceil(seconds / least_step);
  return model;
}

}  // namespace palpate
