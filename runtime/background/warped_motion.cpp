#include "runtime/background/warped_motion.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <exception>
#include <numeric>
#include <utility>

#include "base/vectors.h"

namespace palpate {
namespace {

constexpr WarpBalanceOptions effort{.tolerance = 1e-4, .most_rounds = 3};
constexpr double most_behind = 0.03;  // [rad] by which W may lag
constexpr double most_wrong = 0.3;    // error of W, as a fraction of a step's displacement of loaded nodes
constexpr double least_wrong = 1e-6;  // fraction of their displacement below which it is negligible
constexpr double least_part = 1e-6;   // [largest] smaller eigenvalues of a compliance are rounding

/// Pseudo-inverse of a positive semidefinite matrix; eigenvalues within rounding of zero are dropped.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(0.5 * (A + A.transpose()));
  const double least = least_part * parts.eigenvalues().maxCoeff();
  const Eigen::VectorXd inverse =
      parts.eigenvalues().unaryExpr([=](double part) { return part > least ? 1.0 / part : 0.0; });
  return parts.eigenvectors() * inverse.asDiagonal() * parts.eigenvectors().transpose();
}

/// Sine of half the angle between rotations: |A - B| = 2 sqrt(2) sin(angle / 2).
double half_sine(const Mat3& A, const Mat3& B) {
  return (A - B).norm() / std::sqrt(8.0);
}

}  // namespace

WarpedMotion::WarpedMotion(const Body& body)
    : body_(body),
      warp_(warp_surface(body)),
      balance_(warp_, linear_response(body)),
      R_(static_cast<std::size_t>(body.greens().nodes()), Mat3::Identity()),
      R_turned_(R_),
      by_load_(static_cast<std::size_t>(body.greens().order())),
      x_(by_load_.size()),
      x_before_(by_load_.size()),
      without_(by_load_.size()) {}

void WarpedMotion::rest() noexcept {
  balance_.rest();
  std::fill(R_turned_.begin(), R_turned_.end(), Mat3::Identity());
  turned_ = nullptr;
  for (std::vector<double>* all : {&x_, &x_before_, &without_}) std::fill(all->begin(), all->end(), 0.0);
  const std::lock_guard lock(mutex_);
  telling_ = {};
}

WarpTelling WarpedMotion::telling() const {
  const std::lock_guard lock(mutex_);
  return telling_;
}

void WarpedMotion::do_job(const MotionJob& job, bool, std::span<double> u) noexcept {
  std::swap(x_, x_before_);
  try {
    const bool is_balanced = balance_.find(job.load.nodes(), job.load.forces(), effort);
    warp_.displacement(balance_.place(), x_);
    warp_.rotations(balance_.place(), R_);
    if (must_turn(job)) turn_compliance(job);
    tell(is_balanced);
  } catch (const std::exception&) {  // out of memory: the body stays as it was
  }
  std::fill(by_load_.begin(), by_load_.end(), 0.0);
  if (!job.load.empty()) now().displacement(job.load.nodes(), job.load.forces(), by_load_);
  for (std::size_t k = 0; k < u.size(); ++k) without_[k] = x_[k] - by_load_[k];
  std::copy(without_.begin(), without_.end(), u.begin());
}

bool WarpedMotion::must_turn(const MotionJob& job) const {
  double behind = 0.0;
  for (std::size_t node = 0; node < R_.size(); ++node)
    behind = std::max(behind, half_sine(R_[node], R_turned_[node]));
  if (behind > 0.5 * most_behind) return true;
  if (turned_ == nullptr || job.load.empty()) return false;
  // Positions of the loaded nodes in the tick, compared with the actual ones.
  std::vector<double> by_load(x_.size());
  turned_->displacement(job.load.nodes(), job.load.forces(), by_load);
  double off = 0.0, moved = 0.0, size = 0.0;
  for (const Index node : job.load.nodes()) {
    const int d = body_.dimension();
    const Vec3 x = vector_at(x_, d, node);
    off += (x - vector_at(without_, d, node) - vector_at(by_load, d, node)).squaredNorm();
    moved += (x - vector_at(x_before_, d, node)).squaredNorm();
    size += x.squaredNorm();
  }
  return off > most_wrong * most_wrong * moved && off > least_wrong * least_wrong * size;
}

/// Unit force along an axis [n], distributed as the load is.
std::vector<double> WarpedMotion::spread(const MotionJob& job, int axis) const {
  const auto d = static_cast<std::size_t>(body_.dimension());
  std::vector<double> p(x_.size(), 0.0);
  double sum = 0.0;
  for (std::size_t k = 0; k < job.load.nodes().size(); ++k) {
    const double size = vector_at(job.load.forces(), body_.dimension(), static_cast<Index>(k)).norm();
    p[d * static_cast<std::size_t>(job.load.nodes()[k]) + static_cast<std::size_t>(axis)] += size;
    sum += size;
  }
  for (double& value : p) value /= sum;
  return p;
}

void WarpedMotion::turn_compliance(const MotionJob& job) {
  std::shared_ptr<const Greens> rotated = turned(body_.shared_greens(), R_);
  if (!job.load.empty()) {
    const int d = body_.dimension();
    // Distributed forces, the body's displacement by them, and that by rotated blocks alone.
    Eigen::MatrixXd P(std::ssize(x_), d), S(std::ssize(x_), d), T(std::ssize(x_), d);
    std::vector<Index> nodes(static_cast<std::size_t>(body_.greens().nodes()));
    std::iota(nodes.begin(), nodes.end(), 0);
    std::vector<double> moved(x_.size());
    const auto column = [](const std::vector<double>& values) {
      return Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values));
    };
    for (int axis = 0; axis < d; ++axis) {
      const std::vector<double> p = spread(job, axis);
      P.col(axis) = column(p);
      balance_.respond_to(p, moved);
      S.col(axis) = column(moved);
      rotated->displacement(nodes, p, moved);
      T.col(axis) = column(moved);
    }
    Eigen::MatrixXd left(P.rows(), 2 * d), right(P.rows(), 2 * d);
    left << S * inverse_of(S.transpose() * P), -T * inverse_of(T.transpose() * P);
    right << S, T;
    rotated = turned(body_.shared_greens(), R_, left, right);
  }
  turned_ = std::move(rotated);
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
