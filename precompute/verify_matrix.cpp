#include "precompute/verify_matrix.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

namespace palpate {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr int vectors = 4;          // of random signs
constexpr double deviations = 8.0;  // for a sum of roundings: exceeded once in 10^13
constexpr double touch_safety = 4.0;
using Signs = Eigen::Array<double, vectors, 1>;

/// The stored entries (without the smooth part) times the vectors, and the squares of the rows' lengths.
template <class T>
void multiply(std::span<const T> packed, const std::vector<Signs>& r, std::vector<Signs>& y,
              Vector& squares) {
  const T* entry = packed.data();
  const std::size_t n = r.size();
  for (std::size_t j = 0; j < n; ++j) {
    Signs sum = static_cast<double>(*entry) * r[j];
    double square = static_cast<double>(*entry) * static_cast<double>(*entry);
    ++entry;
    for (std::size_t i = j + 1; i < n; ++i) {
      const auto a = static_cast<double>(*entry++);
      y[i] += a * r[j];
      sum += a * r[i];
      squares[static_cast<Eigen::Index>(i)] += a * a;
      square += a * a;
    }
    y[j] += sum;
    squares[static_cast<Eigen::Index>(j)] += square;
  }
}

void add_smooth(const SmoothPart& smooth, const std::vector<Signs>& r, std::vector<Signs>& y) {
  std::vector<Signs> sums(static_cast<std::size_t>(smooth.terms), Signs::Zero());
  for (std::size_t i = 0; i < r.size(); ++i)
    for (std::size_t k = 0; k < sums.size(); ++k)
      sums[k] += smooth.row(static_cast<std::int64_t>(i))[k] * r[i];
  for (std::size_t i = 0; i < r.size(); ++i)
    for (std::size_t k = 0; k < sums.size(); ++k)
      y[i] += smooth.row(static_cast<std::int64_t>(i))[k] * sums[k];
}

/// Signs that are drawn by lot for each dof, the same in each run.
std::vector<Signs> random_signs(std::size_t dofs) {
  std::mt19937_64 random(31);
  std::vector<Signs> r(dofs);
  for (Signs& of_dof : r) {
    const std::uint64_t bits = random();
    for (int v = 0; v < vectors; ++v) of_dof[v] = (bits >> v & 1U) != 0 ? 1.0 : -1.0;
  }
  return r;
}

Check check_rows(const PackedGreens& stored, const Factor& factor, const SparseMatrix& K,
                 std::span<const std::int64_t> stored_dofs, const std::string& name) {
  const std::vector<Signs> r = random_signs(stored_dofs.size());
  std::vector<Signs> y(r.size(), Signs::Zero());
  Matrix b = Matrix::Zero(factor.order(), vectors);
  for (std::size_t i = 0; i < r.size(); ++i)
    if (stored_dofs[i] >= 0) b.row(stored_dofs[i]) = r[i].matrix().transpose();
  Vector squares = Vector::Zero(std::ssize(r));
  if (has_float_entries(stored.precision())) {
    multiply(stored.as<float>(), r, y, squares);
  } else {
    multiply(stored.as<double>(), r, y, squares);
  }
  if (stored.smooth() != nullptr) add_smooth(*stored.smooth(), r, y);

  const RefinedSolution x = solve_refined(factor, K, b);
  const Signs solver =
      (x.plain.cast<long double>() - x.refined).cast<double>().cwiseAbs().colwise().maxCoeff();
  const Signs largest = x.plain.cwiseAbs().colwise().maxCoeff();
  Check rows{name + "rows", 0.0, 1.0};
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double rounding =
        deviations * unit_roundoff(stored.precision()) * std::sqrt(squares[static_cast<Eigen::Index>(i)]);
    for (int v = 0; v < vectors; ++v) {
      const double expected = stored_dofs[i] < 0 ? 0.0 : static_cast<double>(x.refined(stored_dofs[i], v));
      const double difference = std::abs(stored.scale() * y[i][v] - expected);
      const double bound =
          stored_dofs[i] < 0 ? 0.0 : rounding + solver_safety * solver[v] + sum_rounding * largest[v];
      const double error = difference == 0.0 ? 0.0 : difference / bound;
      rows.error = std::isnan(error) ? INFINITY : std::max(rows.error, error);
    }
  }
  return rows;
}

Check check_columns(const PackedGreens& stored, const Factor& factor, const SparseMatrix& K,
                    std::span<const std::int64_t> stored_dofs, double solver, const std::string& name,
                    int samples) {
  Check columns{name + "columns", 0.0,
                2.0 * unit_roundoff(stored.precision()) + sum_rounding + solver_safety * solver};
  std::mt19937_64 random(7);
  for (int sample = 0; sample < samples; ++sample) {
    const std::uint64_t j = random() % stored_dofs.size();
    Matrix e = Matrix::Zero(factor.order(), 1);
    if (stored_dofs[j] >= 0) e(stored_dofs[j], 0) = 1.0;
    const Matrix x = solve_refined(factor, K, e).refined.cast<double>();
    double difference = 0.0, largest = 0.0;
    for (std::size_t i = 0; i < stored_dofs.size(); ++i) {
      const double solved = stored_dofs[i] < 0 ? 0.0 : x(stored_dofs[i], 0);
      largest = std::max(largest, std::abs(solved));
      difference = std::max(
          difference, std::abs(stored(static_cast<std::int64_t>(i), static_cast<std::int64_t>(j)) - solved));
    }
    columns.error = std::max(columns.error, largest > 0.0 ? difference / largest : difference);
  }
  return columns;
}

}  // namespace

double unit_roundoff(Precision precision) noexcept {
  return has_float_entries(precision) ? 0x1p-24 : 0x1p-53;
}

double solver_error(const Factor& factor, const SparseMatrix& K, std::span<const std::int64_t> stored_dofs,
                    int samples) {
  std::vector<std::int64_t> free;
  std::copy_if(stored_dofs.begin(), stored_dofs.end(), std::back_inserter(free),
               [](std::int64_t dof) { return dof >= 0; });
  Matrix e = Matrix::Zero(factor.order(), samples);
  std::mt19937_64 random(37);
  for (int sample = 0; sample < samples; ++sample) e(free[random() % free.size()], sample) = 1.0;
  const RefinedSolution x = solve_refined(factor, K, e);
  double worst = 0.0;
  for (int sample = 0; sample < samples; ++sample) {
    const long double difference =
        (x.plain.col(sample).cast<long double>() - x.refined.col(sample)).cwiseAbs().maxCoeff();
    worst = std::max(worst, static_cast<double>(difference) / x.plain.col(sample).cwiseAbs().maxCoeff());
  }
  return worst;
}

std::vector<Check> verify_matrix(const Model& model, const PackedGreens& stored, const ForceErrors& measured,
                                 const Factor& factor, const SparseMatrix& K,
                                 std::span<const std::int64_t> stored_dofs, double solver,
                                 const std::string& name, int samples) {
  const std::vector<TouchedPlace> places =
      touched_places(model, factor, K, stored_dofs, largest_smooth_part(factor, K, stored_dofs));
  const double said = measured[stored.precision()];
  const double bound = said < 0.0 ? INFINITY : std::max(good_force_error, touch_safety * said);
  return {check_columns(stored, factor, K, stored_dofs, solver, name, samples),
          check_rows(stored, factor, K, stored_dofs, name),
          {name + "touches", force_error(places, model.dimension(), stored), bound}};
}

}  // namespace palpate
