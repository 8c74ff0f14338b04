#include "runtime/core/tick/state.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/number_text.h"
#include "runtime/core/solve/tick_tuning.h"

namespace palpate {
namespace {

void check(const Tool& tool, std::size_t number) {
  const auto check = [&](const char* what, double value, bool valid, const char* hint) {
    if (valid) return;
    throw Error(
        "the " + std::string(what) + " of tool " + std::to_string(number) + " is " + number_text(value),
        "tools", hint);
  };
  const auto size = [&](const char* what, double value) {
    check(what, value, std::isfinite(value) && value >= 0.0, "give a finite number that is not negative");
  };
  const auto bound = [&](const char* what, double value) {
    check(what, value, value > 0.0, "give a positive number, infinite for none");
  };
  size("radius", tool.radius);
  size("length", tool.length);
  size("disc radius", tool.disc_radius);
  check("disc radius", tool.disc_radius,
        tool.disc_radius == 0.0 || (tool.disc_radius >= tool.radius && tool.length == 0.0),
        "give at least the radius, and no length, or 0");
  size("reach", tool.reach);
  size("friction", tool.friction.value_or(0.0));
  bound("coupling stiffness", tool.coupling_stiffness);
  bound("coupling torsion", tool.coupling_torsion);
  bound("largest force", tool.max_force);
  bound("hand-over", tool.hand_over);
}

std::vector<ToolState> make_tools(const StateOptions& options) {
  if (options.tools.empty()) throw Error("there is no tool", "tools", "give at least one");
  if (options.max_contacts < 1) {
    throw Error("room for " + std::to_string(options.max_contacts) + " contacts was asked for", "tools",
                "ask for room for at least one");
  }
  if (!(options.tick > 0.0 && std::isfinite(options.tick))) {
    throw Error("a tick of " + number_text(options.tick) + " s was asked for", "tools",
                "ask for one that is positive");
  }
  std::vector<ToolState> tools;
  for (const Tool& tool : options.tools) {
    check(tool, tools.size());
    tools.emplace_back().tool = tool;
  }
  return tools;
}

/// Mean of the surface's own compliance over some nodes: the scale of a soft part.
double mean_compliance(const ElasticBody& body) {
  const std::vector<Index>& nodes = body.free_surface_nodes();
  const std::size_t stride = std::max<std::size_t>(1, nodes.size() / 64);
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t k = 0; k < nodes.size(); k += stride) {
    sum += body.greens().block(nodes[k], nodes[k]).trace() / body.dimension();
    count += 1.0;
  }
  return sum / count;
}

double least_compliance_of_a_node(const ElasticBody& body) {
  double least = std::numeric_limits<double>::infinity();
  for (const Index node : body.free_surface_nodes())
    least = std::min(least, body.greens().block(node, node).trace() / body.dimension());
  return least;
}

/// Capacity of the near field. A contact has up to three nodes; many contacts have nodes in common, and are
/// merged if there is no overlay.
Index near_room(const ElasticBody& body, const StateOptions& options) {
  const Index m = options.max_contacts;
  const Index most = options.patch_nodes > 0 ? std::min(3 * m + 32, 2 * m + 96) : 4 * m + 96;
  return std::min(most, body.aggregate_node(body.aggregates().count()));
}

SurfaceState make_surface(const ElasticBody& body, const StateOptions& options) {
  NearField near(body, near_room(body, options), options.patch_nodes);
  const ComplianceChange change(body, near.followed_room());
  FreeMotion motion(body, options.tick, static_cast<Index>(near.load().node.size()));
  return {.tree = SurfaceTree(body.simplices(), body.dimension(), body.surface_rest_positions(),
                              tuning.far.tree_margin * body.mean_surface_edge()),
          .near = std::move(near),
          .motion = std::move(motion),
          .stored_displacement = std::vector<double>(static_cast<std::size_t>(body.greens().order())),
          .sweep = FarSweep(body.runs().count()),
          .change = change,
          .patch = nullptr,
          .rigid_compliance = tuning.assembly.coincident_share * mean_compliance(body),
          .least_compliance = tuning.assembly.wall_share * least_compliance_of_a_node(body)};
}

}  // namespace

State::State(const ElasticBody& body, const StateOptions& options)
    : tick(options.tick),
      tools(make_tools(options)),
      contact_points(options.max_contacts),
      surface(make_surface(body, options)),
      scratch(body, static_cast<Index>(tools.size()), options.max_contacts, surface.near) {}

}  // namespace palpate
