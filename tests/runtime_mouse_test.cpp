#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "runtime/mouse_device.h"

namespace palpate {
namespace {

constexpr std::int64_t ms_ns = 1'000'000;

DeviceNews tick(MouseDevice& mouse, std::int64_t number, std::int64_t rate = 1000) {
  const std::int64_t time = number * 1'000'000'000 / rate;
  return mouse.hear({.number = number, .due = time, .begun = time});
}

// x = d (1 - (1 + t / T) exp(-t / T)) after a step of d, whatever the rate.
TEST(Mouse, FollowsAStepWithoutAJumpAndWithoutOvershoot) {
  for (const std::int64_t rate : {1000, 5000}) {
    MouseDevice mouse({.position = {0.1, 0.0, 0.0}}, rate);
    mouse.point({.position = {0.1, 0.0, 0.02}, .grab = true});
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
  MouseDevice mouse({}, 1000);
  mouse.point({.position = {0.0, 0.0, 0.01}});
  EXPECT_EQ(tick(mouse, 1).events, DeviceEvent::none);
  EXPECT_EQ(tick(mouse, 5000).events, DeviceEvent::none) << "without a button a pointer may rest";
  mouse.lose();
  EXPECT_EQ(tick(mouse, 5001).events, DeviceEvent::input_lost);
  EXPECT_EQ(tick(mouse, 5002).events, DeviceEvent::none) << "told once";
  mouse.point({.position = {0.0, 0.0, 0.01}, .grab = true});
  EXPECT_EQ(tick(mouse, 5003).events, DeviceEvent::acknowledged);
  EXPECT_EQ(tick(mouse, 6003).events, DeviceEvent::none);
  EXPECT_EQ(tick(mouse, 6004).events, DeviceEvent::input_lost)
      << "held for more than a second without a word";
  mouse.point({.grab = true});
  EXPECT_EQ(tick(mouse, 6005).events, DeviceEvent::acknowledged);
}

TEST(Mouse, TakesWordsFromAnotherThread) {
  MouseDevice mouse({}, 1000);
  std::atomic<bool> stop = false;
  std::thread viewer([&] {
    for (int k = 0; !stop; ++k) mouse.point({.position = Vec3::Constant(k % 2 == 0 ? 0.01 : -0.01)});
  });
  for (std::int64_t k = 1; k <= 20000; ++k) {
    const Vec3 at = tick(mouse, k).state.pose.position;
    ASSERT_LE(at.cwiseAbs().maxCoeff(), 0.0101);
    ASSERT_EQ(at.x(), at.y()) << "half of one word and half of another";
  }
  stop = true;
  viewer.join();
}

}  // namespace
}  // namespace palpate
