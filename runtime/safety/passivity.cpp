#include "runtime/safety/passivity.h"

#include <algorithm>

namespace palpate {

void Passivity::observe(const Vec3& position) noexcept {
  if (placed_) energy_ -= shown_.dot(position - position_);
  position_ = position;
  placed_ = true;
}

Vec3 Passivity::control(const Vec3& force, const Vec3& velocity) noexcept {
  if (force == Vec3::Zero()) energy_ = std::min(energy_, 0.0);
  damping_ = 0.0;
  const double next = energy_ - period_ * force.dot(velocity);
  const double speed2 = velocity.squaredNorm();
  if (!(next < 0.0 && speed2 > 0.0)) return force;
  damping_ = std::min(-next / (period_ * speed2), max_damping_);
  return force - damping_ * velocity;
}

}  // namespace palpate
