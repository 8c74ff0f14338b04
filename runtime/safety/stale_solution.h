// Extrapolation of a solution that is older than the tick.
#pragma once

#include "runtime/safety/device.h"

namespace palpate {

struct StaleOptions {
  double fresh = 0.0015;        ///< age up to which a solution counts as current [s]
  double time_to_live = 0.010;  ///< age up to which an older solution is extrapolated [s]
  double fade = 0.020;          ///< time to fade out after that, and back in with a new solution [s]
  double damping = 0.5;         ///< b: damping added to a solution that is not current [N s/m]
};

/// Last solution as a force field: force - K (x - point) - b v within its radius and time to live; outside
/// either it fades. The force is never held constant. (The model of a VRPN force field; ecosystem rule
/// 2.4.4.)
class StaleSolution {
 public:
  explicit StaleSolution(const StaleOptions& options) noexcept : options_(options) {}

  /// Returns the force [N] at `position` [m], not yet scaled by share(). b acts only on a solution that is
  /// not current. Beyond the radius the displacement is cut to the radius. `age` [s] and `elapsed` since the
  /// last call [s] update share(), which is at most 1 - (age - time_to_live) / fade: a solution that arrives
  /// old has faded on its way.
  Vec3 force(const DeviceCommand& solution, const Vec3& position, const Vec3& velocity, double age,
             double elapsed) noexcept;

  [[nodiscard]] double share() const noexcept { return share_; }  ///< fraction of the force to display [0, 1]

  void reset() noexcept { share_ = 1.0; }

 private:
  StaleOptions options_;
  double share_ = 1.0;
};

}  // namespace palpate
