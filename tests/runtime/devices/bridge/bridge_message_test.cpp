// The two messages of a bridge: byte by byte as the book has them, and every bad one by its reason.
#include "runtime/devices/bridge/bridge_message.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "runtime/devices/bridge/bridge_force.h"
#include "runtime/safety/monotonic_clock.h"
#include "tests/support/devices/bytes.h"

namespace palpate::bridge_message_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t second = 1'000'000'000;  // ns

// Bytes of the numbers by hand: 1.0 is 3ff0..., 0.5 3fe0..., -2.0 c000... as f64; 1.0 3f800000, 8.0 41000000,
// 2000.0 44fa0000, 0.25 3e800000 as f32.
const Bytes state_by_hand = bytes(
    "50 4c 50 53  03 00 00 00  04 03 02 01  05 00 03 00"     // magic, version, sequence, buttons 0, 2, both
                                                             // flags
    " 00 ca 9a 3b 00 00 00 00  00 00 00 00 00 00 f0 3f"      // 1 s; position 1,
    " 00 00 00 00 00 00 e0 3f  00 00 00 00 00 00 00 c0"      // 0.5, -2
    " 00 00 00 00 00 00 e0 3f  00 00 00 00 00 00 00 00"      // velocity 0.5, 0,
    " 00 00 00 00 00 00 f0 3f  00 00 00 00  00 00 80 3f"     // 1; orientation 0, 1,
    " 00 00 00 00  00 00 00 00  00 00 80 3e  00 00 00 41"    // 0, 0; gripper 0.25; limits 8,
    " 00 00 00 00  00 00 fa 44  00 00 00 00  00 00 80 3e");  // not said, 2000, not said, 0.25

// Without its time.
const Bytes command_by_hand = bytes(
    "50 4c 50 43  03 00 00 00  07 00 00 00  02 00 00 00"      // magic, version, answers 7, local model
    " 00 00 00 00 00 00 00 00  00 00 00 00 00 00 f0 3f"       // force 1,
    " 00 00 00 00 00 00 e0 3f  00 00 00 00 00 00 00 c0"       // 0.5, -2
    " 00 00 00 00 00 00 e0 3f  00 00 00 00 00 00 00 00"       // point 0.5, 0,
    " 00 00 00 00 00 00 f0 3f  00 00 80 3f  00 00 00 41"      // 1; torque 1, 8,
    " 00 00 80 3e  00 00 fa 44  00 00 00 41  00 00 80 3f"     // 0.25; stiffness 2000, 8, 1,
    " 00 00 80 3e  00 00 80 bf  00 00 00 c1  00 00 80 3e"     // xy 0.25, yz -1, zx -8; damping 0.25
    " 00 00 80 3e  00 00 00 41  0a 00  14 00  00 00 00 00");  // radius 0.25, 8 N, 10 ms, then 20 ms

bridge_state as_state(const Bytes& message) {
  bridge_state said{};
  if (!message.empty()) std::memcpy(&said, message.data(), std::min(message.size(), sizeof said));
  return said;
}

Refusal refusal_of(const Bytes& message, BridgeState& state, std::int64_t now = second) {
  return read_bridge_state(as_state(message), message.size(), now, state);
}

Refusal refusal_of(const Bytes& message, std::int64_t now = second) {
  BridgeState state;
  return refusal_of(message, state, now);
}

template <class Number>
Refusal refusal_with(std::size_t at, Number value) {
  Bytes message = state_by_hand;
  std::memcpy(&message[at], &value, sizeof value);
  return refusal_of(message);
}

DeviceCommand command_like_that_by_hand() {
  Mat3 stiffness;
  stiffness << 2000, 0.25, -8, 0.25, 8, -1, -8, -1, 1;
  const Vec3 force(1, 0.5, -2);
  return {{force, Vec3(1, 8, 0.25)}, {force, stiffness, Vec3(0.5, 0, 1), 0.25}};
}

TEST(BridgeMessage, StateByHand) {
  BridgeState state;
  ASSERT_EQ(refusal_of(state_by_hand, state, second + 5), Refusal::none);
  EXPECT_EQ(state.device.sequence, 0x01020304U);
  EXPECT_EQ(state.device.buttons, 5U);
  EXPECT_TRUE(state.device.pose.grab);
  EXPECT_TRUE(state.fault);
  EXPECT_EQ(state.device.arrived, second + 5);
  EXPECT_EQ(state.device.pose.position, Vec3(1, 0.5, -2));
  EXPECT_EQ(state.device.velocity, Vec3(0.5, 0, 1));
  EXPECT_EQ(state.device.pose.orientation.coeffs(), Eigen::Vector4d(1, 0, 0, 0));  // x, y, z, w
  EXPECT_EQ(state.limits.max_force, 8.0);
  EXPECT_EQ(state.limits.max_torque, infinity);
  EXPECT_EQ(state.limits.max_stiffness, 2000.0);
  EXPECT_EQ(state.limits.max_damping, infinity);
  EXPECT_EQ(state.limits.workspace_radius, 0.25);
}

TEST(BridgeMessage, CommandByHand) {
  const std::int64_t before = monotonic_now();
  bridge_command told = make_bridge_command(command_like_that_by_hand(), 7, {.damping = 0.25}, 8.0);
  EXPECT_GE(told.time, static_cast<std::uint64_t>(before));
  EXPECT_LE(told.time, static_cast<std::uint64_t>(monotonic_now()));
  told.time = 0;
  Bytes message(sizeof told);
  std::memcpy(message.data(), &told, sizeof told);
  EXPECT_EQ(message, command_by_hand);
}

TEST(BridgeMessage, SizesAndVersions) {
  ASSERT_EQ(state_by_hand.size(), sizeof(bridge_state));
  for (std::size_t size = 0; size < state_by_hand.size(); ++size) {
    EXPECT_EQ(refusal_of(Bytes(state_by_hand.begin(), state_by_hand.begin() + static_cast<long>(size))),
              Refusal::size)
        << size;
  }
  Bytes long_one = state_by_hand;
  long_one.push_back(0);
  EXPECT_EQ(refusal_of(long_one), Refusal::size);
  EXPECT_EQ(refusal_with(3, std::uint8_t{'C'}), Refusal::version);
  for (const std::uint32_t version : {0U, 2U, 4U, 0x00030000U})
    EXPECT_EQ(refusal_with(4, version), Refusal::version) << version;
  long_one[4] = 4;
  EXPECT_EQ(refusal_of(long_one), Refusal::version) << "another version may be of another size";
}

TEST(BridgeMessage, NumbersThatAreNone) {
  for (const double bad : {nan, infinity, -infinity}) {
    for (std::size_t at = 24; at < 72; at += 8) EXPECT_EQ(refusal_with(at, bad), Refusal::not_finite) << at;
    for (const std::size_t at : {72U, 76U, 80U, 84U, 92U, 96U, 100U, 104U, 108U})
      EXPECT_EQ(refusal_with(at, static_cast<float>(bad)), Refusal::not_finite) << at;
  }
}

TEST(BridgeMessage, NumbersOutOfBounds) {
  EXPECT_EQ(refusal_with(24, 9.7), Refusal::none);          // with 0.5 and 2: 9.916 m
  EXPECT_EQ(refusal_with(24, -9.8), Refusal::implausible);  // 10.014 m
  EXPECT_EQ(refusal_with(32, 1e300), Refusal::implausible);
  EXPECT_EQ(refusal_with(48, 99.9), Refusal::none);
  EXPECT_EQ(refusal_with(48, 100.0), Refusal::implausible);  // with 1: 100.005 m/s
  for (std::size_t at = 92; at < 112; at += 4)
    EXPECT_EQ(refusal_with(at, -1e-6F), Refusal::implausible) << at;
  EXPECT_EQ(refusal_with(76, 0.0F), Refusal::orientation);  // of length 0
  EXPECT_EQ(refusal_with(76, 0.98F), Refusal::orientation);
  EXPECT_EQ(refusal_with(76, 1.02F), Refusal::orientation);
  EXPECT_EQ(refusal_with(76, -0.995F), Refusal::none);
}

TEST(BridgeMessage, AgeIsByTheClockOfThisMachine) {
  constexpr std::int64_t ms = 1'000'000;  // ns
  EXPECT_EQ(refusal_of(state_by_hand, second + 19 * ms), Refusal::none);
  EXPECT_EQ(refusal_of(state_by_hand, second + 21 * ms), Refusal::age);
  EXPECT_EQ(refusal_of(state_by_hand, second - 900 * ms), Refusal::none);
  EXPECT_EQ(refusal_of(state_by_hand, second - 1100 * ms), Refusal::age) << "another clock";
  EXPECT_EQ(refusal_with(16, std::uint64_t{0}), Refusal::age);
  EXPECT_EQ(refusal_with(16, std::numeric_limits<std::uint64_t>::max()), Refusal::age);
}

TEST(BridgeMessage, OrientationIsNormalised) {
  Bytes message = state_by_hand;
  const float shorter = 0.995F;
  std::memcpy(&message[76], &shorter, sizeof shorter);
  BridgeState state;
  ASSERT_EQ(refusal_of(message, state), Refusal::none);
  EXPECT_NEAR(state.device.pose.orientation.norm(), 1.0, 1e-15);
}

TEST(BridgeMessage, RefusedOnesLeaveTheStateAsItIs) {
  BridgeState state;
  state.device.sequence = 99;
  Bytes message = state_by_hand;
  std::memcpy(&message[24], &nan, sizeof nan);
  EXPECT_EQ(refusal_of(message, state), Refusal::not_finite);
  EXPECT_EQ(state.device.sequence, 99U);
  EXPECT_FALSE(state.fault);
}

TEST(BridgeMessage, ModesOfCommands) {
  DeviceCommand command;
  const auto mode = [&] { return make_bridge_command(command, 0, {}, 1.0).mode; };
  EXPECT_EQ(mode(), std::uint32_t{BRIDGE_ZERO});
  command.local.radius = 0.001;
  command.local.point = Vec3(1, 2, 3);
  EXPECT_EQ(mode(), std::uint32_t{BRIDGE_ZERO});
  command.local.stiffness(1, 1) = 100.0;
  EXPECT_EQ(mode(), std::uint32_t{BRIDGE_LOCAL_MODEL});
  command.local.radius = 0.0;
  EXPECT_EQ(mode(), std::uint32_t{BRIDGE_ZERO});
  command.wrench.torque.y() = 0.01;
  EXPECT_EQ(mode(), std::uint32_t{BRIDGE_FORCE});
  command.wrench = {Vec3(0, 0, -1), Vec3::Zero()};
  EXPECT_EQ(mode(), std::uint32_t{BRIDGE_FORCE});
  command.local.radius = 0.001;
  EXPECT_EQ(mode(), std::uint32_t{BRIDGE_LOCAL_MODEL});
  command.wrench.force.x() = nan;
  EXPECT_EQ(mode(), std::uint32_t{BRIDGE_ZERO});
  EXPECT_EQ(make_bridge_command(command, 0, {}, 1.0).force[2], 0.0) << "nor anything else of it is told";
}

TEST(BridgeMessage, NumbersTooLargeForTheirFieldsAreTheLargest) {
  DeviceCommand command;
  command.wrench.force.z() = 1.0;
  command.wrench.torque = Vec3(-1e90, 0, 0);
  command.local.radius = infinity;
  const bridge_command told =
      make_bridge_command(command, 0, {.time_to_live = 1000.0, .fade = -1.0}, infinity);
  EXPECT_EQ(told.radius, std::numeric_limits<float>::max());
  EXPECT_EQ(told.max_force, std::numeric_limits<float>::max());
  EXPECT_EQ(told.torque[0], std::numeric_limits<float>::lowest());
  EXPECT_EQ(told.time_to_live, 65535);
  EXPECT_EQ(told.fade, 0);
}

TEST(BridgeMessage, GarbageDoesNotGetThrough) {
  std::mt19937 random(7);
  int taken = 0;
  for (int i = 0; i < 100'000; ++i) {
    BridgeState state;
    EXPECT_NE(refusal_of(random_bytes(random, random() % 200)), Refusal::none);
    // Ours with a few bytes changed: what is taken, arithmetic can bear.
    Bytes changed = state_by_hand;
    for (auto k = random() % 6; k > 0; --k) changed[8 + random() % 104] = static_cast<std::uint8_t>(random());
    if (refusal_of(changed, state) != Refusal::none) continue;
    ++taken;
    EXPECT_LE(state.device.pose.position.norm(), 10.0);
    EXPECT_LE(state.device.velocity.norm(), 100.0);
    EXPECT_NEAR(state.device.pose.orientation.norm(), 1.0, 1e-12);
    EXPECT_GE(state.limits.max_force, 0.0);
  }
  EXPECT_GT(taken, 10'000);
}

TEST(BridgeMessage, ExampleShowsNoGarbage) {
  std::mt19937 random(8);
  int shown = 0;
  for (int i = 0; i < 100'000; ++i) {
    Bytes changed = command_by_hand;
    for (auto k = random() % 6; k > 0; --k) changed[8 + random() % 120] = static_cast<std::uint8_t>(random());
    bridge_command command{};
    std::memcpy(&command, changed.data(), sizeof command);
    const Vec3 x(0.5, 0.1, 1), v(1, 0, -1);
    Vec3 force;
    bridge_force(&command, x.data(), v.data(), 0.015, 8.0, force.data());
    EXPECT_LE(force.norm(), 8.0 + 1e-9);
    if (force.norm() > 0.0) ++shown;
  }
  EXPECT_GT(shown, 10'000);
}

}  // namespace
}  // namespace palpate::bridge_message_test
