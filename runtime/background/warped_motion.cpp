#include "runtime/background/warped_motion.h"

#include <algorithm>
#include <cmath>
#include <exception>

namespace palpate {
namespace {

constexpr WarpBalanceOptions effort{.tolerance = 1e-4, .most_rounds = 3};
constexpr double most_turn = 0.03;  // [rad] by which W is behind

/// Sine of half the angle between rotations: |A - B| = 2 sqrt(2) sin(angle / 2).
double half_sine(const Mat3& A, const Mat3& B) {
  return (A - B).norm() / std::sqrt(8.0);
}

}  // namespace

WarpedMotion::WarpedMotion(const Body& body)
    : body_(body),
      warp_(body),
      balance_(warp_),
      R_(static_cast<std::size_t>(body.greens().nodes()), Mat3::Identity()),
      R_turned_(R_),
      by_load_(static_cast<std::size_t>(body.greens().order())) {}

void WarpedMotion::rest() noexcept {
  balance_.rest();
  std::fill(R_turned_.begin(), R_turned_.end(), Mat3::Identity());
  turned_ = nullptr;
  const std::lock_guard lock(mutex_);
  telling_ = {};
}

WarpTelling WarpedMotion::telling() const {
  const std::lock_guard lock(mutex_);
  return telling_;
}

void WarpedMotion::do_job(const MotionJob& job, bool, std::span<double> u) noexcept {
  try {
    const bool is_balanced = balance_.find(job.load.nodes(), job.load.forces(), effort);
    warp_.rotations(balance_.place(), R_);
    turn_compliance();
    tell(is_balanced);
  } catch (const std::exception&) {  // there is no memory: the body stays as it was
  }
  warp_.displacement(balance_.place(), u);
  if (job.load.empty()) return;
  const Greens& W = turned_ != nullptr ? *turned_ : body_.greens();
  W.displacement(job.load.nodes(), job.load.forces(), by_load_);
  for (std::size_t k = 0; k < u.size(); ++k) u[k] -= by_load_[k];
}

void WarpedMotion::turn_compliance() {
  double behind = 0.0;
  for (std::size_t node = 0; node < R_.size(); ++node)
    behind = std::max(behind, half_sine(R_[node], R_turned_[node]));
  if (behind <= 0.5 * most_turn) return;
  turned_ = std::make_shared<const Greens>(body_.greens().turned(R_));
  R_turned_ = R_;
  std::erase_if(kept_, [](const auto& old) { return old.use_count() == 1; });
  kept_.push_back(turned_);
  const std::lock_guard lock(mutex_);
  ++telling_.turns;
}

void WarpedMotion::tell(bool is_balanced) {
  double turn = 0.0;
  for (const Vec3& w : balance_.place().w) turn = std::max(turn, w.norm());
  const std::lock_guard lock(mutex_);
  telling_.last_rotation = turn;
  telling_.largest_rotation = std::max(telling_.largest_rotation, turn);
  telling_.last_residual = balance_.residual();
  telling_.unbalanced += is_balanced ? 0 : 1;
}

}  // namespace palpate
