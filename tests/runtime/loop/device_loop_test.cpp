// The loop with a device that is felt: workspace, safety, replay, settings.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "runtime/app/script_device.h"
#include "runtime/loop/loop.h"
#include "runtime/loop/replay_device.h"
#include "runtime/loop/settings.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/files/recorded_ticks.h"

namespace palpate::device_loop_test {
namespace {

constexpr std::int64_t millisecond = 1'000'000;

/// A device whose state and events are functions of the tick; remembers what it was shown.
class MadeUpDevice : public Device {
 public:
  explicit MadeUpDevice(std::function<DeviceNews(const TickTime&)> says) : says_(std::move(says)) {}
  DeviceNews poll(const TickTime& tick) noexcept override { return says_(tick); }
  void display(const DeviceCommand& command, const DeviceState& state, std::int64_t) noexcept override {
    shown.push_back(command);
    answered.push_back(state.sequence);
  }

  std::vector<DeviceCommand> shown;
  std::vector<std::uint32_t> answered;

 private:
  std::function<DeviceNews(const TickTime&)> says_;
};

/// Goes down from 1.05 m to 0.98 m in the first 200 ms and stays: on the unit body, whose top is at 1 m. A
/// trace of tremor, so that it is not taken for frozen.
DeviceState pressing(const TickTime& tick) {
  const double t = static_cast<double>(tick.number) * 1e-3;
  const double z = 1.05 - 0.35 * std::min(t, 0.2) + 1e-6 * std::sin(60.0 * t);
  return {.pose = {.position = {0.52, 0.5, z}},
          .velocity = {0.0, 0.0, t < 0.2 ? -0.35 : 0.0},
          .arrived = tick.begun,
          .sequence = static_cast<std::uint32_t>(tick.number + 1)};
}

class DeviceLoop : public testing::Test {
 protected:
  LoopReport run(Device& device, std::int64_t ticks, Safety* safety,
                 const Workspace& workspace = Workspace()) {
    return run_loop(
        {.body = body_, .state = state_, .device = device, .workspace = workspace, .safety = safety},
        {.ticks = ticks, .fast = true}, stop_);
  }

  static constexpr Tool ball = {.radius = 0.01};
  Body body_{test::unit_model(3, 4, Scope::surface, Precision::double_precision)};
  State state_{body_, {.tools = {ball}}};
  std::atomic<bool> stop_ = false;
};

TEST_F(DeviceLoop, ShowsWhatSafetyLetsThrough) {
  MadeUpDevice device([](const TickTime& tick) { return DeviceNews{.state = pressing(tick)}; });
  SafetyOptions options;
  options.ramp = 0.1;
  options.max_force = 0.002;
  options.max_force_rate = 0.1;
  options.small_force = 1e-6;
  Safety safety(options);
  const LoopReport report = run(device, 500, &safety);
  ASSERT_EQ(device.shown.size(), 501U) << "and once no force, at the end";
  EXPECT_GT(report.largest_force, 2.0 * options.max_force) << "the clamp has something to do";
  EXPECT_DOUBLE_EQ(report.largest_shown, options.max_force);
  Vec3 before = Vec3::Zero();
  for (std::size_t k = 0; k < 500; ++k) {
    const Vec3& force = device.shown[k].wrench.force;
    ASSERT_LE(force.norm(), options.max_force * (1.0 + 1e-12));
    ASSERT_LE((force - before).norm(), 1e-3 * options.max_force_rate * (1.0 + 1e-12));
    before = force;
  }
  EXPECT_NEAR(before.norm(), options.max_force, 1e-12);
  EXPECT_TRUE(device.shown.back().wrench.force.isZero(0.0));
  for (std::size_t k = 0; k < 500; ++k) ASSERT_EQ(device.answered[k], k + 1);
  EXPECT_EQ(safety.phase(), SafetyPhase::shut_down);
}

TEST_F(DeviceLoop, WithoutSafetyShowsWhatWasComputed) {
  MadeUpDevice device([](const TickTime& tick) { return DeviceNews{.state = pressing(tick)}; });
  const LoopReport report = run(device, 500, nullptr);
  EXPECT_EQ(report.largest_shown, report.largest_force);
  EXPECT_EQ(device.shown[499].wrench.force, state_.tools[0].wrench.force);
  EXPECT_EQ(device.shown[499].local.stiffness, state_.tools[0].local.stiffness);
}

// The same motion of the body's side by another device frame: forces turn and scale with it.
TEST_F(DeviceLoop, MapsTheWorkspaceBothWays) {
  MadeUpDevice straight([](const TickTime& tick) { return DeviceNews{.state = pressing(tick)}; });
  run(straight, 400, nullptr);
  const Workspace workspace({.device_origin = Vec3::Zero(),
                             .body_origin = Vec3(0.52, 0.5, 1.05),
                             .axes = parse_axes("x,-z,y"),
                             .motion_scale = 2.0,
                             .force_scale = 3.0});
  MadeUpDevice turned([](const TickTime& tick) {
    DeviceNews news{.state = pressing(tick)};
    // Down in the body, -z, is the device's +y; half as far.
    news.state.pose.position = Vec3(0.0, 0.5 * (1.05 - news.state.pose.position.z()), 0.0);
    news.state.velocity = Vec3(0.0, -0.5 * news.state.velocity.z(), 0.0);
    return news;
  });
  State again(body_, {.tools = {ball}});
  std::swap(state_, again);
  run(turned, 400, nullptr, workspace);
  const Vec3 force = straight.shown[399].wrench.force;
  ASSERT_GT(force.z(), 1e-3);
  EXPECT_LT((turned.shown[399].wrench.force - 3.0 * Vec3(force.x(), -force.z(), force.y())).norm(),
            1e-9 * force.norm());
}

TEST_F(DeviceLoop, TellsSafetyWhatBefellTheDevice) {
  // Lost in contact at 300, back at 400, in contact until it lifts at 500; acknowledged faults elsewhere.
  MadeUpDevice device([](const TickTime& tick) {
    DeviceNews news{.state = pressing(tick)};
    if (tick.number >= 500) news.state.pose.position.z() += 0.2e-3 * static_cast<double>(tick.number - 500);
    if (tick.number == 300) news.events = DeviceEvent::lost;
    if (tick.number == 400) news.events = DeviceEvent::opened_again;
    if (tick.number == 1500) news.events = DeviceEvent::input_lost;
    if (tick.number == 1600) news.events = DeviceEvent::acknowledged;
    return news;
  });
  SafetyOptions options;
  options.ramp = 0.05;
  options.small_force = 1e-6;
  options.max_damping = 0.0;
  Safety safety(options);
  const LoopReport report = run(device, 1700, &safety);
  const auto force = [&](std::size_t tick) { return device.shown[tick].wrench.force.norm(); };
  EXPECT_GT(force(299), 1e-4);
  for (std::size_t k = 300; k < 500; ++k) ASSERT_EQ(force(k), 0.0) << k << ": in contact nothing may begin";
  EXPECT_EQ(report.opened_again, 1);
  EXPECT_EQ(report.faults[static_cast<std::size_t>(Fault::device_lost)], 1);
  EXPECT_EQ(report.faults[static_cast<std::size_t>(Fault::input_lost)], 1);
  EXPECT_EQ(report.faults[static_cast<std::size_t>(Fault::device_silent)], 0);
}

TEST_F(DeviceLoop, LateTicksTakeTheForceAway) {
  // A real clock would say so: here a "replay" does.
  MadeUpDevice device([](const TickTime& tick) {
    DeviceNews news{.state = pressing(tick)};
    const bool late = tick.number >= 300 && tick.number < 330;
    news.begun = tick.due + (late ? millisecond : 0);
    news.state.arrived = *news.begun;
    return news;
  });
  SafetyOptions options;
  options.ramp = 0.05;
  options.small_force = 1e-6;
  Safety safety(options);
  const LoopReport report = run(device, 400, &safety);
  EXPECT_EQ(report.faults[static_cast<std::size_t>(Fault::deadline_missed)], 1);
  EXPECT_TRUE(device.shown[399].wrench.force.isZero(0.0));
  EXPECT_FALSE(device.shown[299].wrench.force.isZero(0.0));
}

class Replay : public DeviceLoop {
 protected:
  Replay() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directory(folder_);
  }
  ~Replay() override { std::filesystem::remove_all(folder_); }

  std::vector<TickRecord> record(Device& device, Safety& safety, std::int64_t ticks, bool fast) {
    State state(body_, {.tools = {ball}});
    Recorder recorder(folder_ / "a.mcap", {"box.palpate.hdf", "0123", "made up", 1000, "tool=sphere:0.01\n"});
    run_loop({.body = body_, .state = state, .device = device, .safety = &safety, .recorder = &recorder},
             {.ticks = ticks, .fast = fast}, stop_);
    recorder.finish();
    return test::ticks_of(folder_ / "a.mcap");
  }

  LoopReport replay(ReplayDevice& device, const SafetyOptions& options, const Tool& tool = ball) {
    State state(body_, {.tools = {tool}});
    Safety safety(options);
    return run_loop({.body = body_, .state = state, .device = device, .safety = &safety, .replayed = &device},
                    {.ticks = device.ticks(), .fast = true}, stop_);
  }
  ReplayDifference replay(const SafetyOptions& options, const Tool& tool = ball) {
    const RecordingFile session(folder_ / "a.mcap");
    ReplayDevice device(session);
    return replay(device, options, tool).replay;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("palpate_replay." + std::to_string(getpid()));
};

// On the real clock, with whatever lateness this machine has, a re-plug and a fault.
TEST_F(Replay, IsTheSessionBitByBit) {
  MadeUpDevice device([](const TickTime& tick) {
    DeviceNews news{.state = pressing(tick)};
    if (tick.number == 350) news.events = DeviceEvent::lost;
    if (tick.number == 360) news.events = DeviceEvent::opened_again;
    return news;
  });
  SafetyOptions options;
  options.ramp = 0.05;
  options.small_force = 1.0;
  options.deadline.most = 1e6;
  Safety safety(options);
  const std::vector<TickRecord> session = record(device, safety, 450, false);
  ASSERT_EQ(session.size(), 450U);
  for (std::size_t k = 0; k < 450; ++k) {
    ASSERT_EQ(Vec3(session[k].shown_force), device.shown[k].wrench.force);
    ASSERT_GE(session[k].begun_ns, static_cast<std::int64_t>(k) * millisecond);
  }
  EXPECT_EQ(session[355].fault, static_cast<std::uint8_t>(Fault::device_lost));
  const ReplayDifference same = replay(options);
  EXPECT_EQ(same.ticks, 450);
  EXPECT_EQ(same.different, 0);
  EXPECT_EQ(same.largest, 0.0);
  EXPECT_EQ(same.first_tick, -1);

  options.ramp = 0.1;
  const ReplayDifference other_ramp = replay(options);
  EXPECT_GT(other_ramp.different, 20);
  EXPECT_GT(other_ramp.largest, 0.0);
  options.ramp = 0.05;
  EXPECT_GT(replay(options, {.radius = 0.012}).different, 100);
}

// What was proved may be cut off later, or its disk may fail.
TEST_F(Replay, IsOverWhereTheSessionCannotBeReadAnyMore) {
  MadeUpDevice device([](const TickTime& tick) { return DeviceNews{.state = pressing(tick)}; });
  const SafetyOptions options;
  Safety safety(options);
  record(device, safety, 2000, true);  // a chunk each 500
  const RecordingFile session(folder_ / "a.mcap");
  ReplayDevice cut(session);
  std::filesystem::resize_file(session.path(), std::filesystem::file_size(session.path()) / 2);
  const LoopReport report = replay(cut, options);
  EXPECT_GE(report.ticks, 500);
  EXPECT_LT(report.ticks, 1500);
  EXPECT_EQ(report.replay.different, 0);
  EXPECT_TRUE(cut.failed());
  EXPECT_THROW(cut.check(), Error);
}

// Without the clock, so that the ramp ends before the tool touches however busy the machine is.
TEST_F(Replay, NamesTheFirstTickAndFieldThatDiffer) {
  MadeUpDevice device([](const TickTime& tick) { return DeviceNews{.state = pressing(tick)}; });
  SafetyOptions options;
  options.ramp = 0.05;
  options.small_force = 1.0;
  options.deadline.most = 1e6;
  Safety safety(options);
  const std::vector<TickRecord> session = record(device, safety, 450, true);
  options.ramp = 0.1;
  const ReplayDifference other_ramp = replay(options);
  EXPECT_STREQ(other_ramp.first_field, "phase");  // where the session's ramp ended
  ASSERT_GT(other_ramp.first_tick, 0);
  const auto first = static_cast<std::size_t>(other_ramp.first_tick);
  EXPECT_NE(session[first].phase, session[first - 1].phase);
  options.ramp = 0.05;
  const ReplayDifference other_tool = replay(options, {.radius = 0.012});
  EXPECT_STREQ(other_tool.first_field, "contacts")
      << "a larger tool touches earlier, and is where the device is";
}

TEST(Settings, ReadBackAsTheyWere) {
  Settings settings;
  settings.tool = {.radius = 0.1 / 3.0, .length = 0.2 / 7.0};
  settings.tool.coupling_stiffness = 1000.0 / 3.0;
  settings.origin = Vec3(0.1, -1.0 / 3.0, 1e-17);
  settings.axes = "-y,x,z";
  settings.overlay = {.kind = OverlayKind::uniform, .refinement = 3, .rings = 1};
  settings.safety = SafetyOptions{};
  settings.safety->max_force = 10.0 / 3.0;
  settings.safety->buzz.flips = 7;
  settings.safety->silence.most = 0.1 / 3.0;
  settings.load_scale = 0.1 / 3.0;
  settings.stiffness_scale = 20.0 / 3.0;
  const std::string text = to_text(settings);
  const auto value = [&](const std::string& name) {
    const std::size_t begin = ("\n" + text).find("\n" + name + "=") + name.size() + 1;
    return text.substr(begin, text.find('\n', begin) - begin);
  };
  EXPECT_EQ(parse_shape(value("tool")).radius, settings.tool.radius);
  EXPECT_EQ(parse_shape(value("tool")).length, settings.tool.length);
  EXPECT_EQ(std::stod(value("coupling")), settings.tool.coupling_stiffness);
  EXPECT_EQ(value("axes"), "-y,x,z");
  EXPECT_EQ(parse_overlay(value("overlay"), "").rings, 1);
  const SafetyOptions safety = parse_safety(value("safety"));
  EXPECT_EQ(safety.max_force, settings.safety->max_force);
  EXPECT_EQ(safety.buzz.flips, 7);
  EXPECT_EQ(safety.silence.most, settings.safety->silence.most);
  EXPECT_EQ(safety.ramp, SafetyOptions{}.ramp);
  EXPECT_EQ(text.find("friction"), std::string::npos) << "what was not said is not said";
  const Settings again = read_settings(split_settings(text + "later=1\n"));
  EXPECT_EQ(to_text(again), text);
  EXPECT_EQ(again.load_scale, settings.load_scale);
  EXPECT_EQ(again.stiffness_scale, settings.stiffness_scale);
}

TEST(Settings, AxesAreRotations) {
  const Mat3 turned = parse_axes("x,-z,y").toRotationMatrix();
  EXPECT_LT((turned * Vec3::UnitX() - Vec3::UnitX()).norm(), 1e-15);
  EXPECT_LT((turned * Vec3::UnitY() + Vec3::UnitZ()).norm(), 1e-15);
  EXPECT_LT((turned * Vec3::UnitZ() - Vec3::UnitY()).norm(), 1e-15);
  EXPECT_EQ(parse_axes("x,y,z").coeffs(), Eigen::Quaterniond::Identity().coeffs());
  for (const char* wrong : {"x,y,-z", "x,x,z", "x,y", "x,y,w", "", "x,y,z,x", "1,2,3", "--x,y,z"})
    EXPECT_THROW(static_cast<void>(parse_axes(wrong)), Error) << wrong;
}

TEST(Settings, RefusesBoundsThatItDoesNotKnow) {
  EXPECT_EQ(parse_safety("max_force=5,ramp=0").max_force, 5.0);
  EXPECT_EQ(parse_safety("default").max_force, SafetyOptions{}.max_force);
  for (const char* wrong :
       {"max_farce=5", "max_force", "max_force=-1", "max_force=nan", "=3", "", "ramp=1;2"})
    EXPECT_THROW(static_cast<void>(parse_safety(wrong)), Error) << wrong;
}

// Each name means its own number; told by 30 different ones.
TEST(Settings, BoundsHaveTheirNames) {
  SafetyOptions o;
  const std::vector<std::pair<const char*, double*>> names = {{"max_force", &o.max_force},
                                                              {"max_torque", &o.max_torque},
                                                              {"max_force_rate", &o.max_force_rate},
                                                              {"max_torque_rate", &o.max_torque_rate},
                                                              {"max_stiffness", &o.max_stiffness},
                                                              {"max_damping", &o.max_damping},
                                                              {"max_speed", &o.max_speed},
                                                              {"ramp", &o.ramp},
                                                              {"small_force", &o.small_force},
                                                              {"calm_time", &o.calm_time},
                                                              {"late", &o.deadline.tolerance},
                                                              {"late_fade", &o.deadline.fade},
                                                              {"late_recovery", &o.deadline.recovery},
                                                              {"most_late", &o.deadline.most},
                                                              {"forgiveness", &o.deadline.forgiveness},
                                                              {"silence", &o.silence.most},
                                                              {"silence_fade", &o.silence.fade_from},
                                                              {"frozen", &o.silence.frozen},
                                                              {"frozen_force", &o.silence.frozen_force},
                                                              {"stale", &o.stale.fresh},
                                                              {"stale_life", &o.stale.time_to_live},
                                                              {"stale_fade", &o.stale.fade},
                                                              {"stale_damping", &o.stale.damping},
                                                              {"buzz_speed", &o.buzz.speed},
                                                              {"buzz_force", &o.buzz.force},
                                                              {"buzz_mean", &o.buzz.mean_time},
                                                              {"buzz_window", &o.buzz.window},
                                                              {"buzz_fade", &o.buzz.fade},
                                                              {"buzz_recovery", &o.buzz.recovery}};
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k)
    text += std::string(k > 0 ? "," : "") + names[k].first + "=" + std::to_string(100 + k);
  o = parse_safety(text);
  for (std::size_t k = 0; k < names.size(); ++k)
    EXPECT_EQ(*names[k].second, 100.0 + static_cast<double>(k)) << names[k].first;
}

TEST(Settings, FrictionMayBeZeroAndAStiffnessMayNot) {
  EXPECT_EQ(read_settings({{"friction", "0"}}).tool.friction, 0.0);
  EXPECT_EQ(read_settings({{"friction", "0.3"}}).tool.friction, 0.3);
  for (const char* wrong : {"-0.1", "nan", "inf", "", "x"})
    EXPECT_THROW(static_cast<void>(read_settings({{"friction", wrong}})), Error) << wrong;
  EXPECT_EQ(read_settings({{"coupling", "250"}}).tool.coupling_stiffness, 250.0);
  for (const char* wrong : {"0", "-1", "nan", ""})
    EXPECT_THROW(static_cast<void>(read_settings({{"coupling", wrong}})), Error) << wrong;
}

TEST(ReplayDifference, IsOfAnyBitOfAnyForce) {
  TickRecord then{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto x = static_cast<double>(axis);
    then.force[axis] = 1.0 + x;
    then.torque[axis] = 4.0 + x;
    then.shown_force[axis] = 7.0 + x;
    then.shown_torque[axis] = 10.0 + x;
  }
  ReplayDifference difference;
  compare(then, then, difference);
  EXPECT_EQ(difference.ticks, 1);
  EXPECT_EQ(difference.different, 0);
  std::int64_t different = 0;
  for (const auto member :
       {&TickRecord::force, &TickRecord::torque, &TickRecord::shown_force, &TickRecord::shown_torque}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      TickRecord now = then;
      (now.*member)[axis] = std::nextafter((now.*member)[axis], 100.0);
      compare(now, then, difference);
      EXPECT_EQ(difference.different, ++different) << "component " << axis;
    }
  }
  EXPECT_EQ(difference.ticks, 13);
}

TEST(Monitor, DrawsHowDurationsAreSpread) {
  TimeHistogram histogram;
  EXPECT_EQ(histogram_bars(histogram), "············");
  histogram.add(500);                                     // below 1 us
  for (int k = 0; k < 3; ++k) histogram.add(3'000);       // 2 to 4 us
  for (int k = 0; k < 1000; ++k) histogram.add(600'000);  // 512 us to 1.024 ms
  histogram.add(50'000'000);
  EXPECT_EQ(histogram_bars(histogram), "▁·▂·······█▁");
}

}  // namespace
}  // namespace palpate::device_loop_test
