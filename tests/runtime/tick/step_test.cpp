// The tick, and what it does with tools that misbehave.
#include "runtime/core/tick/step.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "base/error.h"
#include "base/vectors.h"
#include "runtime/body/prescribed_nodes.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::step_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

ToolPose pose(const Vec3& position, bool grab = false) {
  ToolPose tool;
  tool.position = position;
  tool.grab = grab;
  return tool;
}

/// A tool whose force is the contact's own.
Tool plain(Tool tool) {
  tool.hand_over = infinity;
  return tool;
}

/// A cube or, in the plane, a square and a tool above the middle of its top.
class ToolTouch : public testing::TestWithParam<int> {
 protected:
  Body body_{test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision)};
  State state_{body_, {.tools = {plain({.reach = 0.1})}}};
  Index top_ = body_.nearest_surface_node(test::top_middle(GetParam())).node;
  Vec3 start_ = at(0.5, 0.5, 1.03);

  /// The place or motion (x, y, z) with z up, in the plane (x, z).
  static Vec3 at(double x, double y, double z) { return test::upright(GetParam(), x, y, z); }

  /// Force on the top that displaces it by `motion` when nothing else is held.
  [[nodiscard]] Vec3 force_alone(const Body& body, const Vec3& motion) const {
    const Eigen::Map<const Eigen::VectorXd> u(motion.data(), GetParam());
    const Eigen::VectorXd f = body.greens().block(top_, top_).inverse() * u;
    return vector_at({f.data(), static_cast<std::size_t>(f.size())}, GetParam(), 0);
  }

  const ToolState& tool() { return state_.tools[0]; }
  StepStatus go(const Vec3& position, bool grab = false) { return step(body_, state_, pose(position, grab)); }
};
INSTANTIATE_TEST_SUITE_P(Dimension, ToolTouch, testing::Values(2, 3));

TEST_P(ToolTouch, GrabDoesNotKickAndThePlaceFollowsTheTool) {
  EXPECT_EQ(go(start_), StepStatus::ok);
  EXPECT_FALSE(tool().holding);
  EXPECT_EQ(go(start_, true), StepStatus::ok);
  EXPECT_TRUE(tool().holding);
  EXPECT_EQ(tool().wrench.force, Vec3::Zero());

  const Vec3 motion = at(0.001, -0.002, -0.01);
  EXPECT_EQ(go(start_ + motion, true), StepStatus::ok);
  ASSERT_EQ(state_.contacts().size(), 1U);
  const Vec3 expected = force_alone(body_, motion);
  EXPECT_LT((tool().wrench.force + expected).norm(), 1e-8 * expected.norm());
  EXPECT_GT(tool().wrench.force[GetParam() - 1], 0.0) << "the hand is pushed up";
  Eigen::VectorXd u(body_.greens().order());
  surface_displacement(body_, state_, {u.data(), static_cast<std::size_t>(u.size())});
  EXPECT_LT((vector_at({u.data(), static_cast<std::size_t>(u.size())}, GetParam(), top_) - motion).norm(),
            1e-10);
}

TEST_P(ToolTouch, GrabbedNodeGivesTheForceOfTheCapacitanceMatrixAlgorithm) {
  PrescribedNodes held(body_);
  held.hold(body_, top_);
  go(start_, true);
  for (int k = 1; k <= 20; ++k) {
    const Vec3 motion = at(0.002 * k, 0.001 * k, 0.004 * k);
    go(start_ + motion, true);
    held.prescribe(top_, motion);
    held.solve();
    const Vec3 expected = vector_at(held.forces(), GetParam(), 0);
    EXPECT_LT((tool().wrench.force + expected).norm(), 1e-8 * expected.norm());
  }
}

TEST_P(ToolTouch, KeepsTheSurfaceWhereverItPullsUntilReleased) {
  go(start_, true);
  for (int k = 1; k < 200; ++k) {
    go(start_ + at(0.0, 0.0, 0.025 * k), true);
    ASSERT_TRUE(tool().holding);
  }
  EXPECT_LT(tool().wrench.force[GetParam() - 1], 0.0) << "the hand is pulled down";
  go(start_ + at(0.0, 0.0, 5.0), false);
  EXPECT_FALSE(tool().holding);
  for (int k = 0; k < 30; ++k) go(start_ + at(0.0, 0.0, 5.0), false);
  EXPECT_EQ(tool().wrench.force, Vec3::Zero());
  EXPECT_EQ(tool().contacts, 0);
}

TEST_P(ToolTouch, TakesHoldOnceItComesWithinReach) {
  const Vec3 far = at(0.5, 0.5, 1.2);
  EXPECT_EQ(go(far, true), StepStatus::nothing_in_reach);
  EXPECT_FALSE(tool().holding);
  StepStatus status = StepStatus::ok;
  for (int k = 0; k < 10; ++k) status = go(start_, true);
  EXPECT_EQ(status, StepStatus::ok);
  EXPECT_TRUE(tool().holding);
}

TEST_P(ToolTouch, HoldsTheLastValidPoseWhenThePoseIsNotFinite) {
  go(start_, true);
  go(start_ - at(0.0, 0.0, 0.01), true);
  const Vec3 force = tool().wrench.force;
  ToolPose turned = pose(start_, true);
  turned.orientation.w() = nan;
  ToolPose zero = pose(start_, true);
  zero.orientation.coeffs().setZero();
  for (const ToolPose& bad : {pose(Vec3(nan, 0.0, 0.0), true), pose(Vec3(0.0, nan, 0.0), false),
                              pose(Vec3(0.0, infinity, 0.0), true), turned, zero}) {
    EXPECT_EQ(step(body_, state_, bad), StepStatus::pose_not_finite);
    EXPECT_LT((tool().wrench.force - force).norm(), 1e-12 * force.norm());
    EXPECT_TRUE(tool().holding);
  }
  EXPECT_EQ(go(start_, true), StepStatus::ok);
  EXPECT_LT(tool().wrench.force.norm(), 1e-9);
}

// So stiff a body that its force passes the largest number.
TEST_P(ToolTouch, NeverGivesAForceThatIsNotFinite) {
  Model stiff = test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision);
  stiff.greens =
      test::pack(1e-200 * test::random_definite(stiff.stored_dofs(), 1), Precision::double_precision);
  const Body body(std::move(stiff));
  State state(body, {.tools = {plain({.reach = 0.1})}});
  step(body, state, pose(start_, true));
  EXPECT_TRUE(has(step(body, state, pose(start_ - at(0.0, 0.0, 0.01), true)), StepStatus::result_not_finite));
  EXPECT_EQ(state.tools[0].wrench.force, Vec3::Zero()) << "the last valid force stands";
}

TEST_P(ToolTouch, APushOpensAndClosesWithoutForceInBetween) {
  for (const double height : {1.1, 1.05, 1.01, 1.001}) {
    go(at(0.5, 0.5, height));
    EXPECT_EQ(tool().wrench.force, Vec3::Zero());
  }
  for (int k = 1; k <= 10; ++k) {
    EXPECT_EQ(go(at(0.5, 0.5, 1.0 - 0.002 * k)), StepStatus::ok);
    EXPECT_GT(tool().wrench.force[GetParam() - 1], 0.0);
  }
  const Vec3 expected = force_alone(body_, at(0.0, 0.0, -0.02));
  EXPECT_GT(tool().wrench.force.norm(), 0.5 * std::abs(expected[GetParam() - 1]));
  for (int k = 9; k >= -3; --k) go(at(0.5, 0.5, 1.0 - 0.002 * k));
  EXPECT_EQ(tool().wrench.force, Vec3::Zero()) << "nothing sticks to the tool";
}

TEST_P(ToolTouch, BeginsToFeelOnlyOnceItHasBeenOutside) {
  EXPECT_EQ(go(at(0.5, 0.5, 0.95)), StepStatus::inside_body);
  EXPECT_EQ(go(at(0.5, 0.5, 0.97)), StepStatus::inside_body);
  EXPECT_EQ(tool().wrench.force, Vec3::Zero());
  EXPECT_EQ(go(at(0.5, 0.5, 1.02)), StepStatus::ok);
  go(at(0.5, 0.5, 0.99));
  EXPECT_GT(tool().wrench.force.norm(), 0.0);
}

// One that has been lost (here by hand) need not be taken away first, only out.
TEST_P(ToolTouch, OneLostInTheBodyIsFeltAgainWithoutAKick) {
  State state(body_, {.tools = {{.radius = 0.1}}});
  const ToolPose pressed = pose(at(0.5, 0.5, 1.07));
  step(body_, state, pose(at(0.5, 0.5, 1.2)));
  for (int k = 0; k < 300; ++k) step(body_, state, pressed);
  const double force = state.tools[0].wrench.force.norm();
  EXPECT_GT(force, 0.0);

  state.tools[0].engaged = false;
  for (int k = 0; k < 300; ++k)
    EXPECT_TRUE(has(step(body_, state, pose(at(0.5, 0.5, 0.9))), StepStatus::inside_body));
  EXPECT_EQ(state.tools[0].wrench.force, Vec3::Zero());
  State anew(body_, {.tools = {{.radius = 0.1}}});
  double last = 0.0;
  for (int k = 0; k < 300; ++k) {
    EXPECT_FALSE(has(step(body_, state, pressed), StepStatus::inside_body));
    EXPECT_TRUE(has(step(body_, anew, pressed), StepStatus::inside_body)) << "never been clear";
    const double now = state.tools[0].wrench.force.norm();
    EXPECT_LE(now - last, 0.0051 * force);
    last = now;
  }
  EXPECT_NEAR(last, force, 1e-9 * force);
}

// Free space is crossed at once; a body in the way is met however far the device jumps.
TEST_P(ToolTouch, ATeleportDoesNotPassThroughTheBody) {
  go(at(0.5, 0.5, 3.0));
  EXPECT_EQ(go(at(0.5, 0.5, 1.3)), StepStatus::ok) << "nothing in between";
  StepStatus status = StepStatus::ok;
  for (int k = 0; k < 20; ++k) {
    status = go(at(0.5, 0.5, 0.9));
    EXPECT_TRUE(k > 0 || has(status, StepStatus::pose_limited));
  }
  EXPECT_EQ(status, StepStatus::ok) << "it has caught up";
  EXPECT_GT(tool().wrench.force[GetParam() - 1], 0.0);
}

// Spheres: the gap is the radius sooner.
TEST_P(ToolTouch, ASphereTouchesByItsRadiusAndPushesAlongTheNormal) {
  State state(body_, {.tools = {plain({.radius = 0.1})}});
  step(body_, state, pose(at(0.37, 0.41, 1.11)));
  step(body_, state, pose(at(0.37, 0.41, 1.1001)));
  EXPECT_EQ(state.tools[0].wrench.force, Vec3::Zero());
  step(body_, state, pose(at(0.37, 0.41, 1.0999)));
  const Vec3 force = state.tools[0].wrench.force;
  EXPECT_GT(force[GetParam() - 1], 0.0);
  EXPECT_LT((force - force.norm() * at(0.0, 0.0, 1.0)).norm(), 1e-6 * force.norm());
  EXPECT_LT(state.tools[0].wrench.torque.norm(), 1e-9 * force.norm())
      << "without friction none about the centre";
}

bool same_bits(const Vec3& a, const Vec3& b) {
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (std::bit_cast<std::uint64_t>(a[axis]) != std::bit_cast<std::uint64_t>(b[axis])) return false;
  }
  return true;
}

// Copies are whole: a copy taken in the middle goes the same way to the last bit.
TEST_P(ToolTouch, CopiesReplayBitwise) {
  State state(body_, {.tools = {Tool{.radius = 0.1, .length = 0.2, .friction = 0.3}, Tool{.reach = 0.2}}});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> move(-0.05, 0.05);
  std::vector<std::array<ToolPose, 2>> poses;
  poses.reserve(200);
  for (int k = 0; k < 200; ++k) {
    poses.push_back({pose(at(0.3, 0.4, 1.08) + at(move(random), move(random), move(random)), k % 70 > 50),
                     pose(at(0.7, 0.6, 1.0) + at(move(random), move(random), move(random)), k % 50 > 5)});
  }
  for (int k = 0; k < 20; ++k) step(body_, state, poses[static_cast<std::size_t>(k)]);
  State copy = state;
  double largest = 0.0;
  for (const auto& both : poses) {
    ASSERT_EQ(step(body_, state, both), step(body_, copy, both));
    for (std::size_t k = 0; k < 2; ++k) {
      ASSERT_TRUE(same_bits(state.tools[k].wrench.force, copy.tools[k].wrench.force));
      ASSERT_TRUE(same_bits(state.tools[k].wrench.torque, copy.tools[k].wrench.torque));
      largest = std::max(largest, state.tools[k].wrench.force.norm());
    }
  }
  EXPECT_GT(largest, 1e-3);
}

// No tick needs the workspace of the one before: with that of another state it goes the same way.
TEST_P(ToolTouch, ScratchIsOfOneTick) {
  const StateOptions options{.tools = {Tool{.radius = 0.3, .friction = 0.3}}};
  State state(body_, options);
  State other(body_, options);
  HighWater most;
  for (int k = 0; k < 60; ++k) {
    const ToolPose at_tick = pose(at(0.5 + 0.002 * k, 0.5, 1.35 - 0.002 * k), k > 45);
    State copy = state;
    copy.scratch = other.scratch;
    step(body_, other, pose(at(0.4, 0.6, k % 2 == 0 ? 1.25 : 1.4)));
    ASSERT_EQ(step(body_, state, at_tick), step(body_, copy, at_tick)) << k;
    ASSERT_TRUE(same_bits(state.tools[0].wrench.force, copy.tools[0].wrench.force)) << k;
    most.contact_points = std::max(most.contact_points, state.contact_count);
    most.unknowns = std::max(most.unknowns, state.scratch.problem.rows);
    most.near_nodes = std::max(most.near_nodes, state.surface.near.count());
  }
  EXPECT_GT(state.tools[0].wrench.force.norm(), 1e-3);
  EXPECT_GT(most.contact_points, 1);
  EXPECT_EQ(state.scratch.high_water.contact_points, most.contact_points);
  EXPECT_GE(state.scratch.high_water.unknowns, most.unknowns);
  EXPECT_GE(state.scratch.high_water.simplices, most.contact_points / GetParam());
  EXPECT_EQ(state.scratch.high_water.near_nodes, most.near_nodes);
}

TEST(Plane, TheToolsHeightOverThePlaneDoesNotCount) {
  const Body body(test::unit_model(2, 4, Scope::surface, Precision::double_precision));
  const StateOptions options{.tools = {Tool{.radius = 0.05, .length = 0.1, .friction = 0.2}}};
  State low(body, options);
  State high(body, options);
  for (int k = 0; k < 40; ++k) {
    ToolPose tool = pose(Vec3(0.52 + 0.002 * k, 1.06 - 0.001 * k, 0.0));
    const StepStatus status = step(body, low, tool);
    tool.position.z() = 7.0 + 0.1 * k;
    ASSERT_EQ(step(body, high, tool), status);
    EXPECT_EQ(low.tools[0].wrench.force, high.tools[0].wrench.force);
    EXPECT_EQ(high.tools[0].wrench.force.z(), 0.0);
    EXPECT_EQ(high.tools[0].wrench.torque.x(), 0.0);
  }
  EXPECT_GT(low.tools[0].wrench.force.norm(), 1e-3);
}

/// A body under loads rests elsewhere and feels the same.
class RestState : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimension, RestState, testing::Values(2, 3));

TEST_P(RestState, MovesTheBodyAndChangesNoForceOfAGrab) {
  Model model = test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision);
  const Body unloaded{Model(model)};
  test::set_rest(model, 0.1);
  const Body loaded(std::move(model));
  const Index top = unloaded.nearest_surface_node(test::top_middle(GetParam())).node;
  const Vec3 shift = loaded.rest_position(top) - unloaded.rest_position(top);
  ASSERT_GT(shift.norm(), 0.05);

  const StateOptions options{.tools = {plain({.reach = 0.01})}};
  State there(unloaded, options);
  State here(loaded, options);
  for (const double depth : {0.0, 0.02}) {
    const Vec3 position = unloaded.rest_position(top) - test::upright(GetParam(), 0.0, 0.0, depth);
    ASSERT_EQ(step(unloaded, there, pose(position, true)), StepStatus::ok);
    ASSERT_EQ(step(loaded, here, pose(position + shift, true)), StepStatus::ok);
    EXPECT_LT((here.tools[0].wrench.force - there.tools[0].wrench.force).norm(),
              1e-9 * (1.0 + there.tools[0].wrench.force.norm()));
  }
  EXPECT_GT(here.tools[0].wrench.force.norm(), 1e-3);
  Eigen::VectorXd u[2] = {Eigen::VectorXd(loaded.greens().order()), Eigen::VectorXd(loaded.greens().order())};
  surface_displacement(unloaded, there, {u[0].data(), static_cast<std::size_t>(u[0].size())});
  surface_displacement(loaded, here, {u[1].data(), static_cast<std::size_t>(u[1].size())});
  EXPECT_LT((u[1] - u[0]).norm(), 1e-9) << "u is relative to rest";

  State away(loaded, options);
  EXPECT_TRUE(has(step(loaded, away, pose(unloaded.rest_position(top), true)), StepStatus::nothing_in_reach))
      << "the body has left this place";
}

TEST(State, RefusesNonsense) {
  const Body body(test::unit_model(3, 2, Scope::surface, Precision::double_precision));
  const auto refused = [&](const StateOptions& options, const char* what) {
    try {
      const State state(body, options);
      ADD_FAILURE() << what << " was not refused";
    } catch (const Error& error) {
      EXPECT_NE(to_text(error).find(what), std::string::npos) << to_text(error);
    }
  };
  refused({.tools = {}}, "no tool");
  refused({.max_contacts = 0}, "room for 0 contacts");
  refused({.tools = {Tool{.radius = -1.0}}}, "radius of tool 0");
  refused({.tools = {Tool{}, Tool{.length = nan}}}, "length of tool 1");
  refused({.tools = {Tool{.disc_radius = nan}}}, "disc radius of tool 0");
  refused({.tools = {Tool{.radius = 0.2, .disc_radius = 0.1}}}, "disc radius of tool 0");
  refused({.tools = {Tool{.radius = 0.1, .length = 0.1, .disc_radius = 0.2}}}, "disc radius of tool 0");
  refused({.tools = {Tool{.reach = infinity}}}, "reach");
  refused({.tools = {Tool{.coupling_stiffness = 0.0}}}, "coupling stiffness");
  refused({.tools = {Tool{.coupling_torsion = nan}}}, "coupling torsion");
  refused({.tools = {Tool{.max_force = -3.0}}}, "largest force");
  refused({.tools = {Tool{.hand_over = 0.0}}}, "hand-over");
  refused({.tools = {Tool{.friction = -0.1}}}, "friction");
}

}  // namespace
}  // namespace palpate::step_test
