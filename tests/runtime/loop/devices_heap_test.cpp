// Safety takes no memory and makes no system call, the loop takes no memory. A program of its own, as it
// replaces malloc.
#include <gtest/gtest.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "runtime/loop/device_link.h"
#include "runtime/loop/loop.h"
#include "runtime/safety/safety.h"
#include "runtime/safety/workspace.h"
#include "tests/support/bodies/runtime_model.h"

namespace {
thread_local long heap_calls = 0;
}  // namespace

// operator new and delete of libstdc++ come here too.
extern "C" {
void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier): glibc's names
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT(bugprone-reserved-identifier)
void __libc_free(void* p);                                       // NOLINT(bugprone-reserved-identifier)

void* malloc(std::size_t size) {
  ++heap_calls;
  return __libc_malloc(size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++heap_calls;
  return __libc_memalign(alignment, size);
}
void free(void* p) {
  if (p != nullptr) ++heap_calls;
  __libc_free(p);
}
}

namespace palpate::devices_heap_test {
namespace {

constexpr std::int64_t ms_ns = 1'000'000;  // ns

/// Contact, nonsense, silence, lateness, faults, what follows them, and the end. Returns the ticks with
/// force.
int exercise(const Workspace& workspace, Safety& safety) noexcept {
  int with_force = 0;
  DeviceState device;
  std::int64_t now = ms_ns;
  for (int k = 0; k < 20'000; ++k) {
    now += k % 4001 == 4000 ? 30 * ms_ns : ms_ns;
    device.pose.position.z() = 0.002 * std::sin(0.01 * k);
    device.velocity.z() = 0.02 * std::cos(0.01 * k);
    if (k % 777 == 0) device.velocity.x() = std::numeric_limits<double>::quiet_NaN();
    if (k % 777 == 5) device.velocity.x() = 0.0;
    if (k % 5000 < 4900) {
      ++device.sequence;
      device.arrived = now;
    }
    const DeviceState body = workspace.in_body(device);
    DeviceCommand wanted;
    wanted.wrench.force.z() = -500.0 * std::min(body.pose.position.z(), 0.0);
    wanted.local.force = wanted.wrench.force;
    wanted.local.point = body.pose.position;
    wanted.local.stiffness(2, 2) = 500.0;
    wanted.local.radius = 0.001;
    const DeviceCommand shown = safety.filter(
        device, workspace.in_device(wanted),
        {.now = now, .due = now, .solved = k % 900 < 50 ? 0 : now, .inside_body = k % 1900 == 0});
    if (shown.wrench.force != Vec3::Zero()) ++with_force;
    if (k % 1000 == 999) safety.acknowledge();
    if (k == 15'000) safety.restart();
    if (k == 19'000) safety.shut_down();
  }
  return with_force;
}

SafetyOptions options() {
  SafetyOptions quick;
  quick.ramp = 0.1;
  return quick;
}

TEST(SafetyTick, MakesNoHeapCall) {
  heap_calls = 0;
  { const std::vector<int> proof(100); }
  ASSERT_EQ(heap_calls, 2) << "the counter does not count";
  const Workspace workspace({.motion_scale = 2.0});
  Safety safety(options());
  heap_calls = 0;
  const int with_force = exercise(workspace, safety);
  EXPECT_EQ(heap_calls, 0);
  EXPECT_GT(with_force, 2000);
}

/// A wire that says where it is each millisecond and takes everything. The hand goes down with the loop's
/// ticks: not by the clock, by which it may be in the body before the loop begins.
class QuietPort : public DevicePort {
 public:
  explicit QuietPort(const std::atomic<std::uint64_t>& tick) : tick_(tick) {}
  void open() override {}
  ReadResult read(DeviceState& state) noexcept override {
    timespec time{.tv_sec = 0, .tv_nsec = ms_ns};
    nanosleep(&time, nullptr);
    clock_gettime(CLOCK_MONOTONIC, &time);
    ++said_;
    const double way = std::min(1.0, 0.002 * static_cast<double>(tick_.load()));
    state.pose.position = Vec3(0.52, 0.5, 1.15 - 0.17 * way + 1e-6 * (said_ % 7));
    state.arrived = time.tv_sec * 1'000'000'000 + time.tv_nsec;
    state.sequence = static_cast<std::uint32_t>(said_);
    return ReadResult::report;
  }
  bool write(const DeviceCommand& /*command*/, const DeviceState& /*state*/) noexcept override {
    return true;
  }
  void close() noexcept override {}
  [[nodiscard]] DeviceLimits limits() const override { return {}; }
  [[nodiscard]] std::string refusals() const override { return ""; }
  [[nodiscard]] std::string name() const override { return "quiet"; }

 private:
  const std::atomic<std::uint64_t>& tick_;
  int said_ = 0;
};

/// Counts the heap calls of the loop's thread between the first ticks and the last ones.
class CountingDevice : public Device {
 public:
  CountingDevice(Device& device, std::atomic<std::uint64_t>& tick) : device_(device), tick_(tick) {}
  DeviceNews poll(const TickTime& tick) noexcept override {
    tick_ = static_cast<std::uint64_t>(tick.number);
    if (tick.number == 20) heap_calls = 0;
    if (tick.number == 980) counted = heap_calls;
    return device_.poll(tick);
  }
  void display(const DeviceCommand& command, const DeviceState& state, std::int64_t begun) noexcept override {
    device_.display(command, state, begun);
  }

  long counted = -1;

 private:
  Device& device_;
  std::atomic<std::uint64_t>& tick_;
};

// All that the loop does in a tick, not only the step: device, safety, recording, frames, monitor.
TEST(LoopTick, MakesNoHeapCall) {
  const Body body(test::unit_model(3, 4, Scope::surface, Precision::double_precision));
  State state(body, {.tools = {{.radius = 0.05}}});
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("palpate_loop_heap." + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  LoopReport report;
  long counted = -1;
  {
    std::atomic<std::uint64_t> tick = 0;
    DeviceLink link(std::make_unique<QuietPort>(tick), {});
    while (!link.has_reported()) {
      const timespec pause{.tv_sec = 0, .tv_nsec = ms_ns};
      nanosleep(&pause, nullptr);
    }
    CountingDevice device(link, tick);
    SafetyOptions patient = options();
    patient.deadline.tolerance = 1e9;
    patient.silence.most = 1e9;
    patient.max_speed = 1e9;  // of a hand that is seen seldom
    Safety safety(patient);
    Recorder recorder(folder / "a.mcap", {"box.palpate.hdf", "0123", "quiet", 1000, ""},
                      recorded_surface(body));
    SurfaceFrames frames(body, state, {},
                         [&](SurfacePicture picture) { recorder.push_picture(std::move(picture.frame)); });
    Monitor monitor({});
    LoopControl control;
    TickFeed feed([](std::span<const TickNote>) {});
    SurfaceFrames viewed(body, state, {.ticks_per_frame = 1}, [](const SurfacePicture&) {});
    const std::atomic<bool> stop = false;
    report = run_loop({.body = body,
                       .state = state,
                       .device = device,
                       .safety = &safety,
                       .recorder = &recorder,
                       .monitor = &monitor,
                       .frames = &frames,
                       .control = &control,
                       .feed = &feed,
                       .viewed = &viewed},
                      {.ticks = 1000}, stop);
    counted = device.counted;
  }
  std::filesystem::remove_all(folder);
  EXPECT_EQ(counted, 0);
  EXPECT_GT(report.ticks_in_contact, 300);
  EXPECT_GT(report.largest_shown, 0.0);
}

/// In a process that the kernel kills at the first system call but write and exit.
TEST(SafetyTick, MakesNoSystemCall) {
  const Workspace workspace({.motion_scale = 2.0});
  Safety safety(options());
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) != 0) _exit(77);
    syscall(SYS_exit, exercise(workspace, safety) > 2000 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 77) GTEST_SKIP() << "no seccomp here";
  EXPECT_FALSE(WIFSIGNALED(status)) << "signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace palpate::devices_heap_test
