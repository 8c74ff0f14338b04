// How the motion of all dofs is stepped beside the tick.
#pragma once

#include <span>

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
};

}  // namespace palpate
