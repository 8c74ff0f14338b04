// Steps a live body, and sees to it that steps stay whole.
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
  ImplicitOptions scheme{};  ///< the integrator, of explicit ones too
  std::vector<Wall> walls{};
};

/// What a step did.
struct LiveReport {
  bool whole = true;   ///< else it diverged in the shortest steps too: the body was stopped where it was
  int parts = 1;       ///< steps that it was cut into as it diverged, or where the body had become too stiff
  int newton = 0;      ///< steps of Newton's method in all parts
  Index inverted = 0;  ///< most quadrature points on its way
  Index contacts = 0;  ///< nodes that a wall pushes
  FlowSums flow{};     ///< plastic flow
  double limit = 0.0;  ///< explicit: longest stable step by the last look [s]; else infinity
  bool is_near = false;  ///< explicit: the step is above nine tenths of the limit
};

/// How often what has happened.
struct LiveCounts {
  std::int64_t steps = 0;
  std::int64_t halved = 0;      ///< steps that were cut
  std::int64_t stopped = 0;     ///< steps that diverged however short
  std::int64_t inverted = 0;    ///< steps in which elements were inverted
  Index most_inverted = 0;      ///< quadrature points in a step
  std::int64_t near_limit = 0;  ///< explicit: steps above nine tenths of the stable one
  double plastic_work = 0.0;    ///< [J]

  void add(const LiveReport& report) noexcept;
};

/// Steps of one length. Explicit ones are refused where they are longer than is stable, watched while the
/// body stiffens, and cut then; implicit ones are cut where Newton's method does not get there.
class LiveStepper {
 public:
  /// Throws Error for a step that is not positive, for explicit steps longer than is stable at rest (with the
  /// limit), for walls without sense.
  LiveStepper(const LiveBody& body, const StepperOptions& options);

  /// One step under `push` [d N] beside the body's load [N]; empty: none.
  LiveReport step(LiveState& state, const Eigen::VectorXd& push = {});

  [[nodiscard]] const LiveBody& body() const noexcept { return body_; }
  [[nodiscard]] const StepperOptions& options() const noexcept { return options_; }
  [[nodiscard]] const LiveCounts& counts() const noexcept { return counts_; }
  /// The longest stable step at rest [s]: infinity of implicit integrators.
  [[nodiscard]] double limit_at_rest() const noexcept { return limit_at_rest_; }
  /// The factor of the last implicit step.
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

/// f [d N] += -C_d v, the damping forces of a body at positions x [N].
void add_damping_forces(const LiveBody& body, const Eigen::VectorXd& x, const Eigen::VectorXd& v,
                        std::span<const Mat3> plastic, Eigen::VectorXd& f);

}  // namespace palpate
