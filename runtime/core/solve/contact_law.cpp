#include "runtime/core/solve/contact_law.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "runtime/core/solve/tick_tuning.h"

namespace palpate {
namespace {

Vec3 tangential(const Vec3& v, const Vec3& n) noexcept {
  return v - n.dot(v) * n;
}

}  // namespace

template <typename Real>
ContactLaw::ContactLaw(const ContactProblem& problem, Index k, MatrixRows<const Real> W) noexcept
    : first(problem.first_row(k)),
      rows(problem.rows_of(k)),
      owner(problem.owner[k]),
      kind(rows == 0              ? Kind::absent
           : problem.held[k] != 0 ? Kind::held
           : rows == 1            ? Kind::normal
                                  : Kind::cone),
      mu(problem.friction[k]),
      n(problem.normal[k]) {
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < rows; ++j) D(i, j) = W[first + i][first + j];
    w += D(i, i);
  }
  if (rows > 0) w /= rows;
  for (int i = rows; i < 3; ++i) D(i, i) = w;
  inverse = D.inverse();
}
template ContactLaw::ContactLaw(const ContactProblem&, Index, MatrixRows<const float>) noexcept;
template ContactLaw::ContactLaw(const ContactProblem&, Index, MatrixRows<const double>) noexcept;

Vec3 ContactLaw::difference(const Vec3& f, const Vec3& r) const noexcept {
  if (kind == Kind::absent) return f;
  if (kind == Kind::held) return r / w;
  if (kind == Kind::normal) return {f[0] - std::max(0.0, f[0] - r[0] / w), 0.0, 0.0};
  const Vec3 z = f - r / w;
  const double normal = std::max(0.0, n.dot(z));
  Vec3 tangent = tangential(z, n);
  const double length = tangent.norm();
  if (length > mu * normal) tangent *= mu * normal / length;
  return f - normal * n - tangent;
}

/// Returns the force on the cone with r_n = 0 and r_t opposite to the tangential force; its direction is
/// found by Newton's method on the angle.
Vec3 ContactLaw::slipping_force(const Vec3& f, const Vec3& r, const Vec3& sticking) const noexcept {
  const Vec3 alone = r - D * f;  // motion without the contact's own force
  Vec3 to = tangential(f, n) - tangential(r, n) / w;
  if (!(to.squaredNorm() > 0.0)) to = tangential(sticking, n);
  if (!(to.squaredNorm() > 0.0)) return std::max(0.0, n.dot(f)) * n;
  to.normalize();
  Vec3 force = Vec3::Zero();
  for (int round = 0; round < tuning.many.local_rounds; ++round) {
    const Vec3 along = n + mu * to;
    const Vec3 moved = D * along;
    const double give = n.dot(moved);
    if (!(give > 0.0)) break;
    const double normal = -n.dot(alone) / give;
    force = normal * along;
    const Vec3 motion = alone + normal * moved;
    const Vec3 aside = n.cross(to);
    const double wrong = aside.dot(motion);
    const double scale = w * mu * normal;
    if (std::abs(wrong) <= tuning.many.local_tolerance * scale) {
      if (to.dot(motion) <= 0.0 || round > 0) break;
      to = -to;
      continue;
    }
    const Vec3 turned = D * aside;
    const double normal_change = -normal * mu * n.dot(turned) / give;
    double slope = -to.dot(motion) + normal_change * aside.dot(moved) + normal * mu * aside.dot(turned);
    if (!(slope > 0.0)) slope = scale;
    const double half = 0.5 * std::clamp(-wrong / slope, -0.5, 0.5);  // half the angle, by its tangent
    to = ((1.0 - half * half) * to + 2.0 * half * aside) / (1.0 + half * half);
  }
  return force;
}

Vec3 ContactLaw::suiting_change(const Vec3& f, const Vec3& r) const noexcept {
  Vec3 to_stick = -(inverse * r);
  if (kind == Kind::held) return to_stick;
  if (kind == Kind::normal) return {std::max(-f[0], -r[0] / w), 0.0, 0.0};
  if (n.dot(r - D * f) >= 0.0) return -f;
  const Vec3 sticking = f + to_stick;
  const double normal = n.dot(sticking);
  if (normal > 0.0 && tangential(sticking, n).norm() <= mu * normal) return to_stick;
  return slipping_force(f, r, sticking) - f;
}

Vec3 ContactLaw::within(const Vec3& f) const noexcept {
  const double normal = n.dot(f);
  if (kind == Kind::held) return f;
  if (!(normal > 0.0)) return Vec3::Zero();
  const Vec3 tangent = tangential(f, n);
  const double length = tangent.norm();
  if (kind != Kind::cone || length <= mu * normal) return f;
  return f + (mu * normal / length - 1.0) * tangent;
}

void ContactLaw::choose_mode(const Vec3& f, const Vec3& r) noexcept {
  mode = Mode::stick;
  if (kind == Kind::held) return;
  const double wanted = n.dot(f) - n.dot(r) / w;
  if (!(wanted > 0.0)) {
    mode = Mode::open;
  } else if (kind == Kind::cone) {
    const Vec3 z = tangential(f, n) - tangential(r, n) / w;
    const double normal = n.dot(f) > 0.0 ? n.dot(f) : wanted;
    const double bound = mu * normal;
    const double length = z.norm();
    if (length > bound) {
      mode = Mode::slip;
      e = z / length;
      across = n.cross(e);
      const double share = bound / length;
      turning = std::min((1.0 - share) * w / (share + 1e-20), 1e4 * w);
    }
  }
}

}  // namespace palpate
