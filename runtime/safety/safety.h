// Safety layer between the solver and a person's hand.
#pragma once

#include <cstdint>

#include "runtime/safety/buzz_detector.h"
#include "runtime/safety/clamps.h"
#include "runtime/safety/deadline_watch.h"
#include "runtime/safety/device.h"
#include "runtime/safety/engagement.h"
#include "runtime/safety/fault.h"
#include "runtime/safety/passivity.h"
#include "runtime/safety/safety_options.h"
#include "runtime/safety/silence_watch.h"
#include "runtime/safety/speed_limit.h"
#include "runtime/safety/stale_solution.h"

namespace palpate {

/// Returns `options` with each bound lowered to the device's limit where that is lower.
[[nodiscard]] SafetyOptions limited(SafetyOptions options, const DeviceLimits& limits) noexcept;

/// Times of one tick, CLOCK_MONOTONIC.
struct TickTiming {
  std::int64_t now = 0;      ///< time of the tick [ns]
  std::int64_t due = 0;      ///< time at which it should have begun [ns]
  std::int64_t solved = 0;   ///< time at which the solved pose was read [ns]
  bool inside_body = false;  ///< the tool is inside the body: force must not start
};

/// Applies all safety rules to one device, in the device's frame. In each tick, in this order:
///
///   1. no force after shut_down or while a fault is latched
///   2. input: a report that is new and plausible is accepted, otherwise the last one is kept; a plausible
///      command is accepted, otherwise the last one is kept and ages
///   3. faults: speed, silence, frozen numbers, deadline, buzz; the first one is latched and the force is
///      zero. Until a force has been felt, silence and late ticks restart the engagement instead
///   4. the local stiffness is limited; the solution is a force field about its point, which fades if it is
///      too old or too far away
///   5. the gate: no force starts in the body or in contact; then the ramp from zero. A solution that has
///      faded out closes the gate again
///   6. factors on the force: the product of ramp, late ticks, silence, stale solution and buzz
///   7. passivity controller
///   8. clamps: force, torque, then their rates
///
/// For any input, the output is finite, |F| <= max_force and |T| <= max_torque. From tick to tick |dF| <=
/// max_force_rate times the elapsed time or the period, whichever is shorter. Exceptions: a fault, restart or
/// shut_down sets the force to zero at once; after a gap between ticks, in which the device itself let the
/// force fade as a stale solution, dF counts from the faded force. No memory allocation, lock or system call;
/// copies are complete and independent.
class Safety {
 public:
  /// Throws Error if an option is negative or not a number, or the period is 0.
  explicit Safety(const SafetyOptions& options = {}, const DeviceLimits& limits = {});

  /// Returns the command for the device. Its local model keeps the force within max_force inside its radius.
  DeviceCommand filter(const DeviceState& device, const DeviceCommand& wanted,
                       const TickTiming& timing) noexcept;

  /// Sets the force to zero after a pause or a reconnection; it starts again from zero, out of contact. A
  /// latched fault stays.
  void restart() noexcept;

  /// Latches a fault detected elsewhere; an earlier one stays.
  void fail(Fault fault) noexcept;

  /// Clears the fault, which a person has seen, and restarts. Does nothing after shut_down.
  void acknowledge() noexcept;

  /// Sets the force to zero for good.
  void shut_down() noexcept { shut_down_ = true; }

  [[nodiscard]] Fault fault() const noexcept { return fault_; }
  [[nodiscard]] SafetyPhase phase() const noexcept;
  [[nodiscard]] double share() const noexcept { return share_; }        ///< factor on the force [0, 1]
  [[nodiscard]] double ramp() const noexcept { return ramp_.share(); }  ///< factor of the start ramp [0, 1]
  [[nodiscard]] double speed() const noexcept { return speed_limit_.speed(); }  ///< speed of the device [m/s]
  [[nodiscard]] double misses() const noexcept { return deadline_.misses(); }   ///< misses not yet forgiven
  [[nodiscard]] bool buzzing() const noexcept { return buzz_.buzzing(); }
  [[nodiscard]] double energy() const noexcept { return passivity_.energy(); }    ///< see Passivity [J]
  [[nodiscard]] double damping() const noexcept { return passivity_.damping(); }  ///< [N s/m]

 private:
  void take(const DeviceState& device, const DeviceCommand& wanted, const TickTiming& timing) noexcept;
  void look_for_faults() noexcept;
  DeviceCommand nothing() noexcept;
  DeviceCommand pass(const TickTiming& timing, double elapsed) noexcept;
  void bridge_gap(double elapsed) noexcept;
  void begin_anew() noexcept;
  LocalModel local_model(const Vec3& wanted, double share) const noexcept;

  SafetyOptions options_;  // options lowered to the device's limits
  Fault fault_ = Fault::none;
  bool shut_down_ = false;
  bool started_ = false;
  bool felt_ = false;  // true once a force has been displayed since the start
  std::int64_t last_now_ = 0;
  double share_ = 0.0;

  DeviceState device_;      // last accepted report
  DeviceCommand solution_;  // last accepted command, with its stiffness limited
  std::int64_t solved_ = 0;
  Vec3 shown_ = Vec3::Zero();  // last displayed force [N]

  SpeedLimit speed_limit_;
  SilenceWatch silence_;
  DeadlineWatch deadline_;
  BuzzDetector buzz_;
  StaleSolution stale_;
  EngageGate gate_;
  Ramp ramp_;
  Passivity passivity_;
  RateClamp force_rate_;
  RateClamp torque_rate_;
};

}  // namespace palpate
