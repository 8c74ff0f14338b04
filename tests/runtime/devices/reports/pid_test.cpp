// Report descriptors of real devices, and USB PID: reports byte by byte, the conversation against a simulated
// joystick.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "base/error.h"
#include "runtime/devices/reports/hid_report_descriptor.h"
#include "runtime/devices/reports/pid_effects.h"
#include "runtime/devices/reports/pid_layout.h"
#include "runtime/devices/reports/pid_reports.h"
#include "tests/support/devices/bytes.h"

namespace palpate::pid_test {
namespace {

using enum HidReportType;

constexpr HidUsage desktop(std::uint16_t id) {
  return {0x01, id};
}
constexpr HidUsage pid(std::uint16_t id) {
  return {0x0F, id};
}

HidReportDescriptor parsed(const std::string& hex) {
  return parse_report_descriptor(bytes(hex), "a device");
}

std::string refusal(const std::string& hex) {
  try {
    static_cast<void>(parsed(hex));
  } catch (const Error& error) {
    return to_text(error);
  }
  return "taken";
}

PidLayout side_winder() {
  return find_pid_layout(parsed(side_winder_descriptor), "SideWinder");
}

const PidConstants constants{{0.05, 0.05}, {10.0, 10.0}, {270.0, 180.0}};

// --- the parser ---

TEST(HidDescriptor, SpaceNavigator) {
  const auto descriptor = parsed(space_navigator_descriptor);
  EXPECT_EQ(descriptor.usage, desktop(0x08));
  EXPECT_EQ(descriptor.report_bytes(input, 1), 6);
  EXPECT_EQ(descriptor.report_bytes(input, 2), 6);
  EXPECT_EQ(descriptor.report_bytes(input, 3), 2);
  EXPECT_EQ(descriptor.report_bytes(output, 4), 1);
  EXPECT_EQ(descriptor.report_bytes(feature, 8), 7);
  EXPECT_EQ(descriptor.report_bytes(feature, 99), 0);
  const auto turn = descriptor.element(input, {}, desktop(0x34));  // Ry
  ASSERT_TRUE(turn);
  EXPECT_EQ(turn->report_id, 2);
  EXPECT_EQ(turn->bit, 16U);
  EXPECT_EQ(turn->logical_min, -350);
  EXPECT_EQ(turn->logical_max, 350);
  EXPECT_EQ(read_element(*turn, bytes("00 00 e2 ff 00 00")), -30);
  const auto second = descriptor.element(input, {}, {0x09, 2});  // button 2, by a range of usages
  ASSERT_TRUE(second);
  EXPECT_EQ(second->bit, 1U);
}

TEST(HidDescriptor, SpaceMouseWirelessHasSixAxesInReportOne) {
  const auto descriptor = parsed(space_mouse_wireless_descriptor);
  EXPECT_EQ(descriptor.report_bytes(input, 1), 12);
  const auto turn = descriptor.element(input, {}, desktop(0x35));
  ASSERT_TRUE(turn);
  EXPECT_EQ(turn->report_id, 1);
  EXPECT_EQ(turn->bit, 80U);
}

TEST(HidDescriptor, Gamepad) {
  const auto descriptor = parsed(dual_sense_descriptor);
  EXPECT_EQ(bytes(dual_sense_descriptor).size(), 273U);
  EXPECT_EQ(descriptor.usage, desktop(0x05));
  EXPECT_EQ(descriptor.report_bytes(input, 1), 63);
  EXPECT_EQ(descriptor.report_bytes(output, 2), 47);
  const auto hat = descriptor.element(input, {}, desktop(0x39));
  ASSERT_TRUE(hat);
  EXPECT_EQ(hat->bits, 4U);
  EXPECT_EQ(hat->bit, 56U);
  const auto last = descriptor.element(input, {}, {0x09, 15});
  ASSERT_TRUE(last);
  EXPECT_EQ(last->bit, 56U + 4 + 14);
  try {
    static_cast<void>(find_pid_layout(descriptor, "DualSense"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "its report descriptor lacks DC Enable Actuators (usage 000F:0097)");
    EXPECT_EQ(error.where(), "DualSense");
  }
}

TEST(HidDescriptor, SideWinder) {
  const auto descriptor = parsed(side_winder_descriptor);
  EXPECT_EQ(bytes(side_winder_descriptor).size(), 1343U);  // as its HID descriptor says
  EXPECT_EQ(descriptor.report_bytes(input, 1), 12);
  EXPECT_EQ(descriptor.report_bytes(output, 1), 15);
  EXPECT_EQ(descriptor.report_bytes(output, 5), 3);
  EXPECT_EQ(descriptor.report_bytes(feature, 2), 4);
  // 25 03 15 01: the maximum before the minimum; the third choice of Block Load Status.
  const auto error = descriptor.option(feature, {pid(0x89)}, pid(0x8E));
  ASSERT_TRUE(error);
  EXPECT_EQ(error->value, 3);
  // 0B 01 00 0A 00: a usage with a page of its own.
  const auto angle = descriptor.element(output, {pid(0x21), pid(0x57)}, {0x0A, 1});
  ASSERT_TRUE(angle);
  EXPECT_EQ(angle->bit, 88U);
}

TEST(HidDescriptor, PushAndPop) {
  // 8 bits, 0..255; pushed; 16 bits; popped; 8 bits again.
  const auto descriptor = parsed(
      "05 01 09 04 a1 01 15 00 25 ff 75 08 95 01 09 30 81 02 a4 75 10 26 ff 7f 09 31 81 02 b4 09 32 81 02 "
      "c0");
  EXPECT_FALSE(descriptor.numbered);
  const auto z = descriptor.element(input, {}, desktop(0x32));
  ASSERT_TRUE(z);
  EXPECT_EQ(z->bits, 8U);
  EXPECT_EQ(z->bit, 24U);
  EXPECT_EQ(z->logical_max, 255);
  EXPECT_EQ(descriptor.element(input, {}, desktop(0x31))->logical_max, 32767);
}

TEST(HidDescriptor, RefusesWhatCannotBe) {
  EXPECT_NE(refusal("").find("is empty"), std::string::npos);
  EXPECT_NE(refusal("fe 02 10 00 00").find("a device, byte 0 of its report descriptor: a long item"),
            std::string::npos);
  EXPECT_NE(refusal("05 01 09").find("byte 2 of its report descriptor: the last item is cut off"),
            std::string::npos);
  EXPECT_NE(refusal("05 01 09 04 a1 01").find("a collection is not ended"), std::string::npos);
  EXPECT_NE(refusal("c0").find("that was not begun"), std::string::npos);
  EXPECT_NE(refusal("b4").find("was not pushed"), std::string::npos);
  EXPECT_NE(refusal("85 00").find("report id 0"), std::string::npos);
  EXPECT_NE(refusal("76 01 01").find("numbers of 257 bits"), std::string::npos);
  EXPECT_NE(refusal("75 20 97 00 00 01 00 09 30 81 02").find("longer than 16 KiB"), std::string::npos);
  EXPECT_NE(refusal("19 05 29 01 75 08 95 01 81 02").find("ends before it begins"), std::string::npos);
  EXPECT_NE(refusal("1b 00 00 01 00 2b ff ff 01 00 75 08 95 01 81 02").find("too many usages"),
            std::string::npos);
  EXPECT_NE(
      refusal("15 05 25 01 75 08 95 01 09 30 81 02").find("a logical maximum of 1 under the minimum of 5"),
      std::string::npos);
}

TEST(HidDescriptor, GarbageIsReadOrRefused) {
  std::mt19937 random(5);
  const Bytes real = bytes(side_winder_descriptor);
  for (int i = 0; i < 3000; ++i) {
    Bytes any = i % 2 == 0 ? random_bytes(random, random() % 200) : real;
    for (int k = 0; i % 2 == 1 && k < 5; ++k) {
      any[random() % any.size()] = static_cast<std::uint8_t>(random());
    }
    try {
      const auto descriptor = parse_report_descriptor(any, "garbage");
      const PidLayout layout = find_pid_layout(descriptor, "garbage");
      static_cast<void>(encode_set_effect(layout, 1, 90.0));
      static_cast<void>(encode_constant_force(layout, 1, 0.5));
      static_cast<void>(decode_pid_input(layout, random_bytes(random, 13)));
      static_cast<void>(decode_block_load(layout, random_bytes(random, 5)));
    } catch (const Error&) {
    }
  }
}

TEST(HidElement, WhatIsWrittenIsRead) {
  std::mt19937 random(6);
  for (int i = 0; i < 2000; ++i) {
    const auto bits = static_cast<std::uint32_t>(1 + random() % 32);
    const auto bit = static_cast<std::uint32_t>(random() % 32);
    const bool negative = random() % 2 == 0;
    const HidElement element{output, 0, 8, bit, bits, negative ? -1 : 0, 1};
    const std::int64_t least = negative ? -(std::int64_t{1} << (bits - 1)) : 0;
    const std::int64_t value = least + static_cast<std::int64_t>(random() % (std::uint64_t{1} << bits));
    Bytes report = random_bytes(random, 8);
    const Bytes before = report;
    write_element(element, value, report);
    EXPECT_EQ(read_element(element, report), value);
    for (std::uint32_t k = 0; k < 64; ++k) {  // nothing else changes
      if (k < bit || k >= bit + bits) {
        ASSERT_EQ((report[k / 8] ^ before[k / 8]) >> (k % 8) & 1, 0) << k;
      }
    }
  }
}

// --- reports of the SideWinder, written by hand from its descriptor ---

TEST(PidReports, Position) {
  const PidLayout layout = side_winder();
  const auto right_and_away = decode_pid_input(layout, bytes("01 ff 01 00 02 00 00 00 05 00 00 00 00"));
  ASSERT_TRUE(right_and_away);
  EXPECT_DOUBLE_EQ(right_and_away->axes[0], 1.0);  // 511
  EXPECT_DOUBLE_EQ(right_and_away->axes[1], 1.0);  // -512: HID's y is to the user
  EXPECT_EQ(right_and_away->buttons, 5U);
  const DeviceState state = pid_state(constants, *right_and_away);
  EXPECT_LT((state.pose.position - Vec3(0.05, 0.05, 0)).norm(), 1e-15);
  EXPECT_TRUE(state.pose.grab);
  const auto middle = decode_pid_input(layout, bytes("01 00 00 00 00 00 00 00 00 00 00 00 00"));
  ASSERT_TRUE(middle);
  EXPECT_NEAR(middle->axes[0], 0.0, 1e-3);
}

TEST(PidReports, PositionRefusesShortLongAndOthers) {
  const PidLayout layout = side_winder();
  EXPECT_FALSE(decode_pid_input(layout, {}));
  EXPECT_FALSE(decode_pid_input(layout, Bytes(12, 1)));
  EXPECT_FALSE(decode_pid_input(layout, Bytes(14, 1)));
  EXPECT_FALSE(decode_pid_input(layout, bytes("02 00 00 00 00 00 00 00 00 00 00 00 00")));
  EXPECT_FALSE(decode_pid_input(layout, bytes("02 01 01")));  // PID State
}

TEST(PidReports, AxisOutsideItsRangeIsGarbage) {
  // X: 8 bits, -100..100.
  PidLayout layout = side_winder();
  layout.axes = {HidElement{input, 1, 2, 0, 8, -100, 100}, HidElement{input, 1, 2, 8, 8, -100, 100}};
  layout.buttons = {};
  EXPECT_TRUE(decode_pid_input(layout, bytes("01 64 9c")));
  EXPECT_FALSE(decode_pid_input(layout, bytes("01 65 00")));
  EXPECT_FALSE(decode_pid_input(layout, bytes("01 00 9b")));
}

TEST(PidReports, ByHand) {
  const PidLayout layout = side_winder();
  EXPECT_EQ(as_bytes(encode_device_control(layout.device_reset).span()), bytes("0c 04"));
  EXPECT_EQ(as_bytes(encode_device_control(layout.enable_actuators).span()), bytes("0c 01"));
  EXPECT_EQ(as_bytes(encode_create_constant(layout).span()), bytes("01 01 00 00"));
  EXPECT_EQ(as_bytes(block_load_request(layout).span()), bytes("02 00 00 00 00"));
  // Block 1, constant force, without end, full gain, direction enabled, 270 of 360 degrees = 191 of 255.
  EXPECT_EQ(as_bytes(encode_set_effect(layout, 1, 270.0).span()),
            bytes("01 01 01 ff ff 00 00 00 00 ff 00 04 bf 00 00 00"));
  EXPECT_EQ(as_bytes(encode_set_effect(layout, 1, -90.0).span()),
            as_bytes(encode_set_effect(layout, 1, 270.0).span()));
  EXPECT_EQ(as_bytes(encode_constant_force(layout, 2, 1.0).span()), bytes("05 02 ff 00"));
  EXPECT_EQ(as_bytes(encode_constant_force(layout, 2, -0.5).span()), bytes("05 02 80 ff"));
  EXPECT_EQ(as_bytes(encode_constant_force(layout, 2, -7.0).span()), bytes("05 02 01 ff"));
  EXPECT_EQ(as_bytes(encode_constant_force(layout, 2, std::numeric_limits<double>::quiet_NaN()).span()),
            bytes("05 02 00 00"));
  EXPECT_EQ(as_bytes(encode_operation(layout, 1, layout.start).span()), bytes("0a 01 01 ff"));
  EXPECT_EQ(as_bytes(encode_operation(layout, 1, layout.stop).span()), bytes("0a 01 03 ff"));
}

TEST(PidReports, BlockLoad) {
  const PidLayout layout = side_winder();
  const auto loaded = decode_block_load(layout, bytes("02 03 01 ff 00"));
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->load, PidLoad::success);
  EXPECT_EQ(loaded->block, 3U);
  EXPECT_EQ(decode_block_load(layout, bytes("02 00 02 00 00"))->load, PidLoad::full);
  EXPECT_EQ(decode_block_load(layout, bytes("02 00 00 00 00"))->load, PidLoad::pending);
  EXPECT_EQ(decode_block_load(layout, bytes("02 00 03 00 00"))->load, PidLoad::pending);
  EXPECT_FALSE(decode_block_load(layout, bytes("02 00 01 00 00")));  // no effect has number 0
  EXPECT_FALSE(decode_block_load(layout, bytes("02 29 01 00 00")));  // 41 of 40
  EXPECT_FALSE(decode_block_load(layout, bytes("03 01 01 00 00")));
  EXPECT_FALSE(decode_block_load(layout, bytes("02 01 01 00")));
}

TEST(PidReports, ForceInParts) {
  EXPECT_EQ(pid_force(constants, Vec3(5, -2.5, 100)), (std::array<double, 2>{0.5, -0.25}));
  EXPECT_EQ(pid_force(constants, Vec3(20, 10, 0)), (std::array<double, 2>{1.0, 0.5}));
}

/// The same device with other report ids.
Bytes renumbered(const Bytes& descriptor, std::uint8_t mask) {
  Bytes result = descriptor;
  for (std::size_t at = 0; at < result.size();) {
    if (result[at] == 0x85) result[at + 1] = static_cast<std::uint8_t>(result[at + 1] ^ mask);
    at += 1 + ((result[at] & 3U) == 3U ? 4U : result[at] & 3U);
  }
  return result;
}

TEST(PidReports, IdsAreTheDevicesOwn) {
  const auto descriptor =
      parse_report_descriptor(renumbered(bytes(side_winder_descriptor), 0x60), "renumbered");
  const PidLayout layout = find_pid_layout(descriptor, "renumbered");
  EXPECT_EQ(as_bytes(encode_constant_force(layout, 2, 1.0).span()), bytes("65 02 ff 00"));
  EXPECT_EQ(as_bytes(encode_create_constant(layout).span()), bytes("61 01 00 00"));
  EXPECT_EQ(as_bytes(block_load_request(layout).span()), bytes("62 00 00 00 00"));
}

// --- the conversation ---

/// Firmware of a SideWinder, which knows its own bytes.
struct SimulatedJoystick {
  struct Effect {
    bool set = false, plays = false;
    int direction = 0, magnitude = 0;
  };
  std::vector<Effect> effects = std::vector<Effect>(41);
  bool actuators = false;
  int created = 0, asked = 0, resets = 0;
  int busy = 3;  // Block Load requests before it answers
  int room = 40;

  void reset() { *this = SimulatedJoystick{std::vector<Effect>(41), false, 0, 0, resets + 1, busy, room}; }

  void output(const Bytes& report) {
    ASSERT_FALSE(report.empty());
    const auto effect = [&]() -> Effect& { return effects.at(report.at(1)); };
    if (report[0] == 0x0C && report.size() == 2) {
      if (report[1] == 4) reset();
      if (report[1] == 1) actuators = true;
    } else if (report[0] == 0x01 && report.size() == 16) {
      ASSERT_EQ(report[2], 1);
      effect() = {true, false, report[12], 0};
    } else if (report[0] == 0x05 && report.size() == 4) {
      effect().magnitude = static_cast<std::int16_t>(report[2] | report[3] << 8);
    } else if (report[0] == 0x0A && report.size() == 4) {
      ASSERT_TRUE(effect().set);
      effect().plays = report[2] == 1;
    } else {
      FAIL() << "unknown report " << int{report[0]};
    }
  }
  void set_feature(const Bytes& report) {
    ASSERT_EQ(report, bytes("01 01 00 00"));
    ++created;
    asked = 0;
  }
  Bytes get_feature(const Bytes& request) {
    EXPECT_EQ(request.size(), 5U);
    EXPECT_EQ(request[0], 2);
    if (created > room) return bytes("02 00 02 00 00");
    if (++asked <= busy) return bytes("02 00 00 00 00");
    return {2, static_cast<std::uint8_t>(created), 1, 0xFF, 0};
  }
};

/// The wire to a joystick that takes all reports.
PidWire wire_to(SimulatedJoystick& joystick) {
  return {.output =
              [&](const PidReport& report) {
                joystick.output(as_bytes(report.span()));
                return true;
              },
          .set_feature =
              [&](const PidReport& report) {
                joystick.set_feature(as_bytes(report.span()));
                return true;
              },
          .get_feature =
              [&](PidReport& report) {
                const Bytes answer = joystick.get_feature(as_bytes(report.span()));
                std::copy(answer.begin(), answer.end(), report.bytes.begin());
                report.size = answer.size();
                return true;
              }};
}

void stop(const PidEffects& effects, SimulatedJoystick& joystick) {
  for (const PidReport& report : effects.stop()) joystick.output(as_bytes(report.span()));
}

TEST(PidEffects, MakeAJoystickShowForces) {
  const PidLayout layout = side_winder();
  PidEffects effects(layout, constants);
  SimulatedJoystick joystick;
  ASSERT_EQ(effects.start(wire_to(joystick)), nullptr);
  EXPECT_EQ(joystick.resets, 1);
  EXPECT_TRUE(joystick.actuators);
  EXPECT_TRUE(joystick.effects[1].plays);
  EXPECT_TRUE(joystick.effects[2].plays);
  EXPECT_EQ(joystick.effects[1].direction, 191);
  EXPECT_EQ(joystick.effects[2].direction, 128);
  EXPECT_EQ(joystick.effects[1].magnitude, 0);
  for (const PidReport& report : effects.force(pid_force(constants, Vec3(10, -5, 0)))) {
    joystick.output(as_bytes(report.span()));
  }
  EXPECT_EQ(joystick.effects[1].magnitude, 255);
  EXPECT_EQ(joystick.effects[2].magnitude, -128);

  std::vector<Bytes> way_out;
  for (const PidReport& report : effects.stop()) way_out.push_back(as_bytes(report.span()));
  EXPECT_EQ(way_out, (std::vector{bytes("05 01 00 00"), bytes("05 02 00 00"), bytes("0a 01 03 ff"),
                                  bytes("0a 02 03 ff"), bytes("0c 04")}));
  stop(effects, joystick);
  EXPECT_EQ(joystick.resets, 2);
  EXPECT_FALSE(joystick.actuators);
}

TEST(PidEffects, SayWhenTheDeviceIsFull) {
  const PidLayout layout = side_winder();
  PidEffects effects(layout, constants);
  SimulatedJoystick joystick;
  joystick.room = 1;
  const char* const failure = effects.start(wire_to(joystick));
  ASSERT_NE(failure, nullptr);
  EXPECT_NE(std::string(failure).find("no room"), std::string::npos);
  stop(effects, joystick);
  EXPECT_EQ(joystick.resets, 2);  // the first axis's effect does not play on
}

TEST(PidEffects, SayWhenTheDeviceNeverLoads) {
  const PidLayout layout = side_winder();
  PidEffects effects(layout, constants);
  SimulatedJoystick joystick;
  joystick.busy = 60;
  const char* const failure = effects.start(wire_to(joystick));
  ASSERT_NE(failure, nullptr);
  EXPECT_NE(std::string(failure).find("does not say that it loaded"), std::string::npos);
  PidEffects patient(layout, constants);
  SimulatedJoystick slow;
  slow.busy = 59;
  EXPECT_EQ(patient.start(wire_to(slow)), nullptr);
}

/// Each report that the device takes in turn is the first that it refuses.
TEST(PidEffects, SayWhenTheDeviceRefuses) {
  const PidLayout layout = side_winder();
  for (int taken = 0; taken < 10; ++taken) {
    PidEffects effects(layout, constants);
    SimulatedJoystick joystick;
    PidWire wire = wire_to(joystick);
    int left = taken;
    const auto until_refused = [&left](const auto& send) {
      return [&left, send](const PidReport& report) { return left-- > 0 && send(report); };
    };
    wire.output = until_refused(wire.output);
    wire.set_feature = until_refused(wire.set_feature);
    const char* const failure = effects.start(wire);
    ASSERT_NE(failure, nullptr) << taken;
    EXPECT_NE(std::string(failure).find("refuses a report"), std::string::npos) << taken;
    EXPECT_EQ(as_bytes(effects.stop().back().span()), bytes("0c 04")) << taken;
    EXPECT_EQ(effects.stop().size(), taken < 3 ? 1U : taken < 7 ? 3U : 5U) << taken;
  }
}

TEST(PidEffects, GarbageForAnAnswerIsNoAnswer) {
  const PidLayout layout = side_winder();
  PidEffects effects(layout, constants);
  SimulatedJoystick joystick;
  PidWire wire = wire_to(joystick);
  int asked = 0;
  wire.get_feature = [&](PidReport& report) {
    report.bytes.fill(0xFF);
    report.size = ++asked == 60 ? 0 : 3;
    return true;
  };
  EXPECT_NE(effects.start(wire), nullptr);
  EXPECT_EQ(asked, 60);
}

}  // namespace
}  // namespace palpate::pid_test
