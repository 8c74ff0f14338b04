// Capsules and spheres that press and slide, tick by tick, against contact over the whole surface in double
// precision (tests/support/second_routes/surface_truth.h): none of the tick's detection, near field or
// solvers.
#include "tests/support/second_routes/surface_truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::surface_truth_test {
namespace {

using test::SurfaceTruth;

const Body& cube() {
  static const Body body(test::unit_model(3, 8, Scope::surface, Precision::double_precision));
  return body;
}

struct Case {
  const char* name;
  double radius;
  double length;
  double friction;
  double tolerance;  // most that force and torque are off, of the largest force
  double usual;      // that they are off in half of the ticks
  int closed;
};

void PrintTo(const Case& c, std::ostream* out) {  // NOLINT(readability-identifier-naming): GoogleTest's
  *out << c.name;
}

/// Presses in, slides across and turns back.
Vec3 place(const Case& c, int tick) {
  const int slide = std::clamp(tick - 80, 0, 60) - std::clamp(tick - 140, 0, 40);
  const double lower = 0.05 * c.length;
  return {0.41 + 0.0005 * slide, 0.31, 1.0 + c.radius + lower + 0.002 - 0.0007 * std::min(tick, 80)};
}

/// Along y, its far end 0.05 rad lower.
Eigen::Quaterniond orientation() {
  return Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), Vec3(0.0, std::cos(0.05), -std::sin(0.05)));
}

class WholeSurface : public testing::TestWithParam<Case> {};

/// How far force and torque are off, tick by tick, of the largest force, in order of size.
std::vector<double> differences(const Case& c, int& closed) {
  const Tool tool = test::plain({.radius = c.radius, .length = c.length, .friction = c.friction});
  State state(cube(), {.tools = {tool}});
  SurfaceTruth truth(cube(), tool, c.friction, orientation());
  double largest = 0.0;
  double left_over = 0.0;
  std::vector<double> found;
  for (int tick = 0; tick < 180; ++tick) {
    ToolPose pose = test::pose(place(c, tick));
    pose.orientation = orientation();
    EXPECT_EQ(step(cube(), state, pose), StepStatus::ok) << tick;
    const Wrench expected = truth.step(place(c, tick));
    const Wrench& wrench = state.tools.front().contact_wrench;
    left_over = std::max(left_over, truth.residual());
    largest = std::max(largest, expected.force.norm());
    closed = std::max(closed, truth.closed());
    if (truth.closed() == 0) continue;
    found.push_back(std::max((wrench.force - expected.force).norm(),
                             (wrench.torque - expected.torque).norm() / c.radius));
  }
  EXPECT_LT(left_over, 1e-6);
  for (double& difference : found) difference /= largest;
  std::sort(found.begin(), found.end());
  return found;
}

// The forces of a press and a slide are those of contact at all of the surface; where nothing but the tool's
// motion changes, to much less than where nodes come and go or the tool turns back.
TEST_P(WholeSurface, GivesTheSameForces) {
  int closed = 0;
  const std::vector<double> found = differences(GetParam(), closed);
  ASSERT_GT(found.size(), 100U);
  EXPECT_LT(found.back(), GetParam().tolerance);
  EXPECT_LT(found[found.size() / 2], GetParam().usual);
  EXPECT_GE(closed, GetParam().closed);
}

INSTANTIATE_TEST_SUITE_P(Cases, WholeSurface,
                         testing::Values(Case{"capsule", 0.25, 0.4, 0.3, 1e-3, 3e-4, 4},
                                         Case{"frictionless_capsule", 0.25, 0.4, 0.0, 7e-3, 6e-3, 6},
                                         Case{"sphere", 0.6, 0.0, 0.05, 1e-3, 3e-4, 4},
                                         Case{"frictionless_sphere", 0.6, 0.0, 0.0, 2e-4, 1e-5, 4}),
                         [](const testing::TestParamInfo<Case>& c) { return std::string(c.param.name); });

}  // namespace
}  // namespace palpate::surface_truth_test
