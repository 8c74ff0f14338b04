// What is decoded and encoded in a tick takes nothing from the heap.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>

#include "runtime/devices/reports/palpate_board.h"
#include "runtime/devices/reports/pid_effects.h"
#include "runtime/devices/reports/space_mouse.h"
#include "runtime/devices/reports/woodenhaptics_report.h"
#include "tests/support/devices/board_codec.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PALPATE_OWN_MALLOC 0  // sanitizers have their own
#else
#define PALPATE_OWN_MALLOC 1
#endif

namespace {
std::size_t allocations = 0;
}

#if PALPATE_OWN_MALLOC
extern "C" {
void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier): glibc's name

// operator new of libstdc++ comes here too.
void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
}
#endif

namespace palpate::report_heap_test {
namespace {

TEST(DeviceHeap, TicksTakeNothing) {
  const Bytes encoders(woodenhaptics_report_bytes, 0);
  const Bytes cap = bytes("01 5e 01 a2 fe 03 00 04 00 05 00 fa ff");
  const Bytes stick = bytes("01 ff 01 00 02 00 00 00 05 00 00 00 00");
  const auto board_report = encode_board_input({1, 6, {1, 2, 3, 4, 5, 6}, 1});
  const ArmConstants arm{.lengths = Vec3::Ones(),
                         .capstan_diameters = Vec3::Ones(),
                         .body_diameters = Vec3::Ones(),
                         .torque_constants = Vec3::Ones(),
                         .max_current = 1.0,
                         .counts_per_turn = {1, 1, 1, 1, 1, 1}};
  SpaceMouse mouse({}, 0.1);
  const PidLayout layout =
      find_pid_layout(parse_report_descriptor(bytes(side_winder_descriptor), "it"), "it");
  const PidConstants constants{{1, 1}, {1, 1}};
  PidEffects effects(layout, constants);
  const BoardFeature feature{.force_unit = 250};

  EXPECT_EQ(allocations > 0, PALPATE_OWN_MALLOC == 1);
  const std::size_t before = allocations;
  double sum = 0.0;
  for (int tick = 0; tick < 10; ++tick) {
    const auto report = decode_encoders(encoders);
    sum += arm_state(arm, *report).pose.position.x();
    const Vec3 currents = motor_currents(arm, joint_angles(arm, report->counters), Vec3(1, 2, 3));
    sum += encode_currents(currents)[1];
    mouse.take(*decode_space_mouse(cap));
    sum += mouse.advance(1e-3).pose.position.x();
    sum += pid_state(constants, *decode_pid_input(layout, stick)).pose.position.x();
    sum += effects.force(pid_force(constants, Vec3(1, 2, 3)))[0].bytes[0];
    sum += board_state(*decode_board_input(board_report)).pose.position.x();
    sum += encode_board_force({1, board_counts(feature, Vec3(1, 2, 3))})[5];
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace palpate::report_heap_test
