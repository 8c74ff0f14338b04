#include "precompute/numerics/lowest_modes.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "base/error.h"
#include "precompute/numerics/inertia.h"
#include "precompute/numerics/krylov_space.h"
#include "precompute/numerics/touches.h"

namespace palpate {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr double tolerance = 1e-12;       // of residuals, relative
constexpr double smallest_gap = 1e-6;     // between omega^2 that count as distinct, relative
constexpr double dependent = 1e-13;       // squared norm of a vector in the span of others, relative
constexpr std::int64_t widest_block = 8;  // wider ones take more solves: the degree in K^-1 M counts
constexpr int restarts = 100;

/// Number of vectors added per step.
std::int64_t block_size(std::int64_t wanted) {
  return std::clamp<std::int64_t>(wanted / 3, 1, widest_block);
}

/// Number of vectors that the Lanczos method keeps.
std::int64_t basis_size(std::int64_t wanted, std::int64_t dofs) {
  return std::min(dofs, 3 * wanted + 4 * block_size(wanted) + 20);
}

/// Scales to unit modal mass, with a sign that does not depend on the method.
void normalize(Eigen::MatrixXd& shapes, const SparseMatrix& M) {
  for (Eigen::Index i = 0; i < shapes.cols(); ++i) {
    auto phi = shapes.col(i);
    Eigen::Index largest = 0;
    phi.cwiseAbs().maxCoeff(&largest);
    const Vector M_phi = M.selfadjointView<Eigen::Lower>() * phi;
    const double mass = phi.dot(M_phi);
    phi *= (phi[largest] < 0.0 ? -1.0 : 1.0) / std::sqrt(mass);
  }
}

Modes all_modes(const SparseMatrix& K, const SparseMatrix& M, std::int64_t count) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver{Eigen::MatrixXd(K),
                                                                         Eigen::MatrixXd(M)};
  if (solver.info() != Eigen::Success)
    throw Error("the dense eigenvalue problem has no solution", "[dynamics] modes",
                "Look at the worst element of the mesh and at the densities");
  Modes modes;
  for (std::int64_t i = 0; i <= count; ++i)
    modes.omega.push_back(i < K.rows() ? std::sqrt(solver.eigenvalues()[i])
                                       : std::numeric_limits<double>::infinity());
  modes.shapes = solver.eigenvectors().leftCols(count);
  return modes;
}

/// W := W R^-1, orthonormal in M, with as many vectors as W has independent ones. Returns R. Updates M_W.
Matrix normalise(SharedPencil& pencil, Matrix& W, Matrix& M_W) {
  const Matrix gram = pencil.product(W, M_W);
  if (pencil.stopped()) return Matrix::Identity(W.cols(), W.cols());
  const Vector norms = gram.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Vector inverse = norms.unaryExpr([](double x) { return x > 0.0 ? 1.0 / x : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(inverse.asDiagonal() * gram * inverse.asDiagonal());
  const Vector& squares = solver.eigenvalues();
  const auto rank = (squares.array() > dependent * squares.maxCoeff()).count();
  const Vector kept = squares.tail(rank).cwiseSqrt();
  const Matrix vectors = solver.eigenvectors().rightCols(rank);
  const Matrix change = inverse.asDiagonal() * vectors * kept.cwiseInverse().asDiagonal();
  W = W * change;
  M_W = M_W * change;
  return kept.asDiagonal() * vectors.transpose() * norms.asDiagonal();
}

/// Block Lanczos on A = K^-1 M in the inner product of M: A V = V H + Q R E^T, where E has the last rows of
/// V's columns.
class BlockLanczos {
 public:
  BlockLanczos(SharedPencil& pencil, std::int64_t wanted, std::int64_t capacity, std::uint64_t seed)
      : pencil_(pencil),
        space_(pencil, capacity),
        wanted_(wanted),
        width_(std::min(block_size(wanted), capacity)),
        capacity_(capacity),
        random_(seed) {}

  /// Iterates; returns true if the `wanted` largest eigenvalues of A have converged.
  bool search() {
    begin_anew();
    std::int64_t next_look = 2 * wanted_;
    for (int restart = 0; restart <= restarts && !pencil_.stopped();) {
      step();
      const bool full = space_.size() + Q_.cols() > capacity_;
      if (space_.size() < next_look && !full) continue;
      next_look = space_.size() + std::max(width_, space_.size() / 8);
      if (space_.size() >= wanted_ && look()) return true;
      if (!full) continue;
      thicken();
      next_look = space_.size() + std::max(width_, space_.size() / 8);
      ++restart;
    }
    return false;
  }

  /// Modes with ascending omega, and the shapes of the first `count`.
  [[nodiscard]] Modes modes(std::int64_t count) {
    Modes modes;
    for (std::int64_t i = 0; i < wanted_; ++i) modes.omega.push_back(1.0 / std::sqrt(values_[last(i)]));
    modes.shapes = space_.combine(vectors_.rightCols(count).rowwise().reverse());
    return modes;
  }

 private:
  [[nodiscard]] Eigen::Index last(std::int64_t i) const { return values_.size() - 1 - i; }

  /// Removes the components along V from W, and makes W orthonormal. Returns the coefficients of V and R.
  std::pair<Matrix, Matrix> orthonormalise(Matrix& W, Matrix& M_W) {
    M_W = pencil_.mass_times(W);
    Matrix C = space_.coefficients(M_W), R = Matrix::Identity(W.cols(), W.cols());
    space_.remove(C, W);
    for (int pass = 0; pass < 2;
         ++pass) {  // rounding leaves components along V that are small only relative to the original W
      M_W = pencil_.mass_times(W);
      R = normalise(pencil_, W, M_W) * R;
      if (pass == 1) break;
      const Matrix again = space_.coefficients(M_W);
      space_.remove(again, W);
      C += again * R;
    }
    return {C, R};
  }

  /// Sets Q to a random block orthogonal to V.
  void begin_anew() {
    Matrix f(pencil_.order(), width_);
    for (double& entry : f.reshaped()) entry = uniform(random_);
    Q_ = pencil_.inverse_times(std::move(f));
    orthonormalise(Q_, M_Q_);
  }

  void step() {
    Matrix W = pencil_.inverse_times(M_Q_), M_W;
    const Eigen::Index before = space_.size(), width = Q_.cols();
    space_.append(Q_);
    auto [C, R] = orthonormalise(W, M_W);
    Matrix H = Matrix::Zero(space_.size(), space_.size());
    H.topLeftCorner(before, before) = H_;
    H.rightCols(width) = C;
    H.bottomLeftCorner(width, before) = C.topRows(before).transpose();
    H.bottomRightCorner(width, width) = (C.bottomRows(width) + C.bottomRows(width).transpose()) / 2.0;
    H_ = std::move(H);
    coupling_ = std::move(R);
    Q_ = std::move(W);
    M_Q_ = std::move(M_W);
    if (Q_.cols() > 0) return;
    coupling_ = Matrix::Zero(1, width);  // V spans an invariant subspace
    begin_anew();
  }

  /// Solves in V; returns true if the residuals of the wanted eigenvalues are small.
  bool look() {
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(H_);
    values_ = solver.eigenvalues();
    vectors_ = solver.eigenvectors();
    for (std::int64_t i = 0; i < wanted_; ++i) {
      const double residual = (coupling_ * vectors_.col(last(i)).tail(coupling_.cols())).norm();
      if (!(residual <= tolerance * values_[last(i)])) return false;
    }
    return true;
  }

  /// Reduces V to the best vectors of its span.
  void thicken() {
    const std::int64_t kept = wanted_ + (capacity_ - width_ - wanted_) / 3;
    space_.replace(vectors_.rightCols(kept));
    H_ = values_.tail(kept).asDiagonal();
  }

  SharedPencil& pencil_;
  KrylovSpace space_;
  std::int64_t wanted_, width_, capacity_;
  std::mt19937_64 random_;
  Matrix Q_, M_Q_, coupling_;
  Matrix H_;       // V^T M A V
  Vector values_;  // of H, ascending
  Matrix vectors_;
};

/// Repeats Lanczos with larger bases: vectors of one frequency beyond the block size appear by rounding
/// alone, so a larger basis may find modes that a smaller one has missed.
std::optional<Modes> lanczos(const Factor& factor, const SparseMatrix& K, const SparseMatrix& M,
                             std::int64_t count, Sharing& sharing) {
  SharedPencil pencil(factor, M, sharing);
  const std::int64_t wanted = count + 1;
  for (std::int64_t basis = basis_size(wanted, K.rows());; basis = std::min(2 * basis, K.rows())) {
    BlockLanczos solver(pencil, wanted, basis, static_cast<std::uint64_t>(basis));
    const bool converged = solver.search();
    if (pencil.stopped()) return {};
    if (converged) {
      Modes modes = solver.modes(count);
      if (none_left_out(factor, K, M, modes.omega)) return modes;
    }
    if (basis == K.rows())
      throw Error(fmt::format("the Lanczos method has not found the {} lowest modes", wanted),
                  "[dynamics] modes", "Ask for some modes more or fewer");
  }
}

}  // namespace

bool dense_modes(std::int64_t count, std::int64_t dofs) noexcept {
  return 3 * (count + 1) > dofs;
}

std::int64_t modes_bytes(std::int64_t count, std::int64_t dofs) noexcept {
  constexpr auto scalar = static_cast<std::int64_t>(sizeof(double));
  if (dense_modes(count, dofs)) return 5 * dofs * dofs * scalar;
  return dofs * (basis_size(count + 1, dofs) + 2 * count + 6 * block_size(count + 1)) * scalar;
}

std::optional<Modes> lowest_modes(const Factor& factor, const SparseMatrix& K, const SparseMatrix& M,
                                  std::int64_t count, Sharing& sharing) {
  std::optional<Modes> modes =
      dense_modes(count, K.rows()) ? all_modes(K, M, count) : lanczos(factor, K, M, count, sharing);
  if (modes) normalize(modes->shapes, M);
  return modes;
}

std::int64_t modes_below(const Factor& analysed, const SparseMatrix& K, const SparseMatrix& M,
                         double square) {
  SparseMatrix shifted = K;  // in one pattern, as assembled
  for (std::int64_t k = 0; k < shifted.nonZeros(); ++k) shifted.valuePtr()[k] -= square * M.valuePtr()[k];
  return negative_pivots(analysed, shifted);
}

bool none_left_out(const Factor& analysed, const SparseMatrix& K, const SparseMatrix& M,
                   const std::vector<double>& omega) {
  for (std::size_t i = omega.size(); i-- > 1;) {
    if (std::isinf(omega[i])) return static_cast<std::int64_t>(i) == K.rows();
    const double above = omega[i] * omega[i], below = omega[i - 1] * omega[i - 1];
    if (above - below < smallest_gap * above) continue;
    return modes_below(analysed, K, M, (above + below) / 2.0) == static_cast<std::int64_t>(i);
  }
  return true;  // all of one frequency
}

}  // namespace palpate
