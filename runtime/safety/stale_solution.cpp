#include "runtime/safety/stale_solution.h"

#include <algorithm>

#include "runtime/safety/clamps.h"

namespace palpate {

Vec3 StaleSolution::force(const DeviceCommand& solution, const Vec3& position, const Vec3& velocity,
                          double age, double elapsed) noexcept {
  const double radius = solution.local.radius > 0.0 ? solution.local.radius : 0.0;
  const Vec3 moved = position - solution.local.point;
  const bool fresh = age <= options_.fresh;
  const bool holds = fresh || (age <= options_.time_to_live && moved.norm() <= radius);
  if (fresh) share_ = std::min(1.0, share_ + elapsed / options_.fade);
  if (!holds) share_ -= elapsed / options_.fade;
  share_ = std::max(0.0, std::min(share_, 1.0 - (age - options_.time_to_live) / options_.fade));
  const Vec3 force = solution.wrench.force - solution.local.stiffness * clamped(moved, radius);
  return fresh ? force : Vec3(force - options_.damping * velocity);
}

}  // namespace palpate
