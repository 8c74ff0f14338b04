#include "runtime/live/live_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "base/error.h"
#include "runtime/live/step_compliance.h"
#include "runtime/live/wall_contacts.h"
#include "statics/balance.h"

namespace palpate {
namespace {

constexpr Eigen::Index most_seen_dofs =
    3000;  // limit for a body in the plane with a visible interior; a larger W is not renewed

/// Throws Error if a movable node starts inside a wall.
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

/// Rest position: that of balance, if it is found.
Eigen::VectorXd rest_of(const LiveBody& body) {
  Eigen::VectorXd x = body.start();
  if (body.free_dofs() == body.dofs()) return x;
  return find_balance(body, body.load(), {}, x, {.tolerance = 1e-8}).converged ? x : body.start();
}

/// Compliance of a step at x.
PackedGreens compliance_at(const LiveParts& live, const Eigen::VectorXd& x, const std::vector<Index>& nodes) {
  StepCompliance compliance(live.body, live.stepper, nodes);
  if (!compliance.begin(x, {})) {
    throw Error("the body's stiffness at rest is not positive definite", "live body",
                "its loads may be too large for it: try --load-scale");
  }
  compliance.find_all(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  return compliance.take();
}

/// Returns all nodes, or those on the surface, ascending.
std::vector<Index> nodes_in(const Model& model) {
  std::vector<Index> nodes = model.surface;
  if (model.scope == Scope::full) nodes = model.mesh.connectivity;
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

void use_poissons_ratio(const LiveSettings& settings, std::vector<Material>& materials) {
  if (!settings.poissons_ratio) return;
  for (Material& material : materials) material.poissons_ratio = *settings.poissons_ratio;
}

}  // namespace

LiveParts make_live_parts(const Model& model, const LiveSettings& settings) {
  LiveInput input = live_input(model);
  if (settings.free) {
    input.fixed.clear();
    input.held_displacement.clear();
  }
  use_poissons_ratio(settings, input.materials);
  LiveParts parts{LiveBody(std::move(input), live_options(settings)),
                  stepper_options(settings, model.dimension())};
  check_start(parts.body, parts.stepper.walls);
  if (!is_implicit(settings.integrator)) LiveStepper(parts.body, parts.stepper);  // throws if unstable
  return parts;
}

Model live_model(Model model, const LiveParts& live, const LiveSettings& settings) {
  const LiveBody& body = live.body;
  if (settings.free) std::fill(model.fixed.begin(), model.fixed.end(), std::uint8_t{0});
  use_poissons_ratio(settings, model.materials);
  const int d = body.dimension();
  const unsigned all_axes = (1U << static_cast<unsigned>(d)) - 1U;
  model.scope = d == 2 && body.dofs() <= most_seen_dofs ? Scope::full : Scope::surface;
  model.stored_nodes.clear();
  for (const Index node : nodes_in(model)) {
    if ((model.fixed[node] & all_axes) != all_axes) model.stored_nodes.push_back(node);
  }
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
  model.greens = compliance_at(live, x, model.stored_nodes);
  return model;
}

}  // namespace palpate
