#include "runtime/live/step_compliance.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "base/parallel.h"

namespace palpate {
namespace {

constexpr Eigen::Index columns_at_once = 64;

std::vector<Index> free_dofs_of(const LiveBody& body, std::span<const Index> nodes) {
  const int d = body.dimension();
  std::vector<Index> free;
  for (const Index node : nodes) {
    for (int axis = 0; axis < d; ++axis)
      free.push_back(body.free_of_dof()[static_cast<std::size_t>(d * node + axis)]);
  }
  return free;
}

}  // namespace

StepCompliance::StepCompliance(const LiveBody& body, const StepperOptions& stepper,
                               std::span<const Index> nodes)
    : body_(body),
      stepper_(stepper),
      free_(free_dofs_of(body, nodes)),
      A_(body.pattern().zero()),
      solver_({}) {}

bool StepCompliance::begin(const Eigen::VectorXd& x, std::span<const Mat3> plastic) {
  const Integrator integrator = stepper_.scheme.integrator;
  const double h = stepper_.time_step;
  StepFactors factors{.s = 1.0 / (h * h)};
  if (is_implicit(integrator)) {
    factors = step_factors(integrator, h);
    assemble_tangent(body_, x, plastic, TangentKind::positive, A_);
    for (Eigen::Index k = 0; k < A_.nonZeros(); ++k)
      A_.valuePtr()[k] *= 1.0 + factors.t * body_.options().damping.stiffness;
  } else {
    std::fill_n(A_.valuePtr(), A_.nonZeros(), 0.0);
  }
  for (Index free = 0; free < body_.free_dofs(); ++free)
    A_.valuePtr()[body_.pattern().diagonal()[free]] +=
        (factors.s + factors.t * body_.options().damping.mass) * body_.mass()[body_.dof_of_free()[free]];
  scale_ = factors.ahead;
  found_ = 0;
  packed_.reset(new double[static_cast<std::size_t>(packed_size(std::ssize(free_)))]);
  return solver_.set(A_);
}

void StepCompliance::find(Eigen::Index first, Eigen::Index count) {
  const auto order = std::ssize(free_);
  Eigen::MatrixXd E = Eigen::MatrixXd::Zero(A_.rows(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    if (const Index dof = free_[static_cast<std::size_t>(first + k)]; dof >= 0) E(dof, k) = scale_;
  }
  const Eigen::MatrixXd found = solver_.by_factor(E);
  for (Eigen::Index k = 0; k < count; ++k) {
    const double* const column = found.col(k).data();
    double* into = packed_.get() + packed_index(first + k, first + k, order);
    for (Eigen::Index row = first + k; row < order; ++row) {
      const Index dof = free_[static_cast<std::size_t>(row)];
      *into++ = dof >= 0 ? column[dof] : 0.0;
    }
  }
}

bool StepCompliance::go_on(Index columns) {
  const auto order = std::ssize(free_);
  const Eigen::Index count = std::min<Eigen::Index>(columns, order - found_);
  find(found_, count);
  found_ += count;
  return found_ == order;
}

void StepCompliance::find_all(int jobs) {
  const Eigen::Index order = std::ssize(free_);
  parallel_for((order + columns_at_once - 1) / columns_at_once, jobs, [&](std::int64_t piece, int) {
    const Eigen::Index first = columns_at_once * piece;
    find(first, std::min(columns_at_once, order - first));
  });
  found_ = order;
}

PackedGreens StepCompliance::take() noexcept {
  return {std::exchange(packed_, nullptr), std::ssize(free_), Precision::double_precision};
}

PackedGreens turned(const PackedGreens& W, const Mat3& Q, int d) {
  const std::int64_t order = W.order();
  const std::shared_ptr<double[]> packed(new double[static_cast<std::size_t>(packed_size(order))]);
  Mat3 block = Mat3::Zero();
  for (std::int64_t column = 0; column < order; column += d) {
    for (std::int64_t row = column; row < order; row += d) {
      for (int a = 0; a < d; ++a) {
        for (int b = 0; b < d; ++b) block(a, b) = W(row + a, column + b);
      }
      const Mat3 there = Q * block * Q.transpose();
      for (int b = 0; b < d; ++b) {
        for (int a = row == column ? b : 0; a < d; ++a)
          packed[packed_index(row + a, column + b, order)] = there(a, b);
      }
    }
  }
  return {packed, order, Precision::double_precision};
}

}  // namespace palpate
