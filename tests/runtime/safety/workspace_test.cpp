// The map between device and body against virtual work and finite differences.
#include "runtime/safety/workspace.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <random>

#include "base/error.h"

namespace palpate::workspace_test {
namespace {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double number() { return normal_(engine_); }
  double scale() { return std::exp(number()); }
  Vec3 vector() { return {number(), number(), number()}; }
  Eigen::Quaterniond turn() {
    return Eigen::Quaterniond(number(), number(), number(), number()).normalized();
  }
  WorkspaceOptions workspace() {
    return {.device_origin = vector(),
            .body_origin = vector(),
            .axes = turn(),
            .motion_scale = scale(),
            .force_scale = scale()};
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

TEST(Workspace, IsNothingByDefault) {
  const Workspace workspace;
  const Vec3 x(0.1, -0.2, 0.3);
  EXPECT_EQ(workspace.position_in_body(x), x);
  EXPECT_EQ(workspace.position_in_device(x), x);
}

TEST(Workspace, TakesTheOriginToTheOriginAndOneMetreToTheScale) {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()));
  const Workspace workspace({.device_origin = Vec3(1, 2, 3),
                             .body_origin = Vec3(10, 20, 30),
                             .axes = quarter,
                             .motion_scale = 0.5,
                             .force_scale = 4.0});
  EXPECT_TRUE(workspace.position_in_body(Vec3(1, 2, 3)).isApprox(Vec3(10, 20, 30)));
  EXPECT_TRUE(workspace.position_in_body(Vec3(2, 2, 3)).isApprox(Vec3(10, 20.5, 30)));
  DeviceCommand body;
  body.wrench.force = Vec3(0, 1, 0);
  body.wrench.torque = Vec3(0, 1, 0);
  EXPECT_TRUE(workspace.in_device(body).wrench.force.isApprox(Vec3(4, 0, 0)));
  EXPECT_TRUE(workspace.in_device(body).wrench.torque.isApprox(Vec3(8, 0, 0)));  // c / s
}

TEST(Workspace, GoesThereAndBack) {
  Random random(1);
  for (int k = 0; k < 100; ++k) {
    const Workspace workspace(random.workspace());
    const Vec3 x = random.vector();
    EXPECT_LT((workspace.position_in_device(workspace.position_in_body(x)) - x).norm(), 1e-13 * 100);
  }
}

TEST(Workspace, TurnsTheHandleWithTheAxes) {
  Random random(2);
  for (int k = 0; k < 100; ++k) {
    const WorkspaceOptions options = random.workspace();
    const Workspace workspace(options);
    DeviceState device;
    device.pose.orientation = random.turn();
    device.pose.position = random.vector();
    const Vec3 tip(0.0, 0.0, 0.1);  // in the handle's own axes, a direction of the device
    const Vec3 along = device.pose.orientation * tip;
    const DeviceState body = workspace.in_body(device);
    const Vec3 moved = workspace.position_in_body(device.pose.position + along) - body.pose.position;
    EXPECT_LT((moved - options.motion_scale * (body.pose.orientation * tip)).norm(), 1e-12);
  }
}

TEST(Workspace, VelocityIsThatOfThePosition) {
  Random random(3);
  const Workspace workspace(random.workspace());
  DeviceState device;
  device.pose.position = random.vector();
  device.velocity = random.vector();
  const double h = 1e-6;
  const Vec3 moved = workspace.position_in_body(device.pose.position + h * device.velocity) -
                     workspace.position_in_body(device.pose.position - h * device.velocity);
  EXPECT_LT((moved / (2.0 * h) - workspace.in_body(device).velocity).norm(), 1e-8);
}

/// For any small motion and turn of the hand: its work is c / s of the body's.
TEST(Workspace, KeepsTheRatioOfWork) {
  Random random(4);
  for (int k = 0; k < 100; ++k) {
    const WorkspaceOptions options = random.workspace();
    const Workspace workspace(options);
    DeviceState hand;
    hand.velocity = random.vector();
    const Vec3 turning = random.vector();
    DeviceCommand body;
    body.wrench = {.force = random.vector(), .torque = random.vector()};
    const Wrench felt = workspace.in_device(body).wrench;
    const double work = felt.force.dot(hand.velocity) + felt.torque.dot(turning);
    const double of_body = body.wrench.force.dot(workspace.in_body(hand).velocity) +
                           body.wrench.torque.dot(options.axes * turning);
    EXPECT_NEAR(work, options.force_scale / options.motion_scale * of_body, 1e-12 * (1.0 + std::abs(work)));
  }
}

/// A force at the end of a lever: its torque is felt as that of the force felt at the lever felt.
TEST(Workspace, TorqueIsOfTheScaledLever) {
  Random random(5);
  const WorkspaceOptions options = random.workspace();
  const Workspace workspace(options);
  const Vec3 lever = random.vector();
  const Vec3 lever_felt = workspace.position_in_device(lever) - workspace.position_in_device(Vec3::Zero());
  DeviceCommand body;
  body.wrench.force = random.vector();
  body.wrench.torque = lever.cross(body.wrench.force);
  const Wrench felt = workspace.in_device(body).wrench;
  EXPECT_LT((felt.torque - lever_felt.cross(felt.force)).norm(), 1e-12 * felt.torque.norm());
}

/// A body that stiffens as it is pressed.
Vec3 body_force(const Vec3& x) {
  return Vec3(-30.0 * x.x(), -50.0 * x.y() + 10.0 * x.x(), -80.0 * x.z()) - 40.0 * x.squaredNorm() * x;
}

Mat3 difference(const auto& force, const Vec3& x) {
  const double h = 1e-5;
  Mat3 stiffness;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = h * Vec3::Unit(axis);
    stiffness.col(axis) = (force(Vec3(x - step)) - force(Vec3(x + step))) / (2.0 * h);
  }
  return stiffness;
}

TEST(Workspace, StiffnessIsTheDerivativeOfTheForceFelt) {
  Random random(6);
  for (int k = 0; k < 20; ++k) {
    const Workspace workspace(random.workspace());
    const auto felt = [&](const Vec3& x) {
      DeviceCommand body;
      body.wrench.force = body_force(workspace.position_in_body(x));
      return workspace.in_device(body).wrench.force;
    };
    const Vec3 x = random.vector();
    DeviceCommand body;
    body.local.stiffness = difference(body_force, workspace.position_in_body(x));
    const Mat3 expected = difference(felt, x);
    EXPECT_LT((workspace.in_device(body).local.stiffness - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST(Workspace, LocalModelIsTheSameFieldOnBothSides) {
  Random random(7);
  const Workspace workspace(random.workspace());
  DeviceCommand body;
  body.wrench.force = random.vector();
  body.local = {.force = body.wrench.force,
                .stiffness = Vec3(100.0, 200.0, 300.0).asDiagonal(),
                .point = random.vector(),
                .radius = 0.01};
  const DeviceCommand felt = workspace.in_device(body);
  const Vec3 edge_in_body = body.local.point + body.local.radius * random.vector().normalized();
  const Vec3 edge = workspace.position_in_device(edge_in_body);
  EXPECT_NEAR((edge - felt.local.point).norm(), felt.local.radius, 1e-12);
  DeviceCommand there;
  there.wrench.force = body.local.force - body.local.stiffness * (edge_in_body - body.local.point);
  const Vec3 expected = workspace.in_device(there).wrench.force;
  EXPECT_LT((felt.local.force - felt.local.stiffness * (edge - felt.local.point) - expected).norm(),
            1e-12 * expected.norm());
}

TEST(Workspace, RefusesWhatIsNoMap) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double scale : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(Workspace({.motion_scale = scale}), Error);
    EXPECT_THROW(Workspace({.force_scale = scale}), Error);
  }
  EXPECT_THROW(Workspace({.device_origin = Vec3(nan, 0, 0)}), Error);
  EXPECT_THROW(Workspace({.body_origin = Vec3(nan, 0, 0)}), Error);
  EXPECT_THROW(Workspace({.axes = Eigen::Quaterniond(0, 0, 0, 0)}), Error);
  const Workspace twice({.axes = Eigen::Quaterniond(2, 0, 0, 0)});
  EXPECT_EQ(twice.position_in_body(Vec3(1, 2, 3)), Vec3(1, 2, 3));
}

}  // namespace
}  // namespace palpate::workspace_test
