#include "statics/warp_balance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

constexpr std::size_t most_mixed = 6;  // rounds
constexpr double most_turn = 3.0;      // [rad] beyond it the axis of the rotation is ambiguous

double largest(std::span<const double> values) {
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

}  // namespace

WarpBalance::WarpBalance(const SurfaceWarp& warp, LinearResponse linear)
    : warp_(warp),
      linear_(std::move(linear)),
      place_(warp),
      u_(static_cast<std::size_t>(warp.surface().dimension * warp.surface().stored_nodes())),
      f_(u_.size()),
      g_(u_.size()),
      rounds_(most_mixed, {std::vector<double>(u_.size()), std::vector<double>(u_.size())}) {}

void WarpBalance::rest() {
  std::fill(u_.begin(), u_.end(), 0.0);
  warp_.warp(u_, place_);
  residual_ = 0.0;
}

void WarpBalance::respond(std::vector<double>& v) {
  warp_.pull_back(place_, f_, g_);
  linear_(g_, v);
}

void WarpBalance::respond_to(std::span<const double> p, std::span<double> dx) {
  std::vector<double> u(u_.size());
  warp_.pull_back(place_, p, g_);
  linear_(g_, u);
  warp_.push_forward(place_, u, dx);
}

bool WarpBalance::find(std::span<const Index> nodes, std::span<const double> forces,
                       const WarpBalanceOptions& options) {
  if (largest(forces) == 0.0) {
    rest();
    return true;
  }
  const auto d = static_cast<std::size_t>(warp_.surface().dimension);
  std::fill(f_.begin(), f_.end(), 0.0);
  for (std::size_t k = 0; k < forces.size(); ++k)
    f_[d * static_cast<std::size_t>(nodes[k / d]) + k % d] += forces[k];
  for (int round = 0; round < options.most_rounds; ++round) {
    Round& now = rounds_[static_cast<std::size_t>(round) % most_mixed];
    respond(now.v);
    for (std::size_t k = 0; k < u_.size(); ++k) now.r[k] = now.v[k] - u_[k];
    residual_ = largest(now.r) / largest(now.v);
    mix(static_cast<std::size_t>(round) + 1);
    keep_within_reach();
    if (residual_ <= options.tolerance) return true;
  }
  return false;
}

/// Anderson mixing: the affine combination of the last rounds (weights sum to 1) with the smallest r.
void WarpBalance::mix(std::size_t rounds) {
  const std::size_t last = (rounds - 1) % most_mixed, count = std::min(rounds, most_mixed) - 1;
  const Round& now = rounds_[last];
  std::copy(now.v.begin(), now.v.end(), u_.begin());
  if (count == 0) return;
  const auto map = [](const std::vector<double>& values) {
    return Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values));
  };
  Eigen::MatrixXd dr(std::ssize(u_), static_cast<Eigen::Index>(count));
  std::vector<const Round*> before;
  for (std::size_t k = 0; k < most_mixed && before.size() < count; ++k) {
    if (k == last) continue;
    dr.col(std::ssize(before)) = map(now.r) - map(rounds_[k].r);
    before.push_back(&rounds_[k]);
  }
  const Eigen::VectorXd share = dr.colPivHouseholderQr().solve(map(now.r));
  if (!share.allFinite()) return;
  Eigen::Map<Eigen::VectorXd> u(u_.data(), std::ssize(u_));
  for (std::size_t k = 0; k < count; ++k)
    u -= share[static_cast<Eigen::Index>(k)] * (map(now.v) - map(before[k]->v));
}

/// Limits all rotations to `most_turn`; larger ones need forces that no body of such a rotation bears.
void WarpBalance::keep_within_reach() {
  if (!std::all_of(u_.begin(), u_.end(), [](double value) { return std::isfinite(value); })) return rest();
  warp_.warp(u_, place_);
  double turn = 0.0;
  for (const Vec3& w : place_.w) turn = std::max(turn, w.norm());
  if (turn <= most_turn) return;
  for (double& value : u_) value *= most_turn / turn;
  warp_.warp(u_, place_);
}

}  // namespace palpate
