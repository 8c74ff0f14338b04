// What a tick that had no room for all contact points says of its force, against one that had.
#include "runtime/core/tick/force_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/linearise.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::force_error_test {
namespace {

using test::go;
using test::hold;
using test::plain;
using test::pose;

/// A ball of many edges that is pressed into the top of a cube or, in the plane, a square.
class ForceError : public testing::TestWithParam<int> {
 protected:
  [[nodiscard]] State pressed(const Tool& tool, double depth, Index max_contacts) const {
    State state(body_, {.tools = {plain(tool)}, .max_contacts = max_contacts});
    const Vec3 top = test::upright(GetParam(), 0.5, 0.5, 1.0 + tool.radius);
    const Vec3 down = test::upright(GetParam(), 0.0, 0.0, -depth);
    go(body_, state, top - 0.1 * down, pose(top + down), 50);
    hold(body_, state, pose(top + down), 20);
    return state;
  }
  static const ToolState& tool_of(const State& state) { return state.tools.front(); }

  double depth_ = GetParam() == 3 ? 0.07 : 0.02;
  Body body_{
      test::unit_model(GetParam(), GetParam() == 3 ? 8 : 40, Scope::surface, Precision::double_precision)};
};
INSTANTIATE_TEST_SUITE_P(Dimension, ForceError, testing::Values(2, 3));

TEST_P(ForceError, IsNothingWhereThereWasRoomAndTheSolverIsExact) {
  const State state = pressed({.radius = 0.8}, depth_, 200);
  EXPECT_EQ(state.status, StepStatus::ok);
  EXPECT_GT(tool_of(state).contacts, 3);
  EXPECT_EQ(tool_of(state).force_error, 0.0);
  EXPECT_EQ(tool_of(state).left_out, 0);
}

TEST_P(ForceError, OfContactPointsThatFoundNoRoom) {
  for (const double coupling : {std::numeric_limits<double>::infinity(), 2.0}) {
    const Tool tool{.radius = 0.8, .coupling_stiffness = coupling};
    const State whole = pressed(tool, depth_, 200);
    for (const Index room : {2, 3}) {  // too little for three nodes that could be merged
      if (room >= tool_of(whole).contacts) continue;
      const State state = pressed(tool, depth_, room);
      ASSERT_TRUE(has(state.status, StepStatus::capacity_full)) << room;
      const double truth = (tool_of(whole).contact_wrench.force - tool_of(state).contact_wrench.force).norm();
      EXPECT_GT(truth, 0.005 * tool_of(whole).contact_wrench.force.norm()) << room;
      EXPECT_GT(tool_of(state).force_error, truth) << room;
      EXPECT_LT(tool_of(state).force_error, 3.5 * truth) << room;
      EXPECT_GT(tool_of(state).left_out, 0) << room;
      EXPECT_LE(tool_of(state).left_out, 3 * tool_of(whole).contacts) << room;
    }
  }
}

// A tick that changes no force has the error of the one before.
TEST_P(ForceError, IsToldAtRest) {
  State state = pressed({.radius = 0.8, .friction = 0.5}, depth_, GetParam() == 3 ? 4 : 3);
  hold(body_, state, tool_of(state).device, 200);
  const Vec3 force = tool_of(state).contact_wrench.force;
  hold(body_, state, tool_of(state).device, 1);
  ASSERT_EQ(tool_of(state).contact_wrench.force, force);
  EXPECT_TRUE(has(state.status, StepStatus::capacity_full));
  EXPECT_GT(tool_of(state).left_out, 0);
  EXPECT_GT(tool_of(state).force_error, 0.0);
}

// As if the solver had been stopped with forces that are a hundredth too large.
TEST_P(ForceError, OfForcesThatAreAHundredthTooLarge) {
  for (const double friction : {0.0, 0.5}) {
    State state = pressed({.radius = GetParam() == 3 ? 2.0 : 0.8, .friction = friction}, depth_, 200);
    Scratch& scratch = state.scratch;
    EXPECT_EQ(scratch.problem.single, GetParam() == 3 && friction > 0.0) << "both solvers are looked at";
    const Vec3 force = tool_of(state).contact_wrench.force;
    for (Index i = 0; i < scratch.problem.rows; ++i) scratch.problem.lambda[i] *= 1.01;
    scratch.is_solved = false;
    linearise(body_, state, scratch);
    find_force_errors(body_, state, scratch);
    EXPECT_LT((scratch.force_error.missing_force[0] + 0.01 * force).norm(), 1e-3 * force.norm()) << friction;
    const double step = scratch.force_error.missing_force[0].norm();
    const double said = scratch.problem.single ? tuning.hand.error_margin * step
                                               : std::sqrt(step * scratch.force_error.imbalance.residual());
    EXPECT_NEAR(tool_of(state).force_error, said, 1e-9 * force.norm());
    EXPECT_EQ(tool_of(state).left_out, 0);
  }
}

// What is beyond the room, and not touched, is no loss.
TEST_P(ForceError, IsNothingWhereThoseWithoutRoomAreNotPressed) {
  State state(body_, {.tools = {plain({.radius = 0.8})}, .max_contacts = 2});
  hold(body_, state, pose(test::upright(GetParam(), 0.5, 0.5, 1.8)), 5);
  const Vec3 touching = test::upright(GetParam(), 0.5, 0.5, 1.8 - 1e-6);
  go(body_, state, test::upright(GetParam(), 0.5, 0.5, 1.8), pose(touching), 20);
  EXPECT_GT(tool_of(state).contacts, 0);
  EXPECT_LE(tool_of(state).contacts, 2);
  EXPECT_EQ(tool_of(state).left_out, 0);
  EXPECT_EQ(tool_of(state).force_error, 0.0);
}

}  // namespace
}  // namespace palpate::force_error_test
