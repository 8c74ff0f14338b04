// Safety takes no memory and makes no system call. A program of its own, as it replaces malloc.
#include <gtest/gtest.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include "runtime/devices/safety.h"
#include "runtime/devices/workspace.h"

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // sanitizers have their own malloc

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

namespace palpate {
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
}  // namespace palpate

#endif
