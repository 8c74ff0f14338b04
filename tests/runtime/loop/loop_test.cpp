#include "runtime/loop/loop.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.h"
#include "formats/recording.h"
#include "runtime/app/script_device.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/files/recorded_ticks.h"

namespace palpate::loop_test {
namespace {

const char* const pull =
    "t,x,y,z,grab\n0,0.5,0.5,1.5,1\n0.1,0.5,0.5,1,1\n0.2,0.5,0.5,0.9,1\n0.3,0.5,0.5,1.0,0\n";
const char* const slide =
    "t,x,y,z,qw,qx,qy,qz,grab\n0,0.4,0.4,1.4,1,0,0,0,0\n0.1,0.4,0.4,1.1,1,0,0,0,0\n"
    "0.3,0.6,0.5,1.1,0.9,0.1,0,0.1,1\n0.4,0.7,0.5,1.4,1,0,0,0,0\n";

/// A tilted finger that hangs on springs, so that it is not where the device is.
const Tool finger = {.radius = 0.15,
                     .length = 0.3,
                     .coupling_stiffness = 1.0,
                     .coupling_torsion = 1.0,
                     .reach = 0.1,
                     .friction = 0.3};

const SessionInfo session_info = {"box.palpate.hdf", "0123", "script:box.csv", 1000, ""};

LoopReport run(const Body& body, State& state, ScriptDevice device, bool fast, const std::atomic<bool>& stop,
               Recorder* recorder = nullptr) {
  return run_loop({.body = body, .state = state, .device = device, .recorder = recorder},
                  {.ticks = device.ticks(), .fast = fast}, stop);
}

class Loop : public testing::Test {
 protected:
  Body body_{test::unit_model(3, 4, Scope::surface, Precision::double_precision)};
  State state_{body_, {.tools = {{.hand_over = std::numeric_limits<double>::infinity(), .reach = 0.012}}}};
  std::atomic<bool> stop_ = false;
};

TEST_F(Loop, StepsThroughTheScriptAndReports) {
  ScriptDevice device = ScriptDevice::parse(pull, "pull.csv");
  const LoopReport report = run(body_, state_, device, true, stop_);
  EXPECT_EQ(report.ticks, 301);
  EXPECT_EQ(state_.ticks, 301);
  EXPECT_FALSE(report.interrupted);
  EXPECT_EQ(report.deadline_misses, 0);
  EXPECT_EQ(report.ticks_begun_inside, 0);
  // In reach from 1.012 m down, that is after 0.488 of the 0.5 m in 0.1 s: where tick 98 leaves the tool, so
  // that it is held in ticks 99 to 299.
  EXPECT_EQ(report.status_ticks[0], 99) << status_names[0].second;
  EXPECT_EQ(report.ticks_in_contact, 201);
  EXPECT_EQ(report.most_contacts, 1);
  const Index top = body_.nearest_surface_node(Vec3(0.5, 0.5, 1.0)).node;
  const auto force = [&](double tick) {
    const Vec3 motion(0.0, 0.0, (device.pose(tick / 1000.0).position - device.pose(0.098).position).z());
    return (body_.greens().block(top, top).inverse() * motion).norm();
  };
  EXPECT_DOUBLE_EQ(report.largest_force_time, 0.2);
  EXPECT_NEAR(report.largest_force, force(200), 1e-7 * force(200));
  EXPECT_DOUBLE_EQ(report.largest_jump_time, 0.3) << "where the button is let go";
  EXPECT_NEAR(report.largest_jump, force(299), 1e-7 * force(200));
  EXPECT_GT(report.compute.worst(), 0);
}

TEST_F(Loop, ReportsTheLargestOfWhatEachTickGave) {
  ScriptDevice device = ScriptDevice::parse(slide, "slide.csv");
  State state(body_, {.tools = {finger}});
  State again = state;
  const LoopReport report = run(body_, state, device, true, stop_);

  std::int64_t in_contact = 0;
  Index most = 0;
  std::vector<Vec3> forces = {Vec3::Zero()};
  for (int tick = 0; tick <= 400; ++tick) {
    step(body_, again, device.pose(tick / 1000.0));
    const auto& contacts = again.contacts();
    const auto closed = std::count_if(contacts.begin(), contacts.end(), [](const ContactPoint& contact) {
      return contact.force != Vec3::Zero();
    });
    in_contact += closed > 0 ? 1 : 0;
    most = std::max(most, static_cast<Index>(closed));
    forces.push_back(again.tools[0].wrench.force);
  }
  EXPECT_GT(in_contact, 150);
  EXPECT_EQ(report.ticks_in_contact, in_contact);
  EXPECT_GT(most, 1);
  EXPECT_EQ(report.most_contacts, most);
  const auto largest_at = [&](double time) { return static_cast<std::size_t>(std::lround(1e3 * time)) + 1; };
  const std::size_t at = largest_at(report.largest_force_time);
  const std::size_t jump = largest_at(report.largest_jump_time);
  EXPECT_DOUBLE_EQ(report.largest_force, forces[at].norm());
  EXPECT_DOUBLE_EQ(report.largest_jump, (forces[jump] - forces[jump - 1]).norm());
  for (std::size_t k = 1; k < forces.size(); ++k) {
    ASSERT_LE(forces[k].norm(), 1.000001 * report.largest_force);
    ASSERT_LE((forces[k] - forces[k - 1]).norm(), 1.000001 * report.largest_jump);
  }
}

TEST_F(Loop, TellsHowLongTheToolWasInsideAtFirst) {
  // At 0.9 + 0.0021 k: inside in ticks 0 to 47. It comes back to touch.
  const char* const rows = "t,x,y,z\n0,0.52,0.5,0.9\n0.1,0.52,0.5,1.11\n0.2,0.52,0.5,0.95\n";
  const LoopReport report = run(body_, state_, ScriptDevice::parse(rows, "inside.csv"), true, stop_);
  EXPECT_EQ(report.ticks_begun_inside, 48);
  EXPECT_GT(report.ticks_in_contact, 20);
  EXPECT_LT(report.ticks_in_contact, 40);
}

TEST_F(Loop, KeepsTheClockWhenItIsReal) {
  ScriptDevice device = ScriptDevice::parse("t,x,y,z\n0,0.5,0.5,1\n0.05,0.5,0.5,0.9\n", "short.csv");
  timespec begin{};
  timespec end{};
  clock_gettime(CLOCK_MONOTONIC, &begin);
  const LoopReport report = run(body_, state_, device, false, stop_);
  clock_gettime(CLOCK_MONOTONIC, &end);
  const double seconds = static_cast<double>(end.tv_sec - begin.tv_sec) +
                         1e-9 * static_cast<double>(end.tv_nsec - begin.tv_nsec);
  EXPECT_EQ(report.ticks, 51);
  EXPECT_GE(seconds, 0.05) << "no tick may come before its time";
  EXPECT_GT(report.lateness.worst(), 0);
}

TEST_F(Loop, StopsWhenAsked) {
  stop_ = true;
  const LoopReport report = run(body_, state_, ScriptDevice::parse(pull, "pull.csv"), false, stop_);
  EXPECT_TRUE(report.interrupted);
  EXPECT_EQ(report.ticks, 0);
}

/// A device that asks the loop for something in some of its ticks, and keeps what it was shown.
class Asking : public ScriptDevice {
 public:
  Asking(const ScriptDevice& script, std::function<void(std::int64_t)> ask)
      : ScriptDevice(script), ask_(std::move(ask)) {}
  DeviceNews poll(const TickTime& tick) noexcept override {
    heard.push_back(tick);
    ask_(tick.number);
    return ScriptDevice::poll(tick);
  }
  void display(const DeviceCommand& command, const DeviceState&, std::int64_t) noexcept override {
    shown.push_back(command.wrench.force.norm());
    ++shows;
  }
  std::vector<TickTime> heard;
  std::vector<double> shown;
  std::atomic<std::size_t> shows = 0;

 private:
  std::function<void(std::int64_t)> ask_;
};

// A thread lets it take three single ticks, then go on.
TEST_F(Loop, StandsStillWhilePausedAndGoesOnWithoutAGap) {
  LoopControl control;
  const ScriptDevice script = ScriptDevice::parse("t,x,y,z\n0,0.5,0.5,0.9\n0.2,0.5,0.5,0.9\n", "rest.csv");
  Asking device(script, [&](std::int64_t k) {
    if (k == 50) control.paused = true;
  });
  // Paused, it shows no force once per period: so many that there are 40 of the pause and some of single
  // ticks.
  const auto wait_for_shows = [&] {
    const std::size_t begin = device.shows;
    while (device.shows < begin + 44) std::this_thread::yield();
  };
  std::thread person([&] {
    while (!control.paused) std::this_thread::yield();
    wait_for_shows();
    control.single_ticks = 3;
    while (control.single_ticks > 0) std::this_thread::yield();
    wait_for_shows();
    control.paused = false;
  });
  Safety safety({.ramp = 0.0, .calm_time = 0.0, .deadline = {.tolerance = 1e9}, .silence = {.most = 1e9}});
  std::vector<std::int64_t> told;
  {
    TickFeed feed([&](std::span<const TickNote> notes) {
      for (const TickNote& note : notes) told.push_back(note.number);
    });
    const LoopReport report = run_loop({.body = body_,
                                        .state = state_,
                                        .device = device,
                                        .safety = &safety,
                                        .control = &control,
                                        .feed = &feed},
                                       {.ticks = 101}, stop_);
    EXPECT_EQ(report.ticks, 101);
  }
  person.join();
  ASSERT_EQ(device.heard.size(), 101U);
  ASSERT_EQ(told.size(), 101U);
  std::vector<std::int64_t> waits;  // ms, of those that are longer than a tick
  for (std::size_t k = 1; k < 101; ++k) {
    EXPECT_EQ(told[k], told[k - 1] + 1);
    const std::int64_t wait = device.heard[k].due - device.heard[k - 1].due;
    EXPECT_EQ(wait % 1'000'000, 0);
    if (wait > 1'000'000) waits.push_back(wait / 1'000'000);
  }
  ASSERT_GE(waits.size(), 2U);
  EXPECT_GE(waits.front(), 39);
  EXPECT_GE(waits.back(), 39);
  EXPECT_GE(device.shown.size(), 101U + 78U) << "no force while it is paused";
}

TEST_F(Loop, LeavesWithoutBeingInterrupted) {
  LoopControl control;
  Asking device(ScriptDevice::parse(pull, "pull.csv"), [&](std::int64_t k) { control.leave = k == 20; });
  const LoopReport report = run_loop({.body = body_, .state = state_, .device = device, .control = &control},
                                     {.ticks = 301, .fast = true}, stop_);
  EXPECT_EQ(report.ticks, 21);
  EXPECT_FALSE(report.interrupted);
}

// A node that is held moves with the tool: it is pressed in by what the tool went down since.
TEST_F(Loop, TellsHowFarTheSurfaceIsPressedIn) {
  const char* const lightly =
      "t,x,y,z,grab\n0,0.5,0.5,1.5,1\n0.1,0.5,0.5,1,1\n0.2,0.5,0.5,0.999,1\n0.3,0.5,0.5,1.0,0\n";
  ScriptDevice device = ScriptDevice::parse(lightly, "lightly.csv");
  std::vector<double> depth;
  {
    TickFeed feed([&](std::span<const TickNote> notes) {
      for (const TickNote& note : notes) depth.push_back(note.depth);
    });
    run_loop({.body = body_, .state = state_, .device = device, .feed = &feed}, {.ticks = 301, .fast = true},
             stop_);
  }
  ASSERT_EQ(depth.size(), 301U);
  EXPECT_EQ(depth[50], 0.0) << "it touches nothing yet";
  const double down = device.pose(0.098).position.z() - device.pose(0.2).position.z();
  EXPECT_NEAR(depth[200], down, 1e-3 * down) << "but for the tilt of the surface";
  EXPECT_EQ(depth[300], 0.0) << "let go";
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

class RecordedLoop : public Loop {
 protected:
  RecordedLoop() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directory(folder_);
  }
  ~RecordedLoop() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("palpate_recordings." + std::to_string(getpid()));
};

// The event that begins force anew is of those ticks alone that come after a pause.
TEST_F(RecordedLoop, RecordsWhereItWentOn) {
  LoopControl control;
  const ScriptDevice script = ScriptDevice::parse("t,x,y,z\n0,0.5,0.5,0.9\n0.1,0.5,0.5,0.9\n", "rest.csv");
  Asking device(script, [&](std::int64_t k) {
    if (k != 50) return;
    control.single_ticks = 2;
    control.paused = true;
  });
  std::thread person([&] {
    while (!control.paused || control.single_ticks > 0) std::this_thread::yield();
    control.paused = false;
  });
  Recorder recorder(folder_ / "paused.mcap", session_info);
  run_loop({.body = body_, .state = state_, .device = device, .recorder = &recorder, .control = &control},
           {.ticks = 101}, stop_);
  person.join();
  recorder.finish();
  const auto ticks = test::ticks_of(folder_ / "paused.mcap");
  ASSERT_EQ(ticks.size(), 101U);
  for (std::size_t k = 0; k < 101; ++k) {
    const auto event = static_cast<DeviceEvent>(ticks[k].event);
    if (k == 53) continue;  // the pause may end before or after tick 52
    EXPECT_EQ(event, k == 51 || k == 52 ? DeviceEvent::resumed : DeviceEvent::none) << k;
  }
}

// 70 s: more ticks than the recorder's ring holds.
TEST_F(RecordedLoop, FastRunsLeaveTheSameRecordingToTheLastBit) {
  ScriptDevice device = ScriptDevice::parse("t,x,y,z,grab\n0,0.5,0.5,1,1\n70,0.5,0.4,0.9,1\n", "long.csv");
  for (const char* name : {"one.mcap", "two.mcap"}) {
    State state(body_, {.tools = {{.reach = 0.01}}});
    Recorder recorder(folder_ / name, session_info);
    EXPECT_EQ(run(body_, state, device, true, stop_, &recorder).ticks, 70001);
    recorder.finish();
    EXPECT_EQ(recorder.dropped(), 0);
  }
  const std::string one = bytes_of(folder_ / "one.mcap");
  EXPECT_GT(one.size(), 70001U * 220U);
  EXPECT_TRUE(one == bytes_of(folder_ / "two.mcap"));
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, 2U) << "something half-written was left";
}

TEST_F(RecordedLoop, KeepsWhatEachTickGave) {
  ScriptDevice device = ScriptDevice::parse(slide, "slide.csv");
  State state(body_, {.tools = {finger}});
  State again = state;
  {
    Recorder recorder(folder_ / "slide.mcap", session_info);
    run(body_, state, device, true, stop_, &recorder);
    recorder.finish();
  }
  const auto ticks = test::ticks_of(folder_ / "slide.mcap");
  ASSERT_EQ(ticks.size(), 401U);
  const auto vector = [](const double(&v)[3]) { return Vec3(v[0], v[1], v[2]); };
  const auto rotation = [](const double(&q)[4]) {
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  };
  double stretched = 0.0;
  for (int k = 0; k <= 400; ++k) {
    const ToolPose pose = device.pose(k / 1000.0);
    const StepStatus status = step(body_, again, pose);
    const ToolState& tool = again.tools[0];
    const TickRecord& tick = ticks[static_cast<std::size_t>(k)];
    ASSERT_EQ(tick.time, k / 1000.0);
    ASSERT_EQ(vector(tick.device_position), pose.position);
    ASSERT_EQ(rotation(tick.device_orientation), pose.orientation.toRotationMatrix());
    ASSERT_EQ(vector(tick.tool_position), tool.pose.position);
    ASSERT_EQ(rotation(tick.tool_orientation), tool.pose.orientation.toRotationMatrix());
    ASSERT_EQ(vector(tick.force), -tool.wrench.force);
    ASSERT_EQ(vector(tick.torque), -tool.wrench.torque);
    ASSERT_EQ(tick.contacts, tool.contacts);
    Eigen::Matrix3d stiffness;
    const double(&s)[6] = tick.stiffness;
    stiffness << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
    ASSERT_LE((stiffness - tool.local.stiffness).norm(), 1e-12 * tool.local.stiffness.norm());
    ASSERT_EQ(tick.status, static_cast<std::uint32_t>(status));
    ASSERT_EQ(tick.compute_ns, 0U);
    ASSERT_EQ(tick.grab, pose.grab ? 1 : 0);
    stretched = std::max(stretched, (tool.pose.position - pose.position).norm());
  }
  EXPECT_GT(stretched, 0.01) << "the tool was never elsewhere than the device";
}

TEST(PlaneLoop, IgnoresTheScriptsZ) {
  const Body body(test::unit_model(2, 4, Scope::surface, Precision::double_precision));
  const std::atomic<bool> stop = false;
  double largest[2] = {};
  for (const int z : {0, 5}) {
    State state(body, {.tools = {{.reach = 0.1}}});
    const std::string rows = "t,x,y,z,grab\n0,0.5,1,0,1\n0.1,0.5,0.95," + std::to_string(z) + ",1\n";
    const LoopReport report = run(body, state, ScriptDevice::parse(rows, "plane.csv"), true, stop);
    EXPECT_EQ(report.ticks_in_contact, 100) << "all but the first, in which there is no force yet";
    largest[z == 0 ? 0 : 1] = report.largest_force;
  }
  const Index top = body.nearest_surface_node(Vec3(0.5, 1.0, 0.0)).node;
  const Eigen::VectorXd f = body.greens().block(top, top).inverse() * Eigen::Vector2d(0.0, -0.05);
  EXPECT_NEAR(largest[0], f.norm(), 1e-7 * f.norm());
  EXPECT_EQ(largest[0], largest[1]);
}

TEST(CountTicks, CountsTheLastRow) {
  const auto ticks = [](const std::string& end) {
    return ScriptDevice::parse("t,x,y,z\n" + end + ",0,0,0\n", "end.csv").ticks();
  };
  EXPECT_EQ(ticks("0"), 1);
  EXPECT_EQ(ticks("0.003"), 4);
  EXPECT_EQ(ticks("0.0035"), 4);
  EXPECT_EQ(ticks("4.35"), 4351);
}

TEST(TimeHistogram, IsOffByAFiveHundredthAtMost) {
  for (const std::int64_t ns :
       {0LL, 1LL, 499LL, 500LL, 999LL, 1000LL, 1001LL, 123'456LL, 1'023'999LL, 1'024'000LL, 999'999'999LL}) {
    TimeHistogram histogram;
    histogram.add(ns);
    histogram.add(2'000'000'000);
    EXPECT_GE(histogram.percentile(0.5), ns);
    EXPECT_LE(histogram.percentile(0.5), ns + ns / 500);
  }
  // Classes that begin and end with powers of 2 have what lies between.
  for (std::int64_t to = 1000; to < 1'000'000'000; to *= 2) {
    TimeHistogram histogram;
    for (const std::int64_t ns : {to / 2 - 1, to / 2, to - 1, to}) histogram.add(ns);
    EXPECT_EQ(histogram.total_between(to / 2, to), 2) << to;
  }
}

TEST(TimeHistogram, GivesPercentilesOfWhatItCounted) {
  TimeHistogram histogram;
  EXPECT_EQ(histogram.percentile(0.5), 0);
  for (std::int64_t ns = 1; ns <= 1000; ++ns) histogram.add(ns);
  EXPECT_EQ(histogram.percentile(0.5), 500);
  EXPECT_EQ(histogram.percentile(0.999), 999);
  EXPECT_EQ(histogram.worst(), 1000);
  histogram.add(5'000'300);
  EXPECT_EQ(histogram.percentile(1.0), 5'000'300);
  EXPECT_EQ(histogram.percentile(0.999), 1001) << "in steps of 2 ns";
  histogram.add(7'000'000'000);
  EXPECT_EQ(histogram.percentile(0.9985), 5'005'311) << "in steps of 2^13 ns";
  EXPECT_EQ(histogram.percentile(1.0), 7'000'000'000);
  EXPECT_EQ(histogram.total_between(0, 501), 500);
  EXPECT_EQ(histogram.total_between(501, 8'192'000), 501);
  EXPECT_EQ(histogram.total_between(8'192'000, INT64_MAX), 1);
  histogram.clear();
  EXPECT_EQ(histogram.total_between(0, INT64_MAX), 0);
  EXPECT_EQ(histogram.percentile(1.0), 0);
}

TEST(TimeHistogram, CountsMoreThanThirtyTwoBitsHold) {
  TimeHistogram histogram;
  histogram.add(700);
  for (int k = 0; k < 33; ++k) histogram.add(TimeHistogram(histogram));
  histogram.add(900);
  EXPECT_EQ(histogram.total(), (std::int64_t{1} << 33) + 1);
  EXPECT_EQ(histogram.total_between(700, 701), std::int64_t{1} << 33);
  EXPECT_EQ(histogram.percentile(0.5), 700);
}

}  // namespace
}  // namespace palpate::loop_test
