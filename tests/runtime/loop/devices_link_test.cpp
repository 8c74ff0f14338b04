// The loop's side of a device whose wire is made up.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <ctime>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "base/error.h"
#include "runtime/loop/device_link.h"

namespace palpate::devices_link_test {
namespace {

std::int64_t now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

/// What was written, and when.
struct Written {
  DeviceState state;
  DeviceCommand command;
  std::int64_t at = 0;
};

/// The wire, as a test wants it. Shared with the test, which the port itself is not.
struct Wire {
  std::mutex mutex;
  std::deque<DeviceState> reports;
  DeviceLimits limits;  // set before it is opened
  std::vector<Written> written;
  std::atomic<bool> is_lost = false;        // reads find it gone
  std::atomic<bool> takes_nothing = false;  // writes fail
  std::atomic<int> refusals = 0;            // of the next openings
  std::atomic<int> opened = 0;
  std::atomic<int> closed = 0;
  std::atomic<int> users = 0;  // reads and writes under way
  std::atomic<bool> misused = false;

  void say(const DeviceState& state) {
    const std::lock_guard lock(mutex);
    reports.push_back(state);
  }
  std::vector<Written> trace() {
    const std::lock_guard lock(mutex);
    return written;
  }
};

class MadeUpPort : public DevicePort {
 public:
  explicit MadeUpPort(std::shared_ptr<Wire> wire) : wire_(std::move(wire)) {}

  void open() override {
    if (wire_->users != 0) wire_->misused = true;
    if (wire_->refusals > 0) {
      --wire_->refusals;
      throw Error("is not there", "made up", "wait");
    }
    ++wire_->opened;
    is_open_ = true;
  }

  ReadResult read(DeviceState& state) noexcept override {
    ++wire_->users;
    if (!is_open_) wire_->misused = true;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    ReadResult heard = ReadResult::nothing;
    if (wire_->is_lost) {
      heard = ReadResult::lost;
    } else if (const std::lock_guard lock(wire_->mutex); !wire_->reports.empty()) {
      state = wire_->reports.front();
      wire_->reports.pop_front();
      heard = ReadResult::report;
    }
    --wire_->users;
    return heard;
  }

  bool write(const DeviceCommand& command, const DeviceState& state) noexcept override {
    ++wire_->users;
    if (!is_open_) wire_->misused = true;
    const bool takes = !wire_->takes_nothing;
    if (takes) {
      const std::lock_guard lock(wire_->mutex);
      wire_->written.push_back({state, command, now()});
    }
    --wire_->users;
    return takes;
  }

  void close() noexcept override {
    if (wire_->closed++ < 0 || wire_->users != 0) wire_->misused = true;
    is_open_ = false;
  }

  [[nodiscard]] DeviceLimits limits() const override { return wire_->limits; }
  [[nodiscard]] std::string refusals() const override { return ""; }
  [[nodiscard]] std::string name() const override { return "made up"; }

 private:
  std::shared_ptr<Wire> wire_;
  std::atomic<bool> is_open_ = false;
};

class DeviceLinkTest : public testing::Test {
 protected:
  ~DeviceLinkTest() override {
    EXPECT_FALSE(wire_->misused) << "read or written while it was closed, or closed while it was used";
  }

  std::unique_ptr<DeviceLink> make(const DeviceLinkOptions& options = {}) {
    return std::make_unique<DeviceLink>(std::make_unique<MadeUpPort>(wire_), options);
  }

  /// Waits for what must come; how long it takes is not tested.
  static void wait_for(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!condition()) {
      ASSERT_LT(std::chrono::steady_clock::now(), end);
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  }

  const std::shared_ptr<Wire> wire_ = std::make_shared<Wire>();
};

DeviceState at(const Vec3& position, std::uint32_t sequence, const Vec3& velocity = Vec3::Zero()) {
  return {.pose = {.position = position}, .velocity = velocity, .arrived = now(), .sequence = sequence};
}

TEST_F(DeviceLinkTest, HandsReportsToTheLoopAndCommandsToTheDevice) {
  const auto link = make();
  EXPECT_FALSE(link->has_reported());
  wire_->say(at({0.1, 0.2, 0.3}, 7));
  wait_for([&] { return link->has_reported(); });
  wire_->say(at({0.4, 0.5, 0.6}, 8));
  wait_for([&] { return link->reports() == 2; });
  const DeviceNews news = link->poll({});
  EXPECT_EQ(news.events, DeviceEvent::none);
  EXPECT_EQ(news.state.pose.position, Vec3(0.4, 0.5, 0.6));

  DeviceCommand command;
  command.wrench = {.force = {1, 2, 3}, .torque = {4, 5, 6}};
  // A command that the writing thread finds too late goes out as its field, extrapolated: on a busy machine
  // one has to be shown more than once.
  const auto as_it_was_shown = [&] {
    const std::vector<Written> trace = wire_->trace();
    return std::any_of(trace.begin(), trace.end(), [](const Written& each) {
      return each.command.wrench.force == Vec3(1, 2, 3) && each.command.wrench.torque == Vec3(4, 5, 6) &&
             each.state.sequence == 8;
    });
  };
  wait_for([&] {
    link->display(command, news.state, now());
    return as_it_was_shown();
  });
}

TEST_F(DeviceLinkTest, RefusesADeviceThatCannotBeOpened) {
  wire_->refusals = 1;
  EXPECT_THROW(make(), Error);
  EXPECT_EQ(wire_->opened, 0);
}

// The loop hangs: the hand moves on in the field of the last solution, which fades.
TEST_F(DeviceLinkTest, GoesOnByItselfWhenTheLoopHangsAndLetsGo) {
  const DeviceLinkOptions options;
  const double stiffness = 100.0;
  const Vec3 moved(0.002, 0.0, 0.0);
  const Vec3 velocity(0.1, 0.0, 0.0);
  DeviceCommand command;
  command.wrench.force = Vec3(-1.0, 0.5, 0.0);
  command.wrench.torque = Vec3(0.01, 0.0, 0.0);
  command.local = {.force = command.wrench.force,
                   .stiffness = stiffness * Mat3::Identity(),
                   .point = Vec3::Zero(),
                   .radius = 0.005};
  const auto link = make(options);
  wire_->say(at(moved, 1, velocity));
  wait_for([&] { return link->has_reported(); });
  const std::int64_t shown = now();
  link->display(command, link->poll({}).state, shown);
  wait_for([&] {
    const auto trace = wire_->trace();
    return trace.size() > 20 && trace.back().command.wrench.force.isZero(0.0);
  });
  EXPECT_GT(link->extrapolated(), 10);

  const std::vector<Written> trace = wire_->trace();
  const Vec3 field = command.wrench.force - stiffness * moved - options.stale.damping * velocity;
  int followed = 0;
  for (std::size_t k = 1; k < trace.size(); ++k) {
    const Vec3& force = trace[k].command.wrench.force;
    const double latest = 1e-9 * static_cast<double>(trace[k].at - shown);
    const double whole = 1.0 - (latest - options.stale.time_to_live) / options.stale.fade;
    ASSERT_LE(force.norm(), field.norm() + 1e-12);
    if (force.isApprox(field, 1e-12)) ++followed;
    // Whoever wakes late has more to take away: no moment may have more than its share. The write itself came
    // a little after the force was worked out.
    if (trace[k].at - trace[k - 1].at < 5'000'000) {
      ASSERT_LE(force.norm(), std::max(0.0, whole + 0.005 / options.stale.fade) * field.norm() + 1e-12);
    }
  }
  if (trace.size() > 4 && trace[3].at - shown < 9'000'000) {
    EXPECT_GT(followed, 0) << "within its time to live the whole field is shown";
  }
  EXPECT_TRUE(trace.back().command.wrench.torque.isZero(0.0));
}

// What the loop worked out before it hung comes too late: it is the field of then, as far as that still
// holds.
TEST_F(DeviceLinkTest, ShowsNoOldCommandAsIfItWereNew) {
  const auto link = make();
  wire_->say(at({0.0, 0.0, 0.0}, 1));
  wait_for([&] { return link->has_reported(); });
  const DeviceCommand command{.wrench = {.force = {1, 0, 0}, .torque = Vec3::Zero()}, .local = {}};
  link->display(command, link->poll({}).state, now());
  wait_for([&] { return !wire_->trace().empty() && wire_->trace().back().command.wrench.force.isZero(0.0); });
  const std::size_t before = wire_->trace().size();
  link->display(command, link->poll({}).state, now() - 60'000'000);
  wait_for([&] { return wire_->trace().size() > before + 5; });
  for (std::size_t k = before; k < wire_->trace().size(); ++k)
    ASSERT_TRUE(wire_->trace()[k].command.wrench.force.isZero(0.0)) << "a kick";
}

TEST_F(DeviceLinkTest, NeverShowsMoreThanTheClampsWhenItGoesOnByItself) {
  const DeviceLinkOptions options{.max_force = 2.0, .max_force_rate = 100.0};
  const auto link = make(options);
  DeviceCommand command;
  command.wrench.force = Vec3(1.0, 0.0, 0.0);
  command.local = {.force = command.wrench.force,
                   .stiffness = 5000.0 * Mat3::Identity(),
                   .point = Vec3::Zero(),
                   .radius = 0.01};
  wire_->say(at({-0.009, 0.0, 0.0}, 1));  // where the field has 46 N
  wait_for([&] { return link->has_reported(); });
  const std::int64_t shown = now();
  link->display(command, link->poll({}).state, shown);
  wait_for([&] { return link->extrapolated() > 25; });
  const std::vector<Written> trace = wire_->trace();
  for (std::size_t k = 1; k < trace.size(); ++k) {
    const Vec3 change = trace[k].command.wrench.force - trace[k - 1].command.wrench.force;
    ASSERT_LE(trace[k].command.wrench.force.norm(), options.max_force * (1.0 + 1e-12));
    // A force is worked out after the one before the last was written, and before it is written itself.
    const std::int64_t before = k > 1 ? trace[k - 2].at : shown;
    ASSERT_LE(change.norm(), options.max_force_rate * 1e-9 * static_cast<double>(trace[k].at - before));
  }
}

TEST_F(DeviceLinkTest, NeverShowsMoreThanTheDeviceBearsWhenItGoesOnByItself) {
  wire_->limits.max_force = 0.5;
  const auto link = make({.max_force = 2.0, .max_force_rate = 1e6});
  DeviceCommand command;
  command.wrench.force = Vec3(0.4, 0.0, 0.0);
  command.local = {.force = command.wrench.force,
                   .stiffness = 100.0 * Mat3::Identity(),
                   .point = Vec3::Zero(),
                   .radius = 0.01};
  wire_->say(at({-0.005, 0.0, 0.0}, 1));  // where the field is 0.9 N
  wait_for([&] { return link->has_reported(); });
  link->display(command, link->poll({}).state, now());
  wait_for([&] { return link->extrapolated() > 20; });
  double largest = 0.0;
  for (const Written& written : wire_->trace())
    largest = std::max(largest, written.command.wrench.force.norm());
  EXPECT_LE(largest, 0.5 * (1.0 + 1e-12));
}

TEST_F(DeviceLinkTest, TellsOfALostDeviceAndOfItsReturn) {
  const auto link = make();
  wire_->say(at({0.1, 0.0, 0.0}, 1));
  wait_for([&] { return link->has_reported(); });
  wire_->refusals = 2;
  wire_->is_lost = true;
  wait_for([&] { return wire_->closed == 1; });
  DeviceEvent events = DeviceEvent::none;
  wait_for([&] { return (events = link->poll({}).events) != DeviceEvent::none; });
  EXPECT_EQ(events, DeviceEvent::lost);
  EXPECT_EQ(link->poll({}).events, DeviceEvent::none) << "told once";
  EXPECT_EQ(link->poll({}).state.pose.position.x(), 0.1) << "the last state stands";
  const std::size_t before = wire_->trace().size();
  link->display({.wrench = {.force = {1, 0, 0}, .torque = Vec3::Zero()}, .local = {}}, {}, now());
  wire_->is_lost = false;
  wait_for([&] { return wire_->opened == 2; });
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(link->poll({}).events, DeviceEvent::none) << "it has not said anything yet";
  wire_->say(at({0.2, 0.0, 0.0}, 1));
  wait_for([&] { return (events = link->poll({}).events) != DeviceEvent::none; });
  EXPECT_EQ(events, DeviceEvent::opened_again);
  EXPECT_EQ(link->poll({}).state.pose.position.x(), 0.2);
  EXPECT_EQ(wire_->opened, 2);
  for (std::size_t k = before; k < wire_->trace().size(); ++k) {
    EXPECT_GT(wire_->trace()[k].at, 0);
    EXPECT_LT(wire_->trace()[k].command.wrench.force.norm(), 1e-9)
        << "a quarter of a second old: nothing is left of it";
  }
}

TEST_F(DeviceLinkTest, ADeviceThatTakesNothingIsLost) {
  const auto link = make();
  wire_->say(at({0.1, 0.0, 0.0}, 1));
  wait_for([&] { return link->has_reported(); });
  wire_->takes_nothing = true;
  wire_->refusals = 1000;
  link->display({}, {}, now());
  DeviceEvent events = DeviceEvent::none;
  wait_for([&] { return (events = link->poll({}).events) != DeviceEvent::none; });
  EXPECT_EQ(events, DeviceEvent::lost);
  EXPECT_EQ(wire_->closed, 1);
}

TEST_F(DeviceLinkTest, ClosesTheDeviceAtItsEnd) {
  {
    const auto link = make();
    link->display({.wrench = {.force = {1, 0, 0}, .torque = Vec3::Zero()}, .local = {}}, {}, now());
  }
  EXPECT_EQ(wire_->closed, 1);
  const std::size_t written = wire_->trace().size();
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(wire_->trace().size(), written) << "something still writes";
}

}  // namespace
}  // namespace palpate::devices_link_test
