// How a press feels over its depth: by small strain, on two levels, and by the whole mesh with large strain.
//
//   depth_study FILE RADIUS X Y Z DX DY DZ DEPTH...
//
// A sphere goes on a line through the point along the direction, and to each depth [m] from where it touches,
// without friction, on the mesh's own surface. Prints CSV: depth, contact points, forces [N] by the three,
// that of the whole mesh for the contact points of either, and largest distances of surface nodes from the
// whole mesh's, of the largest displacement. scripts/studies/depth makes a table and a picture of it.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>

#include "formats/model_file.h"
#include "runtime/background/motion_source.h"
#include "runtime/depth/deep_body.h"
#include "tests/support/bodies/whole_press.h"

namespace palpate::test {
namespace {

struct Felt {
  double force = 0.0;  // [N]
  std::size_t points = 0;
  double whole = NAN;  // force of the whole mesh for the same points
  double off = NAN;    // largest distance of a surface node, of the largest displacement
};

/// Presses at 15 mm/s and waits.
Felt felt(const Body& body, double radius, const Vec3& from, const Vec3& direction, double depth) {
  State state(body, {.tools = {Tool{.radius = radius, .friction = 0.0}}});
  std::unique_ptr<MotionSource> source;
  if (body.contact_model() == ContactModel::two_level)
    source = std::make_unique<MotionSource>(body, state, MotionSourceOptions{.in_background = false});
  constexpr double apart = 0.002;  // at first [m]: a tool that begins within the body is not felt
  const int ticks = static_cast<int>(1e3 * (depth + apart) / 0.015);
  for (int k = 0; k <= ticks + 600; ++k) {
    if (source) source->receive(state);
    step(body, state,
         {.position =
              from + (std::min(1.0, static_cast<double>(k) / ticks) * (depth + apart) - apart) * direction});
    if (source) source->post(state);
  }
  Felt result;
  result.force = state.tools[0].contact_wrench.force.norm();
  const std::vector<PressedPoint> points = pressed_points(body, state);
  result.points = points.size();
  const LiveBody whole(live_input(body.model()), {.law = LiveLaw::neo_hookean});
  Eigen::VectorXd x = whole.start();
  const std::optional<Vec3> force = press_whole(whole, points, x, 1 + static_cast<int>(depth / 0.003));
  if (!force) return result;
  result.whole = force->norm();
  std::vector<Vec3> u(body.surface_rest_positions().size());
  std::vector<double> stored(static_cast<std::size_t>(body.greens().order()));
  MotionSnapshot motion(body);
  state.surface.motion.snapshot(motion);
  surface_displacement(body, state.surface.near.load(), stored, u, &motion);
  double largest = 0.0, off = 0.0;
  for (std::size_t k = 0; k < body.surface_mesh_nodes().size(); ++k) {
    const Eigen::Index dof = 3 * Eigen::Index{body.surface_mesh_nodes()[k]};
    const Vec3 truth = (x - whole.rest()).segment<3>(dof);
    largest = std::max(largest, truth.norm());
    off = std::max(off, (u[k] - truth).norm());
  }
  result.off = off / largest;
  return result;
}

}  // namespace
}  // namespace palpate::test

int main(int argc, char** argv) {
  using namespace palpate;
  if (argc < 10) return 2;
  const auto number = [&](int k) { return std::strtod(argv[k], nullptr); };
  const double radius = number(2);
  Vec3 from(number(3), number(4), number(5));
  const Vec3 direction = Vec3(number(6), number(7), number(8)).normalized();
  const Model model = load_model(argv[1]);
  double touch = std::numeric_limits<double>::infinity();  // how far from the point the sphere meets a node
  for (const Index node : model.surface) {
    const Vec3 x = model.mesh.nodes[static_cast<std::size_t>(node)] - from;
    const double along = x.dot(direction), beside = (x - along * direction).squaredNorm();
    if (beside < radius * radius) touch = std::min(touch, along - std::sqrt(radius * radius - beside));
  }
  from += touch * direction;
  const Body linear{Model(model)}, deep = deep_body(model);
  fmt::print("depth,points,linear,whole_of_linear,two_levels,whole,linear_off,two_levels_off\n");
  for (int k = 9; k < argc; ++k) {
    const test::Felt by_linear = test::felt(linear, radius, from, direction, number(k)),
                     by_levels = test::felt(deep, radius, from, direction, number(k));
    fmt::print("{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.4f},{:.4f}\n", number(k), by_levels.points,
               by_linear.force, by_linear.whole, by_levels.force, by_levels.whole, by_linear.off,
               by_levels.off);
    std::fflush(stdout);
  }
}
