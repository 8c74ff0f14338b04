#include "runtime/core/tick/clearance.h"

#include <algorithm>

#include "runtime/core/solve/tick_tuning.h"

namespace palpate {
namespace {

/// True if no simplex is within a distance of a tool's core or cut by it.
bool keeps_distance(const ElasticBody& body, const SurfaceTree& tree, DetectionScratch& detection,
                    const Tool& tool, const Core& core, double distance) noexcept {
  const std::size_t count = near_core(tree, core, distance, detection.found);
  return std::all_of(detection.found.begin(), detection.found.begin() + static_cast<std::ptrdiff_t>(count),
                     [&](Index simplex) {
                       const NearestPoint pair =
                           nearest_points(tree, nodes_of(body, simplex), core, has_point_core(tool));
                       return pair.squared_distance > 0.0 && pair.squared_distance >= distance * distance;
                     });
}

}  // namespace

bool is_outside(const ElasticBody& body, const SurfaceTree& tree, DetectionScratch& detection,
                const Tool& tool, const ToolPose& pose) noexcept {
  const Core core = core_of(tool, pose, body.dimension());
  return !tree.inside(core.origin) &&
         (has_point_core(tool) ||
          (!tree.inside(core.end) && keeps_distance(body, tree, detection, tool, core, 0.0)));
}

bool is_clear(const ElasticBody& body, const SurfaceTree& tree, DetectionScratch& detection, const Tool& tool,
              const ToolPose& pose) noexcept {
  const Core core = core_of(tool, pose, body.dimension());
  const double radius = tool.radius - tuning.detection.on_surface * body.mean_surface_edge();
  return is_outside(body, tree, detection, tool, pose) &&
         (radius <= 0.0 || keeps_distance(body, tree, detection, tool, core, radius));
}

}  // namespace palpate
