// A warped body as a motion stepper.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "runtime/background/motion_stepper.h"
#include "runtime/warp/warp_balance.h"

namespace palpate {

/// What is told of a warped body.
struct WarpTelling {
  std::int64_t turns = 0;         ///< how often the compliance of the tick was turned anew
  double largest_rotation = 0.0;  ///< of the surface, so far [rad]
  double last_rotation = 0.0;     ///< now [rad]
  double last_residual = 0.0;     ///< of the linear displacement: what the next round will change [-]
  std::int64_t unbalanced = 0;    ///< jobs that ended before the balance was found
};

/// Warps a body beside the tick. The tick meets x = x(f_p) + W (f - f_p): f_p are the forces of the last job, x
/// where the warped body is under them, and W = R_i Xi_ij R_j^T the Green's functions turned with the surface.
/// So an error of W does not add up: at rest the body is where WarpBalance has it.
class WarpedMotion final : public MotionStepper {
 public:
  /// `body` must be warped (ContactModel), and live as long. Throws Error where it cannot be.
  explicit WarpedMotion(const Body& body);

  void rest() noexcept override;
  void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept override;
  [[nodiscard]] std::shared_ptr<const Greens> compliance() const noexcept override { return turned_; }

  [[nodiscard]] WarpTelling telling() const;  ///< from any thread

 private:
  void turn_compliance();
  void tell(bool is_balanced);

  const Body& body_;
  SurfaceWarp warp_;
  WarpBalance balance_;
  std::vector<Mat3> R_, R_turned_;         // [stored] rotations now, and those of turned_
  std::vector<double> by_load_;            // [n] W f
  std::shared_ptr<const Greens> turned_;   // W; null: that of the body at rest
  std::vector<std::shared_ptr<const Greens>> kept_;  // until the tick has let go of them: none is freed there
  mutable std::mutex mutex_;               // of telling_
  WarpTelling telling_;
};

}  // namespace palpate
