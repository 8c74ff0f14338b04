#include "tests/support/second_routes/coulomb_solver.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::test {

using Eigen::Vector2d;
using Eigen::VectorXd;

/// What a sweep makes of a contact's force where it moves by `motion`.
VectorXd CoulombSolver::projected(Eigen::Index contact, const VectorXd& force, const VectorXd& motion) const {
  const Eigen::Index at = d_ * contact;
  VectorXd result(d_);
  result[0] = std::max(0.0, force[0] - motion[0] / W(at, at));
  if (d_ == 1) return result;
  const double give = 0.5 * (W(at + 1, at + 1) + W(at + 2, at + 2));
  Vector2d across = force.tail<2>() - motion.tail<2>() / give;
  const double most = friction * result[0];
  if (across.norm() > most) across *= most / across.norm();
  result.tail<2>() = across;
  return result;
}

double CoulombSolver::residual(const VectorXd& force) const {
  const VectorXd motion = b + W * force;
  double largest = std::numeric_limits<double>::min();
  double change = 0.0;
  for (Eigen::Index k = 0; k < contacts(); ++k) {
    const VectorXd now = force.segment(d_ * k, d_);
    const VectorXd next = projected(k, now, motion.segment(d_ * k, d_));
    const double difference = (next - now).norm();
    if (!std::isfinite(difference)) return std::numeric_limits<double>::infinity();
    change = std::max(change, difference);
    largest = std::max({largest, now.norm(), next.norm()});
  }
  return change / largest;
}

VectorXd CoulombSolver::without_friction(const std::vector<Eigen::Index>& closed) const {
  VectorXd next = VectorXd::Zero(b.size());
  next(closed) = solved(W(closed, closed), -b(closed));
  return next;
}

/// Normals stay shut. Where friction is used up, p_t = mu p_n z / |z| to first order about the present
/// z = p_t - r_t / w, else r_t = 0.
VectorXd CoulombSolver::with_friction(const std::vector<Eigen::Index>& closed, const VectorXd& motion) const {
  std::vector<Eigen::Index> rows;
  for (const Eigen::Index k : closed) rows.insert(rows.end(), {3 * k, 3 * k + 1, 3 * k + 2});
  Eigen::MatrixXd S = W(rows, rows);
  VectorXd right = -b(rows);
  for (Eigen::Index at = 0; at < S.rows(); at += 3) {
    const Eigen::Index row = rows[static_cast<std::size_t>(at)];
    const double give = 0.5 * (W(row + 1, row + 1) + W(row + 2, row + 2));
    const double normal = std::max(0.0, p[row]);
    const double most = friction * std::max(0.0, p[row] - motion[row] / W(row, row));
    const Vector2d z = p.segment<2>(row + 1) - motion.segment<2>(row + 1) / give;
    if (z.norm() <= most) continue;
    const Vector2d along = z.normalized();
    const Vector2d across(-along.y(), along.x());
    const double share = std::min(1.0, friction * normal / z.norm());
    const VectorXd turned = S.middleRows<2>(at + 1).transpose() * across;
    const double turned_right = across.dot(right.segment<2>(at + 1));
    S.row(at + 1).setZero();
    S.block<1, 2>(at + 1, at + 1) = along.transpose();
    S(at + 1, at) = -friction;
    right[at + 1] = 0.0;
    S.row(at + 2) = share / give * turned.transpose();
    S.block<1, 2>(at + 2, at + 1) += (1.0 - share) * across.transpose();
    right[at + 2] = share / give * turned_right;
  }
  VectorXd next = VectorXd::Zero(b.size());
  const VectorXd forces = S.partialPivLu().solve(right);
  next(rows) = forces;
  return next;
}

VectorXd CoulombSolver::newton_step() const {
  const VectorXd motion = b + W * p;
  std::vector<Eigen::Index> closed;
  for (Eigen::Index k = 0; k < contacts(); ++k) {
    if (p[d_ * k] - motion[d_ * k] / W(d_ * k, d_ * k) > 0.0) closed.push_back(k);
  }
  if (closed.empty()) return VectorXd::Zero(b.size());
  return d_ == 1 ? without_friction(closed) : with_friction(closed, motion);
}

void CoulombSolver::sweep(int times) {
  VectorXd motion = b + W * p;
  for (int n = 0; n < times; ++n) {
    for (Eigen::Index k = 0; k < contacts(); ++k) {
      const VectorXd now = p.segment(d_ * k, d_);
      const VectorXd step = projected(k, now, motion.segment(d_ * k, d_)) - now;
      if (step.isZero(0.0)) continue;
      p.segment(d_ * k, d_) += step;
      motion += W.middleCols(d_ * k, d_) * step;
    }
  }
}

double CoulombSolver::solve(double tolerance) {
  steps_ = 0;
  VectorXd best = p;
  double least = residual(p);
  int failures = 0;
  while (least > tolerance && steps_ < 80) {
    ++steps_;
    p = newton_step();
    // The step makes forces that no contact can bear: a sweep brings them back to where Newton starts well.
    if (failures > 0) sweep(failures > 3 ? 40 : 3);
    const double now = residual(p);
    failures = now < 0.7 * least ? 0 : failures + 1;
    if (now < least) {
      least = now;
      best = p;
    } else if (failures % 3 == 0) {
      p = best;
      sweep(20 * failures);
    }
  }
  if (least > tolerance) {
    p = best;
    sweep(3000);
    const double now = residual(p);
    if (now < least) return now;
    p = best;
  }
  return least;
}

}  // namespace palpate::test
