// Warped body as a motion stepper.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "runtime/background/motion_stepper.h"
#include "runtime/warp/body_warp.h"

namespace palpate {

/// Statistics of a warped body.
struct WarpTelling {
  std::int64_t turns = 0;         ///< number of times that the tick's compliance was rotated
  double largest_rotation = 0.0;  ///< rotation of the surface so far [rad]
  double last_rotation = 0.0;     ///< present rotation of the surface [rad]
  double last_residual = 0.0;     ///< residual of the linear displacement: change by the next round [-]
  std::int64_t unbalanced = 0;    ///< jobs that ended before balance was reached
};

/// Warps a body beside the tick. The tick uses x = x(f_p) + W (f - f_p): f_p are the forces of the last job,
/// x(f_p) is the warped body under them, and W the Green's functions rotated with the surface, R_i Xi_ij
/// R_j^T. Additional terms make W equal to J Xi J^T for forces distributed like those of the job, in any
/// direction (update of rank 2 d by Davidon, Fletcher and Powell, which stays positive). Errors of W thus do
/// not accumulate: at rest the body is at the state of WarpBalance. W is updated once the surface has
/// rotated, or W was wrong about the last step.
class WarpedMotion final : public MotionStepper {
 public:
  /// `body` must be warped (ContactModel), and outlive this. Throws Error if it cannot be warped.
  explicit WarpedMotion(const Body& body);

  void rest() noexcept override;
  void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept override;
  [[nodiscard]] std::shared_ptr<const Greens> compliance() const noexcept override { return turned_; }

  [[nodiscard]] WarpTelling telling() const;  ///< for any thread

 private:
  [[nodiscard]] const Greens& now() const noexcept { return turned_ != nullptr ? *turned_ : body_.greens(); }
  [[nodiscard]] bool must_turn(const MotionJob& job) const;
  void turn_compliance(const MotionJob& job);
  [[nodiscard]] std::vector<double> spread(const MotionJob& job, int axis) const;
  void tell(bool is_balanced);

  const Body& body_;
  SurfaceWarp warp_;
  WarpBalance balance_;
  std::vector<Mat3> R_, R_turned_;                   // [stored] present rotations, and those of turned_
  std::vector<double> by_load_;                      // [n] W f
  std::vector<double> x_, x_before_;                 // [n] displacement by the last job, and the one before
  std::vector<double> without_;                      // [n] displacement passed to the tick: x_ - W f
  std::shared_ptr<const Greens> turned_;             // W; null: that of the body at rest
  std::vector<std::shared_ptr<const Greens>> kept_;  // until the tick has released them: the tick frees none
  mutable std::mutex mutex_;                         // guards telling_
  WarpTelling telling_;
};

}  // namespace palpate
