// The law of one contact.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "runtime/core/solve/contact_problem.h"

namespace palpate {

/// One contact of a ContactProblem, by its force f [N] and the motion r [m] along its rows: Alart & Curnier's
/// equations (1991), and the force that solves them alone.
struct ContactLaw {
  enum class Kind : std::uint8_t { absent, normal, cone, held };
  enum class Mode : std::uint8_t { open, stick, slip };

  ContactLaw() = default;
  /// Contact `k` of a problem whose W is `W`.
  template <typename Real>
  ContactLaw(const ContactProblem& problem, Index k, MatrixRows<const Real> W) noexcept;

  /// Difference of the equations' two sides [N].
  [[nodiscard]] Vec3 difference(const Vec3& f, const Vec3& r) const noexcept;
  /// Change of f that solves the equations, the other contacts being as they are.
  [[nodiscard]] Vec3 suiting_change(const Vec3& f, const Vec3& r) const noexcept;
  /// Nearest force in the cone, except that normal forces below zero become zero.
  [[nodiscard]] Vec3 within(const Vec3& f) const noexcept;
  /// Sets the mode of one that is there, and where it slips, what is of that.
  void choose_mode(const Vec3& f, const Vec3& r) noexcept;

  Index first = 0;  ///< row
  int rows = 0;
  Index owner = -1;  ///< contact of a held row
  Kind kind = Kind::held;
  Mode mode = Mode::open;
  double mu = 0.0;
  double w = 0.0;                                         ///< mean of W's diagonal [m/N]
  Vec3 n = Vec3::Zero();                                  ///< normal in the axes of the rows
  Eigen::Matrix3d D = Eigen::Matrix3d::Identity();        ///< W at the contact itself [m/N]
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();  ///< inverse of D
  Vec3 e = Vec3::Zero();                                  ///< slipping: direction of the tangential force
  Vec3 across = Vec3::Zero();                             ///< slipping: the tangent across e
  double turning = 0.0;                                   ///< slipping: motion across per force across [m/N]

 private:
  [[nodiscard]] Vec3 slipping_force(const Vec3& f, const Vec3& r, const Vec3& sticking) const noexcept;
};

}  // namespace palpate
