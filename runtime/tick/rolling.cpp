#include "runtime/tick/rolling.h"

#include <algorithm>

#include "runtime/solve/tick_tuning.h"

namespace palpate {

double rolling_radius(const Tool& tool, double edge) noexcept {
  return std::max(tuning.assembly.least_tilt_radius * edge, tool.radius);
}

Vec3 rolled_normal(const Vec3& normal, const Vec3& shift, double radius) noexcept {
  const Vec3 along = shift - shift.dot(normal) * normal;
  const double most = tuning.assembly.most_roll * radius;
  const double length = along.norm();
  return (radius * normal + (length > most ? most / length : 1.0) * along).normalized();
}

}  // namespace palpate
