// HidPort with the system's hidapi, against emulated devices in sysfs and /dev: run by umockdev-wrapper, or
// by scripts/devices-in-vm against the devices of a real kernel.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/error.h"
#include "runtime/devices/hid/hid_port.h"
#include "tests/support/devices/board_codec.h"
#include "tests/support/devices/emulated_bus.h"
#include "tests/support/folders.h"

namespace palpate::umockdev_test {
namespace {

using ReadResult = DevicePort::ReadResult;

const BoardFeature board_feature{.axes = 3,
                                 .watchdog = 100,
                                 .force_unit = 250,
                                 .max_force = 4000,
                                 .max_stiffness = 1500,
                                 .max_damping = 3000,
                                 .workspace_radius = 80000};

Vec3 circle(double t) {
  return {0.02 * std::cos(3.0 * t), 0.02 * std::sin(3.0 * t), 0.005};
}

Vec3 resting(double /*t*/) {
  return Vec3::Zero();
}

DeviceCommand command(const Vec3& force) {
  DeviceCommand result;
  result.wrench.force = force;
  return result;
}

template <typename Constants>
Constants constants_of(const std::string& profile) {
  return std::get<Constants>(find_profile(profile).profile.kind);
}

HidChoice choose(const std::string& text, const std::string& profile = "") {
  return choose_hid_device(
      attached_devices(),
      profile.empty() ? known_profiles() : std::vector<NamedProfile>{find_profile(profile)}, text);
}

std::string message(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return to_text(error);
  }
  return "nothing was thrown";
}

::testing::AssertionResult says(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "'" << part << "' is not in: " << text;
}

/// Waits for what comes a moment later, for ten seconds at most.
template <typename Condition>
bool comes_true(const Condition& condition) {
  for (int k = 0; k < 2000; ++k) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return condition();
}

ReadResult next(HidPort& port, DeviceState& state) {
  for (int k = 0; k < 500; ++k) {
    const ReadResult heard = port.read(state);
    if (heard != ReadResult::nothing) return heard;
  }
  return ReadResult::nothing;
}

/// What a program prints.
std::string output_of(const std::string& line) {
  std::string text;
  FILE* pipe = popen(line.c_str(), "r");
  std::array<char, 256> part{};
  while (fgets(part.data(), part.size(), pipe) != nullptr) {
    text += part.data();
  }
  EXPECT_EQ(pclose(pipe), 0) << text;
  return text;
}

class EmulatedHid : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(EmulatedBus::is_there()) << "run this by umockdev-wrapper, or by scripts/devices-in-vm";
  }
};

TEST_F(EmulatedHid, NothingIsAttached) {
  const EmulatedBus bus;
  EXPECT_TRUE(attached_devices().empty());
  EXPECT_TRUE(says(message([] { static_cast<void>(choose("")); }), "no HID device is attached"));
  EXPECT_TRUE(
      says(output_of(palpate::test::built_file("runtime/palpate-runtime") + " devices"), "No HID device"));
}

TEST_F(EmulatedHid, WhatIsAttachedIsSeenWithItsProfiles) {
  EmulatedBus bus;
  bus.plug_in(std::make_shared<WoodenHapticsFirmware>(constants_of<ArmConstants>("woodenhaptics"), resting),
              "");
  bus.plug_in(std::make_shared<BoardFirmware>(board_feature, resting), "B 7");
  bus.plug_in(std::make_shared<JoystickFirmware>(constants_of<PidConstants>("pid_joystick"), resting));
  bus.plug_in(std::make_shared<SpaceMouseFirmware>([](double) { return std::array<std::int16_t, 6>{}; }));
  const auto attached = attached_devices();
  ASSERT_EQ(attached.size(), 4U);
  EXPECT_EQ(attached[1].path, "/dev/hidraw1");
  EXPECT_EQ(attached[1].vendor, 0xCAFE);
  EXPECT_EQ(attached[1].product, 0x4001);
  EXPECT_EQ(attached[1].serial, "B 7");
  EXPECT_TRUE(attached[1].maker.empty() || attached[1].maker == "Emulated");  // uhid has none
  EXPECT_EQ(attached[1].product_name, "Board");
  EXPECT_EQ(attached[1].descriptor, board_report_descriptor(3));
  EXPECT_EQ(attached[1].access, 0);
  EXPECT_EQ(attached[0].serial, "");
  const auto profiles = known_profiles();
  const auto keys = [&](const AttachedDevice& device) {
    std::vector<std::string> result;
    for (const NamedProfile* profile : fitting_profiles(device, profiles)) {
      result.push_back(profile->key);
    }
    return result;
  };
  EXPECT_EQ(keys(attached[0]), (std::vector<std::string>{"aluhaptics", "polhem_v1", "woodenhaptics"}));
  EXPECT_EQ(keys(attached[1]), std::vector<std::string>{"palpate_board"});
  EXPECT_EQ(keys(attached[2]), std::vector<std::string>{"pid_joystick"});
  EXPECT_EQ(keys(attached[3]), std::vector<std::string>{"spacemouse"});
  EXPECT_TRUE(says(message([] { static_cast<void>(choose("")); }), "several devices"));
  EXPECT_TRUE(says(message([] { static_cast<void>(choose("1234:0006")); }), "several profiles fit"));
  EXPECT_EQ(choose("/dev/hidraw0", "polhem_v1").profile.name, "Polhem v1");
  EXPECT_EQ(choose("045e:001b").profile.name, "Force-feedback joystick (USB PID)");

  const std::string program = palpate::test::built_file("runtime/palpate-runtime") + " devices";
  const std::string text = output_of(program);
  EXPECT_TRUE(says(text, "CAFE:4001 Board (/dev/hidraw1)\n"));
  EXPECT_TRUE(says(text, "  serial   B 7\n"));
  EXPECT_TRUE(says(text, "  profile  polhem_v1: Polhem v1\n"));
  EXPECT_TRUE(says(text, "  access   yes\n"));
  const nlohmann::json listed = nlohmann::json::parse(output_of(program + " --json")).at("devices").at(0);
  EXPECT_EQ(listed.at("profiles"), nlohmann::json({"aluhaptics", "polhem_v1", "woodenhaptics"}));
  EXPECT_EQ(listed.at("accessible"), true);
}

TEST_F(EmulatedHid, UnknownDevices) {
  struct Pad : Firmware {
    Pad() : Firmware(0x054C, 0x0CE6, "Pad", bytes(dual_sense_descriptor)) {}
    std::optional<Bytes> do_input() override { return std::nullopt; }
  };
  EmulatedBus bus;
  bus.plug_in(std::make_shared<Pad>());
  const std::string text = message([] { static_cast<void>(choose("")); });
  EXPECT_TRUE(says(text, "no profile fits this device"));
  EXPECT_TRUE(says(text, "output report 2: 47 x 8 bit"));
  EXPECT_TRUE(
      says(output_of(palpate::test::built_file("runtime/palpate-runtime") + " devices"), "none fits"));
}

TEST_F(EmulatedHid, ANodeThatIsNotThere) {
  EmulatedBus bus;
  bus.remove_node(bus.plug_in(std::make_shared<BoardFirmware>(board_feature, resting)));
  EXPECT_TRUE(says(message([] { static_cast<void>(choose("")); }), "its node is not there"));
}

TEST_F(EmulatedHid, BoardAtAThousandReportsASecond) {
  EmulatedBus bus;
  auto firmware = std::make_shared<BoardFirmware>(board_feature, circle);
  const std::string path = bus.plug_in(firmware);
  HidPort port(choose(""));
  port.open();
  EXPECT_EQ(port.limits().max_force, 4.0);  // asked for by a feature report
  EXPECT_EQ(port.limits().max_damping, 3.0);
  bus.talk(path);
  DeviceState state;
  std::vector<std::uint32_t> sequences;
  std::vector<Vec3> wanted;
  while (state.sequence < 2000) {
    ASSERT_EQ(next(port, state), ReadResult::report);
    // In order; each is the place that belongs to its number: none is torn.
    if (!sequences.empty()) {
      ASSERT_GT(state.sequence, sequences.back());
    }
    ASSERT_LT((state.pose.position - circle(1e-3 * (state.sequence - 1))).norm(), 1e-6);
    sequences.push_back(state.sequence);
    wanted.emplace_back(1e-3 * state.sequence, -0.5, 1.0);
    ASSERT_TRUE(port.write(command(wanted.back()), state));
  }
  // None is lost but those that newer ones overtook while the reader was held up.
  EXPECT_EQ(port.dropped(), 0);
  // What it was told: what it shows is zero, too, where its watchdog has found this side held up.
  ASSERT_TRUE(comes_true([&] { return firmware->outputs().size() == wanted.size(); }));
  const auto told = firmware->outputs();
  const auto answered = firmware->answered();
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const auto force = decode_board_force(told[k]);
    ASSERT_TRUE(force);
    const Vec3 shown = 250e-6 * Vec3(force->counts[0], force->counts[1], force->counts[2]);
    EXPECT_LE((shown - wanted[k]).cwiseAbs().maxCoeff(), 0.5001 * 250e-6);
    EXPECT_EQ(answered[k] + 1, sequences[k]);
  }
  RecordProperty("overtaken", static_cast<int>(2000 - sequences.size()));
  port.close();
  ASSERT_TRUE(comes_true([&] { return firmware->outputs().size() == wanted.size() + 2; }));
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
}

TEST_F(EmulatedHid, ReportsThatWaitAreDrained) {
  EmulatedBus bus;
  auto firmware = std::make_shared<BoardFirmware>(board_feature, circle);
  const std::string path = bus.plug_in(firmware);
  HidPort port(choose(""));
  port.open();
  bus.talk(path);
  DeviceState state;
  ASSERT_EQ(next(port, state), ReadResult::report);
  // Some thirty, one behind the other, once the device has not been held up as well; else they come one by
  // one.
  EXPECT_TRUE(comes_true([&] {
    const std::uint32_t before = state.sequence;
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    return next(port, state) == ReadResult::report && state.sequence >= before + 20;
  }));
  EXPECT_EQ(port.dropped(), 0);
}

TEST_F(EmulatedHid, WoodenHapticsByRequestAndResponse) {
  EmulatedBus bus;
  const auto arm = constants_of<ArmConstants>("woodenhaptics");
  // Slow, and without a watchdog: a busy machine may hold up both sides.
  auto firmware = std::make_shared<WoodenHapticsFirmware>(arm, [](double t) { return circle(0.05 * t); });
  firmware->watchdog = 60.0;
  bus.talk(bus.plug_in(firmware));
  HidPort port(choose("", "woodenhaptics"));
  port.open();
  DeviceState state;
  const Vec3 force(0.5, -0.3, 0.8);
  for (std::uint32_t tick = 1; tick <= 500; ++tick) {
    ASSERT_EQ(next(port, state), ReadResult::report);
    ASSERT_EQ(state.sequence, tick);
    ASSERT_NEAR(state.pose.position.head<2>().norm(), 0.02, 3e-4);
    ASSERT_TRUE(port.write(command(force), state));
  }
  ASSERT_TRUE(comes_true([&] { return firmware->forces().size() == 501; }));
  const auto shown = firmware->forces();
  for (std::size_t k = 1; k < shown.size(); ++k) {
    // To the milliampere; the hand goes on from where it was read, 3 mm/s.
    ASSERT_LT((shown[k].force - force).norm(), 0.1) << k;
  }
  port.close();
  ASSERT_TRUE(comes_true([&] { return firmware->forces().size() == 503; }));
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
}

TEST_F(EmulatedHid, JoystickConversation) {
  EmulatedBus bus;
  auto firmware = std::make_shared<JoystickFirmware>(
      constants_of<PidConstants>("pid_joystick"),
      [](double t) { return Vec3(0.03 * std::cos(3.0 * t), 0.03 * std::sin(3.0 * t), 0); });
  firmware->slow = 2;
  const std::string path = bus.plug_in(firmware);
  HidPort port(choose(""));
  port.open();
  ASSERT_TRUE(comes_true([&] { return firmware->playing() == 2; }));
  bus.talk(path);
  DeviceState state;
  for (int tick = 0; tick < 200; ++tick) {
    ASSERT_EQ(next(port, state), ReadResult::report);
    EXPECT_NEAR(state.pose.position.norm(), 0.03, 5e-4);
    ASSERT_TRUE(port.write(command(Vec3(0.04 * tick, -2.0, 0.0)), state));
  }
  ASSERT_TRUE(comes_true(
      [&] { return (firmware->forces().back().force - Vec3(0.04 * 199, -2.0, 0.0)).norm() < 0.2; }));
  port.close();
  ASSERT_TRUE(comes_true([&] { return firmware->playing() == 0; }));
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
}

TEST_F(EmulatedHid, SpaceMouseStream) {
  EmulatedBus bus;
  std::atomic<bool> pressed = false;
  auto firmware = std::make_shared<SpaceMouseFirmware>([&](double) {
    return std::array<std::int16_t, 6>{0, 0, static_cast<std::int16_t>(pressed ? -350 : 0), 0, 0, 0};
  });
  const std::string path = bus.plug_in(firmware);
  HidPort port(choose(""));
  port.open();
  bus.talk(path);
  DeviceState state;
  std::uint32_t before = 0;
  const auto read_until = [&](const std::function<bool()>& is_so) {
    return comes_true([&] {
      EXPECT_EQ(port.read(state), ReadResult::report);
      EXPECT_EQ(state.sequence, ++before);
      return is_so();
    });
  };
  const double begin = firmware->time();
  pressed = true;
  ASSERT_TRUE(read_until([&] { return state.pose.position.z() > 0.02; }));
  EXPECT_LT((state.velocity - Vec3(0.0, 0.0, 0.1)).norm(), 1e-12);
  pressed = false;
  ASSERT_TRUE(read_until([&] { return state.velocity.isZero(0.0); }));
  const double end = firmware->time();
  EXPECT_EQ(port.dropped(), 0);
  EXPECT_LE(state.pose.position.z(), 0.1 * (end - begin)) << "up, with 0.1 m/s while it was pressed";
  const Vec3 rest = state.pose.position;
  for (int k = 0; k < 50; ++k) ASSERT_EQ(port.read(state), ReadResult::report);
  EXPECT_EQ(state.pose.position, rest);
}

TEST_F(EmulatedHid, UnpluggedAndPluggedInAgain) {
  EmulatedBus bus;
  const std::string path = bus.plug_in(std::make_shared<BoardFirmware>(board_feature, circle), "B1");
  HidPort port(choose(""));
  port.open();
  bus.talk(path);
  DeviceState state;
  for (int k = 0; k < 50; ++k) {
    ASSERT_EQ(next(port, state), ReadResult::report);
  }
  bus.unplug(path);
  EXPECT_TRUE(comes_true([&] { return port.read(state) == ReadResult::lost; }));
  EXPECT_FALSE(port.write(command(Vec3(1, 0, 0)), state));
  port.close();
  EXPECT_TRUE(says(message([&] { port.open(); }), "the device is not attached"));

  const std::uint32_t last = state.sequence;
  auto again = std::make_shared<BoardFirmware>(board_feature, circle);
  const std::string new_path = bus.plug_in(again, "B1");
  port.open();
  bus.talk(new_path);
  ASSERT_EQ(next(port, state), ReadResult::report);
  EXPECT_GT(state.sequence, last);
  ASSERT_TRUE(port.write(command(Vec3(1, 0, 0)), state));
  EXPECT_TRUE(comes_true([&] { return !again->forces().empty(); }));
  EXPECT_NEAR(again->forces().back().force.x(), 1.0, 250e-6);
}

TEST_F(EmulatedHid, AKilledProcessLeavesNoForce) {
  EmulatedBus bus;
  auto firmware = std::make_shared<JoystickFirmware>(constants_of<PidConstants>("pid_joystick"), resting);
  const std::string path = bus.plug_in(firmware);
  const pid_t child = fork();
  if (child == 0) {
    try {
      Guardian guardian;
      HidPort port(choose(""), &guardian);
      port.open();
      while (true) {
        port.write(command(Vec3(4, 3, 0)), {});
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    } catch (const Error& error) {
      static_cast<void>(std::fputs(to_text(error).c_str(), stderr));
    }
    _exit(1);
  }
  ASSERT_GT(child, 0);
  const bool pulls = comes_true([&] {
    const auto forces = firmware->forces();
    return !forces.empty() && (forces.back().force - Vec3(4, 3, 0)).norm() < 0.2;
  });
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(pulls);
  EXPECT_TRUE(comes_true([&] { return firmware->playing() == 0; }));
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
}

}  // namespace
}  // namespace palpate::umockdev_test
