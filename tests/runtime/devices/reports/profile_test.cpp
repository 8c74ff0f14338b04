// Device profiles: those we ship, what fits which device, and what a person is told of a bad one.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "base/error.h"
#include "runtime/devices/reports/device_profile.h"
#include "runtime/devices/reports/palpate_board.h"
#include "tests/support/devices/bytes.h"
#include "tests/support/folders.h"

namespace palpate::profile_test {
namespace {

const std::string folder = palpate::test::source_file("runtime/devices/hid/profiles/");

DeviceProfile shipped(const std::string& name) {
  return read_device_profile(folder + name + ".toml");
}

const std::string good = R"(name = "A"
kind = "spacemouse"
[[match]]
vendor = 0x1
[limits]
workspace_radius = 0.1
[spacemouse]
full_scale = 350
dead_zone = 15
speed = 0.1
turning_speed = 1.5
translation_signs = [1, -1, -1]
rotation_signs = [1, -1, -1]
silence = 0.1
)";

/// What a person sees of the good profile with `from` replaced by `to`.
std::string told(const std::string& from, const std::string& to, std::string text = good) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  try {
    static_cast<void>(parse_device_profile(text, "my.toml"));
  } catch (const Error& error) {
    return to_text(error);
  }
  return "taken";
}

TEST(DeviceProfile, WoodenHaptics) {
  const DeviceProfile profile = shipped("woodenhaptics");
  EXPECT_EQ(profile.reports.input, 14);
  EXPECT_EQ(profile.limits.max_force, 5.0);
  EXPECT_EQ(profile.limits.max_stiffness, 1000.0);
  EXPECT_EQ(profile.limits.max_damping, 8.0);
  EXPECT_EQ(profile.limits.workspace_radius, 0.1);
  EXPECT_TRUE(std::isinf(profile.limits.max_torque));
  const auto& arm = std::get<ArmConstants>(profile.kind);
  EXPECT_EQ(arm.lengths, Vec3(0.080, 0.205, 0.245));
  EXPECT_EQ(arm.body_diameters, Vec3(0.160, 0.120, 0.120));
  EXPECT_EQ(arm.max_current, 3.0);
  EXPECT_FALSE(arm.has_wrist());
  EXPECT_TRUE(profile.fits({0x1234, 0x0006}));
  EXPECT_FALSE(profile.fits({0x1234, 0x0007}));
  EXPECT_FALSE(profile.fits({0x1235, 0x0006}));
}

TEST(DeviceProfile, Polhem) {
  const auto arm = std::get<ArmConstants>(shipped("polhem_v1").kind);
  EXPECT_TRUE(arm.has_wrist());
  EXPECT_EQ(arm.motor_aligned, (std::array<bool, 3>{true, true, true}));
  EXPECT_EQ(arm.encoder_aligned, (std::array<bool, 3>{false, true, false}));
  EXPECT_EQ(arm.calibration[2], -5000);
}

TEST(DeviceProfile, SpaceMouse) {
  const DeviceProfile profile = shipped("spacemouse");
  EXPECT_EQ(std::get<SpaceMouseConstants>(profile.kind).full_scale, 350.0);
  EXPECT_TRUE(profile.fits({0x256F, 0xC62E, {0x01, 0x08}}));
  EXPECT_TRUE(profile.fits({0x046D, 0xC626, {0x01, 0x08}}));
  EXPECT_FALSE(profile.fits({0x046D, 0xC52B, {0x01, 0x02}}));  // Logitech's mice
}

TEST(DeviceProfile, JoystickIsKnownByItsDescriptor) {
  const DeviceProfile profile = shipped("pid_joystick");
  const auto side_winder = parse_report_descriptor(bytes(side_winder_descriptor), "SideWinder");
  const auto dual_sense = parse_report_descriptor(bytes(dual_sense_descriptor), "DualSense");
  EXPECT_TRUE(profile.fits({0x045E, 0x001B, side_winder.usage, side_winder.collections}));
  EXPECT_FALSE(profile.fits({0x054C, 0x0CE6, dual_sense.usage, dual_sense.collections}));
  EXPECT_FALSE(profile.fits({0x045E, 0x001B}));
  EXPECT_EQ(std::get<PidConstants>(profile.kind).directions, (std::array<double, 2>{270.0, 180.0}));
}

TEST(DeviceProfile, BoardIsKnownByItsUsage) {
  const DeviceProfile profile = shipped("palpate_board");
  EXPECT_TRUE(profile.fits({0xCAFE, 0x4001, board_usage}));
  EXPECT_FALSE(profile.fits({0xCAFE, 0x4001, {0x01, 0x04}}));
  EXPECT_EQ(static_cast<std::size_t>(profile.reports.input), board_input_bytes(most_board_axes));
  EXPECT_EQ(static_cast<std::size_t>(profile.reports.output), board_force_bytes);
  EXPECT_EQ(static_cast<std::size_t>(profile.reports.feature), board_feature_bytes);
}

TEST(DeviceProfile, AllThatAreShippedCanBeRead) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    EXPECT_NO_THROW(static_cast<void>(read_device_profile(entry.path()))) << entry.path();
    ++count;
  }
  EXPECT_EQ(count, 6);
}

TEST(DeviceProfile, SaysFileLineKeyAndWhatToDo) {
  EXPECT_EQ(told("silence", "silence"), "taken");
  EXPECT_EQ(told("dead_zone = 15", "deadzone = 15"),
            "error: my.toml:9:1: unknown key \"deadzone\" in [spacemouse]\n"
            "hint: The nearest known key is \"dead_zone\" of full_scale, dead_zone, speed, turning_speed, "
            "translation_signs, rotation_signs, silence\n");
  EXPECT_EQ(told("speed = 0.1\n", ""),
            "error: my.toml:7:1: [spacemouse] speed is missing\nhint: Add it to [spacemouse]\n");
  EXPECT_EQ(told("speed = 0.1", "speed = -0.1"),
            "error: my.toml:10:9: [spacemouse] speed must be greater than 0, not -0.1\nhint: Give a positive "
            "number\n");
  EXPECT_EQ(told("dead_zone = 15", "dead_zone = 200"),
            "error: my.toml:9:13: [spacemouse] dead_zone must be from 0 to 175, not 200\n"
            "hint: Choose a value in that range\n");
  EXPECT_EQ(told("= [1, -1, -1]", "= [1, -1]"),
            "error: my.toml:12:21: [spacemouse] translation_signs must be [three whole numbers]\n"
            "hint: Write translation_signs = [three whole numbers]\n");
  EXPECT_EQ(told("kind = \"spacemouse\"", "kind = \"mouse\""),
            "error: my.toml:2:8: kind is \"mouse\"\n"
            "hint: Use \"woodenhaptics\", \"spacemouse\", \"pid\" or \"palpate_board\"\n");
}

TEST(DeviceProfile, RefusesWhatMakesNoSense) {
  const auto says = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says(told("full_scale = 350", "full_scale = nan"), "full_scale is not a finite number");
  says(told("full_scale = 350", "full_scale = \"350\""), "full_scale must be a number");
  says(told("vendor = 0x1", "vendor = 0x10000"), "must be from 0 to 65535, not 65536");
  says(told("vendor = 0x1", "product = 1"), "a product without a vendor");
  says(told("vendor = 0x1\n", ""), "fits every device");
  says(told("vendor = 0x1", "usage = [1]"), "usage must be [two whole numbers]");
  says(told("[[match]]", "[match]"), "match must be a list of at least one table");
  says(told("[[match]]\nvendor = 0x1\n", ""), "match is missing");
  says(told("name = \"A\"", "name = 3"), "name must be a text");
  says(told("name = \"A\"", "name = \"\""), "name is empty");
  says(told("name = \"A\"", "name = \"A"), "not valid TOML");
  says(told("workspace_radius = 0.1", "max_force = 5"), "[limits] workspace_radius is missing");
  says(told("[limits]", "[arm]\n[limits]"), "unknown key \"arm\"");
  says(told("[limits]", "[reports]\ninput = 0\n[limits]"), "[reports] input must be from 1 to 4096, not 0");
  EXPECT_THROW(static_cast<void>(read_device_profile(folder + "none.toml")), Error);
  EXPECT_THROW(static_cast<void>(read_device_profile(folder)), Error);
}

TEST(DeviceProfile, RefusesWhatWouldOverflowTheParser) {
  const std::string name = "name = \"A\"";
  std::string deep;
  for (int i = 0; i < 100'000; ++i) {
    deep += "a.";
  }
  EXPECT_NE(told(name, deep + "a = 1").find("more than 16 parts"), std::string::npos);
  EXPECT_NE(told(name, "a = " + std::string(100'000, '[')).find("more than 32 deep"), std::string::npos);
  EXPECT_LT(told(name, std::string(70'000, 'a') + " = 1").size(), 500U);
}

TEST(DeviceProfile, RefusesArmsThatCannotBe) {
  std::string arm;
  {
    std::ifstream stream(folder + "polhem_v1.toml");
    arm.assign(std::istreambuf_iterator<char>(stream), {});
  }
  const auto says = [&](const std::string& from, const std::string& to, const std::string& part) {
    const std::string text = told(from, to, arm);
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says("input = 14", "input = 64", "[reports] of this kind are input = 14 and output = 14");
  says("1024, 1024, 1024]", "1024, 0, 1024]", "counts_per_turn must be positive");
  says("[2000,", "[0,", "counts_per_turn must be positive");
  says("[0.058, 0.174", "[0.058, 0", "[arm] lengths must be greater than 0, not 0");
  says("[true, true, true]", "[1, true, true]", "motor_aligned must be [three of true or false]");
  says("-5000", "-50000", "must be from -32768 to 32767, not -50000");
}

}  // namespace
}  // namespace palpate::profile_test
