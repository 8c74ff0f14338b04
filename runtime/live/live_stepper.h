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
  ImplicitOptions scheme{};  ///< integrator, also an explicit one
  std::vector<Wall> walls{};
};

/// Result of a step.
struct LiveReport {
  bool whole = true;     ///< false: it diverged in the shortest steps too, and the body was stopped
  int parts = 1;         ///< parts of a divided step: it diverged, or the body became too stiff
  int newton = 0;        ///< Newton steps in all parts
  Index inverted = 0;    ///< largest number of inverted quadrature points during the step
  Index contacts = 0;    ///< nodes pushed by a wall
  FlowSums flow{};       ///< plastic flow
  double limit = 0.0;    ///< explicit: longest stable step at the last check [s]; else infinity
  bool is_near = false;  ///< explicit: the step exceeds nine tenths of the limit
};

/// Counts of events during all steps.
struct LiveCounts {
  std::int64_t steps = 0;
  std::int64_t halved = 0;      ///< divided steps
  std::int64_t stopped = 0;     ///< steps that diverged at any length
  std::int64_t inverted = 0;    ///< steps with inverted elements
  Index most_inverted = 0;      ///< most inverted quadrature points in a step
  std::int64_t near_limit = 0;  ///< explicit: steps above nine tenths of the stable one
  double plastic_work = 0.0;    ///< [J]

  void add(const LiveReport& report) noexcept;
};

/// Steps of fixed length. Unstable explicit steps are refused, and checked and divided as the body stiffens;
/// implicit steps are divided if Newton's method does not converge.
class LiveStepper {
 public:
  /// Throws Error if the step is not positive, an explicit step is unstable at rest (with the limit), or a
  /// wall is invalid.
  LiveStepper(const LiveBody& body, const StepperOptions& options);

  /// Performs one step under `push` [d N] in addition to the body's load [N]; empty: none.
  LiveReport step(LiveState& state, const Eigen::VectorXd& push = {});

  [[nodiscard]] const LiveBody& body() const noexcept { return body_; }
  [[nodiscard]] const StepperOptions& options() const noexcept { return options_; }
  [[nodiscard]] const LiveCounts& counts() const noexcept { return counts_; }
  /// Longest stable step at rest [s]; infinity for implicit integrators.
  [[nodiscard]] double limit_at_rest() const noexcept { return limit_at_rest_; }
  /// Factor of the last implicit step.
  [[nodiscard]] const TangentSolver& solver() const noexcept { return implicit_.solver(); }
  [[nodiscard]] const WallContacts& contacts() const noexcept { return implicit_.contacts(); }

 private:
  bool advance(LiveState& state, double h, const Eigen::VectorXd& push, int depth, LiveReport& report);
  bool advance_once(LiveState& state, double h, const Eigen::VectorXd& push, LiveReport& report);
  bool advance_explicitly(LiveState& state, double h, const Eigen::VectorXd& push, LiveReport& report);
  Index meet_walls(const Eigen::VectorXd& from, double h, Eigen::VectorXd& x, Eigen::VectorXd& v) const;
  void find_acceleration(LiveState& state, const Eigen::VectorXd& push);
  void watch_limit(const LiveState& state, LiveReport& report);

  const LiveBody& body_;
  StepperOptions options_;
  ImplicitStep implicit_;
  LargestFrequency frequency_;
  double limit_at_rest_;
  double limit_;
  LiveCounts counts_;
  Eigen::VectorXd none_;    // [d N]
  Eigen::VectorXd forces_;  // [d N]
};

/// Adds the damping forces -C_d v of a body at positions x to f [d N] [N].
void add_damping_forces(const LiveBody& body, const Eigen::VectorXd& x, const Eigen::VectorXd& v,
                        std::span<const Mat3> plastic, Eigen::VectorXd& f);

}  // namespace palpate
