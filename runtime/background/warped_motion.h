// A warped body as a motion stepper.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "runtime/background/motion_stepper.h"
#include "runtime/warp/body_warp.h"

namespace palpate {

/// What is told of a warped body.
struct WarpTelling {
  std::int64_t turns = 0;         ///< how often the compliance of the tick was turned anew
  double largest_rotation = 0.0;  ///< of the surface, so far [rad]
  double last_rotation = 0.0;     ///< now [rad]
  double last_residual = 0.0;     ///< of the linear displacement: what the next round will change [-]
  std::int64_t unbalanced = 0;    ///< jobs that ended before the balance was found
};

/// Warps a body beside the tick. The tick meets x = x(f_p) + W (f - f_p): f_p are the forces of the last job,
/// x where the warped body is under them, and W the Green's functions turned with the surface, R_i Xi_ij
/// R_j^T, with terms on top by which it is J Xi J^T for forces that are spread as those of the job are, in
/// any direction (Davidon, Fletcher and Powell's update of rank 2 d, which stays positive). So an error of W
/// does not add up: at rest the body is where WarpBalance has it. W is made anew where the surface has
/// turned, or where W was wrong about the last step.
class WarpedMotion final : public MotionStepper {
 public:
  /// `body` must be warped (ContactModel), and live as long. Throws Error where it cannot be.
  explicit WarpedMotion(const Body& body);

  void rest() noexcept override;
  void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept override;
  [[nodiscard]] std::shared_ptr<const Greens> compliance() const noexcept override { return turned_; }

  [[nodiscard]] WarpTelling telling() const;  ///< from any thread

 private:
  [[nodiscard]] const Greens& now() const noexcept { return turned_ != nullptr ? *turned_ : body_.greens(); }
  [[nodiscard]] bool must_turn(const MotionJob& job) const;
  void turn_compliance(const MotionJob& job);
  [[nodiscard]] std::vector<double> spread(const MotionJob& job, int axis) const;
  void tell(bool is_balanced);

  const Body& body_;
  SurfaceWarp warp_;
  WarpBalance balance_;
  std::vector<Mat3> R_, R_turned_;                   // [stored] rotations now, and those of turned_
  std::vector<double> by_load_;                      // [n] W f
  std::vector<double> x_, x_before_;                 // [n] displacement by the last job, and the one before
  std::vector<double> without_;                      // [n] what was given to the tick: x_ - W f
  std::shared_ptr<const Greens> turned_;             // W; null: that of the body at rest
  std::vector<std::shared_ptr<const Greens>> kept_;  // until the tick has let go of them: none is freed there
  mutable std::mutex mutex_;                         // of telling_
  WarpTelling telling_;
};

}  // namespace palpate
