// Interface to steppers of all dofs beside the tick.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/core/body/free_motion.h"

namespace palpate {

/// Ends the last predicted step with the forces found by the tick, and predicts the next one.
class MotionStepper {
 public:
  MotionStepper() = default;
  virtual ~MotionStepper() = default;
  MotionStepper(const MotionStepper&) = delete;
  MotionStepper& operator=(const MotionStepper&) = delete;

  /// Resets to rest.
  virtual void rest() noexcept = 0;
  /// Performs a job, including its release if `lets_go`; writes the displacement u [n] of the stored dofs at
  /// the end of the next step without contact forces [m].
  virtual void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept = 0;
  /// Writes MotionSample::untouched to `u`.
  virtual void tell_untouched(std::vector<double>& u) const noexcept { u.clear(); }
  /// Writes MotionSample::shift to `shift`.
  virtual void tell_shift(std::vector<double>& shift) const noexcept { shift.clear(); }
  /// Error of the job's forces, as a fraction of them, where it is more than a hand can feel; else 0.
  [[nodiscard]] virtual double force_error() const noexcept { return 0.0; }
  /// MotionSample::small_strain of the job's forces.
  [[nodiscard]] virtual double small_strain() const noexcept { return 0.0; }
  /// Compliance for contact forces, whose effect is added to u; null: the body's Green's functions.
  [[nodiscard]] virtual std::shared_ptr<const Greens> compliance() const noexcept { return nullptr; }
};

}  // namespace palpate
