// Live body as a motion stepper.
#pragma once

#include <Eigen/Core>
#include <mutex>
#include <vector>

#include "runtime/background/live_compliance.h"
#include "runtime/background/motion_stepper.h"
#include "runtime/live/live_stepper.h"

namespace palpate {

/// Report on a live body: its steps, and the error of the tick's local model.
struct LiveTelling {
  LiveCounts counts;
  double compliance_age = 0.0;  ///< time of the body since the factorisation of the tick's compliance [s]
  std::int64_t renewals = 0;    ///< number of renewals from a new factor
  std::int64_t turns = 0;       ///< number of rotations with the body
  /// Distance of loaded nodes at the end of a step from their position by the compliance [m]: largest, and
  /// that of the last step.
  double largest_error = 0.0;
  double last_error = 0.0;
  /// Resulting error of the tool's force, along the force: F (f . du) / (f . W f) [N]: largest, and that of
  /// the last step.
  double largest_force_error = 0.0;
  double last_force_error = 0.0;
  double largest_force = 0.0;  ///< largest sum of the forces on the body at the end of a step [N]
};

/// Measures the computing time of a live model's step beside the tick, by a trial under a small force [s].
double measured_step(const Body& body);

/// Steps a live body. The tick uses x = x_p + W (f - f_p): x_p is the end of the step with the last forces
/// f_p held, W the compliance of one step, which is renewed as the body changes (LiveCompliance). The step is
/// then repeated with the forces f at the end of the tick, without W; the difference is the error of the
/// local model.
class LiveMotion final : public MotionStepper {
 public:
  /// `body` must have a live one, and outlive this.
  explicit LiveMotion(const Body& body, bool renews_compliance = true);

  void rest() noexcept override;
  void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept override;

  [[nodiscard]] std::shared_ptr<const Greens> compliance() const noexcept override {
    return compliance_.renewed();
  }
  void tell_untouched(std::vector<double>& u) const noexcept override;
  [[nodiscard]] const LiveState& state() const noexcept { return state_; }

  [[nodiscard]] LiveTelling telling() const;  ///< for any thread

 private:
  void put_on(const NodalLoad& load, Eigen::VectorXd& push) const noexcept;
  void predict();
  void step(const MotionJob& job);
  void displace(const NodalLoad& load, std::vector<double>& u) const noexcept;
  double compare(const MotionJob& job, const LiveReport& report) noexcept;
  void follow_untouched() noexcept;

  const Body& body_;
  const LiveBody& live_;
  LiveStepper stepper_;
  LiveCompliance compliance_;
  LiveReport predicted_report_;
  LiveState rest_, state_, predicted_;  // at rest; present state; state at the end of the predicted step
  Eigen::VectorXd push_;                // [d N] forces of the prediction
  std::vector<double> by_load_;         // [n] W f of the last job
  std::vector<double> by_last_load_;    // [n] W f_p
  Eigen::VectorXd found_;               // [d N] positions of all nodes when the tool was last away,
  Eigen::VectorXd untouched_;           // [d N] found_ moved with the body, at the end of the predicted step
  std::vector<Index> far_;              // [N] workspace: nodes in the order of their distance from the tool
  mutable std::mutex mutex_;            // guards telling_
  LiveTelling telling_;
};

}  // namespace palpate
