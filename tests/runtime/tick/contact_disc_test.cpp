// A flat punch: what it feels flat and tilted, on fine and coarse surfaces, with friction, and while it
// holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "runtime/core/tick/step.h"
#include "runtime/core/touch/tool_geometry.h"
#include "runtime/core/touch/touching_pair.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::contact_disc_test {
namespace {

using test::go;
using test::hold;
using test::place_now;
using test::plain;
using test::pose;

/// A cube or, in the plane, a square under a disc with a thin edge.
class DiscContact : public testing::TestWithParam<int> {
 protected:
  static int d() { return GetParam(); }
  static Vec3 at(double x, double y, double z) { return test::upright(d(), x, y, z); }
  static double up(const Vec3& force) { return force[d() - 1]; }
  /// Turned by an angle about the axis along which a tilt lowers the side of +x.
  static Eigen::Quaterniond tilted(double angle) {
    return Eigen::Quaterniond(d() == 3 ? Eigen::AngleAxisd(angle, Vec3::UnitY())
                                       : Eigen::AngleAxisd(-angle, Vec3::UnitZ()));
  }
  /// Flat on the top, its face `depth` under it.
  [[nodiscard]] ToolPose pressed(double depth, double x = 0.47, double y = 0.53) const {
    return pose(at(x, y, 1.0 + edge_ - depth));
  }
  [[nodiscard]] Tool disc(double friction = 0.0) const {
    return plain({.radius = edge_, .disc_radius = radius_, .friction = friction});
  }
  /// Pressed down to a pose from above it, and held there.
  [[nodiscard]] State touching(const Tool& tool, const ToolPose& to) const {
    State state(body_, {.tools = {tool}});
    go(body_, state, to.position + at(0.0, 0.0, 2.0 * edge_), to, 60);
    hold(body_, state, to, 100);
    return state;
  }

  Body body_{test::unit_model(GetParam(), 8, Scope::surface, Precision::double_precision)};
  double radius_ = 0.3;
  double edge_ = 0.03;
};
INSTANTIATE_TEST_SUITE_P(Dimension, DiscContact, testing::Values(2, 3));

Wrench sum_of_contacts(const State& state) {
  Wrench sum;
  for (const ContactPoint& contact : state.contacts()) {
    sum.force += contact.force;
    sum.torque += (contact.position - state.tools[0].pose.position).cross(contact.force);
  }
  return sum;
}

TEST_P(DiscContact, PressedFlatKeepsTheSurfaceOutOfAllOfIt) {
  const double depth = 0.02;
  const State state = touching(disc(), pressed(depth));
  EXPECT_EQ(state.status, StepStatus::ok);
  double lowest = 1.0;
  double highest = 0.0;
  for (Index node = 0; node < static_cast<Index>(body_.surface_rest_positions().size()); ++node) {
    const Vec3& place = state.surface.tree.position(node);
    const Vec3 from_axis = place - state.tools[0].pose.position;
    if (body_.surface_rest_positions()[static_cast<std::size_t>(node)][d() - 1] < 1.0) continue;
    if ((from_axis - up(from_axis) * at(0, 0, 1)).norm() > radius_ - edge_) continue;
    lowest = std::min(lowest, up(place));
    highest = std::max(highest, up(place));
  }
  EXPECT_NEAR(highest, 1.0 - depth, 1e-6 * depth) << "the face is as deep as the tool is";
  EXPECT_GT(lowest, 1.0 - 1.1 * depth);
}

TEST_P(DiscContact, PressedFlatPushesUpThroughThePressuresCentre) {
  const State state = touching(disc(), pressed(0.02, 0.5, 0.5));
  const Wrench& wrench = state.tools[0].wrench;
  EXPECT_GT(up(wrench.force), 0.0);
  EXPECT_LT((wrench.force - up(wrench.force) * at(0, 0, 1)).norm(), 0.01 * up(wrench.force));
  EXPECT_LT(wrench.torque.norm(), 0.02 * radius_ * up(wrench.force)) << "the cube is nearly symmetric";
  const State beside = touching(disc(), pressed(0.02, 0.85, 0.5));
  EXPECT_GT(beside.tools[0].wrench.torque.norm(), 0.1 * radius_ * beside.tools[0].wrench.force.norm())
      << "a part of it is over the cube's edge: the force is off its middle";
}

TEST_P(DiscContact, TiltedIsTurnedBackAndItsWrenchIsThatOfItsContacts) {
  for (const double friction : {0.0, 0.4}) {
    for (const double angle : {0.03, -0.1, 0.3}) {
      ToolPose lean = pressed(0.015 - (radius_ - edge_) * std::abs(std::sin(angle)));
      lean.orientation = tilted(angle);
      const State state = touching(disc(friction), lean);
      const Wrench& wrench = state.tools[0].wrench;
      const Wrench sum = sum_of_contacts(state);
      ASSERT_GT(up(wrench.force), 0.0) << angle;
      // With friction the solver of many contacts stops earlier.
      const double rest = friction > 0.0 ? 0.01 : 1e-6;
      EXPECT_LT((wrench.force - sum.force).norm(), rest * sum.force.norm()) << angle;
      EXPECT_LT((wrench.torque - sum.torque).norm(), rest * radius_ * sum.force.norm()) << angle;
      // What lowers the side of +x turns about +y, in the plane about -z.
      const double back = d() == 3 ? -wrench.torque.y() : wrench.torque.z();
      EXPECT_GT(back * angle, 0.3 * radius_ * std::abs(angle) * std::cos(angle) * up(wrench.force));
    }
  }
}

/// Less force the more it is tilted, and no jump where the surface under it comes free from one side.
TEST_P(DiscContact, TiltsWithoutAJump) {
  State state = touching(disc(), pressed(0.01));
  const double largest = state.tools[0].wrench.force.norm();
  Wrench last = state.tools[0].wrench;
  int unsettled = 0;
  for (int tick = 0; tick < 600; ++tick) {
    ToolPose lean = pressed(0.01);
    lean.orientation = tilted(0.1 * std::sin(2.0 * M_PI * tick / 300.0));
    const StepStatus status = step(body_, state, lean);
    if (has(status, StepStatus::not_converged) || has(status, StepStatus::capacity_full)) ++unsettled;
    const Wrench& wrench = state.tools[0].wrench;
    EXPECT_LT((wrench.force - last.force).norm(), 0.04 * largest) << tick;
    EXPECT_LT((wrench.torque - last.torque).norm(), 0.06 * largest * radius_) << tick;
    last = wrench;
  }
  EXPECT_EQ(unsettled, 0);
}

TEST_P(DiscContact, SticksAndThenSlidesWithEachContactsFriction) {
  const double friction = 0.3;
  State state = touching(disc(friction), pressed(0.02));
  ToolPose now = pressed(0.02);
  int unsettled = 0;
  for (int tick = 0; tick < 300; ++tick) {
    now.position += at(2e-4, 0.0, 0.0);
    if (has(step(body_, state, now), StepStatus::not_converged)) ++unsettled;
    EXPECT_LT(state.tools[0].force_error, 0.02 * state.tools[0].wrench.force.norm()) << tick;
    double rubs = 0.0;
    double presses = 0.0;
    for (const ContactPoint& contact : state.contacts()) {
      rubs += test::friction_force(contact).norm();
      presses += test::normal_force(contact);
    }
    if (tick < 2) {
      EXPECT_LT(rubs, 0.6 * friction * presses) << tick;
    }
    EXPECT_LT(rubs, 1.005 * friction * presses) << tick;
    if (tick > 150) {
      EXPECT_GT(rubs, 0.98 * friction * presses) << tick;
    }
    EXPECT_LE(state.tools[0].wrench.force.x(), 1e-9) << tick;
  }
  EXPECT_LE(unsettled, 15) << "of 300 ticks";
}

/// A sphere of the same radius to the last bit.
TEST_P(DiscContact, WithoutAFlatFaceIsASphere) {
  const Tool sphere = plain({.radius = 0.2, .friction = 0.3});
  Tool round = sphere;
  round.disc_radius = round.radius;
  const ToolPose down = pose(at(0.47, 0.53, 1.18));
  const State a = touching(sphere, down);
  const State b = touching(round, down);
  EXPECT_GT(up(a.tools[0].wrench.force), 0.0);
  EXPECT_EQ(a.tools[0].wrench.force, b.tools[0].wrench.force);
  EXPECT_EQ(a.tools[0].wrench.torque, b.tools[0].wrench.torque);
}

TEST_P(DiscContact, HoldsWhatItTouchesAndLiftsIt) {
  const double depth = 0.02;
  ToolPose place = pressed(depth);
  State state = touching(disc(), place);
  const Wrench before = state.tools[0].wrench;
  place.grab = true;
  step(body_, state, place);
  ASSERT_TRUE(state.tools[0].holding);
  EXPECT_LT((state.tools[0].wrench.force - before.force).norm(), 1e-8 * before.force.norm()) << "no kick";
  EXPECT_LT((state.tools[0].wrench.torque - before.torque).norm(), 1e-7 * radius_ * before.force.norm());
  const ToolPose from = place;
  for (int tick = 1; tick <= 200; ++tick) {
    place.position = from.position + at(0.0, 0.0, 2.0 * depth * tick / 200);
    place.orientation = tilted(0.03 * tick / 200);
    step(body_, state, place);
  }
  EXPECT_LT(up(state.tools[0].wrench.force), 0.0) << "it pulls the hand back";
  int held = 0;
  for (const ContactPoint& contact : state.contacts()) {
    if (!contact.held) continue;
    ++held;
    const Vec3 wanted = state.tools[0].pose.position + state.tools[0].pose.orientation * contact.tool_point;
    EXPECT_LT((place_now(state, contact) - wanted).norm(), 1e-6 * depth);
  }
  EXPECT_GE(held, 2);
}

TEST_P(DiscContact, DoesNotBeginInsideOfTheBody) {
  for (const Vec3& place : {at(0.5, 0.5, 0.5), at(1.2, 0.5, 0.5)}) {
    State state(body_, {.tools = {disc()}});
    EXPECT_TRUE(has(step(body_, state, pose(place)), StepStatus::inside_body)) << place.transpose();
    EXPECT_EQ(state.tools[0].wrench.force, Vec3::Zero());
  }
  State state(body_, {.tools = {disc()}});
  EXPECT_EQ(step(body_, state, pose(at(1.0 + 1.02 * radius_, 0.5, 0.5))), StepStatus::ok);
}

class SpatialDisc : public testing::Test {
 protected:
  Body body_{test::unit_model(3, 8, Scope::surface, Precision::double_precision)};
};

/// The disc is turned about its own axis: every contact slides, and each resists by the coefficient times its
/// force at its distance from the axis.
TEST_F(SpatialDisc, TurnedAboutItsAxisIsHeldBackByFriction) {
  const double friction = 0.3;
  State state(body_, {.tools = {plain({.radius = 0.02, .disc_radius = 0.2, .friction = friction})}});
  ToolPose now = pose(Vec3(0.5, 0.5, 1.0));
  go(body_, state, now.position + Vec3(0, 0, 0.05), now, 100);
  hold(body_, state, now, 100);
  int unsettled = 0;
  for (int tick = 1; tick <= 400; ++tick) {
    now.orientation = Eigen::AngleAxisd(1e-3 * tick, Vec3::UnitZ());
    if (has(step(body_, state, now), StepStatus::not_converged)) ++unsettled;
    EXPECT_LT(state.tools[0].force_error, 0.02 * state.tools[0].wrench.force.norm()) << tick;
  }
  EXPECT_LE(unsettled, 40) << "of 400 ticks";
  double most = 0.0;
  for (const ContactPoint& contact : state.contacts()) {
    const Vec3 arm = contact.position - now.position;
    most += friction * test::normal_force(contact) * std::hypot(arm.x(), arm.y());
  }
  EXPECT_LT(state.tools[0].wrench.torque.z(), 0.0);
  EXPECT_NEAR(-state.tools[0].wrench.torque.z(), most, 0.03 * most);
}

// Two triangles of half the top each: the disc lies within one of them, where the mesh has no node or edge
// under it.
TEST(DiscOnACoarseSurface, IsHeldFlatByItsRim) {
  const Body body(test::unit_model(ElementType::tet4, 1, Scope::surface, Precision::double_precision));
  for (const double turned : {0.0, 0.3, 1.1}) {
    for (const double angle : {0.0, 0.05, -0.05}) {
      State state(body, {.tools = {plain({.radius = 0.01, .disc_radius = 0.1})}});
      const Vec3 axis(std::cos(turned), std::sin(turned), 0.0);
      ToolPose lean = pose(Vec3(0.8, 0.5, 1.01 - 0.004 + 0.09 * std::abs(std::sin(angle))));
      lean.orientation = Eigen::AngleAxisd(angle, axis);
      go(body, state, lean.position + Vec3(0, 0, 0.03), lean, 60);
      hold(body, state, lean, 100);
      const Wrench& wrench = state.tools[0].wrench;
      EXPECT_EQ(state.status, StepStatus::ok) << angle;
      ASSERT_GT(wrench.force.z(), 0.0);
      // The top turns with the disc: of a flat one the force is within it, of a tilted one at its low side.
      EXPECT_LT(wrench.torque.norm(), 0.1 * wrench.force.norm());
      for (const ContactPoint& contact : state.contacts()) EXPECT_LT(contact.gap, 0.03);
      if (angle != 0.0) {
        EXPECT_LT(wrench.torque.dot(axis) * angle, 0.0) << angle;
      }
      const Vec3 depth = place_now(state, state.contacts()[0]) - lean.position;
      EXPECT_LT(depth.z(), 0.0);
    }
  }
}

/// Both triangles of an edge have the same two contact points, with numbers of their own.
TEST(DiscsRim, IsPassedByAnEdgeAtTwoPlaces) {
  const std::vector<Vec3> places = {{-2, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, -3, 0}};
  const std::vector<Index> triangles = {0, 1, 2, 1, 0, 3};
  const SurfaceTree tree(triangles, 3, places, 0.1);
  const Vec3 middle(0.1, 0.0, 1.0);
  const Core core{middle, middle, 1.0, Vec3::UnitZ(), Vec3::UnitX()};
  std::array<TouchingPair, 2> one;
  std::array<TouchingPair, 2> other;
  ASSERT_EQ(pairs_over_rim(tree, {0, 1, 2}, TouchingPair{}, 0, core, one), 2U);
  ASSERT_EQ(pairs_over_rim(tree, {1, 0, 3}, TouchingPair{}, 0, core, other), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(one[k].place, other[k].place);
    EXPECT_EQ(one[k].nearest.on_simplex, other[k].nearest.on_simplex);
    EXPECT_LT((one[k].nearest.on_simplex - Vec3(k == 0 ? -0.9 : 1.1, 0, 0)).norm(), 1e-15);
  }
  EXPECT_NE(one[0].place, one[1].place);
  EXPECT_EQ(pairs_over_rim(tree, {0, 1, 2}, TouchingPair{}, 1, core, one), 0U) << "it is beside that edge";
}

TEST(DiscsRim, TouchesEdgesHoweverRoundItIs) {
  const Body body(test::unit_model(ElementType::tet4, 4, Scope::surface, Precision::double_precision));
  EXPECT_TRUE(touches_corners_alone(body, {.radius = 2.0}, 0));
  EXPECT_FALSE(touches_corners_alone(body, {.radius = 2.0, .disc_radius = 3.0}, 0));
}

}  // namespace
}  // namespace palpate::contact_disc_test
