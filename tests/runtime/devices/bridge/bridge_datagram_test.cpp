// The two datagrams of a bridge: byte by byte, every bad one by its reason, and which of them are new.
#include "runtime/devices/bridge/bridge_datagram.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "runtime/devices/bridge/bridge_key.h"
#include "runtime/devices/bridge/bridge_order.h"
#include "runtime/devices/bridge/bridge_wire.h"
#include "tests/support/devices/bytes.h"

namespace palpate::bridge_datagram_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Bytes of the numbers by hand: 1.0 is 3ff0..., 0.5 3fe0..., -2.0 c000... as f64; 1.0 3f800000, 8.0 41000000,
// 2000.0 44fa0000, 0.25 3e800000 as f32.
const Bytes state_by_hand = bytes(
    "50 4c 50 53  02 00  80 00  08 07 06 05 04 03 02 01"    // magic, version, size, nonce
    " 04 03 02 01  05 00 03 00  00 ca 9a 3b 00 00 00 00"    // sequence, buttons 0 and 2, both flags, 1 s
    " 00 00 00 00 00 00 f0 3f  00 00 00 00 00 00 e0 3f"     // position 1, 0.5,
    " 00 00 00 00 00 00 00 c0  00 00 00 00 00 00 e0 3f"     // -2; velocity 0.5,
    " 00 00 00 00 00 00 00 00  00 00 00 00 00 00 f0 3f"     // 0, 1
    " 00 00 00 00  00 00 80 3f  00 00 00 00  00 00 00 00"   // orientation 0, 1, 0, 0
    " 00 00 80 3e  00 00 00 41  00 00 00 00  00 00 fa 44"   // gripper 0.25; limits 8, not said, 2000,
    " 00 00 00 00  00 00 80 3e  00 00 00 00 00 00 00 00");  // not said, 0.25

const Bytes command_by_hand = bytes(
    "50 4c 50 43  02 00  a0 00  08 07 06 05 04 03 02 01"   // magic, version, size, nonce
    " 04 03 02 01  07 00 00 00  00 ca 9a 3b 00 00 00 00"   // sequence, answers 7, 1 s
    " 02 00 00 00  00 00 80 3e  00 00 00 00 00 00 f0 3f"   // local model, damping 0.25; force 1,
    " 00 00 00 00 00 00 e0 3f  00 00 00 00 00 00 00 c0"    // 0.5, -2
    " 00 00 00 00 00 00 e0 3f  00 00 00 00 00 00 00 00"    // point 0.5, 0,
    " 00 00 00 00 00 00 f0 3f  00 00 80 3f  00 00 00 41"   // 1; torque 1, 8,
    " 00 00 80 3e  00 00 fa 44  00 00 00 41  00 00 80 3f"  // 0.25; stiffness 2000, 8, 1,
    " 00 00 80 3e  00 00 80 bf  00 00 00 c1  00 00 80 3e"  // xy 0.25, yz -1, zx -8; radius 0.25
    " 0a 00  14 00  00 00 00 41  00 00 00 00 00 00 00 00"  // 10 ms, then 20 ms; 8 N
    " 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00");

/// Under the key of zeros, as bridge_key_test holds it to the standard.
Bytes sealed(Bytes datagram) {
  seal({}, datagram);
  return datagram;
}

BridgeState good_state() {
  BridgeState state;
  EXPECT_EQ(decode_bridge_state(state_by_hand, state), Refusal::none);
  return state;
}

void put(Bytes& datagram, std::size_t at, double value) {
  std::memcpy(&datagram[at], &value, sizeof value);
}

void put(Bytes& datagram, std::size_t at, float value) {
  std::memcpy(&datagram[at], &value, sizeof value);
}

template <class Number>
Refusal refusal_of_state(std::size_t at, Number value) {
  Bytes datagram = state_by_hand;
  put(datagram, at, value);
  BridgeState state;
  return decode_bridge_state(datagram, state);
}

template <class Number>
Refusal refusal_of_command(std::size_t at, Number value) {
  Bytes datagram = command_by_hand;
  put(datagram, at, value);
  BridgeCommand command;
  return decode_bridge_command(datagram, command);
}

TEST(BridgeDatagram, StateByHand) {
  ASSERT_EQ(state_by_hand.size(), bridge_state_bytes);
  const BridgeState state = good_state();
  EXPECT_EQ(state.nonce, 0x0102030405060708U);
  EXPECT_EQ(state.device.sequence, 0x01020304U);
  EXPECT_EQ(state.device.buttons, 5U);
  EXPECT_TRUE(state.device.pose.grab);
  EXPECT_TRUE(state.in_use);
  EXPECT_TRUE(state.fault);
  EXPECT_EQ(state.time, 1'000'000'000U);
  EXPECT_EQ(state.device.arrived, 0);
  EXPECT_EQ(state.device.pose.position, Vec3(1, 0.5, -2));
  EXPECT_EQ(state.device.velocity, Vec3(0.5, 0, 1));
  EXPECT_EQ(state.device.pose.orientation.coeffs(), Eigen::Vector4d(1, 0, 0, 0));  // x, y, z, w
  EXPECT_EQ(state.gripper, 0.25);
  EXPECT_EQ(state.limits.max_force, 8.0);
  EXPECT_EQ(state.limits.max_torque, infinity);
  EXPECT_EQ(state.limits.max_stiffness, 2000.0);
  EXPECT_EQ(state.limits.max_damping, infinity);
  EXPECT_EQ(state.limits.workspace_radius, 0.25);
  EXPECT_EQ(as_bytes(encode_bridge_state(state)), state_by_hand);
}

TEST(BridgeDatagram, CommandByHand) {
  ASSERT_EQ(command_by_hand.size(), bridge_command_bytes);
  BridgeCommand command;
  ASSERT_EQ(decode_bridge_command(command_by_hand, command), Refusal::none);
  EXPECT_EQ(command.nonce, 0x0102030405060708U);
  EXPECT_EQ(command.sequence, 0x01020304U);
  EXPECT_EQ(command.answers, 7U);
  EXPECT_EQ(command.time, 1'000'000'000U);
  EXPECT_EQ(command.mode, BridgeMode::local_model);
  EXPECT_EQ(command.damping, 0.25);
  EXPECT_EQ(command.command.wrench.force, Vec3(1, 0.5, -2));
  EXPECT_EQ(command.command.wrench.torque, Vec3(1, 8, 0.25));
  EXPECT_EQ(command.command.local.force, Vec3(1, 0.5, -2));
  EXPECT_EQ(command.command.local.point, Vec3(0.5, 0, 1));
  EXPECT_EQ(command.command.local.radius, 0.25);
  Mat3 stiffness;
  stiffness << 2000, 0.25, -8, 0.25, 8, -1, -8, -1, 1;
  EXPECT_EQ(command.command.local.stiffness, stiffness);
  EXPECT_EQ(command.time_to_live, 10);
  EXPECT_EQ(command.fade, 20);
  EXPECT_EQ(command.max_force, 8.0);
  EXPECT_EQ(as_bytes(encode_bridge_command(command)), command_by_hand);
}

TEST(BridgeDatagram, ExampleSpeaksTheSame) {
  bridge_session session{{}, 0x0102030405060708U, 0x01020303, 0x01020303};
  const bridge_reading reading{{1, 0.5, -2}, {0.5, 0, 1},           {0, 1, 0, 0},
                               0.25F,        {8, 0, 2000, 0, 0.25}, 5U | BRIDGE_IN_USE | BRIDGE_DEVICE_FAULT};
  Bytes datagram(bridge_state_bytes);
  bridge_encode_state(datagram.data(), &reading, &session, 1'000'000'000);
  EXPECT_EQ(datagram, sealed(state_by_hand));

  bridge_command command{};
  const auto decode = [&](Bytes said) {
    said = sealed(said);
    return bridge_decode_command(said.data(), static_cast<long>(said.size()), &session, &command);
  };
  ASSERT_TRUE(decode(command_by_hand));
  EXPECT_EQ(command.mode, 2U);
  EXPECT_EQ(command.damping, 0.25);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(command.force[k], Vec3(1, 0.5, -2)[static_cast<Eigen::Index>(k)]);
    EXPECT_EQ(command.point[k], Vec3(0.5, 0, 1)[static_cast<Eigen::Index>(k)]);
    EXPECT_EQ(command.torque[k], Vec3(1, 8, 0.25)[static_cast<Eigen::Index>(k)]);
  }
  const std::array<double, 6> stiffness = {2000, 8, 1, 0.25, -1, -8};
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(command.stiffness[k], stiffness[k]);
  }
  EXPECT_EQ(command.radius, 0.25);
  EXPECT_DOUBLE_EQ(command.time_to_live, 0.010);
  EXPECT_DOUBLE_EQ(command.fade, 0.020);
  EXPECT_EQ(command.max_force, 8.0);

  EXPECT_FALSE(decode(command_by_hand)) << "the same number again";
  Bytes other = command_by_hand;
  other[8] = 9;
  EXPECT_FALSE(decode(other)) << "a force of another session";
  other[32] = 0;
  EXPECT_TRUE(decode(other)) << "a runtime that has just begun, though its number is not ahead";
  EXPECT_EQ(session.nonce, 0x0102030405060709U);
  EXPECT_EQ(command.mode, 0U);
  for (const std::size_t at : {0U, 4U, 6U}) {
    Bytes bad = other;
    bad[16] = 0xFF;  // ahead
    bad[at] = 0x77;
    EXPECT_FALSE(decode(bad)) << at;
  }
  Bytes stranger = sealed(other);
  stranger[16] = 0xFF;  // ahead, but the seal is that of another number
  EXPECT_FALSE(bridge_decode_command(stranger.data(), std::ssize(stranger), &session, &command));
  stranger = sealed(stranger);
  session.key[0] = 1;
  EXPECT_FALSE(bridge_decode_command(stranger.data(), std::ssize(stranger), &session, &command));
  session.key[0] = 0;
  EXPECT_TRUE(bridge_decode_command(stranger.data(), std::ssize(stranger), &session, &command));
}

TEST(BridgeDatagram, BadOnesByReason) {
  BridgeState state;
  BridgeCommand command;
  const auto state_with = [&](std::size_t at, std::uint8_t value) {
    Bytes datagram = state_by_hand;
    datagram[at] = value;
    return decode_bridge_state(datagram, state);
  };
  const auto command_with = [&](std::size_t at, std::uint8_t value) {
    Bytes datagram = command_by_hand;
    datagram[at] = value;
    return decode_bridge_command(datagram, command);
  };
  for (std::size_t size = 0; size < bridge_state_bytes; ++size) {
    EXPECT_EQ(decode_bridge_state(std::span(state_by_hand).first(size), state), Refusal::size) << size;
  }
  for (std::size_t size = 0; size < bridge_command_bytes; ++size) {
    EXPECT_EQ(decode_bridge_command(std::span(command_by_hand).first(size), command), Refusal::size) << size;
  }
  Bytes long_one = state_by_hand;
  long_one.push_back(0);
  EXPECT_EQ(decode_bridge_state(long_one, state), Refusal::size);
  EXPECT_EQ(state_with(6, 0x81), Refusal::size);
  EXPECT_EQ(state_with(3, 'C'), Refusal::magic);
  EXPECT_EQ(command_with(3, 'S'), Refusal::magic);
  EXPECT_EQ(state_with(4, 1), Refusal::version);
  EXPECT_EQ(state_with(5, 1), Refusal::version);
  EXPECT_EQ(command_with(4, 1), Refusal::version);
  EXPECT_EQ(command_with(32, 3), Refusal::implausible);
  EXPECT_EQ(command_with(35, 1), Refusal::implausible);
}

TEST(BridgeDatagram, NumbersThatAreNone) {
  for (const double bad : {nan, infinity, -infinity}) {
    for (std::size_t at = 32; at < 80; at += 8) {
      EXPECT_EQ(refusal_of_state(at, bad), Refusal::not_finite) << at;
    }
    for (std::size_t at = 80; at < 120; at += 4) {
      EXPECT_EQ(refusal_of_state(at, static_cast<float>(bad)), Refusal::not_finite) << at;
    }
    for (std::size_t at = 40; at < 88; at += 8) {
      EXPECT_EQ(refusal_of_command(at, bad), Refusal::not_finite) << at;
    }
    for (const std::size_t at : {36U, 88U, 92U, 96U, 100U, 104U, 108U, 112U, 116U, 120U, 124U, 132U}) {
      EXPECT_EQ(refusal_of_command(at, static_cast<float>(bad)), Refusal::not_finite) << at;
    }
  }
}

TEST(BridgeDatagram, NumbersOutOfBounds) {
  EXPECT_EQ(refusal_of_state(32, 9.7), Refusal::none);          // with 0.5 and 2: 9.916 m
  EXPECT_EQ(refusal_of_state(32, -9.8), Refusal::implausible);  // 10.014 m
  EXPECT_EQ(refusal_of_state(40, 1e300), Refusal::implausible);
  EXPECT_EQ(refusal_of_state(56, 99.9), Refusal::none);
  EXPECT_EQ(refusal_of_state(56, 100.0), Refusal::implausible);  // with 1: 100.005 m/s
  EXPECT_EQ(refusal_of_state(96, -6.28F), Refusal::none);
  EXPECT_EQ(refusal_of_state(96, 6.29F), Refusal::implausible);
  for (std::size_t at = 100; at < 120; at += 4) {
    EXPECT_EQ(refusal_of_state(at, -1e-6F), Refusal::implausible) << at;
  }
  for (const std::size_t at : {36U, 124U, 132U}) {
    EXPECT_EQ(refusal_of_command(at, -1e-6F), Refusal::implausible) << at;
  }
  EXPECT_EQ(refusal_of_state(84, 0.0F), Refusal::orientation);  // of length 0
  EXPECT_EQ(refusal_of_state(84, 0.98F), Refusal::orientation);
  EXPECT_EQ(refusal_of_state(84, 1.02F), Refusal::orientation);
  EXPECT_EQ(refusal_of_state(84, -0.995F), Refusal::none);
}

TEST(BridgeDatagram, OrientationIsNormalised) {
  Bytes datagram = state_by_hand;
  put(datagram, 84, 0.995F);
  BridgeState state;
  ASSERT_EQ(decode_bridge_state(datagram, state), Refusal::none);
  EXPECT_NEAR(state.device.pose.orientation.norm(), 1.0, 1e-15);
}

TEST(BridgeDatagram, RefusedLeaveTheStateAsItIs) {
  BridgeState state = good_state();
  Bytes datagram = state_by_hand;
  datagram[16] = 99;
  put(datagram, 32, nan);
  EXPECT_EQ(decode_bridge_state(datagram, state), Refusal::not_finite);
  EXPECT_EQ(as_bytes(encode_bridge_state(state)), state_by_hand);
}

TEST(BridgeDatagram, NumbersTooLargeForFloatsAreTheLargest) {
  BridgeCommand command;
  command.command.local.radius = infinity;
  command.command.wrench.torque = Vec3(-1e300, 0, 0);
  BridgeCommand back;
  ASSERT_EQ(decode_bridge_command(encode_bridge_command(command), back), Refusal::none);
  EXPECT_EQ(back.command.local.radius, std::numeric_limits<float>::max());
  EXPECT_EQ(back.command.wrench.torque.x(), std::numeric_limits<float>::lowest());
}

TEST(BridgeDatagram, GarbageDoesNotGetThrough) {
  std::mt19937 random(7);
  int taken = 0;
  for (int i = 0; i < 100'000; ++i) {
    BridgeState state;
    BridgeCommand command;
    const Bytes any = random_bytes(random, random() % 200);
    EXPECT_NE(decode_bridge_state(any, state), Refusal::none);
    EXPECT_NE(decode_bridge_command(any, command), Refusal::none);
    // Ours with a few bytes changed: what is taken, arithmetic can bear.
    Bytes changed = state_by_hand;
    for (auto k = random() % 6; k > 0; --k) {
      changed[8 + random() % 120] = static_cast<std::uint8_t>(random());
    }
    if (decode_bridge_state(changed, state) != Refusal::none) continue;
    ++taken;
    EXPECT_LE(state.device.pose.position.norm(), 10.0);
    EXPECT_LE(state.device.velocity.norm(), 100.0);
    EXPECT_NEAR(state.device.pose.orientation.norm(), 1.0, 1e-12);
    EXPECT_GE(state.limits.max_force, 0.0);
  }
  EXPECT_GT(taken, 10'000);
}

TEST(BridgeDatagram, ExampleShowsNoGarbage) {
  std::mt19937 random(8);
  int taken = 0;
  for (int i = 0; i < 100'000; ++i) {
    bridge_session session{{}, 0x0102030405060708U, 0, 0};
    bridge_command command{};
    const Bytes any = random_bytes(random, random() % 200);
    EXPECT_FALSE(bridge_decode_command(any.data(), static_cast<long>(any.size()), &session, &command));
    Bytes changed = command_by_hand;
    for (auto k = random() % 6; k > 0; --k) {
      changed[8 + random() % 144] = static_cast<std::uint8_t>(random());
    }
    changed = sealed(changed);
    if (!bridge_decode_command(changed.data(), static_cast<long>(changed.size()), &session, &command))
      continue;
    ++taken;
    const Vec3 x(0.5, 0.1, 1), v(1, 0, -1);
    Vec3 force;
    bridge_force(&command, x.data(), v.data(), 0.015, 8.0, force.data());
    EXPECT_LE(force.norm(), 8.0 + 1e-9);
  }
  EXPECT_GT(taken, 10'000);
}

constexpr std::uint64_t ms = 1'000'000;  // ns

TEST(BridgeOrder, NumbersMustGoOn) {
  BridgeOrder order;
  EXPECT_EQ(order.see(0xFFFFFFFE, 1 * ms, 0), Refusal::none);
  EXPECT_EQ(order.see(0xFFFFFFFE, 2 * ms, ms), Refusal::order);
  EXPECT_EQ(order.see(0xFFFFFFFF, 2 * ms, ms), Refusal::none);
  EXPECT_EQ(order.see(2, 3 * ms, 2 * ms), Refusal::none);  // 0 and 1 are lost
  EXPECT_EQ(order.skipped(), 2U);
  EXPECT_EQ(order.see(0, 4 * ms, 3 * ms), Refusal::order);
  EXPECT_EQ(order.see(0xFFFFFFFF, 4 * ms, 3 * ms), Refusal::order);
  EXPECT_EQ(order.see(0x80000001, 4 * ms, 3 * ms), Refusal::none);  // as far ahead as can be told
  EXPECT_EQ(order.see(1, 5 * ms, 4 * ms), Refusal::order);          // and half of the circle, which cannot
  order.reset();
  EXPECT_EQ(order.see(5, 1 * ms, 5 * ms), Refusal::none);
}

TEST(BridgeOrder, TimeMustGoOn) {
  BridgeOrder order;
  EXPECT_EQ(order.see(1, 50 * ms, 0), Refusal::none);
  EXPECT_EQ(order.see(2, 50 * ms, ms), Refusal::time);
  EXPECT_EQ(order.see(3, 49 * ms, ms), Refusal::time);
  EXPECT_EQ(order.see(4, 51 * ms, ms), Refusal::none);
}

TEST(BridgeOrder, AgeIsBeyondTheQuickestOnesWay) {
  // The bridge's clock is 1000 s ahead. Ways of 3, 1, 20 and 21.1 ms: ages 0, 0, 19, 20.1.
  constexpr std::uint64_t ahead = 1'000'000 * ms;
  BridgeOrder order;
  EXPECT_EQ(order.see(1, ahead + 10 * ms, 13 * ms), Refusal::none);
  EXPECT_EQ(order.see(2, ahead + 20 * ms, 21 * ms), Refusal::none);
  EXPECT_EQ(order.see(3, ahead + 30 * ms, 50 * ms), Refusal::none);
  EXPECT_EQ(order.see(4, ahead + 40 * ms, 61'100'000), Refusal::age);
  EXPECT_EQ(order.see(5, ahead + 62 * ms, 63 * ms), Refusal::none);
  EXPECT_EQ(order.skipped(), 1U);
}

TEST(BridgeOrder, ClocksMayDriftByAThousandth) {
  // An hour at 100 Hz with a bridge whose clock is slow by 0.5, then one that is slow by 2 in a thousand: its
  // ways grow by 1 s in 1000 s beyond what is forgotten, and after 20 s by more than 20 ms.
  BridgeOrder order;
  std::uint32_t sequence = 0;
  for (std::int64_t t = 0; t < 3600'000'000'000; t += 10'000'000) {
    const auto slow = static_cast<std::uint64_t>(static_cast<double>(t) * (1.0 - 0.0005)) + 1;
    ASSERT_EQ(order.see(++sequence, slow, t), Refusal::none) << t;
  }
  order.reset();
  std::int64_t first_refused = 0;
  for (std::int64_t t = 0; first_refused == 0 && t < 60'000'000'000; t += 10'000'000) {
    const auto slow = static_cast<std::uint64_t>(static_cast<double>(t) * (1.0 - 0.002)) + 1;
    if (order.see(++sequence, slow, t) == Refusal::age) first_refused = t;
  }
  EXPECT_NEAR(1e-9 * static_cast<double>(first_refused), 20.0, 0.02);
}

}  // namespace
}  // namespace palpate::bridge_datagram_test
