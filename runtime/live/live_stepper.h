// Time stepping of a live body, with safeguards against divergence.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "runtime/live/implicit_step.h"
#include "runtime/live/plastic_flow.h"
#include "runtime/live/stability.h"
#include "statics/live_forces.h"

namespace palpate {

struct StepperOptions {
  double time_step = 0.001;  ///< h [s]
  ImplicitOptions scheme{};  ///< the integrator, the explicit one too
  std::vector<Wall> walls{};
};

/// Result of a step.
struct LiveReport {
  bool whole = true;   ///< false: it diverged in the shortest steps too, and the body was stopped
  int parts = 1;       ///< parts of a divided step: it diverged, or the body became too stiff
  Index inverted = 0;  ///< largest number of inverted quadrature points during the step
  Index contacts = 0;  ///< nodes pushed by a wall
  FlowSums flow{};     ///< plastic flow
};

/// Counts of events during all steps.
struct LiveCounts {
  std::int64_t steps = 0;
  std::int64_t halved = 0;    ///< divided steps
  std::int64_t stopped = 0;   ///< steps that diverged at any length
  std::int64_t inverted = 0;  ///< steps with inverted elements
  Index most_inverted = 0;    ///< most inverted quadrature points in a step
  double plastic_work = 0.0;  ///< [J]

  void add(const LiveReport& report) noexcept;
};

/// Steps of one length. Explicit ones are refused where they are longer than is stable, and cut while the
/// body is stiffer than at rest; implicit ones are cut where Newton's method does not get there.
class LiveStepper {
 public:
  /// Throws Error if the step is not positive, an explicit step is unstable at rest (with the limit), or a
  /// wall is invalid.
  LiveStepper(const LiveBody& body, const StepperOptions& options);

  /// Performs one step under `push` [d N] in addition to the body's load [N]; empty: none.
  LiveReport step(LiveState& state, const Eigen::VectorXd& push = {});

  [[nodiscard]] const LiveCounts& counts() const noexcept { return counts_; }
  /// Factor of the last implicit step.
  [[nodiscard]] const TangentSolver& solver() const noexcept { return implicit_.solver(); }

 private:
  bool advance(LiveState& state, double h, const Eigen::VectorXd& push, int depth, LiveReport& report);
  bool advance_once(LiveState& state, double h, const Eigen::VectorXd& push, LiveReport& report);
  bool advance_explicitly(LiveState& state, double h, const Eigen::VectorXd& push, LiveReport& report);
  Index meet_walls(const Eigen::VectorXd& from, double h, Eigen::VectorXd& x, Eigen::VectorXd& v) const;

  const LiveBody& body_;
  StepperOptions options_;
  ImplicitStep implicit_;
  LargestFrequency frequency_;
  double limit_;  // longest stable step by the last look [s]; implicit: infinity
  LiveCounts counts_;
  Eigen::VectorXd none_;    // [d N]
  Eigen::VectorXd forces_;  // [d N]
};

/// Adds the damping forces -C_d v of a body at positions x to f [d N] [N].
void add_damping_forces(const LiveBody& body, const Eigen::VectorXd& x, const Eigen::VectorXd& v,
                        std::span<const Mat3> plastic, Eigen::VectorXd& f);

}  // namespace palpate
