#include "runtime/live/live_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "base/error.h"
#include "runtime/live/balance.h"
#include "runtime/live/implicit_step.h"
#include "runtime/live/live_forces.h"

namespace palpate {
namespace {

constexpr Index columns_at_once = 64;

/// Throws Error where nodes that can move begin in a wall.
void check_start(const LiveBody& body, const std::vector<Wall>& walls) {
  const int d = body.dimension();
  const double least = -1e-9 * (body.rest().maxCoeff() - body.rest().minCoeff());
  for (Index node = 0; node < std::ssize(body.mesh().nodes); ++node) {
    if (body.free_of_dof()[static_cast<std::size_t>(d * node)] < 0) continue;
    const Vec3 at = node_part(body.start(), d, node);
    for (const Wall& wall : walls) {
      const std::optional<WallGap> gap = gap_to(wall, at, at);
      if (!gap || gap->gap >= least) continue;
      throw Error(
          fmt::format("the body begins in {}: its node at ({:.4g}, {:.4g}, {:.4g}) m is {:.3g} m deep",
                      wall.box ? "the obstacle" : "a wall", at.x(), at.y(), at.z(), -gap->gap),
          wall.box ? "--obstacle" : "--floor and --room", "move it out of the body's way");
    }
  }
}

/// Where the body rests: in balance, where that is found.
Eigen::VectorXd rest_of(const LiveBody& body) {
  Eigen::VectorXd x = body.start();
  if (body.free_dofs() == body.dofs()) return x;
  return find_balance(body, body.load(), {}, x, {.tolerance = 1e-8}).converged ? x : body.start();
}

/// [n] free dof of each stored dof, -1 where it is held.
std::vector<Index> free_of_stored(const LiveBody& body, const std::vector<Index>& stored_nodes) {
  const int d = body.dimension();
  std::vector<Index> free;
  for (const Index node : stored_nodes) {
    for (int axis = 0; axis < d; ++axis)
      free.push_back(body.free_of_dof()[static_cast<std::size_t>(d * node + axis)]);
  }
  return free;
}

/// The blocks of a matrix's inverse, times `scale`, that belong to the stored dofs.
PackedGreens packed_inverse(const LiveMatrix& A, const std::vector<Index>& free, double scale) {
  TangentSolver solver({});
  if (!solver.set(A)) {
    throw Error("the body's stiffness at rest is not positive definite", "live body",
                "its loads may be too large for it: try --load-scale");
  }
  const auto order = std::ssize(free);
  const std::shared_ptr<double[]> packed(new double[static_cast<std::size_t>(packed_size(order))]);
  for (Eigen::Index first = 0; first < order; first += columns_at_once) {
    const Eigen::Index count = std::min<Eigen::Index>(columns_at_once, order - first);
    Eigen::MatrixXd E = Eigen::MatrixXd::Zero(A.rows(), count);
    for (Eigen::Index k = 0; k < count; ++k) {
      if (const Index dof = free[static_cast<std::size_t>(first + k)]; dof >= 0) E(dof, k) = scale;
    }
    const Eigen::MatrixXd columns = solver.by_factor(E);
    for (Eigen::Index k = 0; k < count; ++k) {
      for (Eigen::Index row = first + k; row < order; ++row) {
        const Index dof = free[static_cast<std::size_t>(row)];
        packed[packed_index(row, first + k, order)] = dof >= 0 ? columns(dof, k) : 0.0;
      }
    }
  }
  return {packed, order, Precision::double_precision};
}

}  // namespace

LiveParts make_live_parts(const Model& model, const LiveSettings& settings) {
  if (!is_implicit(settings.integrator)) {
    throw Error(
        std::string(name_of(settings.integrator)) + " is explicit, and a tool needs an implicit integrator",
        "--integrator", "take implicit-euler, midpoint or newmark");
  }
  LiveInput input = live_input(model);
  if (settings.free) {
    input.fixed.clear();
    input.held_displacement.clear();
  }
  LiveParts parts{LiveBody(std::move(input), live_options(settings)),
                  stepper_options(settings, model.dimension())};
  check_start(parts.body, parts.stepper.walls);
  return parts;
}

Model live_model(Model model, const LiveParts& live, const LiveSettings& settings) {
  const LiveBody& body = live.body;
  if (settings.free) std::fill(model.fixed.begin(), model.fixed.end(), std::uint8_t{0});
  const int d = body.dimension();
  const unsigned all_axes = (1U << static_cast<unsigned>(d)) - 1U;
  std::vector<Index> on_surface = model.surface;
  std::sort(on_surface.begin(), on_surface.end());
  on_surface.erase(std::unique(on_surface.begin(), on_surface.end()), on_surface.end());
  model.stored_nodes.clear();
  for (const Index node : on_surface) {
    if ((model.fixed[node] & all_axes) != all_axes) model.stored_nodes.push_back(node);
  }
  model.scope = Scope::surface;
  model.layers = 0;
  model.overlay = {};
  model.probes.clear();
  model.compressed = nullptr;
  model.dynamics = {};
  model.dynamics.method = DynamicsMethod::packed;
  model.dynamics.lumped = true;
  model.dynamics.newmark.time_step = live.stepper.time_step;
  model.dynamics.damping = body.options().damping;

  const Eigen::VectorXd x = rest_of(body);
  for (std::size_t node = 0; node < model.rest_displacement.size(); ++node)
    model.rest_displacement[node] =
        node_part(x, d, static_cast<Index>(node)) - node_part(body.rest(), d, static_cast<Index>(node));
  const StepFactors factors = step_factors(live.stepper.scheme.integrator, live.stepper.time_step);
  LiveMatrix A;
  assemble_tangent(body, x, {}, TangentKind::positive, A);
  for (Eigen::Index k = 0; k < A.nonZeros(); ++k)
    A.valuePtr()[k] *= 1.0 + factors.t * body.options().damping.stiffness;
  for (Index free = 0; free < body.free_dofs(); ++free)
    A.valuePtr()[body.pattern().diagonal()[free]] +=
        (factors.s + factors.t * body.options().damping.mass) * body.mass()[body.dof_of_free()[free]];
  model.greens = packed_inverse(A, free_of_stored(body, model.stored_nodes), factors.ahead);
  return model;
}

}  // namespace palpate
