#include "runtime/warp/warped_model.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/error.h"

namespace palpate {
namespace {

constexpr double least_step = 0.005;    // [s]
constexpr double bytes_a_second = 4e9;  // Green's functions that a thread multiplies per second
constexpr double rounds_a_step = 2.0;

/// Returns the rows and columns of some degrees of freedom.
template <class T>
std::shared_ptr<const void> part_of(std::span<const T> packed, std::int64_t order,
                                    const std::vector<std::int64_t>& dofs) {
  const auto n = std::ssize(dofs);
  std::shared_ptr<T[]> part(new T[static_cast<std::size_t>(packed_size(n))]);
  for (std::int64_t j = 0; j < n; ++j) {
    for (std::int64_t i = j; i < n; ++i) {
      const auto [low, high] =
          std::minmax(dofs[static_cast<std::size_t>(i)], dofs[static_cast<std::size_t>(j)]);
      part[packed_index(i, j, n)] = packed[static_cast<std::size_t>(packed_index(high, low, order))];
    }
  }
  return part;
}

PackedGreens part_of(const PackedGreens& greens, const std::vector<std::int64_t>& dofs) {
  std::shared_ptr<const SmoothPart> smooth;
  if (const SmoothPart* all = greens.smooth().get(); all != nullptr) {
    auto part = std::make_shared<SmoothPart>();
    part->terms = all->terms;
    for (const std::int64_t dof : dofs)
      part->rows.insert(part->rows.end(), all->row(dof), all->row(dof) + all->terms);
    smooth = std::move(part);
  }
  const std::shared_ptr<const void> data = has_float_entries(greens.precision())
                                               ? part_of(greens.as<float>(), greens.order(), dofs)
                                               : part_of(greens.as<double>(), greens.order(), dofs);
  return PackedGreens(data, std::ssize(dofs), greens.precision(), smooth).scaled(greens.scale());
}

void keep_surface(Model& model) {
  std::vector<bool> on_surface(model.mesh.nodes.size(), false);
  for (const Index node : model.surface) on_surface[static_cast<std::size_t>(node)] = true;
  std::vector<Index> nodes;
  std::vector<std::int64_t> dofs;
  const int d = model.dimension();
  for (std::size_t k = 0; k < model.stored_nodes.size(); ++k) {
    if (!on_surface[static_cast<std::size_t>(model.stored_nodes[k])]) continue;
    nodes.push_back(model.stored_nodes[k]);
    for (int axis = 0; axis < d; ++axis)
      dofs.push_back(std::int64_t{d} * static_cast<std::int64_t>(k) + axis);
  }
  if (nodes.size() < model.stored_nodes.size()) {
    if (model.compressed != nullptr) {
      throw Error("its compressed Green's functions are of nodes below the surface too", model.name,
                  "precompute it with scope = \"surface\" in [storage] to play it with --warp");
    }
    model.greens = part_of(model.greens, dofs);
    model.stored_nodes = std::move(nodes);
  }
  model.scope = Scope::surface;
  model.layers = 0;
}

}  // namespace

Model warped_model(Model model) {
  if (model.scope == Scope::none) {
    throw Error(
        "the file has no Green's functions to warp: its scope is none", model.name,
        "leave out --warp and give it a --solver, or set another scope in [storage] and precompute it "
        "again");
  }
  keep_surface(model);
  model.overlay = {};
  model.probes.clear();
  model.dynamics = {};
  model.dynamics.method = DynamicsMethod::packed;
  model.dynamics.lumped = true;
  const double n = static_cast<double>(model.stored_dofs());
  const double bytes = n * n * static_cast<double>(bytes_per_scalar(model.greens.precision()));
  const double steps = std::ceil(rounds_a_step * bytes / bytes_a_second / least_step);
  model.dynamics.newmark.time_step = least_step * std::max(1.0, model.compressed != nullptr ? 1.0 : steps);
  return model;
}

}  // namespace palpate
