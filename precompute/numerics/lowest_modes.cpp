#include "precompute/numerics/lowest_modes.h"

#include <Spectra/SymGEigsShiftSolver.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "precompute/numerics/inertia.h"

namespace palpate {
namespace {

using Vector = Eigen::VectorXd;

constexpr double tolerance = 1e-12;    // of Lanczos' eigenvalues, relative
constexpr double smallest_gap = 1e-6;  // between omega^2 that count as distinct, relative
constexpr int restarts = 1000;

/// Number of vectors that the Lanczos method keeps.
std::int64_t basis_size(std::int64_t wanted, std::int64_t dofs) {
  return std::min(dofs, 2 * wanted + 20);
}

/// Thrown out of Spectra.
struct Stopped {};

/// x -> K^-1 x, as Spectra asks for it.
class InverseOfK {
 public:
  using Scalar = double;
  InverseOfK(const Factor& factor, const std::function<bool()>& stopped)
      : factor_(factor), stopped_(stopped) {}
  [[nodiscard]] Eigen::Index rows() const { return factor_.order(); }
  [[nodiscard]] Eigen::Index cols() const { return factor_.order(); }
  void set_shift(double /*zero*/) const {}
  void perform_op(const double* x, double* y) const {
    if (stopped_()) throw Stopped();
    const std::vector<double> result = factor_.solve({x, static_cast<std::size_t>(factor_.order())});
    std::copy(result.begin(), result.end(), y);
  }

 private:
  const Factor& factor_;
  const std::function<bool()>& stopped_;
};

/// x -> M x.
class ProductWithM {
 public:
  using Scalar = double;
  explicit ProductWithM(const SparseMatrix& M) : M_(M.pruned()) {}  // zeros of K's pattern
  [[nodiscard]] Eigen::Index rows() const { return M_.rows(); }
  [[nodiscard]] Eigen::Index cols() const { return M_.cols(); }
  void perform_op(const double* x, double* y) const {
    Eigen::Map<Vector>(y, M_.rows()).noalias() =
        M_.selfadjointView<Eigen::Lower>() * Eigen::Map<const Vector>(x, M_.rows());
  }

 private:
  SparseMatrix M_;
};

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

LowestModes all_modes(const SparseMatrix& K, const SparseMatrix& M, std::int64_t count) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver{Eigen::MatrixXd(K),
                                                                         Eigen::MatrixXd(M)};
  if (solver.info() != Eigen::Success)
    throw Error("the dense eigenvalue problem has no solution", "[dynamics] modes",
                "Look at the worst element of the mesh and at the densities");
  LowestModes modes;
  for (std::int64_t i = 0; i <= count; ++i)
    modes.omega.push_back(i < K.rows() ? std::sqrt(solver.eigenvalues()[i])
                                       : std::numeric_limits<double>::infinity());
  modes.shapes = solver.eigenvectors().leftCols(count);
  return modes;
}

/// With one starting vector a second mode of the same frequency comes in by rounding alone, so a larger basis
/// may find what a smaller one has left out.
LowestModes lanczos(const Factor& factor, const SparseMatrix& K, const SparseMatrix& M, std::int64_t count,
                    const std::function<bool()>& stopped) {
  InverseOfK inverse(factor, stopped);
  ProductWithM product(M);
  const std::int64_t wanted = count + 1;
  for (std::int64_t basis = basis_size(wanted, K.rows());; basis = std::min(2 * basis, K.rows())) {
    Spectra::SymGEigsShiftSolver<InverseOfK, ProductWithM, Spectra::GEigsMode::ShiftInvert> solver(
        inverse, product, wanted, basis, 0.0);
    solver.init();
    const bool converged = solver.compute(Spectra::SortRule::LargestMagn, restarts, tolerance,
                                          Spectra::SortRule::SmallestAlge) == wanted;
    if (converged && solver.eigenvalues().minCoeff() > 0.0) {
      const Vector omega = solver.eigenvalues().cwiseSqrt();
      LowestModes modes{{omega.begin(), omega.end()}, solver.eigenvectors(wanted).leftCols(count)};
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
  return dofs * (basis_size(count + 1, dofs) + 2 * count) * scalar;
}

std::optional<LowestModes> lowest_modes(const Factor& factor, const SparseMatrix& K, const SparseMatrix& M,
                                        std::int64_t count, const std::function<bool()>& stopped) {
  try {
    LowestModes modes =
        dense_modes(count, K.rows()) ? all_modes(K, M, count) : lanczos(factor, K, M, count, stopped);
    normalize(modes.shapes, M);
    return modes;
  } catch (const Stopped&) {
    return {};
  }
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
