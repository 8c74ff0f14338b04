// What a tool that is turned is given.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::turning_tool_test {
namespace {

using test::go;
using test::hold;
using test::pose;

struct Turn {
  const char* name;
  int dimension;
  Vec3 axis;
};

class TurnedGrab : public testing::TestWithParam<Turn> {};
INSTANTIATE_TEST_SUITE_P(Axes, TurnedGrab,
                         testing::Values(Turn{"Sideways", 3, Vec3(0.6, 0.8, 0.0)},
                                         Turn{"Twist", 3, Vec3::UnitZ()},
                                         Turn{"InThePlane", 2, Vec3::UnitZ()}),
                         [](const testing::TestParamInfo<Turn>& tested) {
                           return std::string(tested.param.name);
                         });

// A slow turn is the tool's own motion as a slow push is: nothing of it is handed over late.
TEST_P(TurnedGrab, IsGivenTheContactsWrench) {
  const auto& [name, d, axis] = GetParam();
  const Body body(test::unit_model(d, 6, Scope::surface, Precision::double_precision));
  const double radius = 1.5 * body.mean_surface_edge();
  const Vec3 above = test::upright(d, 0.47, 0.53, 1.0 + 1.1 * radius);
  const Vec3 place = test::upright(d, 0.47, 0.53, 1.0 + 0.95 * radius);
  State state(body, {.tools = {Tool{.radius = radius}}});
  go(body, state, above, pose(place), 200);
  hold(body, state, pose(place, true), 1000);
  const double speed = 0.26e-3;  // [rad/tick]
  double worst_force = 0.0;
  double worst_torque = 0.0;
  double largest_torque = 0.0;
  for (int k = 1; k <= 1000; ++k) {
    ToolPose turned = pose(place, true);
    turned.orientation = Eigen::AngleAxisd(speed * k, axis);
    step(body, state, turned);
    const ToolState& tool = state.tools[0];
    largest_torque = std::max(largest_torque, tool.contact_wrench.torque.norm());
    worst_force = std::max(worst_force, (tool.wrench.force - tool.contact_wrench.force).norm() /
                                            tool.contact_wrench.force.norm());
    worst_torque = std::max(worst_torque, (tool.wrench.torque - tool.contact_wrench.torque).norm());
  }
  // Where a contact is made beside those that are held, that is handed over.
  EXPECT_LT(worst_force, 0.05);
  EXPECT_LT(worst_torque, 0.05 * largest_torque);
}

}  // namespace
}  // namespace palpate::turning_tool_test
