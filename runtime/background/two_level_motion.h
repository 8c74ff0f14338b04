// Body on two levels as a motion stepper.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "runtime/background/motion_stepper.h"
#include "runtime/body/body.h"
#include "runtime/depth/two_levels.h"

namespace palpate {

/// Statistics of a body on two levels.
struct DepthTelling {
  std::int64_t turns = 0;                ///< number of times that the tick's compliance was renewed
  double largest_rotation = 0.0;         ///< rotation of the surface so far [rad]
  double last_rotation = 0.0;            ///< present rotation of the surface [rad]
  double last_residual = 0.0;            ///< TwoLevelReport::residual
  std::int64_t unbalanced = 0;           ///< jobs that ended before balance was reached
  double largest_force = 0.0;            ///< of a balance so far [N]
  double small_strain_at_largest = 0.0;  ///< by which small strain has more force for the same places, as a
                                         ///< fraction of that force
  double last_small_strain = 0.0;        ///< likewise of the present balance
};

/// Finds the balance of a body on two levels beside the tick, for the places where the tick has the loaded
/// nodes. The tick uses x = x(f_p) + W (f - f_p): f_p are the forces of the last balance, x(f_p) the body
/// under them, and W the compliance there. Errors of W thus do not accumulate: at rest the body is in
/// balance. W is renewed once the surface has rotated, or W was wrong about the last step.
class TwoLevelMotion final : public MotionStepper {
 public:
  /// `body` must be on two levels (ContactModel), and outlive this.
  explicit TwoLevelMotion(const Body& body);

  void rest() noexcept override;
  void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept override;
  [[nodiscard]] std::shared_ptr<const Greens> compliance() const noexcept override { return renewed_; }

  [[nodiscard]] double force_error() const noexcept override { return force_error_; }
  [[nodiscard]] double small_strain() const noexcept override { return telling_.last_small_strain; }
  void tell_shift(std::vector<double>& shift) const noexcept override { shift = shift_; }

  [[nodiscard]] DepthTelling telling() const;  ///< for any thread

 private:
  /// Compliance of the mesh in the state of W. The tick's has the local compliance in place of the mesh's
  /// own.
  [[nodiscard]] const Greens& now() const noexcept { return mesh_ != nullptr ? *mesh_ : body_.greens(); }
  /// u [n + n_q] by the forces of the last balance.
  void find_by_load(const Greens& W, std::vector<double>& u) const;
  void take_load(const MotionJob& job);
  TwoLevelReport find();
  [[nodiscard]] double find_force_error();
  [[nodiscard]] bool must_renew() const;
  [[nodiscard]] std::vector<Index> near_nodes() const;
  void renew();
  void tell(const TwoLevelReport& report);

  const Body& body_;
  const CoarseParts& parts_;
  std::shared_ptr<const Greens> field_at_rest_;  // for its coarse displacement
  TwoLevels levels_;
  int failures_ = 0;                // searches in a row that found no balance
  double force_error_ = 0.0;        // of the job, as a fraction of its force; 0: not felt
  double largest_force_ = 0.0;      // since rest [N]
  std::vector<Index> nodes_;        // loaded in the job, each once
  std::vector<double> f_, places_;  // [d nodes_] their forces and displacements in the tick
  std::vector<Mat3> R_renewed_;     // [stored] rotations of W
  // [n + n_q] of the stored dofs and of the coarse field:
  std::vector<double> by_load_;                      // W f
  std::vector<double> x_, x_before_;                 // displacement by the last job, and the one before
  std::vector<double> shift_;                        // by the last change of W; empty: there was none
  std::vector<double> without_;                      // displacement passed to the tick: x_ - W f
  std::shared_ptr<const Greens> renewed_, mesh_;     // W, and that of now(); null: those of the body at rest
  std::vector<std::shared_ptr<const Greens>> kept_;  // until the tick has released them: the tick frees none
  mutable std::mutex mutex_;                         // guards telling_
  DepthTelling telling_;
};

}  // namespace palpate
