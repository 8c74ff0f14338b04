#include "runtime/live/stability.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "statics/live_forces.h"

namespace palpate {

LargestFrequency::LargestFrequency(const LiveBody& body)
    : body_(body), K_(body.pattern().zero()), shape_(body.free_dofs()), root_mass_(body.free_dofs()) {
  std::mt19937 random(1);  // a start vector with a component of every shape
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  for (Index k = 0; k < body.free_dofs(); ++k) {
    shape_[k] = entry(random);
    root_mass_[k] = std::sqrt(body.mass()[body.dof_of_free()[k]]);
  }
}

double LargestFrequency::estimate(const Eigen::VectorXd& x, std::span<const Mat3> plastic, int rounds) {
  if (body_.free_dofs() == 0) return 0.0;
  assemble_tangent(body_, x, plastic, TangentKind::positive, K_);
  const auto K = K_.selfadjointView<Eigen::Lower>();
  double square = 0.0;
  for (int k = 0; k < rounds; ++k) {
    shape_.normalize();
    const Eigen::VectorXd u = shape_.cwiseQuotient(root_mass_);
    const Eigen::VectorXd next = (K * u).cwiseQuotient(root_mass_);
    square = shape_.dot(next);
    if (!(next.squaredNorm() > 0.0)) break;
    shape_ = next;
  }
  return std::sqrt(std::max(square, 0.0));
}

double longest_step_at(const LiveBody& body, double omega) {
  if (!(omega > 0.0)) return std::numeric_limits<double>::infinity();
  const Rayleigh& damping = body.options().damping;
  const double zeta = 0.5 * (damping.mass / omega + damping.stiffness * omega);
  return 2.0 / (omega * (std::sqrt(1.0 + zeta * zeta) + zeta));
}

}  // namespace palpate
