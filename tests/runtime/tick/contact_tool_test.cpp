// What tools can do beside touching: hold, lie flat, hang on a spring, and what the tick says about them.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "base/vectors.h"
#include "runtime/core/tick/hand_force.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::contact_tool_test {
namespace {

using test::go;
using test::hold;
using test::place_now;
using test::plain;
using test::pose;

/// A cube or, in the plane, a square.
class Tools : public testing::TestWithParam<int> {
 protected:
  Body body_{test::unit_model(GetParam(), 6, Scope::surface, Precision::double_precision)};
  double edge_ = body_.mean_surface_edge();
  double radius_ = edge_;

  static Vec3 at(double x, double y, double z) { return test::upright(GetParam(), x, y, z); }
  static double up(const Vec3& force) { return force[GetParam() - 1]; }

  State touching(const Tool& tool, const Vec3& place, double depth) const {
    State state(body_, {.tools = {tool}});
    go(body_, state, place + at(0.0, 0.0, 0.2 * depth), pose(place - at(0.0, 0.0, depth)), 30);
    hold(body_, state, pose(place - at(0.0, 0.0, depth)), 100);
    return state;
  }
  /// Where a sphere touches.
  [[nodiscard]] Vec3 on_top(double x = 0.47, double y = 0.53) const { return at(x, y, 1.0 + radius_); }
};
INSTANTIATE_TEST_SUITE_P(Dimension, Tools, testing::Values(2, 3));

TEST_P(Tools, AGrabHoldsWhatItTouchesBothWaysWithoutAKick) {
  for (const double friction : {0.0, 0.3}) {
    const double depth = 0.3 * radius_;
    State state = touching({.radius = radius_, .friction = friction}, on_top(), depth);
    const Vec3 place = on_top() - at(0.0, 0.0, depth);
    const Wrench before = state.tools[0].wrench;
    step(body_, state, pose(place, true));
    ASSERT_TRUE(state.tools[0].holding);
    // The guard against rounding gives way by 1e-9 of the body's compliance, once more.
    EXPECT_LT((state.tools[0].wrench.force - before.force).norm(), 1e-8 * before.force.norm());
    EXPECT_LT((state.tools[0].wrench.torque - before.torque).norm(), 3e-8 * radius_ * before.force.norm());
    hold(body_, state, pose(place, true), 50);
    EXPECT_LT((state.tools[0].wrench.force - before.force).norm(), 1e-8 * before.force.norm());

    go(body_, state, place, pose(place + at(0.0, 0.0, 2.0 * depth), true), 100);
    const double tension = state.tools[0].wrench.force.norm();
    EXPECT_LT(up(state.tools[0].wrench.force), 0.0) << "it pulls the hand back";
    for (const ContactPoint& contact : state.contacts()) {
      if (!contact.held) continue;
      const Vec3 held = state.tools[0].pose.position + contact.tool_point;
      EXPECT_LT((place_now(state, contact) - held).norm(), 1e-6 * depth) << "the surface is where it is held";
    }

    Vec3 last = state.tools[0].wrench.force;
    int ticks = 0;
    while (last.norm() > 0.0 && ticks < 100) {
      step(body_, state, pose(place + at(0.0, 0.0, 2.0 * depth), false));
      ++ticks;
      EXPECT_LT((state.tools[0].wrench.force - last).norm(), 0.06 * tension) << "tick " << ticks;
      last = state.tools[0].wrench.force;
    }
    EXPECT_FALSE(state.tools[0].holding);
    EXPECT_GE(ticks, 15);
    EXPECT_LE(ticks, 30);
  }
}

TEST_P(Tools, AGrabThatIsOnlyPressedOnReleasesToWhatItWas) {
  const double depth = 0.3 * radius_;
  State state = touching({.radius = radius_}, on_top(), depth);
  const Vec3 place = on_top() - at(0.0, 0.0, depth);
  const Vec3 before = state.tools[0].wrench.force;
  hold(body_, state, pose(place, true), 50);
  hold(body_, state, pose(place, false), 50);
  EXPECT_FALSE(state.tools[0].holding);
  EXPECT_LT((state.tools[0].wrench.force - before).norm(), 1e-6 * before.norm());
}

/// Lies along x.
Eigen::Quaterniond lying(int dimension) {
  return dimension == 3 ? Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitX())
                        : Eigen::Quaterniond(Eigen::AngleAxisd(-0.5 * M_PI, Vec3::UnitZ()));
}

TEST_P(Tools, ACapsuleLyingFlatIsPushedUpAtThePressuresCentre) {
  const double radius = 0.5 * edge_;
  const double length = 2.2 * edge_;
  const double depth = 0.2 * radius;
  ToolPose lie = pose(at(0.5, 0.5, 1.0 + radius - depth) - at(0.5 * length, 0.0, 0.0));
  lie.orientation = lying(GetParam());
  State state(body_, {.tools = {plain({.radius = radius, .length = length})}});
  go(body_, state, lie.position + at(0.0, 0.0, 1.5 * depth), lie, 40);
  hold(body_, state, lie, 100);
  const ToolState& tool = state.tools[0];
  EXPECT_GT(up(tool.wrench.force), 0.0);
  EXPECT_GT(tool.contacts, 1);
  EXPECT_LT((tool.wrench.force - up(tool.wrench.force) * at(0, 0, 1)).norm(), 0.1 * tool.wrench.force.norm());

  Vec3 centre = Vec3::Zero();  // of the pressure
  double sum = 0.0;
  for (const ContactPoint& contact : state.contacts()) {
    centre += test::normal_force(contact) * contact.position;
    sum += test::normal_force(contact);
  }
  centre /= sum;
  const double lever = centre.x() - lie.position.x();
  EXPECT_NEAR(centre.x(), 0.5, 0.1 * length) << "the cube is nearly symmetric";
  const Vec3 axis = at(1.0, 0.0, 0.0);
  const Vec3 across = at(0.0, 0.0, 1.0).cross(axis);
  EXPECT_NEAR(tool.wrench.torque.dot(across), -lever * up(tool.wrench.force),
              0.01 * lever * up(tool.wrench.force));
  EXPECT_LT(std::abs(tool.wrench.torque.dot(axis)), 1e-9 * radius * up(tool.wrench.force))
      << "without friction it does not roll";
}

// What is held stands still on a tool that is turned, and touches far from its origin.
TEST_P(Tools, ATurnedToolHoldsThePlaceThatItTouches) {
  const double radius = 0.5 * edge_;
  const double length = 2.2 * edge_;
  const double depth = 0.2 * radius;
  ToolPose lie = pose(at(0.5, 0.5, 1.0 + radius - depth) - at(0.5 * length, 0.0, 0.0));
  lie.orientation = lying(GetParam());
  State state(body_, {.tools = {plain({.radius = radius, .length = length})}});
  go(body_, state, lie.position + at(0.0, 0.0, 1.5 * depth), lie, 40);
  hold(body_, state, lie, 100);
  const Vec3 before = state.tools[0].wrench.force;
  ASSERT_GT(before.norm(), 0.0);
  const auto held_places = [&] {
    std::vector<Vec3> places;
    for (const ContactPoint& contact : state.contacts()) {
      if (contact.held) places.push_back(place_now(state, contact));
    }
    return places;
  };

  lie.grab = true;
  step(body_, state, lie);
  ASSERT_TRUE(state.tools[0].holding);
  EXPECT_LT((state.tools[0].wrench.force - before).norm(), 1e-8 * before.norm()) << "without a kick";
  const std::vector<Vec3> grabbed = held_places();
  ASSERT_GT(grabbed.size(), 1U);

  const ToolPose from = lie;
  const Vec3 motion = at(0.3 * depth, 0.0, 2.0 * depth);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.02, GetParam() == 3 ? Vec3::UnitY() : Vec3::UnitZ()));
  for (int k = 1; k <= 100; ++k) {
    lie.position = from.position + 0.01 * k * motion;
    lie.orientation = Eigen::Quaterniond::Identity().slerp(0.01 * k, turn) * from.orientation;
    step(body_, state, lie);
  }
  const std::vector<Vec3> carried = held_places();
  ASSERT_EQ(carried.size(), grabbed.size());
  for (std::size_t k = 0; k < carried.size(); ++k) {
    const Vec3 expected = from.position + motion + turn * (grabbed[k] - from.position);
    EXPECT_LT((carried[k] - expected).norm(), 1e-6 * depth)
        << "held place " << k << " moves as the tool does";
  }
}

// A force that is cut no longer depends on where the device is.
TEST_P(Tools, AForceAtItsLimitHasNoStiffness) {
  const double depth = 0.3 * radius_;
  const State free = touching(plain({.radius = radius_}), on_top(), depth);
  const double whole = free.tools[0].wrench.force.norm();
  EXPECT_GT(free.tools[0].local.stiffness.norm(), 0.0);
  EXPECT_FALSE(has(free.status, StepStatus::force_limited));
  for (const double share : {0.9, 0.25}) {
    const State state =
        touching(plain({.radius = radius_, .max_force = share * whole, .friction = 0.3}), on_top(), depth);
    const ToolState& tool = state.tools[0];
    EXPECT_TRUE(has(state.status, StepStatus::force_limited));
    EXPECT_NEAR(tool.wrench.force.norm(), share * whole, 1e-12 * whole);
    EXPECT_GT(tool.wrench.force.normalized().dot(tool.contact_wrench.force.normalized()), 1.0 - 1e-12);
    EXPECT_EQ(tool.local.force, tool.wrench.force);
    EXPECT_EQ(tool.local.stiffness, Eigen::Matrix3d::Zero());
  }
}

/// What a tool in contact may move per tick: a quarter of the mean edge or of its radius, whichever is more.
TEST_P(Tools, InContactADeviceIsFollowedByAQuarterOfTheEdgeOrTheRadiusPerTick) {
  for (const double radius : {0.5 * edge_, 1.7 * edge_}) {
    const double most = 0.25 * std::max(edge_, radius);
    State start(body_, {.tools = {plain({.radius = radius})}});
    const Vec3 place = at(0.47, 0.53, 1.0 + 0.9 * radius);
    go(body_, start, place + at(0.0, 0.0, 0.2 * radius), pose(place), 60);
    hold(body_, start, pose(place), 20);
    ASSERT_GT(start.tools[0].contacts, 0);

    for (const double share : {0.999, 1.001, 20.0}) {
      const Vec3 wanted = place + share * most * at(0.6, 0.0, -0.8);
      State state = start;
      const StepStatus status = step(body_, state, pose(wanted));
      EXPECT_EQ(has(status, StepStatus::pose_limited), share > 1.0);
      EXPECT_LT((state.tools[0].device.position - (place + std::min(share, 1.0) * most * at(0.6, 0.0, -0.8)))
                    .norm(),
                1e-12 * most);
    }
    for (const double share : {0.999, 1.001, 3.0}) {  // a turn on the spot moves the sphere's rim
      const double angle = share * most / radius;
      ToolPose turned = pose(place);
      turned.orientation = Eigen::AngleAxisd(angle, Vec3::UnitZ());
      State state = start;
      const StepStatus status = step(body_, state, turned);
      EXPECT_EQ(has(status, StepStatus::pose_limited), share > 1.0);
      EXPECT_NEAR(state.tools[0].device.orientation.angularDistance(Eigen::Quaterniond::Identity()),
                  std::min(share, 1.0) * most / radius, 1e-12);
    }
  }
}

// Edges and faces between the nodes are chords of such a sphere: they would hold it out.
TEST_P(Tools, ASphereThatIsLargeAgainstTheEdgesTouchesNodesAlone) {
  for (const double edges : {8.0, 20.0}) {
    const double radius = edges * edge_;
    const Vec3 place = at(0.47, 0.53, 1.0 + radius - 0.1 * edge_);
    State state(body_, {.tools = {plain({.radius = radius, .friction = 0.0})}});
    go(body_, state, place + at(0.0, 0.0, 0.15 * edge_), pose(place), 60);
    hold(body_, state, pose(place), 200);
    int closed = 0;
    for (const ContactPoint& contact : state.contacts()) {
      if (!(test::normal_force(contact) > 0.0)) continue;
      ++closed;
      EXPECT_EQ(
          std::count_if(contact.nodes.begin(), contact.nodes.end(), [](Index node) { return node >= 0; }), 1);
    }
    EXPECT_GE(closed, GetParam());
    for (Index node = 0; node < std::ssize(body_.surface_rest_positions()); ++node)
      EXPECT_GT((state.surface.tree.position(node) - place).norm(), radius - 1e-6 * edge_);
  }
}

// The bottom is clamped: no force is right there, but one that is finite and told of.
TEST_P(Tools, PressedOnWhatIsHeldATellsThatItIsRigid) {
  const double depth = 0.1 * radius_;
  const Vec3 below = at(0.47, 0.53, -radius_);
  const double soft =
      touching({.radius = radius_, .friction = 0.0}, on_top(), depth).tools[0].wrench.force.norm();
  for (const double friction : {0.0, 0.3}) {
    for (const double coupling : {std::numeric_limits<double>::infinity(), 20.0 * soft / depth}) {
      State state(
          body_,
          {.tools = {plain({.radius = radius_, .coupling_stiffness = coupling, .friction = friction})}});
      go(body_, state, below - at(0.0, 0.0, 0.2 * depth), pose(below - at(0.0, 0.0, 0.01 * depth)), 20);
      EXPECT_FALSE(has(state.status, StepStatus::rigid_contact)) << "it does not touch yet";
      go(body_, state, below, pose(below + at(0.0, 0.0, depth)), 30);
      hold(body_, state, pose(below + at(0.0, 0.0, depth)), 100);
      const ToolState& tool = state.tools[0];
      EXPECT_TRUE(has(state.status, StepStatus::rigid_contact));
      EXPECT_TRUE(has(tool.status, StepStatus::rigid_contact));
      EXPECT_LT(up(tool.wrench.force), 0.0);
      if (std::isinf(coupling)) {
        EXPECT_GT(tool.wrench.force.norm(), 30.0 * soft);
        EXPECT_LT(tool.wrench.force.norm(), 2000.0 * soft) << "a wall, and nothing beyond all measure";
      } else {
        EXPECT_NEAR(tool.wrench.force.norm(), coupling * depth, 1e-6 * coupling * depth) << "the coupling's";
      }
    }
  }
}

TEST_P(Tools, PressedOnWhatIsHeldGivesNoMoreThanItsLargestForce) {
  const double depth = 0.1 * radius_;
  const double most = 1e-3;
  const Vec3 below = at(0.47, 0.53, -radius_);
  State state(body_, {.tools = {plain({.radius = radius_, .max_force = most})}});
  go(body_, state, below - at(0.0, 0.0, 0.2 * depth), pose(below + at(0.0, 0.0, depth)), 50);
  EXPECT_NEAR(state.tools[0].wrench.force.norm(), most, 1e-12 * most);
  EXPECT_TRUE(has(state.status, StepStatus::rigid_contact));
  EXPECT_TRUE(has(state.status, StepStatus::force_limited));
}

// From the free side down to the edge of the clamped one: it is told of before the force leaves all measure.
TEST_P(Tools, IsToldToBeRigidWhereTheSurfaceHardlyMoves) {
  const double depth = 0.05 * radius_;
  State state(body_, {.tools = {plain({.radius = radius_, .friction = 0.0})}});
  const auto beside = [&](double z) { return at(1.0 + radius_ - depth, 0.53, z); };
  go(body_, state, at(1.0 + 1.1 * radius_, 0.53, 0.5), pose(beside(0.5)), 50);
  const double soft = state.tools[0].wrench.force.norm();
  EXPECT_EQ(state.status, StepStatus::ok);
  int rigid = 0;
  for (int k = 0; k <= 2000; ++k) {
    step(body_, state, pose(beside(0.5 * (1.0 - k / 2000.0))));
    const double force = state.tools[0].wrench.force.norm();
    ASSERT_LT(force, 2000.0 * soft) << k;
    if (has(state.status, StepStatus::rigid_contact)) ++rigid;
    if (force > 200.0 * soft) {
      ASSERT_TRUE(has(state.status, StepStatus::rigid_contact)) << k;
    }
  }
  EXPECT_GT(rigid, 2);
  // Pressed in by depth it reaches the bottom's edge from sqrt(2 radius depth) above.
  EXPECT_LT(rigid, 1.1 * 2000 / 0.5 * std::sqrt(2.0 * radius_ * depth));
}

// A body that moves tells of nothing, wherever it is touched.
TEST_P(Tools, IsNotToldToBeRigidWhereTheSurfaceMoves) {
  for (double x = 0.05; x < 1.0; x += 0.07) {
    const double depth = 0.2 * radius_;
    EXPECT_FALSE(has(touching({.radius = radius_}, on_top(x, 0.4), depth).status, StepStatus::rigid_contact))
        << x;
  }
}

TEST_P(Tools, ACapsuleOnASoftTorsionTurnsAwayFromTheTorque) {
  const double radius = 0.5 * edge_;
  const double length = 2.2 * edge_;
  const double torsion = 0.02;
  ToolPose lie = pose(at(0.5, 0.5, 1.0 + 0.8 * radius) - at(0.5 * length, 0.0, 0.0));
  lie.orientation = lying(GetParam());
  State state(
      body_,
      {.tools = {plain(
           {.radius = radius, .length = length, .coupling_stiffness = 1.0, .coupling_torsion = torsion})}});
  go(body_, state, lie.position + at(0.0, 0.0, 0.5 * radius), lie, 60);
  hold(body_, state, lie, 300);
  const ToolState& tool = state.tools[0];
  const Eigen::AngleAxisd turn(tool.pose.orientation * lie.orientation.conjugate());
  const Vec3 torque = torsion * turn.angle() * turn.axis();
  EXPECT_GT(turn.angle(), 0.01);
  EXPECT_LT((tool.wrench.torque - torque).norm(), 1e-9 * torque.norm());
  EXPECT_GT(test::upright(GetParam(), 0, 0, 1)
                .dot(tool.pose.orientation * lie.orientation.conjugate() * at(1, 0, 0)),
            0.0)
      << "its far end is lifted";
}

TEST_P(Tools, TheCouplingCarriesTheForceAndBoundsTheStiffness) {
  for (const double stiffness : {0.02, 0.2, 5.0}) {
    for (const double friction : {0.0, 0.3}) {
      State state(
          body_,
          {.tools = {plain({.radius = radius_, .coupling_stiffness = stiffness, .friction = friction})}});
      const Vec3 place = on_top() - at(0.1 * radius_, 0.0, 0.4 * radius_);
      double largest = 0.0;
      for (int k = 0; k <= 100; ++k) {
        const Vec3 device = place + (1.0 - 0.01 * k) * at(0.1 * radius_, 0.0, 0.5 * radius_);
        step(body_, state, pose(device));
        const ToolState& tool = state.tools[0];
        const Vec3 expected = stiffness * (tool.pose.position - device);
        EXPECT_LT((tool.wrench.force - expected).norm(), 1e-9 * stiffness * radius_);
        const double most = tool.local.stiffness.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff();
        EXPECT_LE(most, stiffness * (1.0 + 1e-9));
        largest = std::max(largest, most);
      }
      EXPECT_GT(largest, 0.0);
      EXPECT_GT(state.tools[0].wrench.force.norm(), 0.0);
    }
  }
}

/// Force at rest with the device elsewhere, of a copy.
Vec3 force_at(const Body& body, State state, const Vec3& from, const ToolPose& to) {
  go(body, state, from, to, 20);
  hold(body, state, to, 100);
  return state.tools[0].wrench.force;
}

struct LocalCase {
  const char* name;
  int dimension;
  double friction;
  bool grab;
};
class LocalModelOfTool : public testing::TestWithParam<LocalCase> {};
INSTANTIATE_TEST_SUITE_P(
    Contacts, LocalModelOfTool,
    testing::Values(LocalCase{"Frictionless", 3, 0.0, false}, LocalCase{"Sticking", 3, 5.0, false},
                    LocalCase{"Held", 3, 0.0, true}, LocalCase{"FrictionlessInThePlane", 2, 0.0, false},
                    LocalCase{"StickingInThePlane", 2, 5.0, false},
                    LocalCase{"HeldInThePlane", 2, 0.0, true}),
    [](const testing::TestParamInfo<LocalCase>& tested) { return std::string(tested.param.name); });

/// Symmetric and without what would push the hand on, as a local model is.
Eigen::Matrix3d passive(const Eigen::Matrix3d& stiffness) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (stiffness + stiffness.transpose()));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

// Without friction to hold it, the pressed surface pushes the tool off sideways: normals turn as it moves.
TEST_P(LocalModelOfTool, ModelIsTheDerivativeOfTheForce) {
  const int d = GetParam().dimension;
  const bool grab = GetParam().grab;
  const Body body(test::unit_model(d, 6, Scope::surface, Precision::double_precision));
  const double radius = body.mean_surface_edge();
  int useful = 0;  // a contact that is about to open leaves but a small radius
  for (const double share : {0.003, 0.03, 0.1, 0.3}) {
    SCOPED_TRACE(share);
    const double depth = share * radius;
    const Vec3 place = test::upright(d, 0.47, 0.53, 1.0 + radius - depth);
    State state(body, {.tools = {plain({.radius = radius, .friction = GetParam().friction})}});
    go(body, state, place + test::upright(d, 0.0, 0.0, 1.2 * depth), pose(place), 30);
    hold(body, state, pose(place, grab), 100);
    const LocalModel local = state.tools[0].local;
    EXPECT_EQ(local.point, place);
    EXPECT_EQ(local.force, state.tools[0].wrench.force);
    EXPECT_GT(local.radius, 0.0);
    if (local.radius > 0.01 * depth) ++useful;

    const auto moved = [&](const Vec3& motion) {
      return force_at(body, state, place, pose(place + motion, grab));
    };
    Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
    const double small = 1e-4 * depth;
    double error = 0.0;  // of the force
    for (int axis = 0; axis < d; ++axis) {
      const Vec3 unit = Vec3::Unit(axis);
      stiffness.col(axis) = (moved(-small * unit) - moved(small * unit)) / (2.0 * small);
      for (const double sign : {-1.0, 1.0}) {
        const Vec3 motion = sign * local.radius * unit;
        const Vec3 force = moved(motion);
        error = std::max(error, (force - (local.force - local.stiffness * motion)).norm() /
                                    std::max(force.norm(), local.force.norm()));
      }
    }
    const bool turns = GetParam().friction == 0.0 && !grab;
    // Beside the places that are held the surface slides on the sphere: some of it turns there too.
    const double left_out = grab ? 4e-3 : 2e-3;
    const Eigen::Matrix3d expected = turns ? passive(stiffness) : stiffness;
    EXPECT_LT((local.stiffness - expected).norm(), left_out * stiffness.norm());
    EXPECT_LT(error, 0.02) << "within its radius";
  }
  EXPECT_GE(useful, 3) << "of 4 depths";
}

// Beyond a share of the tool's radius its normals turn too much, however far contacts are from a change.
TEST_P(Tools, ALocalModelReachesATenthOfTheRadiusAtMost) {
  const double radius = 0.05 * edge_;
  const Vec3 place = at(0.47, 0.53, 1.0 + radius);
  State state(body_, {.tools = {plain({.radius = radius})}});
  double largest = 0.0;
  for (int k = 0; k <= 200; ++k) {
    step(body_, state, pose(place + at(0.0, 0.0, (0.2 - 0.01 * std::min(k, 150)) * radius)));
    largest = std::max(largest, state.tools[0].local.radius);
  }
  ASSERT_GT(state.tools[0].contacts, 0);
  EXPECT_GT(largest, 0.09 * radius);
  EXPECT_LE(largest, 0.1 * radius * (1.0 + 1e-12));
}

// dF/dt = -felt / 20 ms, and what was felt is forgotten by 2 % a millisecond: gone after 25.6 ms.
TEST_P(Tools, AForceThatIsLostFadesInTheSameTimeAtAnyRate) {
  const double a = -std::log(0.98);  // 1/ms
  const double expected = -std::log(1.0 - 20.0 * a) / a;
  EXPECT_NEAR(expected, 25.6, 0.05);
  for (const double tick : {1e-3, 5e-4, 2e-4}) {
    const State state(body_, {.tools = {Tool{.radius = radius_}}, .tick = tick});
    ToolState tool = state.tools[0];
    tool.wrench.force = at(0.0, 0.0, 2.0);
    int ticks = 0;
    for (; tool.wrench.force.norm() > 0.0 && ticks < 1000; ++ticks) give_force(tool, tick);
    EXPECT_NEAR(1e3 * tick * ticks, expected, 1.5e3 * tick + 0.5) << tick << " s";
  }
}

TEST_P(Tools, TheWrenchIsThatOfTheForcesOnTheBody) {
  for (const double friction : {0.0, 0.3}) {
    State state(body_, {.tools = {plain({.radius = radius_, .length = 1.5 * edge_, .friction = friction})}});
    constexpr double tilt = 1.7;  // from upright: it touches with its far end
    ToolPose lean = pose(at(0.3, 0.5, 1.0 + 0.8 * radius_ - 1.5 * edge_ * std::cos(tilt)));
    lean.orientation = GetParam() == 3 ? Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Vec3::UnitY()))
                                       : Eigen::Quaterniond(Eigen::AngleAxisd(-tilt, Vec3::UnitZ()));
    go(body_, state, lean.position + at(-0.05, 0.0, 0.3 * radius_), lean, 60);
    hold(body_, state, lean, 200);
    const ToolState& tool = state.tools[0];
    ASSERT_GT(tool.wrench.torque.norm(), 0.1 * edge_ * tool.wrench.force.norm());
    Vec3 force = Vec3::Zero();
    Vec3 torque = Vec3::Zero();
    const std::span<const Index> nodes = state.surface.near.load().nodes();
    for (Index k = 0; k < static_cast<Index>(nodes.size()); ++k) {
      const Vec3 f = vector_at(state.surface.near.load().forces(), GetParam(), k);
      const Index node = body_.surface_node_of_stored(nodes[static_cast<std::size_t>(k)]);
      force += f;
      torque += (state.surface.tree.position(node) - tool.pose.position).cross(f);
    }
    EXPECT_LT((tool.wrench.force + force).norm(), 1e-12 * force.norm());
    EXPECT_LT((tool.wrench.torque + torque).norm(), 1e-6 * torque.norm());
  }
}

TEST_P(Tools, ASecondToolFindsTheSurfaceWhereTheFirstHasPutIt) {
  State state(body_, {.tools = {plain({.radius = radius_}), plain({})}});
  const Vec3 first = at(0.3, 0.4, 1.0 + 0.4 * radius_);
  const Vec3 far = at(0.8, 0.7, 2.0);
  std::vector<ToolPose> poses = {pose(first), pose(far)};
  for (int k = 0; k <= 100; ++k) {
    poses[0].position = first + at(0.0, 0.0, 0.01 * (100 - k) * 0.8 * radius_);
    step(body_, state, poses);
  }
  for (int k = 0; k < 1000; ++k) step(body_, state, poses);

  std::vector<double> u(static_cast<std::size_t>(body_.greens().order()));
  surface_displacement(body_, state, u);
  double furthest = 0.0;
  double largest = 0.0;
  for (Index node = 0; node < static_cast<Index>(body_.surface_rest_positions().size()); ++node) {
    const Index stored = body_.surface_stored_nodes()[static_cast<std::size_t>(node)];
    const Vec3 displacement = stored < 0 ? Vec3::Zero() : vector_at(u, GetParam(), stored);
    const Vec3 now = body_.surface_rest_positions()[static_cast<std::size_t>(node)] + displacement;
    furthest = std::max(furthest, (state.surface.tree.position(node) - now).norm());
    largest = std::max(largest, displacement.norm());
  }
  EXPECT_GT(largest, 0.3 * edge_);
  EXPECT_LT(furthest, 1e-9 * edge_);

  // It comes down on where the top has gone.
  const NearestSimplex under = state.surface.tree.nearest(at(0.8, 0.7, 1.0));
  const Vec3 top = under.nearest.on_simplex;
  const double moved = std::abs(top[GetParam() - 1] - 1.0);
  EXPECT_GT(moved, 1e-3 * edge_);
  const Vec3 above = top + at(0.0, 0.0, 0.02 * moved);
  for (int k = 0; k <= 50; ++k) {
    poses[1].position = above + at(0.0, 0.0, 0.02 * (50 - k) * 0.2 * edge_);
    step(body_, state, poses);
  }
  EXPECT_EQ(state.tools[1].wrench.force, Vec3::Zero());
  poses[1].position = top - at(0.0, 0.0, 0.02 * moved);
  step(body_, state, poses);
  EXPECT_GT(up(state.tools[1].wrench.force), 0.0);
}

}  // namespace
}  // namespace palpate::contact_tool_test
