// How the motion of all dofs is stepped beside the tick.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/body/free_motion.h"

namespace palpate {

/// Ends the step that was predicted last, with the forces that the tick found, and predicts the next one.
class MotionStepper {
 public:
  MotionStepper() = default;
  virtual ~MotionStepper() = default;
  MotionStepper(const MotionStepper&) = delete;
  MotionStepper& operator=(const MotionStepper&) = delete;

  /// Back to rest.
  virtual void rest() noexcept = 0;
  /// Does a job, `lets_go` with its release; fills u [n] of the stored dofs at the end of the step after, as
  /// it would be without contact forces [m].
  virtual void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept = 0;
  /// Whether the last step was explicit, and close to the longest stable one.
  [[nodiscard]] virtual bool is_near_limit() const noexcept { return false; }
  /// Fills `u` as MotionSample::untouched.
  virtual void tell_untouched(std::vector<double>& u) const noexcept { u.clear(); }
  /// What contact forces act by on top of that u; null: the body's Green's functions.
  [[nodiscard]] virtual std::shared_ptr<const Greens> compliance() const noexcept { return nullptr; }
};

}  // namespace palpate
