#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "runtime/app/mouse_device.h"
#include "runtime/loop/loop.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/files/recorded_ticks.h"

namespace palpate::mouse_test {
namespace {

constexpr std::int64_t ms_ns = 1'000'000;

DeviceNews tick(MouseDevice& mouse, std::int64_t number, std::int64_t rate = 1000) {
  const std::int64_t time = number * 1'000'000'000 / rate;
  return mouse.poll({.number = number, .due = time, .begun = time});
}

// x = d (1 - (1 + t / T) exp(-t / T)) after a step of d, whatever the rate.
TEST(Mouse, FollowsAStepWithoutAJumpAndWithoutOvershoot) {
  for (const std::int64_t rate : {1000, 5000}) {
    MouseDevice mouse({.pose = {.position = {0.1, 0.0, 0.0}}}, rate);
    mouse.point({.pose = {.position = {0.1, 0.0, 0.02}, .grab = true}});
    double before = 0.0;
    for (std::int64_t k = 1; k <= rate / 5; ++k) {
      const DeviceState state = tick(mouse, k, rate).state;
      const double share = static_cast<double>(k) / static_cast<double>(rate) / 0.015;
      ASSERT_NEAR(state.pose.position.z(), 0.02 * (1.0 - (1.0 + share) * std::exp(-share)), 1e-12);
      ASSERT_NEAR(state.velocity.z(), 0.02 / 0.015 * share * std::exp(-share), 1e-10);
      ASSERT_GE(state.pose.position.z(), before);
      ASSERT_TRUE(state.pose.grab);
      before = state.pose.position.z();
    }
    EXPECT_NEAR(before, 0.02, 1e-6);
  }
}

TEST(Mouse, IsLostWithItsViewerAndComesBack) {
  const Vec3 above(0.0, 0.0, 0.01), below(0.0, 0.0, -0.01);
  const DeviceEvent lost_and_lifted = DeviceEvent::lifted | DeviceEvent::input_lost;
  MouseDevice mouse({.pose = {.position = above}, .lifted = true}, 1000);
  EXPECT_EQ(tick(mouse, 1).events, DeviceEvent::lifted);
  EXPECT_EQ(tick(mouse, 5000).events, DeviceEvent::lifted) << "lifted, a pointer may rest";
  mouse.lose();
  EXPECT_EQ(tick(mouse, 5001).events, DeviceEvent::lifted) << "nothing was pressed";
  mouse.point({.pose = {.position = below}});
  EXPECT_EQ(tick(mouse, 5002).events, DeviceEvent::none);
  mouse.lose();
  EXPECT_EQ(tick(mouse, 5003).events, lost_and_lifted);
  EXPECT_EQ(tick(mouse, 5004).events, DeviceEvent::lifted) << "told once";
  mouse.point({.pose = {.position = below, .grab = true}});
  EXPECT_EQ(tick(mouse, 5005).events, DeviceEvent::acknowledged);
  EXPECT_EQ(tick(mouse, 10005).events, DeviceEvent::none);
  EXPECT_TRUE(tick(mouse, 10005).state.pose.grab);
  const DeviceNews silent = tick(mouse, 10006);
  EXPECT_EQ(silent.events, lost_and_lifted) << "let down for more than five seconds without a word";
  EXPECT_EQ(silent.state.pose.position, above) << "where it was lifted last";
  EXPECT_FALSE(silent.state.pose.grab);
  mouse.point({.pose = {.position = below}});
  EXPECT_EQ(tick(mouse, 10007).events, DeviceEvent::acknowledged);
}

TEST(Mouse, TakesWordsFromAnotherThread) {
  MouseDevice mouse({}, 1000);
  std::atomic<bool> stop = false;
  std::thread viewer([&] {
    for (int k = 0; !stop; ++k)
      mouse.point({.pose = {.position = Vec3::Constant(k % 2 == 0 ? 0.01 : -0.01)}});
  });
  for (std::int64_t k = 1; k <= 20000; ++k) {
    const Vec3 at = tick(mouse, k).state.pose.position;
    ASSERT_LE(at.cwiseAbs().maxCoeff(), 0.0101);
    ASSERT_EQ(at.x(), at.y()) << "half of one word and half of another";
  }
  stop = true;
  viewer.join();
}

TEST(Mouse, IsWhereThePointerIsWhileLiftedAndFollowsFromThere) {
  MouseDevice mouse({.pose = {.position = {0.0, 0.0, 0.1}}, .lifted = true}, 1000);
  EXPECT_EQ(tick(mouse, 1).events, DeviceEvent::lifted);
  mouse.point({.pose = {.position = {0.2, 0.0, 0.1}, .grab = true}, .lifted = true});
  const DeviceNews hovering = tick(mouse, 2);
  EXPECT_EQ(hovering.events, DeviceEvent::lifted);
  EXPECT_EQ(hovering.state.pose.position, Vec3(0.2, 0.0, 0.1));
  EXPECT_EQ(hovering.state.velocity, Vec3(Vec3::Zero()));
  EXPECT_FALSE(hovering.state.pose.grab) << "what is lifted holds nothing";
  mouse.point({.pose = {.position = {0.2, 0.0, 0.0}}});
  const DeviceNews down = tick(mouse, 3);
  EXPECT_EQ(down.events, DeviceEvent::none);
  const double share = 0.001 / 0.015;
  EXPECT_NEAR(down.state.pose.position.z(), 0.1 * (1.0 + share) * std::exp(-share), 1e-12);
}

TEST(Mouse, LandsWhereItWasLiftedLastThoughNoTickSawIt) {
  MouseDevice mouse({.pose = {.position = {0.0, 0.0, 0.1}}}, 1000);
  EXPECT_EQ(tick(mouse, 1).events, DeviceEvent::none);
  mouse.point({.pose = {.position = {0.2, 0.0, 0.1}}, .lifted = true});
  mouse.point({.pose = {.position = {0.2, 0.0, 0.0}}});
  const DeviceNews landed = tick(mouse, 2);
  EXPECT_EQ(landed.events, DeviceEvent::lifted);
  EXPECT_EQ(landed.state.pose.position, Vec3(0.2, 0.0, 0.1));
  EXPECT_EQ(tick(mouse, 3).events, DeviceEvent::none);
}

/// A pointer that says something before each tick.
class Pointed : public Device {
 public:
  using Hand = std::function<PointerPose(std::int64_t)>;
  explicit Pointed(Hand hand) : hand_(std::move(hand)), mouse_(hand_(0), 1000) {}
  DeviceNews poll(const TickTime& tick) noexcept override {
    mouse_.point(hand_(tick.number));
    return mouse_.poll(tick);
  }
  void display(const DeviceCommand&, const DeviceState&, std::int64_t) noexcept override {}

 private:
  Hand hand_;
  MouseDevice mouse_;
};

/// A cube that a sphere is pointed at.
class PointedCube : public testing::Test {
 protected:
  LoopReport run(Device& device, std::int64_t ticks, Recorder* recorder = nullptr,
                 const ReplayDevice* replayed = nullptr) {
    state_ = State(body_, {.tools = {tool_}});
    return run_loop(
        {.body = body_, .state = state_, .device = device, .recorder = recorder, .replayed = replayed},
        {.ticks = ticks, .fast = true}, stop_);
  }

  const Tool tool_{.radius = 0.1, .coupling_stiffness = 10.0, .friction = 0.3};
  const Body body_{test::unit_model(3, 4, Scope::surface, Precision::double_precision)};
  State state_{body_, {.tools = {tool_}}};
  const std::atomic<bool> stop_ = false;
};

// From above through the cube to the other side, at all depths.
TEST_F(PointedCube, FeelsNothingOfTheWayWhileLifted) {
  for (const bool lifted : {true, false}) {
    Pointed device([&](std::int64_t k) {
      const double along = 0.001 * static_cast<double>(k);
      return PointerPose{.pose = {.position = {-0.5 + along, 0.5, 1.3 - 0.3 * along}}, .lifted = lifted};
    });
    const LoopReport report = run(device, 2001);
    if (lifted) {
      EXPECT_EQ(report.largest_force, 0.0);
      EXPECT_EQ(report.ticks_in_contact, 0);
    } else {
      EXPECT_GT(report.largest_force, 0.01);
    }
  }
}

/// Hovers, presses, hovers over another place, presses there, and goes away.
PointerPose press_twice(std::int64_t k) {
  const auto on = [&](std::int64_t from, std::int64_t to) { return k >= from && k < to; };
  const bool pressed = on(100, 400) || on(500, 800);
  return {.pose = {.position = {k < 450 ? 0.3 : 0.7, 0.5, pressed ? 1.05 : 1.12}}, .lifted = !pressed};
}

TEST_F(PointedCube, FeelsNothingOnceItIsLiftedAfterAPress) {
  Pointed pressed(press_twice);
  run(pressed, 400);
  const double force = state_.tools.front().wrench.force.norm();
  EXPECT_GT(force, 0.01);
  Pointed device(press_twice);
  const LoopReport report = run(device, 450);
  EXPECT_EQ(report.ticks, 450);
  EXPECT_EQ(state_.tools.front().contacts, 0);
  EXPECT_EQ(state_.tools.front().wrench.force, Vec3(Vec3::Zero()));
  EXPECT_EQ(state_.surface.near.load().count, 0) << "the body is loaded by nothing";
}

TEST_F(PointedCube, IsReplayedToTheSameBits) {
  const std::filesystem::path path =
      std::filesystem::path(testing::TempDir()) / ("palpate_pointed." + std::to_string(getpid()) + ".mcap");
  {
    Pointed device(press_twice);
    Recorder recorder(path, {"box.palpate.hdf", "0123", "mouse", 1000, ""});
    const LoopReport report = run(device, 900, &recorder);
    EXPECT_GT(report.ticks_in_contact, 500);
    recorder.finish();
  }
  const RecordingFile session(path);
  ASSERT_EQ(session.ticks(), 900);
  ReplayDevice device(session);
  const LoopReport report = run(device, 900, nullptr, &device);
  EXPECT_EQ(report.replay.ticks, 900);
  EXPECT_EQ(report.replay.different, 0);

  std::vector<TickRecord> ticks = test::ticks_of(path);
  RecordingWriter writer(path, session.info());
  for (TickRecord& tick : ticks) {
    tick.event = 0;  // as if it had slid to the other place
    writer.append(tick);
  }
  writer.finish();
  const RecordingFile slid(path);
  std::filesystem::remove(path);
  ASSERT_EQ(slid.ticks(), 900);
  ReplayDevice without(slid);
  EXPECT_GT(run(without, 900, nullptr, &without).replay.different, 0);
}

}  // namespace
}  // namespace palpate::mouse_test
