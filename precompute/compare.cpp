#include "precompute/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "precompute/numerics/touched_boundary.h"

namespace palpate {
namespace {

constexpr std::size_t observed_places = 200;  // at which the displacement fields are compared

struct Extent3 {
  Vec3 low, high;
};

Extent3 extent_of(const Model& model) {
  Extent3 extent{model.mesh.nodes.front(), model.mesh.nodes.front()};
  for (const Vec3& x : model.mesh.nodes) {
    extent.low = extent.low.cwiseMin(x);
    extent.high = extent.high.cwiseMax(x);
  }
  return extent;
}

void check_same_body(const Model& a, const Model& b) {
  const std::string where = a.name + " and " + b.name,
                    hint = "Compare two files that were made from the same body";
  if (a.dimension() != b.dimension()) {
    throw Error(fmt::format("one is a body in {} dimensions, the other in {}", a.dimension(), b.dimension()),
                where, hint);
  }
  const Extent3 of_a = extent_of(a), of_b = extent_of(b);
  const double size = (of_a.high - of_a.low).norm();
  const double apart = std::max((of_a.low - of_b.low).norm(), (of_a.high - of_b.high).norm());
  if (apart > 0.05 * size) {
    throw Error(
        fmt::format("their bodies are not the same: the corners of their boxes are {:.3g} m apart, the body "
                    "is {:.3g} m large",
                    apart, size),
        where, hint);
  }
}

/// `count` of the nodes, spread out: starting with the first, each is the farthest from all before it.
std::vector<Index> spread(const Model& model, const std::vector<Index>& nodes, std::size_t count) {
  std::vector<Index> chosen;
  std::vector<double> distance(nodes.size(), INFINITY);
  std::size_t next = 0;
  while (chosen.size() < std::min(count, nodes.size())) {
    chosen.push_back(nodes[next]);
    const Vec3& x = model.mesh.nodes[static_cast<std::size_t>(chosen.back())];
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      distance[i] = std::min(distance[i], (model.mesh.nodes[static_cast<std::size_t>(nodes[i])] - x).norm());
    }
    next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  }
  return chosen;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2.0;
}

/// True if a tip at this place of the first file lies on the free boundary of both.
bool is_common(const Model& a, const TouchedBoundary& on_b, Index node, double radius) {
  const Vec3& x = a.mesh.nodes[static_cast<std::size_t>(node)];
  return on_b.nearest(x).distance < std::max(radius, on_b.mean_edge());
}

}  // namespace

Comparison compare(const Model& a, const Model& b, const CompareOptions& options) {
  check_same_body(a, b);
  const TouchedBoundary on_a(a), on_b(b);
  Comparison result{options.radius.value_or(3.0 * std::max(on_a.mean_edge(), on_b.mean_edge())), {}};
  if (on_a.free_nodes().empty() || on_b.free_nodes().empty()) {
    throw Error("no node of the boundary is free to be touched", a.name + " and " + b.name,
                "Hold a smaller part of the body in [[fixed]]");
  }

  struct Observed {
    Vec3 place;
    TouchedBoundary::Place on_a, on_b;
  };
  std::vector<Observed> observed;
  for (const Index node : spread(a, on_a.free_nodes(), observed_places)) {
    const Vec3& x = a.mesh.nodes[static_cast<std::size_t>(node)];
    observed.push_back({x, on_a.nearest(x), on_b.nearest(x)});
  }
  for (const Index node : spread(a, on_a.free_nodes(), static_cast<std::size_t>(options.touches))) {
    if (!is_common(a, on_b, node, result.radius)) continue;
    const Vec3& place = a.mesh.nodes[static_cast<std::size_t>(node)];
    const Vec3 direction = on_a.inward_normal(node);
    const Tip tip_a = on_a.tip(place, result.radius), tip_b = on_b.tip(place, result.radius);
    TouchComparison touch{place, 1.0 / on_a.compliance(tip_a, direction),
                          1.0 / on_b.compliance(tip_b, direction), 0.0};
    for (const Observed& at : observed) {
      if ((at.place - place).norm() < result.radius)
        continue;  // under the tip the pressure depends on the mesh
      const Vec3 u_a = touch.stiffness_a * on_a.displacement(at.on_a, tip_a, direction);
      const Vec3 u_b = touch.stiffness_b * on_b.displacement(at.on_b, tip_b, direction);
      touch.field_difference = std::max(touch.field_difference, (u_a - u_b).norm());
    }
    result.touches.push_back(touch);
  }
  if (result.touches.empty()) {
    throw Error("their free boundaries have no place in common", a.name + " and " + b.name,
                "Compare two files that were made from the same body");
  }
  return result;
}

std::string to_text(const Comparison& comparison) {
  std::string text = fmt::format(
      "finger tip of radius {:.4g} m; stiffness against the tip, displacement of the boundary beside it\n"
      "  {:>10} {:>10} {:>10}   {:>12} {:>12} {:>11} {:>14}\n",
      comparison.radius, "x [m]", "y [m]", "z [m]", "A [N/m]", "B [N/m]", "force", "displacement");
  std::vector<double> force, field;
  for (const TouchComparison& touch : comparison.touches) {
    force.push_back(std::abs(touch.force_difference()));
    field.push_back(touch.field_difference);
    text += fmt::format("  {:>10.4g} {:>10.4g} {:>10.4g}   {:>12.6g} {:>12.6g} {:>+10.3g} % {:>12.3g} %\n",
                        touch.place.x(), touch.place.y(), touch.place.z(), touch.stiffness_a,
                        touch.stiffness_b, 100.0 * touch.force_difference(), 100.0 * touch.field_difference);
  }
  text += fmt::format("force        differs by {:.3g} % (median), {:.3g} % at most\n", 100.0 * median(force),
                      100.0 * *std::max_element(force.begin(), force.end()));
  text += fmt::format("displacement differs by {:.3g} % (median), {:.3g} % at most\n", 100.0 * median(field),
                      100.0 * *std::max_element(field.begin(), field.end()));
  return text;
}

}  // namespace palpate
