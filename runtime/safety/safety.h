// What stands between the solver and a hand.
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

/// With what the device bears where that is lower.
[[nodiscard]] SafetyOptions limited(SafetyOptions options, const DeviceLimits& limits) noexcept;

/// Times of one tick, by the monotonic clock.
struct TickTiming {
  std::int64_t now = 0;      ///< when the tick is [ns]
  std::int64_t due = 0;      ///< when it should have begun [ns]
  std::int64_t solved = 0;   ///< when the pose was taken of which the force is [ns]
  bool inside_body = false;  ///< the tool is in the body: force must not begin
};

/// All rules of one device, in its own frame. Each tick, in this order:
///
///   1. no force after shut_down or while a fault is latched
///   2. what was said: a report that is new and of plausible numbers, else the last one stands; a command
///      of plausible numbers, else the last one stands and ages
///   3. faults: speed, silence, frozen numbers, deadline, buzz; the first is latched, and there is no force.
///   As
///      long as nothing has been felt since the start, silence and late ticks begin the start anew instead
///   4. the local stiffness is limited; the solution is a field about its point, which fades when it is too
///      old or too far
///   5. the gate: no force begins in the body or in contact; then the ramp from zero. A solution that faded
///      away closes it again
///   6. shares: ramp, late ticks, silence, stale solution, buzz: their product
///   7. passivity controller
///   8. clamps: force, torque, then their rates
///
/// Whatever comes in: all that comes out is finite, |F| <= max_force, |T| <= max_torque, and from tick to
/// tick |dF| <= max_force_rate times the shorter of the time that passed and the period - but where a fault,
/// restart or shut_down makes the force zero, which is at once, and after a gap between ticks, in which the
/// device itself let the force fade as a stale solution: there dF is from what that left. No memory, lock or
/// system call; copies are whole.
class Safety {
 public:
  /// Throws Error for options that are negative or not a number, or a period of 0.
  explicit Safety(const SafetyOptions& options = {}, const DeviceLimits& limits = {});

  /// What the device is to show. Its local model stays within the force clamp in its radius.
  DeviceCommand filter(const DeviceState& device, const DeviceCommand& wanted,
                       const TickTiming& timing) noexcept;

  /// After a pause or a re-plug: no force at once, then it begins from zero, out of contact. A fault stays.
  void restart() noexcept;

  /// Latches a fault that is seen elsewhere; the first one stays.
  void fail(Fault fault) noexcept;

  /// The fault was seen by a person: `restart` without it. After shut_down: nothing.
  void acknowledge() noexcept;

  /// No force ever again.
  void shut_down() noexcept { shut_down_ = true; }

  [[nodiscard]] Fault fault() const noexcept { return fault_; }
  [[nodiscard]] SafetyPhase phase() const noexcept;
  [[nodiscard]] double share() const noexcept { return share_; }        ///< of the force that may pass [0, 1]
  [[nodiscard]] double ramp() const noexcept { return ramp_.share(); }  ///< of the start [0, 1]
  [[nodiscard]] double speed() const noexcept { return speed_limit_.speed(); }  ///< of the device [m/s]
  [[nodiscard]] double misses() const noexcept { return deadline_.misses(); }   ///< not forgiven yet
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

  SafetyOptions options_;  // with the device's limits
  Fault fault_ = Fault::none;
  bool shut_down_ = false;
  bool started_ = false;
  bool felt_ = false;  // some force since the start
  std::int64_t last_now_ = 0;
  double share_ = 0.0;

  DeviceState device_;      // the last report
  DeviceCommand solution_;  // the last solution, of limited stiffness
  std::int64_t solved_ = 0;
  Vec3 shown_ = Vec3::Zero();  // the last force

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
