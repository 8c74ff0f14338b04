// A solution that is older than the tick.
#pragma once

#include "runtime/safety/device.h"

namespace palpate {

struct StaleOptions {
  double fresh = 0.0015;        ///< up to this age a solution is of this tick [s]
  double time_to_live = 0.010;  ///< up to this age an older one is extrapolated [s]
  double fade = 0.020;          ///< then from whole to no force, and back when there is one again [s]
  double damping = 0.5;         ///< b, of a solution that is not fresh [N s/m]
};

/// The last solution as a field: force - K (x - point) - b v within its radius and time to live; outside of
/// either it fades. It is never held. (The model that a VRPN force field carries; ecosystem rule 2.4.4.)
class StaleSolution {
 public:
  explicit StaleSolution(const StaleOptions& options) noexcept : options_(options) {}

  /// The force at `position` [m], still whole; b only for old ones. Beyond the radius: that at its edge.
  /// `age` [s] and `elapsed` since the last call [s] move the share.
  Vec3 force(const DeviceCommand& solution, const Vec3& position, const Vec3& velocity, double age,
             double elapsed) noexcept;

  [[nodiscard]] double share() const noexcept { return share_; }  ///< of it that may be shown [0, 1]

  void reset() noexcept { share_ = 1.0; }

 private:
  StaleOptions options_;
  double share_ = 1.0;
};

}  // namespace palpate
