// HidPort against emulated devices in this process: each kind, each fault.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <thread>

#include "base/error.h"
#include "runtime/devices/hid/hid_port.h"
#include "runtime/devices/hid/make_hid_protocol.h"
#include "runtime/devices/reports/woodenhaptics_report.h"
#include "runtime/safety/monotonic_clock.h"
#include "runtime/safety/silence_watch.h"
#include "runtime/safety/speed_limit.h"
#include "tests/support/devices/fake_hidapi.h"
#include "tests/support/folders.h"

namespace palpate::fake_hid_test {
namespace {

using ReadResult = DevicePort::ReadResult;

const BoardFeature board_feature{.axes = 3,
                                 .watchdog = 100,
                                 .force_unit = 250,
                                 .max_force = 4000,
                                 .max_stiffness = 1500,
                                 .max_damping = 0,
                                 .workspace_radius = 80000};

/// A slow circle of 2 cm.
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

/// A fake bus with one device and a port to it.
struct Bench {
  explicit Bench(std::shared_ptr<Firmware> what, const std::string& profile)
      : firmware(std::move(what)),
        path(hid.attach(firmware)),
        port(choose_hid_device(attached_devices(hid.sys()), {find_profile(profile)}, ""), nullptr,
             hid.sys()) {}

  FakeHid hid;
  std::shared_ptr<Firmware> firmware;
  std::string path;
  HidPort port;
  DeviceState state;

  /// Reads until something comes that is not nothing.
  ReadResult next() {
    for (int k = 0; k < 1000; ++k) {
      const ReadResult heard = port.read(state);
      if (heard != ReadResult::nothing) return heard;
    }
    return ReadResult::nothing;
  }
};

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

const ArmConstants& arm() {
  static const ArmConstants constants = std::get<ArmConstants>(find_profile("woodenhaptics").profile.kind);
  return constants;
}

// --- WoodenHaptics ---

TEST(HidArm, RequestsAreAnsweredAndForcesAreFelt) {
  auto firmware = std::make_shared<WoodenHapticsFirmware>(arm(), circle);
  Bench bench(firmware, "woodenhaptics");
  bench.port.open();
  ASSERT_EQ(firmware->outputs().size(), 1U);  // the first report of zeros
  EXPECT_EQ(firmware->outputs()[0], Bytes(15, 0));
  EXPECT_TRUE(says(bench.port.name(), "WoodenHaptics (2015), 1234:0006"));
  EXPECT_EQ(bench.port.limits().max_force, 5.0);
  const Vec3 force(0.5, -0.3, 0.8);
  std::uint32_t before = 0;
  std::vector<double> speeds;
  for (int tick = 0; tick < 300; ++tick) {
    const std::int64_t asked = monotonic_now();
    ASSERT_EQ(bench.next(), ReadResult::report);
    EXPECT_EQ(bench.state.sequence, before + 1);
    before = bench.state.sequence;
    EXPECT_GE(bench.state.arrived, asked);
    EXPECT_LE(bench.state.arrived, monotonic_now());
    // Where the hand is, to what half a count of each motor moves it: 0.3 mm in all.
    EXPECT_NEAR(bench.state.pose.position.head<2>().norm(), 0.02, 3e-4);
    EXPECT_NEAR(bench.state.pose.position.z(), 0.005, 3e-4);
    speeds.push_back(bench.state.velocity.norm());
    ASSERT_TRUE(bench.port.write(command(force), bench.state));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  // 6 cm/s along the circle; the window is some 15 ms, and a count 0.1 mm. The median, as a busy machine
  // stamps some late.
  std::ranges::nth_element(speeds, speeds.begin() + 150);
  EXPECT_NEAR(speeds[150], 0.06, 0.01);
  const auto shown = firmware->forces();
  ASSERT_EQ(shown.size(), 301U);
  // Milliamperes, and the hand that went on since the position was read.
  EXPECT_LT((shown.back().force - force).norm(), 0.1);
  EXPECT_EQ(bench.port.dropped(), 0);
  bench.port.close();
  EXPECT_EQ(firmware->forces().size(), 303U);
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
  EXPECT_EQ(bench.hid.open_devices(), 0);
}

TEST(HidArm, OutOfReachThereIsNoForce) {
  auto firmware = std::make_shared<WoodenHapticsFirmware>(arm(), resting);
  Bench bench(firmware, "woodenhaptics");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  bench.state.pose.position = Vec3(2, 0, 0);
  ASSERT_TRUE(bench.port.write(command(Vec3(1, 1, 1)), bench.state));
  EXPECT_EQ(firmware->outputs().back(), Bytes(15, 0));
}

TEST(HidArm, CalibrateButtonSetsTheCountersOnce) {
  const Vec3 pose = arm_position(arm(), joint_angles(arm(), arm().calibration));
  auto firmware = std::make_shared<WoodenHapticsFirmware>(arm(), [pose](double) { return Vec3(pose); });
  firmware->misplace({200, -300, 150, 0, 0, 0});
  Bench bench(firmware, "woodenhaptics");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  EXPECT_GT((bench.state.pose.position - pose).norm(), 0.01);
  firmware->press_calibrate();
  ASSERT_TRUE(bench.port.write(command(Vec3(0, 0, 1)), bench.state));
  ASSERT_EQ(bench.next(), ReadResult::report);  // says that the button was pressed
  ASSERT_TRUE(bench.port.write(command(Vec3(0, 0, 1)), bench.state));
  const auto set = encode_counters(arm().calibration);
  EXPECT_EQ(firmware->outputs().back(), Bytes(set.begin(), set.end()));
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
  ASSERT_EQ(bench.next(), ReadResult::report);
  EXPECT_LT((bench.state.pose.position - pose).norm(), 1e-12);
  ASSERT_TRUE(bench.port.write(command(Vec3(0, 0, 1)), bench.state));
  EXPECT_NEAR(firmware->forces().back().force.z(), 1.0, 0.01);
}

TEST(HidArm, ButtonGrabs) {
  auto firmware = std::make_shared<WoodenHapticsFirmware>(arm(), resting);
  Bench bench(firmware, "woodenhaptics");
  firmware->press_button(true);
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  EXPECT_TRUE(bench.state.pose.grab);
}

TEST(HidArm, AnotherReportLengthIsAnotherProtocol) {
  // As the later boards have: 64 bytes each way.
  struct Later : Firmware {
    Later()
        : Firmware(
              0x1234, 0x0006, "Later board",
              bytes("06 AB FF 0A 00 02 A1 01 75 08 95 40 15 00 26 FF 00 09 01 81 02 95 40 09 02 91 02 C0")) {}
    std::optional<Bytes> do_input() override { return std::nullopt; }
  };
  Bench bench(std::make_shared<Later>(), "woodenhaptics");
  const std::string text = message([&] { bench.port.open(); });
  EXPECT_TRUE(says(text, "its longest input report has 64 bytes, the profile says 14"));
  EXPECT_EQ(bench.port.read(bench.state), ReadResult::lost);
}

// --- board ---

TEST(HidBoard, LimitsNumbersAndForces) {
  auto firmware = std::make_shared<BoardFirmware>(board_feature, circle, 1000);
  Bench bench(firmware, "palpate_board");
  EXPECT_EQ(bench.port.limits().max_force, 5.0);  // the profile's
  bench.port.open();
  EXPECT_EQ(bench.port.limits().max_force, 4.0);
  EXPECT_EQ(bench.port.limits().max_stiffness, 1000.0);  // the profile's is the smaller one
  EXPECT_EQ(bench.port.limits().max_damping, 8.0);       // the board says nothing
  EXPECT_EQ(bench.port.limits().workspace_radius, 0.08);
  std::vector<std::uint32_t> sequences;
  while (bench.state.sequence < 200) {
    ASSERT_EQ(bench.next(), ReadResult::report);
    sequences.push_back(bench.state.sequence);
    const Vec3 force(0.001 * bench.state.sequence, -1.0, 0.5);
    ASSERT_TRUE(bench.port.write(command(force), bench.state));
    // The number of the position that it follows from is its own time.
    EXPECT_LT((bench.state.pose.position - circle(1e-3 * (bench.state.sequence - 1))).norm(), 1e-6);
    EXPECT_LT((firmware->forces().back().force - force).norm(), 250e-6);
  }
  const auto answered = firmware->answered();
  ASSERT_EQ(answered.size(), sequences.size());
  for (std::size_t k = 0; k < sequences.size(); ++k) {
    EXPECT_EQ(answered[k], sequences[k] + 999);
    if (k > 0) {
      EXPECT_GT(sequences[k], sequences[k - 1]);
    }
  }
}

TEST(HidBoard, TheProfilesLimitsHoldToo) {
  BoardFeature strong = board_feature;
  strong.max_force = 9000;
  strong.max_stiffness = 500;
  strong.max_damping = 9000;
  strong.workspace_radius = 0;
  Bench bench(std::make_shared<BoardFirmware>(strong, circle), "palpate_board");
  bench.port.open();
  EXPECT_EQ(bench.port.limits().max_force, 5.0);
  EXPECT_EQ(bench.port.limits().max_stiffness, 500.0);
  EXPECT_EQ(bench.port.limits().max_damping, 8.0);
  EXPECT_TRUE(std::isinf(bench.port.limits().workspace_radius));
}

TEST(HidBoard, NumbersGrowOnWhenItIsPluggedInAgain) {
  Bench bench(std::make_shared<BoardFirmware>(board_feature, circle, 5000), "palpate_board");
  bench.port.open();
  for (int k = 0; k < 20; ++k) {
    ASSERT_EQ(bench.next(), ReadResult::report);
  }
  const std::uint32_t last = bench.state.sequence;
  bench.hid.detach(bench.path);
  EXPECT_EQ(bench.next(), ReadResult::lost);
  EXPECT_EQ(bench.next(), ReadResult::lost);
  EXPECT_FALSE(bench.port.write({}, bench.state));
  EXPECT_FALSE(bench.port.write({}, bench.state));
  EXPECT_EQ(bench.hid.calls_after_error(), 0);
  bench.port.close();
  EXPECT_EQ(bench.hid.open_devices(), 0);
  EXPECT_TRUE(says(message([&] { bench.port.open(); }), "the device is not attached"));
  EXPECT_EQ(bench.port.read(bench.state), ReadResult::lost);
  EXPECT_FALSE(bench.port.write({}, bench.state));

  auto again = std::make_shared<BoardFirmware>(board_feature, circle, 7);
  const std::string path = bench.hid.attach(again);
  EXPECT_NE(path, bench.path);
  bench.port.open();
  EXPECT_TRUE(says(bench.port.name(), path));
  ASSERT_EQ(bench.next(), ReadResult::report);
  EXPECT_GT(bench.state.sequence, last);
  EXPECT_LT(bench.state.sequence, last + 100);
  ASSERT_TRUE(bench.port.write(command(Vec3(1, 0, 0)), bench.state));
  EXPECT_EQ(again->answered().back() - 7, bench.state.sequence - last - 1);
}

TEST(HidBoard, AnotherOneIsNotTakenForIt) {
  Bench bench(std::make_shared<BoardFirmware>(board_feature, circle), "palpate_board");
  bench.hid.detach(bench.path);
  bench.hid.attach(std::make_shared<BoardFirmware>(board_feature, circle), "SN2");
  EXPECT_TRUE(says(message([&] { bench.port.open(); }), "the device is not attached"));
}

TEST(HidBoard, RefusesFeaturesWithoutWatchdog) {
  BoardFeature careless = board_feature;
  careless.watchdog = 0;
  Bench bench(std::make_shared<BoardFirmware>(careless, circle), "palpate_board");
  EXPECT_TRUE(says(message([&] { bench.port.open(); }), "watchdog"));
  EXPECT_EQ(bench.hid.open_devices(), 0);
}

TEST(HidBoard, RefusesAxesThatDiffer) {
  BoardFeature six = board_feature;
  six.axes = 6;
  Bench bench(std::make_shared<BoardFirmware>(six, circle), "palpate_board");
  EXPECT_TRUE(says(message([&] { bench.port.open(); }), "says 6 axes, the report descriptor has 3"));
}

TEST(HidBoard, FrozenNumbersAreNoNews) {
  Bench bench(std::make_shared<BoardFirmware>(board_feature, circle), "palpate_board");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  const DeviceState last = bench.state;
  bench.hid.freeze(true);
  // What was read ahead of the freeze may still come.
  int news = 0;
  for (int k = 0; k < 50; ++k) {
    news += bench.port.read(bench.state) == ReadResult::report ? 1 : 0;
  }
  EXPECT_LE(news, 1);
  EXPECT_LE(bench.state.sequence - last.sequence, 2U);
  EXPECT_GT(bench.port.dropped(), 20);
  bench.hid.freeze(false);
  EXPECT_EQ(bench.next(), ReadResult::report);
}

TEST(HidBoard, DamagedReportsAreDroppedAndCounted) {
  Bench bench(std::make_shared<BoardFirmware>(board_feature, circle), "palpate_board");
  bench.port.open();
  std::int64_t damaged = 0;
  bench.hid.on_read([&](std::int64_t k) {
    if (k % 10 != 3 && k % 10 != 7) return FakeFault::none;
    ++damaged;
    return k % 10 == 3 ? FakeFault::short_report : FakeFault::garbage;
  });
  std::uint32_t before = 0;
  while (before < 100) {
    ASSERT_NE(bench.port.read(bench.state), ReadResult::lost);
    if (bench.state.sequence == 0) continue;
    EXPECT_GE(bench.state.sequence, before);
    EXPECT_LT((bench.state.pose.position - circle(1e-3 * (bench.state.sequence - 1))).norm(), 1e-6);
    before = bench.state.sequence;
  }
  EXPECT_GT(damaged, 10);
  EXPECT_EQ(bench.port.dropped(), damaged);
}

TEST(HidBoard, GarbageAloneIsNothing) {
  Bench bench(std::make_shared<BoardFirmware>(board_feature, circle), "palpate_board");
  bench.port.open();
  bench.hid.on_read([](std::int64_t) { return FakeFault::short_report; });
  const DeviceState untouched = bench.state;
  for (int k = 0; k < 10; ++k) {
    EXPECT_EQ(bench.port.read(bench.state), ReadResult::nothing);
  }
  EXPECT_EQ(bench.state.arrived, untouched.arrived);
  EXPECT_EQ(bench.state.sequence, untouched.sequence);
}

TEST(HidBoard, StallsAreDrainedToTheNewest) {
  auto firmware = std::make_shared<BoardFirmware>(board_feature, circle);
  Bench bench(firmware, "palpate_board");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  bench.hid.on_read([](std::int64_t k) { return k == 0 ? FakeFault::stall_50ms : FakeFault::none; });
  ASSERT_EQ(bench.next(), ReadResult::report);  // the one that was held up, and all that came meanwhile
  EXPECT_GE(bench.state.sequence, 50U);
  EXPECT_GE(bench.state.sequence + 2, firmware->sequence());
  bench.hid.on_write([](std::int64_t) { return FakeFault::stall_5ms; });
  EXPECT_TRUE(bench.port.write(command(Vec3(1, 0, 0)), bench.state));
}

TEST(HidBoard, AReadErrorIsALoss) {
  Bench bench(std::make_shared<BoardFirmware>(board_feature, circle), "palpate_board");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  bench.hid.on_read([](std::int64_t) { return FakeFault::error; });
  EXPECT_EQ(bench.next(), ReadResult::lost);
  bench.hid.on_read({});
  EXPECT_EQ(bench.next(), ReadResult::lost);
  EXPECT_EQ(bench.hid.calls_after_error(), 0);
  bench.port.open();  // closes what is left
  EXPECT_EQ(bench.next(), ReadResult::report);
  EXPECT_EQ(bench.hid.open_devices(), 1);
}

TEST(HidBoard, AfterAFailingWriteTheWriterKeepsAwayAndTheWayOutStillTakesTheForce) {
  auto firmware = std::make_shared<BoardFirmware>(board_feature, circle);
  Bench bench(firmware, "palpate_board");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  ASSERT_TRUE(bench.port.write(command(Vec3(1, 0, 0)), bench.state));
  bench.hid.on_write([](std::int64_t k) { return k == 0 ? FakeFault::error : FakeFault::none; });
  EXPECT_FALSE(bench.port.write(command(Vec3(2, 0, 0)), bench.state));
  EXPECT_FALSE(bench.port.write(command(Vec3(3, 0, 0)), bench.state));
  EXPECT_EQ(bench.hid.calls_after_error(), 0);
  EXPECT_NEAR(firmware->forces().back().force.x(), 1.0, 1e-3);
  bench.port.close();
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
}

TEST(HidBoard, ReadsWhileItWrites) {
  // As in the loop: one thread reads, another one writes; for the thread sanitizer above all.
  auto firmware = std::make_shared<BoardFirmware>(board_feature, circle);
  Bench bench(firmware, "palpate_board");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  const DeviceState first = bench.state;
  std::thread writer([&] {
    for (int k = 0; k < 200; ++k) {
      EXPECT_TRUE(bench.port.write(command(Vec3(1, 2, 3)), first));
    }
  });
  for (int k = 0; k < 100; ++k) {
    EXPECT_EQ(bench.next(), ReadResult::report);
  }
  writer.join();
  EXPECT_EQ(firmware->forces().size(), 200U);
}

// --- joystick ---

PidConstants joystick() {
  return std::get<PidConstants>(find_profile("pid_joystick").profile.kind);
}

TEST(HidJoystick, ConversationForcesAndWayOut) {
  auto firmware = std::make_shared<JoystickFirmware>(
      joystick(), [](double t) { return Vec3(0.03 * std::sin(3.0 * t), -0.02 * std::cos(3.0 * t), 0); });
  firmware->slow = 3;
  Bench bench(firmware, "pid_joystick");
  bench.port.open();
  EXPECT_EQ(firmware->playing(), 2U);
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
  for (int tick = 0; tick < 100; ++tick) {
    ASSERT_EQ(bench.next(), ReadResult::report);
    const Vec3& place = bench.state.pose.position;
    EXPECT_NEAR(std::hypot(place.x() / 0.03, place.y() / 0.02), 1.0, 0.02);
    const Vec3 force(3.0 * place.x() / 0.03, -2.0, 5.0);
    ASSERT_TRUE(bench.port.write(command(force), bench.state));
    // A count of 255 is 10 N; the stick shows nothing along z.
    EXPECT_NEAR(firmware->forces().back().force.x(), force.x(), 0.05);
    EXPECT_NEAR(firmware->forces().back().force.y(), force.y(), 0.15);
    EXPECT_EQ(firmware->forces().back().force.z(), 0.0);
  }
  bench.port.close();
  EXPECT_EQ(firmware->playing(), 0U);
  EXPECT_EQ(firmware->forces().back().force, Vec3::Zero());
}

TEST(HidJoystick, EqualForcesAreNotRepeatedTooOften) {
  auto firmware = std::make_shared<JoystickFirmware>(joystick(), resting);
  Bench bench(firmware, "pid_joystick");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  const std::size_t before = firmware->outputs().size();
  const auto write = [&](const Vec3& force) {
    EXPECT_TRUE(bench.port.write(command(force), bench.state));
    return firmware->outputs().size() - before;
  };
  EXPECT_EQ(write(Vec3(1, 2, 0)), 2U);
  const std::int64_t sent = monotonic_now();
  std::size_t after = 2;
  for (int k = 0; k < 20; ++k) {
    after = write(Vec3(1, 2, 0));
  }
  if (monotonic_now() - sent < 100'000'000) {
    EXPECT_EQ(after, 2U);
  }
  EXPECT_GE(write(Vec3(1, 5, 0)), after + 1);  // y alone, unless 0.1 s have passed
  std::this_thread::sleep_for(std::chrono::milliseconds(110));
  after = firmware->outputs().size() - before;
  EXPECT_EQ(write(Vec3(1, 5, 0)), after + 2);
}

/// Moves for 0.15 s, then rests.
Vec3 come_to_rest(double t) {
  return {0.2 * std::min(t, 0.15), 0.0, 0.0};
}

TEST(HidJoystick, OneThatReportsChangesAndRestsIsToldOn) {
  auto firmware = std::make_shared<JoystickFirmware>(joystick(), come_to_rest);
  firmware->on_change = true;
  Bench bench(firmware, "pid_joystick");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  SilenceWatch silence({.most = 1e3, .fade_from = 0.1, .frozen = 0.2});
  SpeedLimit speed(0.6, 1e-3);
  double frozen_at = 0.0;
  DeviceState last = bench.state;
  while (firmware->time() < 0.15 || (frozen_at == 0.0 && firmware->time() < 5.0)) {
    ASSERT_EQ(bench.port.read(bench.state), ReadResult::report);
    ASSERT_GT(static_cast<std::int32_t>(bench.state.sequence - last.sequence), 0);
    last = bench.state;
    speed.see(bench.state);
    EXPECT_TRUE(silence.observe(bench.state, bench.state.arrived, 1.0));
    if (frozen_at == 0.0 && silence.frozen()) frozen_at = firmware->time();
  }
  EXPECT_GT(frozen_at, 0.35) << "it rests, and while a force is shown that must not last";
  EXPECT_LT(frozen_at, 5.0);
  EXPECT_EQ(bench.state.velocity, Vec3::Zero());
  EXPECT_NEAR(bench.state.pose.position.x(), 0.03, 5e-4);
  bench.hid.detach(bench.path);
  EXPECT_EQ(bench.port.read(bench.state), ReadResult::lost);
}

/// A stick that reports each 10 ms: between, its place is told again; its speed is from report to report.
TEST(HidJoystick, RepetitionsMakeNoSpeed) {
  const PidConstants constants = joystick();
  const auto stick = make_hid_joystick(
      constants, {}, find_pid_layout(parse_report_descriptor(bytes(side_winder_descriptor), ""), ""), "", 7);
  DeviceState state;
  EXPECT_FALSE(stick->tell(false, 1, state));
  SpeedLimit limit(1.0, 1e-3);
  double fastest = 0.0;
  for (int ms = 0; ms < 200; ++ms) {
    const bool reports = ms % 10 == 0;
    if (!reports && ms % 10 % 3 != 0) continue;
    if (reports) {
      // 0.4 m/s from the left stop, in counts of the descriptor.
      JoystickFirmware firmware(constants, [&](double) { return Vec3(-0.05 + 4e-4 * ms, 0.0, 0.0); });
      ASSERT_TRUE(stick->take(*firmware.input()));
    }
    ASSERT_TRUE(stick->tell(reports, 1'000'000'000 + 1'000'000LL * ms, state));
    state.arrived = 1'000'000'000 + 1'000'000LL * ms;
    limit.see(state);
    if (ms >= 10) fastest = std::max(fastest, limit.speed());
  }
  EXPECT_NEAR(fastest, 0.4, 0.02);
}

TEST(HidJoystick, NothingIsMadeUpForOneThatTakesNoWrites) {
  auto firmware = std::make_shared<JoystickFirmware>(joystick(), resting);
  firmware->on_change = true;
  Bench bench(firmware, "pid_joystick");
  bench.port.open();
  ASSERT_EQ(bench.next(), ReadResult::report);
  bench.hid.on_write([](std::int64_t) { return FakeFault::stall_50ms; });
  std::atomic<bool> stop = false;
  std::thread writer([&] {
    DeviceState state;
    for (int k = 1; !stop; ++k) EXPECT_TRUE(bench.port.write(command(Vec3(k % 2, 1, 0)), state));
  });
  int told = 0;
  int kept = 0;
  for (int k = 0; k < 200; ++k) {
    ++(bench.port.read(bench.state) == ReadResult::report ? told : kept);
  }
  stop = true;
  writer.join();
  // Each write, of one or two reports, lasts 50 or 100 ms: for the first 20 ms of it the place is told.
  EXPECT_GT(told, 5);
  EXPECT_GT(kept, 5);
}

TEST(HidJoystick, SaysWhatItDoesNotDo) {
  {
    auto firmware = std::make_shared<JoystickFirmware>(joystick(), resting);
    firmware->full = true;
    Bench bench(firmware, "pid_joystick");
    EXPECT_TRUE(says(message([&] { bench.port.open(); }), "has no room for another effect"));
    EXPECT_EQ(bench.hid.open_devices(), 0);
  }
  {
    auto firmware = std::make_shared<JoystickFirmware>(joystick(), resting);
    firmware->has_loaded = false;
    Bench bench(firmware, "pid_joystick");
    EXPECT_TRUE(says(message([&] { bench.port.open(); }), "does not answer to Block Load"));
  }
}

// --- SpaceMouse ---

TEST(HidSpaceMouse, IntegratesAndGoesOnTellingWhileItIsStill) {
  // Full to the right for 0.2 s, then let go.
  auto firmware = std::make_shared<SpaceMouseFirmware>([](double t) {
    return std::array<std::int16_t, 6>{static_cast<std::int16_t>(t < 0.2 ? 350 : 0), 0, 0, 0, 0, 0};
  });
  Bench bench(firmware, "spacemouse");
  bench.port.open();
  EXPECT_EQ(bench.port.limits().max_force, 0.0);
  EXPECT_EQ(bench.port.limits().max_torque, 0.0);
  EXPECT_EQ(bench.port.limits().workspace_radius, 0.1);
  ASSERT_EQ(bench.port.read(bench.state), ReadResult::report);
  double fastest = 0.0;
  const auto go_on = [&](double until) {
    while (firmware->time() < until) {
      const DeviceState last = bench.state;
      ASSERT_EQ(bench.port.read(bench.state), ReadResult::report);
      EXPECT_EQ(bench.state.sequence, last.sequence + 1);
      // Places are the integral of speeds, over 20 ms at most where the reader was held up.
      const double passed = std::min(0.02, 1e-9 * static_cast<double>(bench.state.arrived - last.arrived));
      EXPECT_LT((bench.state.pose.position - last.pose.position - passed * bench.state.velocity).norm(),
                1e-12);
      fastest = std::max(fastest, bench.state.velocity.x());
    }
  };
  go_on(0.4);
  EXPECT_NEAR(fastest, 0.1, 1e-12);
  EXPECT_EQ(bench.state.velocity, Vec3::Zero());
  EXPECT_GT(bench.state.pose.position.x(), 0.001);
  const Vec3 rest = bench.state.pose.position;
  const std::uint32_t silent = bench.state.sequence;
  go_on(0.5);
  EXPECT_EQ(bench.state.pose.position, rest);
  EXPECT_GT(bench.state.sequence, silent + 5);
  EXPECT_TRUE(bench.port.write(command(Vec3(1, 1, 1)), bench.state));
  EXPECT_TRUE(firmware->outputs().empty());
  bench.hid.detach(bench.path);
  EXPECT_EQ(bench.port.read(bench.state), ReadResult::lost);
}

// --- choosing ---

struct Shelf {
  FakeHid hid;
  std::string arm_path, board_path;

  void add_arm() { arm_path = hid.attach(std::make_shared<WoodenHapticsFirmware>(arm(), resting), "W1"); }
  void add_board(const std::string& serial) {
    board_path = hid.attach(std::make_shared<BoardFirmware>(board_feature, resting), serial);
  }
  [[nodiscard]] HidChoice choose(const std::string& text) const {
    return choose_hid_device(attached_devices(hid.sys()), known_profiles(), text);
  }
  [[nodiscard]] std::string refusal(const std::string& text) const {
    return message([&] { static_cast<void>(choose(text)); });
  }
};

/// A keyboard: nothing fits it.
struct Keyboard : Firmware {
  Keyboard()
      : Firmware(0x046A, 0x0011, "Keys",
                 bytes("05 01 09 06 A1 01 75 08 95 08 15 00 25 65 05 07 19 00 29 65 81 00 C0")) {}
  std::optional<Bytes> do_input() override { return std::nullopt; }
};

TEST(HidChoice, BuiltInProfilesAreTheFiles) {
  const auto profiles = known_profiles();
  ASSERT_EQ(profiles.size(), 6U);
  for (const NamedProfile& profile : profiles) {
    EXPECT_EQ(profile.profile.name,
              read_device_profile(
                  palpate::test::source_file("runtime/devices/hid/profiles/" + profile.key + ".toml"))
                  .name);
  }
  EXPECT_TRUE(says(message([] { static_cast<void>(find_profile("no such")); }), "aluhaptics, palpate_board"));
  EXPECT_EQ(
      find_profile(palpate::test::source_file("runtime/devices/hid/profiles/polhem_v1.toml")).profile.name,
      "Polhem v1");
}

TEST(HidChoice, NothingIsAttached) {
  const Shelf shelf;
  EXPECT_TRUE(says(shelf.refusal(""), "no HID device is attached"));
  EXPECT_TRUE(says(shelf.refusal(""), "/sys/class/hidraw"));
}

TEST(HidChoice, TheOnlyOneThatAProfileFits) {
  Shelf shelf;
  shelf.hid.attach(std::make_shared<Keyboard>());
  shelf.add_board("B1");
  EXPECT_EQ(shelf.choose("").device.path, shelf.board_path);
  EXPECT_EQ(shelf.choose("").profile.name, "Home-made board");
}

TEST(HidChoice, UnknownDevicesShowTheirReports) {
  Shelf shelf;
  shelf.hid.attach(std::make_shared<Keyboard>());
  const std::string text = shelf.refusal("046a:0011");
  EXPECT_TRUE(says(text, "no profile fits this device"));
  EXPECT_TRUE(says(text, "input report 0: 8 x 8 bit from bit 0, 0 to 101, usage 0007:00 0007:01"));
  EXPECT_TRUE(says(text, "05 01 09 06 a1 01 75 08"));
  EXPECT_TRUE(says(text, "--profile FILE"));
}

TEST(HidChoice, SeveralDevicesAreListed) {
  Shelf shelf;
  shelf.add_board("B1");
  const std::string first = shelf.board_path;
  shelf.add_board("B2");
  const std::string text = shelf.refusal("");
  EXPECT_TRUE(says(text, "several devices"));
  EXPECT_TRUE(says(text, "serial B1"));
  EXPECT_TRUE(says(text, "serial B2"));
  EXPECT_TRUE(says(shelf.refusal("CAFE:4001"), "several devices"));
  EXPECT_EQ(shelf.choose("B2").device.path, shelf.board_path);
  EXPECT_EQ(shelf.choose(first).device.serial, "B1");
  EXPECT_TRUE(says(shelf.refusal("B3"), "no such HID device"));
}

TEST(HidChoice, SeveralProfilesAreNamed) {
  Shelf shelf;
  shelf.add_arm();
  const std::string text = shelf.refusal("1234:0006");
  EXPECT_TRUE(says(text, "several profiles fit"));
  EXPECT_TRUE(says(text, "--profile polhem_v1  Polhem v1"));
  EXPECT_TRUE(says(text, "--profile aluhaptics"));
  const auto choice = choose_hid_device(attached_devices(shelf.hid.sys()), {find_profile("polhem_v1")}, "W1");
  EXPECT_EQ(choice.profile.name, "Polhem v1");
  EXPECT_TRUE(says(message([&] {
                     static_cast<void>(choose_hid_device(attached_devices(shelf.hid.sys()),
                                                         {find_profile("spacemouse")}, ""));
                   }),
                   "the profile spacemouse does not fit this device"));
}

TEST(HidChoice, WithoutAccessTheRuleIsSaid) {
  Shelf shelf;
  shelf.add_board("B1");
  const bool is_root = geteuid() == 0;
  std::filesystem::permissions(shelf.board_path, std::filesystem::perms::none);
  std::filesystem::permissions(shelf.hid.sys(), std::filesystem::perms::all);
  constexpr uid_t nobody = 65534;
  if (is_root) {
    ASSERT_EQ(seteuid(nobody), 0);
  }
  const std::string text = shelf.refusal("");
  if (is_root) {
    ASSERT_EQ(seteuid(0), 0);
  }
  EXPECT_TRUE(says(text, "you may not open it"));
  EXPECT_TRUE(
      says(text, R"(KERNEL=="hidraw*", ATTRS{idVendor}=="cafe", ATTRS{idProduct}=="4001", TAG+="uaccess")"));
  EXPECT_TRUE(says(text, "/etc/udev/rules.d/70-palpate.rules"));
  EXPECT_TRUE(says(text, "udevadm control --reload"));
}

TEST(HidChoice, OtherReasonsThanRights) {
  AttachedDevice device;
  device.path = "/dev/hidraw7";
  device.access = EBUSY;
  EXPECT_EQ(access_problem(device).what, "another program has it");
  device.access = ENOENT;
  EXPECT_TRUE(says(access_problem(device).hint, "--device /dev/hidraw7"));
  device.access = EPERM;
  EXPECT_TRUE(says(access_problem(device).what, "container"));
  device.access = EIO;
  EXPECT_TRUE(says(access_problem(device).what, "Input/output error"));
}

}  // namespace
}  // namespace palpate::fake_hid_test
