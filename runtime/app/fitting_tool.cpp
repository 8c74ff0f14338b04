#include "runtime/app/fitting_tool.h"

#include <fmt/core.h>

#include <algorithm>
#include <string>

#include "base/program.h"
#include "runtime/loop/mesh_stiffening.h"
#include "runtime/loop/output.h"

namespace palpate {
namespace {

constexpr double least_share = 0.03;  // fraction of the body's diagonal
constexpr double most_share = 0.1;

double diagonal(const Body& body) {
  return body.bounds().diagonal().norm();
}

}  // namespace

double fitting_radius(const Body& body) {
  const double radius =
      std::clamp(body.mean_surface_edge(), least_share * diagonal(body), most_share * diagonal(body));
  return std::stod(fmt::format("{:.1e}", radius));
}

std::string too_large(const Tool& tool, double size) {
  const double length = tool.disc_radius > 0.0 ? 2.0 * tool.disc_radius : 2.0 * tool.radius + tool.length;
  if (!(length > size)) return "";
  return fmt::format("the tool is {:.4g} m long, and the whole body {:.4g} m", length, size);
}

std::string too_small(const Tool& tool, const Body& body) {
  if (body.local() != nullptr) return "";
  const double edge = body.mean_surface_edge();
  const double radius = std::max(tool.radius, tool.disc_radius);
  if (!(radius > 0.0))
    return fmt::format("the tool has no radius: what it feels is a mesh with edges of {:.2g} m", edge);
  const double slight = 0.1 * radius;
  const double stiffening = mesh_stiffening(body, tool, radius);
  if (!(stiffening > noticed_stiffening)) return "";
  return fmt::format(
      "the tool is small for the mesh, whose edges are {:.2g} m: pressed in by {:.2g} m the body is about "
      "{:.1f} times too stiff, by {:.2g} m {:.1f} times",
      edge, slight, mesh_stiffening(body, tool, slight), radius, stiffening);
}

void tell_small_tool(const std::string& note) {
  if (!note.empty()) say(stderr, "{}; a larger tool, a finer mesh or tet10 are truer\n", note);
}

void settle_tool(PlayOptions& options, const Body& body) {
  if (options.device.is_live() && !options.settings_text.contains("tool")) {
    const std::string tool = fmt::format("sphere:{}", fitting_radius(body));
    options.settings_text["tool"] = tool;
    options.settings.tool.radius = fitting_radius(body);
    say(stderr, "tool: {}, which suits the body; --tool takes another one\n", tool);
  }
  const std::string problem = too_large(options.settings.tool, diagonal(body));
  if (!problem.empty())
    print_warning(problem + ": lengths are metres, a radius of 8 mm is --tool sphere:0.008");
}

}  // namespace palpate
