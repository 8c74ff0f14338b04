// What one touch costs by Green's functions, and what a step of the same body costs that is solved.
//
//   live_touch_study BODY.palpate.hdf ...
//
// Bodies in space. A sphere with a radius of a tenth of the body's longest side comes from above on the
// middle of its top, presses in by half its radius at 25 mm/s and slides by two radii along x at 50 mm/s:
// processor time of its ticks. Then the same body is stepped by 1/60 s, with the force that the sphere had
// spread over the nodes below it: corotational and implicit Euler, by a factor of each tangent, and by
// conjugate gradients with an older factor (Fagerholt's method). Processor time of one thread; prints
// Markdown.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/core/tick/step.h"
#include "runtime/live/live_stepper.h"
#include "tests/bench/palpation_paths.h"
#include "tests/support/study.h"

namespace palpate {
namespace {

using Eigen::VectorXd;

constexpr double picture = 1.0 / 60.0;                          // [s]
constexpr double pressing_speed = 0.025, sliding_speed = 0.05;  // [m/s]

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

struct Touch {
  double radius = 0.0;
  Vec3 place = Vec3::Zero();    // where the sphere's centre ends
  Vec3 force = Vec3::Zero();    // on the sphere at the end [N]
  Index points = 0;             // most contact points
  std::vector<double> ticks{};  // [s] of those with contact
};

Touch touch(const Body& body) {
  const Vec3 sides = body.bounds().sizes(), middle = body.bounds().center();
  Touch touch;
  touch.radius = 0.1 * sides.maxCoeff();
  touch.place = {middle.x() - touch.radius, middle.y(), body.bounds().max().z() + 1.01 * touch.radius};
  State state(body, {.tools = {{.radius = touch.radius}}});
  const auto go = [&](const Vec3& way, double speed) {
    const auto ticks = static_cast<int>(way.norm() / (speed * test::tick));
    const Vec3 from = touch.place;
    for (int k = 1; k <= ticks; ++k) {
      ToolPose pose;
      pose.position = from + way * k / ticks;
      const double begin = test::processor_time();
      step(body, state, pose);
      const double end = test::processor_time();
      if (state.tools.front().contacts > 0) touch.ticks.push_back(end - begin);
      touch.points = std::max(touch.points, state.tools.front().contacts);
    }
    touch.place += way;
  };
  go(-0.51 * touch.radius * Vec3::UnitZ(), pressing_speed);
  go(2.0 * touch.radius * Vec3::UnitX(), sliding_speed);
  touch.force = state.tools.front().contact_wrench.force;
  return touch;
}

/// The touch's force on the nodes below the sphere.
VectorXd push_of(const LiveBody& body, const Touch& touch) {
  VectorXd push = VectorXd::Zero(body.dofs());
  std::vector<Eigen::Index> below;
  for (Eigen::Index k = 0; k < push.size(); k += 3) {
    if ((body.rest().segment<3>(k) - touch.place).norm() < touch.radius) below.push_back(k);
  }
  for (const Eigen::Index k : below) push.segment<3>(k) = -touch.force / static_cast<double>(below.size());
  return push;
}

/// Median time of a step under the touch.
double step_time(const LiveBody& body, SolverKind kind, const VectorXd& push) {
  StepperOptions options{.time_step = picture, .scheme = {.tolerance = 1e-5, .most_newton = 1}};
  options.scheme.solver = {.kind = kind, .tolerance = 1e-3, .most_iterations = 20};
  LiveStepper stepper(body, options);
  LiveState state(body);
  std::vector<double> times;
  for (int k = 0; k < 40; ++k) {
    const double begin = test::processor_time();
    stepper.step(state, push);
    if (k >= 10) times.push_back(test::processor_time() - begin);
  }
  return quantile(times, 0.5);
}

void study(const std::string& file) {
  const Model model = load_model(file);
  const Body body(model);
  const Touch touched = touch(body);
  const LiveBody live(live_input(model), {.law = LiveLaw::corotational, .damping = {.mass = 1.0}});
  const VectorXd push = push_of(live, touched);
  const double factor = step_time(live, SolverKind::factor, push);
  const double gradients = step_time(live, SolverKind::conjugate_gradient, push);
  const double tick = quantile(touched.ticks, 0.5);
  fmt::print("| {} | {} | {:.0f}, {:.2f} N, {} | {:.0f} / {:.0f} | {:.1f} | {:.1f} | {:.0f}, {:.0f} |\n",
             model.name, live.dofs() / 3, 1e3 * touched.radius, touched.force.norm(), touched.points,
             1e6 * tick, 1e6 * quantile(touched.ticks, 0.999), 1e3 * factor, 1e3 * gradients, factor / tick,
             gradients / tick);
  std::fflush(stdout);
}

}  // namespace
}  // namespace palpate

int main(int count, char** words) {
  try {
    fmt::print(
        "| body | nodes | sphere [mm], force, nodes pressed | tick by Green's functions: median / 99.9 % "
        "[µs] | "
        "corotational step, factor [ms] | by gradients [ms] | steps in ticks "
        "|\n|---|---|---|---|---|---|---|\n");
    for (int k = 1; k < count; ++k) palpate::study(words[k]);
    return 0;
  } catch (const palpate::Error& error) {
    std::fputs(palpate::to_text(error).c_str(), stderr);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
  }
  return 1;
}
