// A live body as a motion stepper.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <mutex>
#include <vector>

#include "runtime/background/live_compliance.h"
#include "runtime/background/motion_stepper.h"
#include "runtime/live/live_stepper.h"

namespace palpate {

/// What is told of a live body: how its steps went, and how far the tick's local model of it was off.
struct LiveTelling {
  LiveCounts counts;
  double compliance_age = 0.0;  ///< time of the body since the compliance that ticks use was factored [s]
  std::int64_t renewals = 0;    ///< times that it was factored anew
  std::int64_t turns = 0;       ///< times that it was turned with the body
  /// How far loaded nodes were at the end of a step from where the compliance had them, at most [m]; and of
  /// the last.
  double largest_error = 0.0;
  double last_error = 0.0;
  /// What that makes of the tool's force, along the force: F (f . du) / (f . W f), at most; and of the last
  /// [N].
  double largest_force_error = 0.0;
  double last_force_error = 0.0;
  /// The shortest of the longest stable steps on the way, of explicit integrators [s]; else infinity.
  double step_limit = std::numeric_limits<double>::infinity();
  double largest_force = 0.0;  ///< sum of the forces on the body at the end of a step [N]
};

/// Time that the body of a live model takes for a step beside the tick, by a trial under a small push [s].
double measured_step(const Body& body);

/// Steps a live body. The tick meets x = x_p + W (f - f_p): x_p is the step with the forces f_p of the last
/// one held, W the compliance of one step, which is renewed as the body changes (LiveCompliance). The forces
/// f that the tick ends with do the step anew, without W; how far the two are apart is the error of the local
/// model.
class LiveMotion final : public MotionStepper {
 public:
  /// `body` must have a live one, and live as long.
  explicit LiveMotion(const Body& body, bool renews_compliance = true);

  void rest() noexcept override;
  void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept override;

  [[nodiscard]] std::shared_ptr<const Greens> compliance() const noexcept override {
    return compliance_.renewed();
  }
  [[nodiscard]] bool is_near_limit() const noexcept override { return predicted_report_.is_near; }
  void tell_untouched(std::vector<double>& u) const noexcept override;
  [[nodiscard]] const LiveState& state() const noexcept { return state_; }

  [[nodiscard]] LiveTelling telling() const;  ///< from any thread

 private:
  void put_on(const NodalLoad& load, Eigen::VectorXd& push) const noexcept;
  void predict() noexcept;
  void displace(const NodalLoad& load, std::vector<double>& u) const noexcept;
  double compare(const MotionJob& job, const LiveReport& report) noexcept;
  void follow_untouched() noexcept;

  const Body& body_;
  const LiveBody& live_;
  LiveStepper stepper_;
  LiveCompliance compliance_;
  LiveReport predicted_report_;
  LiveState state_, predicted_;       // now; at the end of the step that is predicted
  Eigen::VectorXd push_;              // [d N] forces with which it was predicted
  std::vector<double> by_load_;       // [n] W f of the last job
  std::vector<double> by_last_load_;  // [n] W f_p
  Eigen::VectorXd found_;             // [d N] where all nodes were when the tool was last away,
  Eigen::VectorXd untouched_;  // [d N] and that moved along with the body, at the end of the predicted step
  std::vector<Index> far_;     // [N] scratch: nodes in the order of their way from the tool
  mutable std::mutex mutex_;   // of `telling_`
  LiveTelling telling_;
};

}  // namespace palpate
