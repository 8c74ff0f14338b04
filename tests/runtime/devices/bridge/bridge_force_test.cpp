// What the example of a bridge shows of a command.
#include "runtime/devices/bridge/bridge_force.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/vectors.h"

namespace palpate::bridge_force_test {
namespace {

const Vec3 force_at_point(1.0, -2.0, 0.5);
const Vec3 point(0.01, 0.02, 0.03);

Mat3 stiffness() {
  Mat3 K;
  K << 400, 30, -20, 30, 300, 10, -20, 10, 500;
  return K;
}

constexpr double radius = 1.0 / 512.0;  // as a float has it [m]

bridge_command local_model() {
  return {{'P', 'L', 'P', 'C'},
          BRIDGE_VERSION,
          0,
          BRIDGE_LOCAL_MODEL,
          0,
          {1.0, -2.0, 0.5},
          {0.01, 0.02, 0.03},
          {0.0F, 0.0F, 0.0F},
          {400, 300, 500, 30, 10, -20},
          0.5F,
          static_cast<float>(radius),
          0.0F,
          10,
          20,
          0};
}

Vec3 shown(const bridge_command& command, const Vec3& x, const Vec3& v, double age, double most = 0.0) {
  Vec3 force;
  bridge_force(&command, x.data(), v.data(), age, most, force.data());
  return force;
}

TEST(BridgeForce, LocalModelWithinRadiusAndTime) {
  const Vec3 d(0.001, -0.0005, 0.0012), v(0.1, 0.2, -0.3);
  const Vec3 expected = force_at_point - stiffness() * d - 0.5 * v;
  for (const double age : {0.0, 0.005, 0.010}) {
    EXPECT_LT((shown(local_model(), point + d, v, age) - expected).norm(), 1e-12) << age;
  }
}

TEST(BridgeForce, AtTheEdgeBeyondTheRadius) {
  const Vec3 direction = Vec3(1, 2, -2) / 3.0, v(0.1, 0.2, -0.3);
  const Vec3 expected = force_at_point - stiffness() * (radius * direction) - 0.5 * v;
  for (const double distance : {0.002, 0.0021, 0.5}) {
    EXPECT_LT((shown(local_model(), point + distance * direction, v, 0.001) - expected).norm(), 1e-12);
  }
}

TEST(BridgeForce, FadesEvenlyAfterItsTime) {
  const Vec3 d(0.001, 0, 0);
  const Vec3 whole = force_at_point - stiffness() * d;
  for (const auto& [age, share] :
       {std::pair{0.015, 0.75}, {0.020, 0.5}, {0.029, 0.05}, {0.030, 0.0}, {9.0, 0.0}}) {
    EXPECT_LT((shown(local_model(), point + d, Vec3::Zero(), age) - share * whole).norm(), 1e-12) << age;
  }
  bridge_command hard = local_model();
  hard.fade = 0;
  EXPECT_EQ(bridge_share(&hard, 0.010), 1.0);
  EXPECT_EQ(bridge_share(&hard, 0.0100001), 0.0);
}

TEST(BridgeForce, WithoutAModelTheForceAlone) {
  bridge_command command = local_model();
  command.mode = BRIDGE_FORCE;
  EXPECT_EQ(shown(command, Vec3(5, 5, 5), Vec3(1, 1, 1), 0.001), force_at_point);
  for (const std::uint32_t mode : {std::uint32_t{BRIDGE_ZERO}, 3U, 0xFFFFFFFFU}) {
    command.mode = mode;
    EXPECT_EQ(shown(command, point, Vec3::Zero(), 0.001), Vec3::Zero()) << mode;
  }
}

TEST(BridgeForce, NoMoreThanBothMayShow) {
  bridge_command command = local_model();
  command.mode = BRIDGE_FORCE;
  const double length = force_at_point.norm();  // 2.29
  const auto expect = [&](float commands, double devices, double most) {
    command.max_force = commands;
    const Vec3 force = shown(command, point, Vec3::Zero(), 0.0, devices);
    EXPECT_LT((force - force_at_point * (most / length)).norm(), 1e-12) << commands << " " << devices;
  };
  expect(0, 0, length);
  expect(3, 4, length);
  expect(2, 0, 2);
  expect(0, 1.5, 1.5);
  expect(2, 1.5, 1.5);
  expect(1, 1.5, 1);
}

TEST(BridgeForce, TorqueFadesAndIsClamped) {
  bridge_command command = local_model();
  command.torque[0] = 0.375F;
  command.torque[2] = -0.5F;
  const auto torque = [&](double age, double most) {
    Vec3 result;
    bridge_torque(&command, age, most, result.data());
    return result;
  };
  EXPECT_EQ(torque(0.01, 0.0), Vec3(0.375, 0, -0.5));
  EXPECT_LT((torque(0.02, 0.0) - Vec3(0.1875, 0, -0.25)).norm(), 1e-15);
  EXPECT_LT((torque(0.01, 0.1) - Vec3(0.06, 0, -0.08)).norm(), 1e-15);
  EXPECT_EQ(torque(0.04, 0.1), Vec3::Zero());
  command.torque[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(torque(0.01, 0.1), Vec3::Zero());
}

TEST(BridgeForce, NoRadiusTheForceAtThePoint) {
  bridge_command command = local_model();
  for (const float none : {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN()}) {
    command.radius = none;
    EXPECT_EQ(shown(command, point + Vec3(0.1, 0, 0), Vec3::Zero(), 0.0), force_at_point);
  }
}

TEST(BridgeForce, NoNumbersNoForce) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(shown(local_model(), Vec3(nan, 0, 0), Vec3::Zero(), 0.0), Vec3::Zero());
  EXPECT_EQ(shown(local_model(), point, Vec3(0, nan, 0), 0.0), Vec3::Zero());
  EXPECT_EQ(shown(local_model(), point, Vec3::Zero(), nan), Vec3::Zero());
  bridge_command command = local_model();
  command.force[1] = 1e200;
  EXPECT_EQ(shown(command, point, Vec3::Zero(), 0.0, 1.0), Vec3::Zero());  // its square is infinite
}

}  // namespace
}  // namespace palpate::bridge_force_test
