#include "precompute/numerics/touches.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

using Matrix = Eigen::MatrixXd;
using Refined = RefinedSolution::Refined;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Largest force on a node.
template <class Forces>
double largest_force(const Forces& f, int d) {
  double largest = 0.0;
  for (Eigen::Index node = 0; node < f.size() / d; ++node)
    largest = std::max(largest, static_cast<double>(f.segment(d * node, d).norm()));
  return largest;
}

}  // namespace

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0;
}

Matrix touch_displacements(std::span<const Vec3> arms, int d, std::mt19937_64& random) {
  const auto nodes = std::ssize(arms);
  Matrix u = Matrix::Zero(d * nodes, d + 3);
  Eigen::Matrix3d gradient;
  for (double& entry : gradient.reshaped()) entry = uniform(random);
  const Vec3 shift(uniform(random), uniform(random), uniform(random));
  double reach = 0.0;
  for (const Vec3& arm : arms) reach = std::max(reach, arm.norm());
  for (Eigen::Index node = 0; node < nodes; ++node) {
    const Vec3 arm = arms[static_cast<std::size_t>(node)] / (reach > 0.0 ? reach : 1.0);
    for (Eigen::Index axis = 0; axis < d; ++axis) {
      u(d * node + axis, axis) = 1.0;
      u(d * node + axis, d) = (shift + gradient * arm)[axis];
      u(d * node + axis, d + 1) = uniform(random);
      u(d * node + axis, d + 2) = uniform(random);
    }
  }
  return u;
}

double force_error(const Refined& f, const Refined& f_0, int d) {
  double worst = 0.0;
  for (Eigen::Index k = 0; k < f.cols(); ++k) {
    const double error = largest_force(f.col(k) - f_0.col(k), d) / largest_force(f_0.col(k), d);
    worst = std::isnan(error) ? infinity : std::max(worst, error);
  }
  return worst;
}

double touch_error(const Refined& reference_C, const Matrix& C, const Matrix& u, int d) {
  const Eigen::Index size = u.rows();
  const Refined A = reference_C.topLeftCorner(size, size);
  const Eigen::LLT<Matrix> reference(A.cast<double>());
  const Eigen::LLT<Matrix> stored(C.topLeftCorner(size, size));
  if (reference.info() != Eigen::Success || stored.info() != Eigen::Success) return infinity;
  return force_error(stored.solve(u).cast<long double>(), solve_refined(reference, A, u), d);
}

}  // namespace palpate
