// The whole chain with a hand in it: emulated board, HidPort on a false hidapi, DeviceLink, loop, safety. For
// each fault what the hand would have felt, as the firmware was told it.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "runtime/devices/hid/hid_port.h"
#include "runtime/loop/device_link.h"
#include "runtime/loop/loop.h"
#include "runtime/loop/real_time.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/devices/fake_hidapi.h"

namespace palpate::devices_faults_test {
namespace {

constexpr double fault_time = 1.0;  // when the fault begins, while the hand presses [s]
constexpr double lift_time = 1.6;   // when the hand lifts off
constexpr double end_time = 3.2;

const BoardFeature board_feature{.axes = 3,
                                 .watchdog = 200,
                                 .force_unit = 250,
                                 .max_force = 2500,
                                 .max_stiffness = 1000,
                                 .max_damping = 0,
                                 .workspace_radius = 80000};
const double quantum = 1e-6 * board_feature.force_unit;  // of a force's component [N]

constexpr double arm_quantum = 0.02;  // N, by whole milliamperes and encoder counts

/// Presses from 5 mm above to 5 mm below the surface, with the tremor of a hand; lifts off and comes again.
Vec3 pressing(double t) {
  const double smooth_step = t < 0.3 ? 0.0 : std::min(1.0, (t - 0.3) / 0.4);
  double depth = 0.010 * smooth_step * smooth_step * (3.0 - 2.0 * smooth_step);
  const double lifted = (t - lift_time) / 0.5;
  if (lifted > 0.0 && lifted < 1.0) depth -= 0.010 * std::pow(std::sin(std::numbers::pi * lifted), 2);
  return {0.0, 0.0, 0.005 - depth + 2e-5 * std::sin(60.0 * t)};
}

struct Case {
  const char* name;
  const char* what;  // for the picture
  FakeFault on_read = FakeFault::none;
  FakeFault on_write = FakeFault::none;
  double duration = 0.0;  // [s]; of a call that fails or stalls, 0: one call, the first from fault_time on
  bool freezes = false;
  bool is_arm = false;
  double loop_hangs = 0.0;       // [s]
  Fault expected = Fault::none;  // that must be latched; none: no matter
  bool opens_again = false;
  bool may_latch = false;  ///< some fault
};

std::ostream& operator<<(std::ostream& stream, const Case& fault) {
  return stream << fault.name;
}

SafetyOptions safety_options() {
  SafetyOptions options;
  options.ramp = 0.2;
  options.max_force = 2.0;
  options.deadline.tolerance = 1e9;  // late ticks have their own test
  return options;
}

/// A force that a tick gave, which began at `begun` [ns].
struct ComputedForce {
  std::int64_t begun = 0;
  Vec3 force = Vec3::Zero();  ///< [N]
};

/// Makes the loop hang once, and keeps what it gave.
class Hanging : public Device {
 public:
  Hanging(Device& device, double seconds, std::int64_t tick)
      : device_(device), seconds_(seconds), tick_(tick) {
    computed.reserve(10'000);
  }
  std::vector<ComputedForce> computed;

  DeviceNews poll(const TickTime& tick) noexcept override {
    if (tick.number == tick_ && seconds_ > 0.0)
      std::this_thread::sleep_for(std::chrono::duration<double>(seconds_));
    return device_.poll(tick);
  }
  void display(const DeviceCommand& command, const DeviceState& state, std::int64_t begun) noexcept override {
    computed.push_back({begun, command.wrench.force});
    device_.display(command, state, begun);
  }

 private:
  Device& device_;
  double seconds_;
  std::int64_t tick_;
};

/// What was felt, for scripts/studies/faults: only where the folder is named.
void keep_trace(const Case& fault, const std::vector<ShownForce>& trace) {
  const char* folder = std::getenv("PALPATE_FORCE_TRACES");
  if (folder == nullptr) return;
  std::ofstream stream(std::filesystem::path(folder) / (std::string(fault.name) + ".csv"));
  stream << "# " << fault.what << "\nt,fx,fy,fz\n";
  for (const ShownForce& shown : trace)
    stream << shown.time << ',' << shown.force.x() << ',' << shown.force.y() << ',' << shown.force.z()
           << '\n';
}

/// What came of a run.
struct Felt {
  LoopReport report;
  std::vector<ShownForce> trace;
  std::vector<ComputedForce> computed;
};

Felt press(const Case& fault) {
  FakeHid hid;
  const NamedProfile profile = find_profile(fault.is_arm ? "woodenhaptics" : "palpate_board");
  std::shared_ptr<Firmware> board;
  if (fault.is_arm) {
    board = std::make_shared<WoodenHapticsFirmware>(std::get<ArmConstants>(profile.profile.kind), pressing);
  } else {
    board = std::make_shared<BoardFirmware>(board_feature, pressing);
  }
  hid.attach(board);
  const auto active = [&](FakeFault which) {
    return [&, which, was_active = false](std::int64_t) mutable {
      const double t = board->time();
      if (t < fault_time) return FakeFault::none;
      const bool ends = fault.duration > 0.0 ? t >= fault_time + fault.duration : was_active;
      was_active = true;
      return ends ? FakeFault::none : which;
    };
  };
  const Body body(test::unit_model(3, 4, Scope::surface, Precision::double_precision));
  State state(body, {.tools = {{.radius = 0.05}}});
  Safety safety(safety_options());
  auto port = std::make_unique<HidPort>(choose_hid_device(attached_devices(hid.sys()), {profile}, ""),
                                        nullptr, hid.sys());
  DeviceLink link(std::move(port), {.max_force = safety_options().max_force,
                                    .max_force_rate = safety_options().max_force_rate,
                                    .stale = safety_options().stale});
  for (int k = 0; k < 10000 && !link.has_reported(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(link.has_reported());
  if (fault.on_read != FakeFault::none) hid.on_read(active(fault.on_read));
  if (fault.on_write != FakeFault::none) hid.on_write(active(fault.on_write));
  // A motion of 10, so that a millimetre of the hand is a centimetre of this body; a newton or so on the
  // hand.
  const Workspace workspace({.device_origin = Vec3::Zero(),
                             .body_origin = Vec3(0.52, 0.5, 1.05),
                             .axes = Eigen::Quaterniond::Identity(),
                             .motion_scale = 10.0,
                             .force_scale = 60.0});
  const std::atomic<bool> stop = false;
  Hanging device(link, fault.loop_hangs, static_cast<std::int64_t>(1e3 * (fault_time - board->time())));
  std::thread freezer([&] {
    if (!fault.freezes) return;
    std::this_thread::sleep_for(std::chrono::duration<double>(fault_time - board->time()));
    hid.freeze(true);
    std::this_thread::sleep_for(std::chrono::duration<double>(fault.duration));
    hid.freeze(false);
  });
  const RealTimeRights rights;
  LoopReport report =
      run_loop({.body = body, .state = state, .device = device, .workspace = workspace, .safety = &safety},
               {.ticks = static_cast<std::int64_t>(1e3 * (end_time - board->time()))}, stop);
  freezer.join();
  return {.report = std::move(report), .trace = board->forces(), .computed = std::move(device.computed)};
}

/// Never more than the clamp, and no growth faster than its rate, whatever the machine did.
void expect_clamps(const Case& fault, const Felt& felt) {
  const SafetyOptions options = safety_options();
  const std::vector<ShownForce>& trace = felt.trace;
  for (std::size_t k = 1; k < felt.computed.size(); ++k) {
    const ComputedForce &before = felt.computed[k - 1], &now = felt.computed[k];
    ASSERT_LE(now.force.norm(), options.max_force * (1.0 + 1e-12));
    if (now.force.norm() <= before.force.norm()) continue;
    const double time = std::min(1e-9 * static_cast<double>(now.begun - before.begun), options.period);
    ASSERT_LE((now.force - before.force).norm(), options.max_force_rate * time + 1e-9) << "in tick " << k;
  }
  const double rounding = fault.is_arm ? arm_quantum : std::sqrt(3.0) * quantum;
  ASSERT_GT(trace.size(), 100U);
  for (std::size_t k = 0; k < trace.size(); ++k) {
    const double force = trace[k].force.norm();
    ASSERT_LE(force, options.max_force + rounding) << "at " << trace[k].time << " s";
    if (k < 3 || force <= trace[k - 1].force.norm()) continue;
    // The tick after the one of which the last force was began after what was written three before; that
    // tick's own force may have grown for a period.
    const double time = options.period + trace[k].time - trace[k - 3].time;
    ASSERT_LE((trace[k].force - trace[k - 1].force).norm(), options.max_force_rate * time + 2.0 * rounding)
        << "at " << trace[k].time << " s";
  }
}

bool has_force(const std::vector<ShownForce>& trace, double from, double to) {
  return std::any_of(trace.begin(), trace.end(), [&](const ShownForce& shown) {
    return shown.time >= from && shown.time < to && shown.force.norm() > 0.3;
  });
}

/// Pauses between ticks that are longer than this [ns].
std::ptrdiff_t pauses(const Felt& felt, std::int64_t longest) {
  std::ptrdiff_t count = 0;
  for (std::size_t k = 1; k < felt.computed.size(); ++k)
    count += felt.computed[k].begun - felt.computed[k - 1].begun > longest ? 1 : 0;
  return count;
}

/// How often a fault was latched that the case does not plant.
std::int64_t unplanted(const Case& fault, const LoopReport& report) {
  std::int64_t count = 0;
  for (std::size_t k = 0; k < report.faults.size(); ++k)
    count += static_cast<Fault>(k) == fault.expected ? 0 : report.faults[k];
  return count;
}

class Faults : public testing::TestWithParam<Case> {};

TEST_P(Faults, StayWithinTheClamps) {
  const Case& fault = GetParam();
  Felt felt;
  // A machine that is itself away for longer than a device may be silent shows that, and not this fault. It
  // may be away from the loop, or from the threads that read and write: then a fault is latched that is not
  // planted.
  constexpr std::int64_t away = 10'000'000;  // ns
  for (int attempt = 0; attempt < 60; ++attempt) {
    felt = press(fault);
    ASSERT_NO_FATAL_FAILURE(expect_clamps(fault, felt));
    const auto hang = static_cast<std::int64_t>(1e9 * fault.loop_hangs);
    // Beside the pause that is planted there is none.
    if (felt.report.lateness.worst() < away + hang && pauses(felt, away) <= (hang > 0 ? 1 : 0) &&
        (unplanted(fault, felt.report) == 0 || fault.may_latch) && has_force(felt.trace, 0.0, fault_time))
      break;
  }
  keep_trace(fault, felt.trace);

  EXPECT_TRUE(unplanted(fault, felt.report) == 0 || fault.may_latch);

  EXPECT_TRUE(has_force(felt.trace, 0.0, fault_time)) << "the hand felt nothing before the fault";
  if (fault.expected != Fault::none) {
    EXPECT_GE(felt.report.faults[static_cast<std::size_t>(fault.expected)], 1);
    // Until the hand was off the body once, force that is gone stays away.
    bool is_gone = false;
    for (const ShownForce& shown : felt.trace) {
      if (shown.time < fault_time + 0.05 || shown.time > lift_time) continue;
      is_gone = is_gone || shown.force.isZero(0.0);
      ASSERT_TRUE(!is_gone || shown.force.isZero(0.0))
          << "it began again in contact, at " << shown.time << " s";
    }
    EXPECT_TRUE(is_gone);
  }
  EXPECT_GE(felt.report.opened_again, fault.opens_again ? 1 : 0);
  if (fault.expected == Fault::none || fault.opens_again) {
    EXPECT_TRUE(has_force(felt.trace, lift_time + 0.5, end_time) || fault.may_latch)
        << "and when it comes again, it feels again";
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Faults,
    testing::Values(
        Case{.name = "none", .what = "no fault"},
        Case{.name = "short_reports",
             .what = "short reports for 50 ms",
             .on_read = FakeFault::short_report,
             .duration = 0.05,
             .expected = Fault::device_silent},
        Case{.name = "garbage",
             .what = "random bytes for 50 ms",
             .on_read = FakeFault::garbage,
             .duration = 0.05,
             .may_latch = true},
        Case{.name = "read_error",
             .what = "hid_read returns -1; open again after 0.1 s",
             .on_read = FakeFault::error,
             .duration = 0.05,
             .expected = Fault::device_lost,
             .opens_again = true},
        Case{.name = "stall_5ms", .what = "hid_read stalls for 5 ms", .on_read = FakeFault::stall_5ms},
        Case{.name = "stalls_5ms",
             .what = "hid_read stalls for 5 ms, for each report that came in 50 ms",
             .on_read = FakeFault::stall_5ms,
             .duration = 0.05,
             .may_latch = true},
        Case{.name = "stall_50ms",
             .what = "hid_read stalls for 50 ms",
             .on_read = FakeFault::stall_50ms,
             .expected = Fault::device_silent},
        Case{.name = "frozen",
             .what = "WoodenHaptics reports the same numbers for 0.4 s",
             .duration = 0.4,
             .freezes = true,
             .is_arm = true,
             .expected = Fault::device_frozen},
        Case{.name = "frozen_numbered",
             .what = "the same report, with its number, for 0.4 s",
             .duration = 0.4,
             .freezes = true,
             .expected = Fault::device_silent},
        Case{.name = "write_stalls", .what = "hid_write stalls for 50 ms", .on_write = FakeFault::stall_50ms},
        Case{.name = "write_error",
             .what = "hid_write returns -1; open again after 0.1 s",
             .on_write = FakeFault::error,
             .duration = 0.05,
             .expected = Fault::device_lost,
             .opens_again = true},
        Case{.name = "loop_hangs", .what = "the loop hangs for 60 ms", .loop_hangs = 0.06}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace palpate::devices_faults_test
