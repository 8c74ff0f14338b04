// The WoodenHaptics family: reports byte by byte, kinematics against each other and finite differences.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "runtime/devices/reports/device_profile.h"
#include "runtime/devices/reports/woodenhaptics_arm.h"
#include "runtime/devices/reports/woodenhaptics_report.h"
#include "tests/support/devices/bytes.h"
#include "tests/support/folders.h"

namespace palpate::woodenhaptics_test {
namespace {

constexpr double quarter = std::numbers::pi / 2.0;

DeviceProfile profile(const std::string& name) {
  return read_device_profile(palpate::test::source_file("runtime/devices/hid/profiles/" + name + ".toml"));
}

ArmConstants arm_of(const std::string& name) {
  return std::get<ArmConstants>(profile(name).kind);
}

const std::vector<std::string> arms = {"woodenhaptics", "polhem_v1", "aluhaptics"};

/// Places in the workspace that the arm reaches, away from the axis and the straight arm.
std::vector<Vec3> places(const std::string& name) {
  const DeviceProfile device = profile(name);
  const ArmConstants arm = std::get<ArmConstants>(device.kind);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  std::vector<Vec3> result;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 place = device.limits.workspace_radius * Vec3(entry(random), entry(random), entry(random));
    const Vec3 p = place + arm.workspace_origin - Vec3(0, 0, arm.lengths[0]);
    if (place.norm() <= device.limits.workspace_radius && p.head<2>().norm() > 0.01 &&
        p.norm() < 0.999 * (arm.lengths[1] + arm.lengths[2])) {
      result.push_back(place);
    }
  }
  return result;
}

TEST(WoodenHaptics, CalibrationPoseIsBUprightAndCLevel) {
  // 6000 of 2000 a turn on a 10 mm capstan turn the 120 mm body by 90 degrees.
  const auto report = decode_encoders(bytes("00 00 00 00 70 17 00 00 00 00 00 00 01 00"));
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->calibrate);
  EXPECT_FALSE(report->button);
  const ArmConstants arm = arm_of("woodenhaptics");
  EXPECT_EQ(report->counters, arm.calibration);
  const Vec3 angles = joint_angles(arm, report->counters);
  EXPECT_LT((angles - Vec3(0, 0, quarter)).norm(), 1e-12);
  EXPECT_LT((arm_state(arm, *report).pose.position - Vec3(0.025, 0.0, 0.205)).norm(), 1e-12);
}

TEST(WoodenHaptics, PolhemCountsTheOtherWay) {
  const ArmConstants arm = arm_of("polhem_v1");
  const auto report = decode_encoders(bytes("00 00 00 00 78 EC 00 00 00 00 00 00 00 00"));  // -5000
  ASSERT_TRUE(report);
  EXPECT_FALSE(report->calibrate);
  const DeviceState state = arm_state(arm, *report);
  EXPECT_LT((state.pose.position - Vec3(-0.007, 0.0, 0.132)).norm(), 1e-12);
  EXPECT_LT(state.pose.orientation.angularDistance(Eigen::Quaterniond::Identity()), 1e-12);
}

TEST(WoodenHaptics, WristIsWiredFromTheTip) {
  const ArmConstants arm = arm_of("polhem_v1");
  // Counter f is joint D about x, which counts down; e is joint E about y, which counts up. 256 of 1024: 90
  // degrees.
  EXPECT_LT((wrist_angles(arm, {0, 0, 0, 0, 0, 256}) - Vec3(-quarter, 0, 0)).norm(), 1e-12);
  EXPECT_LT((wrist_angles(arm, {0, 0, 0, 0, 256, 0}) - Vec3(0, quarter, 0)).norm(), 1e-12);
  EXPECT_LT((wrist_angles(arm, {0, 0, 0, 256, 0, 0}) - Vec3(0, 0, -quarter)).norm(), 1e-12);
  const Vec3 level(0, 0, quarter);
  const Eigen::Quaterniond turned = arm_orientation(arm, level, Vec3(0, quarter, 0));
  EXPECT_LT((turned * Vec3::UnitX() - Vec3(0, 0, -1)).norm(), 1e-12);
  // Turning the whole arm by A turns the handle about z; link c pointing down (C = 0) points its x axis down.
  EXPECT_LT(
      (arm_orientation(arm, Vec3(quarter, 0, quarter), Vec3::Zero()) * Vec3::UnitX() - Vec3::UnitY()).norm(),
      1e-12);
  EXPECT_LT((arm_orientation(arm, Vec3::Zero(), Vec3::Zero()) * Vec3::UnitX() + Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_EQ(arm_orientation(arm_of("woodenhaptics"), Vec3(1, 1, 1), Vec3(1, 1, 1)).coeffs(),
            Eigen::Quaterniond::Identity().coeffs());
}

TEST(WoodenHaptics, ButtonComesAsTenThousandCounts) {
  const auto report = decode_encoders(bytes("00 00 00 00 00 00 0B 27 00 00 00 00 00 00"));  // 9995
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->button);
  EXPECT_EQ(report->counters[3], -5);
  const DeviceState state = arm_state(arm_of("polhem_v1"), *report);
  EXPECT_EQ(state.buttons, 1U);
  EXPECT_TRUE(state.pose.grab);
}

TEST(WoodenHaptics, RefusesShortLongAndGarbage) {
  EXPECT_FALSE(decode_encoders({}));
  EXPECT_FALSE(decode_encoders(Bytes(13, 0)));
  EXPECT_FALSE(decode_encoders(Bytes(15, 0)));
  EXPECT_TRUE(decode_encoders(Bytes(14, 0)));
  EXPECT_FALSE(decode_encoders(Bytes(14, 0xFF)));
  std::mt19937 random(1);
  int taken = 0;
  for (int i = 0; i < 20000; ++i) {
    taken += decode_encoders(random_bytes(random, random() % 20)).has_value() ? 1 : 0;
  }
  EXPECT_LE(taken, 2);  // 2 of 65536 values of the last number
}

TEST(WoodenHaptics, OneNewtonInMilliamperes) {
  const ArmConstants arm = arm_of("woodenhaptics");
  const Vec3 level(0, 0, quarter);
  // Lever times capstan over body over torque constant: 0.245 * 10/120 / 0.0259 A, and so on.
  const auto up = motor_currents(arm, level, Vec3::UnitZ());
  EXPECT_EQ(as_bytes(encode_currents(up)),
            bytes("00 00 00 00 00 14 03 00 00 00 00 00 00 00 00"));  // 788
  const auto out = motor_currents(arm, level, Vec3::UnitX());
  EXPECT_EQ(as_bytes(encode_currents(out)),
            bytes("00 00 00 94 02 00 00 00 00 00 00 00 00 00 00"));  // 660
  const auto aside = motor_currents(arm, level, Vec3::UnitY());
  EXPECT_EQ(as_bytes(encode_currents(aside)),
            bytes("00 4F 02 00 00 00 00 00 00 00 00 00 00 00 00"));  // 591
  const auto polhem = motor_currents(arm_of("polhem_v1"), level, Vec3::UnitZ());
  EXPECT_EQ(as_bytes(encode_currents(polhem)),
            bytes("00 00 00 00 00 09 FF 00 00 00 00 00 00 00 00"));  // -247
}

TEST(WoodenHaptics, SetsCountersWithoutCurrent) {
  EXPECT_EQ(as_bytes(encode_counters({1, 2, 6000, 4, 5, -6})),
            bytes("00 04 00 05 00 FA FF 01 00 01 00 02 00 70 17"));
}

TEST(WoodenHaptics, TooMuchCurrentIsScaledAsAWhole) {
  const ArmConstants arm = arm_of("woodenhaptics");
  const Vec3 angles(0.3, 0.1, 1.4);
  const Vec3 force(3, -2, 1);
  const Vec3 small = motor_currents(arm, angles, force);
  EXPECT_LT(small.cwiseAbs().maxCoeff(), arm.max_current);
  EXPECT_TRUE(motor_currents(arm, angles, 0.5 * force).isApprox(0.5 * small, 1e-12)) << "all of it is shown";
  const Vec3 large = motor_currents(arm, angles, 100.0 * force);
  EXPECT_NEAR(large.cwiseAbs().maxCoeff(), arm.max_current, 1e-12);
  EXPECT_LT((large / arm.max_current - small / small.cwiseAbs().maxCoeff()).norm(), 1e-12);
  const auto nothing = motor_currents(arm, angles, Vec3(0, std::numeric_limits<double>::quiet_NaN(), 0));
  EXPECT_EQ(nothing, Vec3::Zero());
  const double huge = std::numeric_limits<double>::infinity();
  EXPECT_EQ(as_bytes(encode_currents(Vec3(huge, -1e9, 1e9))),
            bytes("00 00 00 01 80 FF 7F 00 00 00 00 00 00 00 00"));
}

TEST(WoodenHaptics, InverseUndoesForward) {
  for (const std::string& name : arms) {
    const ArmConstants arm = arm_of(name);
    const std::vector<Vec3> all = places(name);
    ASSERT_GT(all.size(), 1000U) << name;
    for (const Vec3& place : all) {
      const auto angles = inverse_arm(arm, place);
      ASSERT_TRUE(angles) << name << " " << place.transpose();
      EXPECT_LT((arm_position(arm, *angles) - place).norm(), 1e-12) << name;
    }
    EXPECT_FALSE(inverse_arm(arm, Vec3(1, 0, 0)));
    EXPECT_FALSE(inverse_arm(arm, -arm.workspace_origin));  // on the axis
    EXPECT_FALSE(inverse_arm(arm, Vec3::Constant(std::numeric_limits<double>::quiet_NaN())));
  }
}

TEST(WoodenHaptics, ForwardUndoesInverseFromCounters) {
  const ArmConstants arm = arm_of("woodenhaptics");
  for (const std::array<std::int16_t, 6>& counters :
       {std::array<std::int16_t, 6>{300, -900, 5200, 0, 0, 0},
        std::array<std::int16_t, 6>{-2000, 700, 6600, 0, 0, 0}}) {
    const Vec3 angles = joint_angles(arm, counters);
    const auto back = inverse_arm(arm, arm_position(arm, angles));
    ASSERT_TRUE(back);
    EXPECT_LT((*back - angles).norm(), 1e-9);
  }
}

TEST(WoodenHaptics, JacobianIsTheDerivative) {
  for (const std::string& name : arms) {
    const ArmConstants arm = arm_of(name);
    for (const Vec3& place : places(name)) {
      const Vec3 angles = *inverse_arm(arm, place);
      const Mat3 J = arm_jacobian(arm, angles);
      constexpr double step = 1e-6;
      for (int i = 0; i < 3; ++i) {
        const Vec3 slope = (arm_position(arm, angles + step * Vec3::Unit(i)) -
                            arm_position(arm, angles - step * Vec3::Unit(i))) /
                           (2.0 * step);
        ASSERT_LT((J.col(i) - slope).norm(), 1e-9) << name << " " << i;
      }
    }
  }
}

TEST(WoodenHaptics, MotorsDoTheWorkOfTheForce) {
  // Currents times torque constants times motor motion = force times motion, by differences of whole counts.
  for (const std::string& name : arms) {
    const ArmConstants arm = arm_of(name);
    const Vec3 force(1.0, -0.7, 0.4);
    for (const auto& counters : {std::array<std::int16_t, 6>{200, 300, 5000, 0, 0, 0},
                                 std::array<std::int16_t, 6>{-700, -500, -4000, 0, 0, 0}}) {
      const Vec3 angles = joint_angles(arm, counters);
      const Vec3 torques = motor_currents(arm, angles, force).cwiseProduct(arm.torque_constants);
      for (std::size_t i = 0; i < 3; ++i) {
        auto more = counters;
        auto less = counters;
        ++more[i];
        --less[i];
        const Vec3 motion =
            arm_position(arm, joint_angles(arm, more)) - arm_position(arm, joint_angles(arm, less));
        const double turned = 2.0 * 2.0 * std::numbers::pi / arm.counts_per_turn[i];
        EXPECT_NEAR(torques[static_cast<Eigen::Index>(i)] * turned, force.dot(motion), 1e-9)
            << name << " " << i;
      }
    }
  }
}

}  // namespace
}  // namespace palpate::woodenhaptics_test
