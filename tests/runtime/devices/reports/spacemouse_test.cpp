// The SpaceMouse: both layouts, as captured from devices, and the integral of its rates.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "runtime/devices/reports/device_profile.h"
#include "runtime/devices/reports/space_mouse.h"
#include "tests/support/devices/bytes.h"
#include "tests/support/folders.h"

namespace palpate::spacemouse_test {
namespace {

using Triple = std::array<std::int16_t, 3>;

SpaceMouseConstants constants() {
  const auto profile =
      read_device_profile(palpate::test::source_file("runtime/devices/hid/profiles/spacemouse.toml"));
  return std::get<SpaceMouseConstants>(profile.kind);
}

SpaceMouseReport decoded(const std::string& hex) {
  const auto report = decode_space_mouse(bytes(hex));
  EXPECT_TRUE(report) << hex;
  return report.value_or(SpaceMouseReport{});
}

TEST(SpaceMouse, OlderOnesSendTranslationAndRotationApart) {
  const SpaceMouseReport still = decoded("01 00 00 00 00 00 00");
  EXPECT_EQ(still.translation, (Triple{0, 0, 0}));
  EXPECT_FALSE(still.rotation);
  EXPECT_FALSE(still.buttons);
  const SpaceMouseReport turned = decoded("02 00 00 e2 ff 00 00");
  EXPECT_EQ(turned.rotation, (Triple{0, -30, 0}));
  EXPECT_FALSE(turned.translation);
}

TEST(SpaceMouse, NewerOnesSendBothTogether) {
  const SpaceMouseReport report = decoded("01 5e 01 a2 fe 03 00 04 00 05 00 fa ff");
  EXPECT_EQ(report.translation, (Triple{350, -350, 3}));
  EXPECT_EQ(report.rotation, (Triple{4, 5, -6}));
}

TEST(SpaceMouse, Buttons) {
  EXPECT_EQ(decoded("03 01 00").buttons, 1U);
  EXPECT_EQ(decoded("03 03 00").buttons, 3U);
  EXPECT_EQ(decoded("03 00 00").buttons, 0U);
  EXPECT_EQ(decoded("03 01 02 04 80 ff ff").buttons, 0x80040201U);
}

TEST(SpaceMouse, RefusesShortLongAndGarbage) {
  for (const char* const hex :
       {"", "01", "01 00 00 00 00 00", "01 00 00 00 00 00 00 00", "02 00 00 00 00 00",
        "02 00 00 00 00 00 00 00 00 00 00 00 00", "03 00", "03 0 0 0 0 0 0 0", "01 f5 01 00 00 00 00",
        "02 00 00 0b fe 00 00", "17 64 01", "00 00 00 00 00 00 00"}) {
    EXPECT_FALSE(decode_space_mouse(bytes(hex))) << hex;
  }
  std::mt19937 random(2);
  for (int i = 0; i < 20000; ++i) {
    const auto report = decode_space_mouse(random_bytes(random, random() % 16));
    if (report && report->translation) {
      EXPECT_LE(std::abs((*report->translation)[0]), 500);
    }
  }
}

TEST(SpaceMouse, PushedToTheStopItGoesAtFullSpeed) {
  SpaceMouse mouse(constants(), 0.1);
  mouse.take(decoded("01 5e 01 00 00 00 00"));  // right
  DeviceState state;
  for (int tick = 0; tick < 80; ++tick) {
    state = mouse.advance(1e-3);
  }
  EXPECT_LT((state.pose.position - Vec3(0.008, 0, 0)).norm(), 1e-12);
  EXPECT_LT((state.velocity - Vec3(0.1, 0, 0)).norm(), 1e-12);
  mouse.take(decoded("01 00 00 a2 fe a2 fe"));  // from the user and lifted
  state = mouse.advance(0.01);
  EXPECT_LT((state.pose.position - Vec3(0.008, 0.001, 0.001)).norm(), 1e-12);
}

TEST(SpaceMouse, DeadZoneHasNoStepAtItsEdge) {
  SpaceMouse mouse(constants(), 0.1);
  mouse.take({Triple{15, -15, 1}, {}, {}});
  EXPECT_EQ(mouse.advance(0.01).velocity, Vec3::Zero());
  mouse.take({Triple{16, 0, 0}, {}, {}});
  EXPECT_NEAR(mouse.advance(0.01).velocity.x(), 0.1 / 335.0, 1e-12);
  mouse.take({Triple{500, 0, 0}, {}, {}});
  EXPECT_NEAR(mouse.advance(0.01).velocity.x(), 0.1, 1e-12);
}

TEST(SpaceMouse, StaysInItsWorkspace) {
  SpaceMouse mouse(constants(), 0.1);
  DeviceState state;
  for (int tick = 0; tick < 5000; ++tick) {
    if (tick % 10 == 0) mouse.take({Triple{350, 350, 0}, {}, {}});
    state = mouse.advance(1e-3);
    ASSERT_LE(state.pose.position.norm(), 0.1 + 1e-12);
  }
  EXPECT_LT((state.pose.position - 0.1 * Vec3(1, -1, 0).normalized()).norm(), 1e-9);
  EXPECT_LT(state.velocity.norm(), 1e-9);
}

TEST(SpaceMouse, TurnsAboutItsAxes) {
  SpaceMouse mouse(constants(), 0.1);
  DeviceState state;
  for (int tick = 0; tick < 1000; ++tick) {
    if (tick % 10 == 0) mouse.take({{}, Triple{0, 0, -350}, {}});
    state = mouse.advance(1e-3);
  }
  const Eigen::Quaterniond expected(Eigen::AngleAxisd(1.5, Vec3::UnitZ()));
  EXPECT_LT(state.pose.orientation.angularDistance(expected), 1e-9);
  EXPECT_NEAR(state.pose.orientation.norm(), 1.0, 1e-12);
}

TEST(SpaceMouse, SilenceStopsIt) {
  SpaceMouse mouse(constants(), 0.1);
  mouse.take(decoded("01 5e 01 00 00 00 00"));
  mouse.take(decoded("03 01 00"));
  DeviceState state;
  for (int tick = 0; tick < 200; ++tick) {
    state = mouse.advance(1e-3);
  }
  EXPECT_NEAR(state.pose.position.x(), 0.01, 2e-4);  // 0.1 s at 0.1 m/s
  EXPECT_EQ(state.velocity, Vec3::Zero());
  EXPECT_TRUE(state.pose.grab);
}

}  // namespace
}  // namespace palpate::spacemouse_test
