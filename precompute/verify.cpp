#include "precompute/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "formats/model_file.h"
#include "meshes/printable.h"
#include "precompute/assembly.h"
#include "precompute/factor.h"
#include "precompute/verify_dynamics.h"

namespace palpate {
namespace {

using Vector = Eigen::VectorXd;

/// Xi f from the packed lower triangle, in double.
template <class T>
Vector multiply(std::span<const T> packed, const Vector& f) {
  Vector u = Vector::Zero(f.size());
  const T* column = packed.data();
  for (Eigen::Index j = 0; j < f.size(); ++j) {
    double row = 0.0;
    for (Eigen::Index i = j + 1; i < f.size(); ++i) {
      const auto entry = static_cast<double>(column[i - j]);
      u[i] += entry * f[j];
      row += entry * f[i];
    }
    u[j] += row + static_cast<double>(column[0]) * f[j];
    column += f.size() - j;
  }
  return u;
}

Vector multiply(const PackedGreens& greens, const Vector& f) {
  return greens.precision() == Precision::single_precision ? multiply(greens.as<float>(), f)
                                                           : multiply(greens.as<double>(), f);
}

double relative_error(const Vector& value, const Vector& reference) {
  return (value - reference).lpNorm<Eigen::Infinity>() / reference.lpNorm<Eigen::Infinity>();
}

/// Rounding of one stored entry, and the bounds that follow from it with a margin for sums over many entries.
struct Bounds {
  double probe, column, residual;
  explicit Bounds(Precision precision)
      : probe(precision == Precision::single_precision ? 1e-4 : 1e-8),
        column(precision == Precision::single_precision ? 1e-6 : 1e-9),
        residual(precision == Precision::single_precision ? 1e-6 : 1e-12) {}
};

/// K split by stored (b) and other (a) free dofs, to condense a stored column exactly: u_a = -K_aa^-1 K_ab
/// u_b.
class Condensation {
 public:
  Condensation(const Stiffness& stiffness, const std::vector<std::int64_t>& stored_dofs)
      : K_(stiffness.K), is_stored_(stiffness.free_dofs.size(), 0) {
    for (const std::int64_t dof : stored_dofs) {
      if (dof >= 0) is_stored_[static_cast<std::size_t>(dof)] = 1;
    }
    std::vector<std::int64_t> number(is_stored_.size(), -1);
    for (std::size_t dof = 0; dof < is_stored_.size(); ++dof) {
      if (is_stored_[dof]) continue;
      number[dof] = static_cast<std::int64_t>(other_.size());
      other_.push_back(static_cast<std::int64_t>(dof));
    }
    if (other_.empty()) return;
    std::vector<Eigen::Triplet<double, std::int64_t>> entries;
    for (std::int64_t j = 0; j < K_.cols(); ++j) {
      for (SparseMatrix::InnerIterator entry(K_, j); entry; ++entry) {
        const std::int64_t row = number[static_cast<std::size_t>(entry.row())],
                           column = number[static_cast<std::size_t>(j)];
        if (row >= 0 && column >= 0) entries.emplace_back(row, column, entry.value());
      }
    }
    K_aa_.resize(static_cast<std::int64_t>(other_.size()), static_cast<std::int64_t>(other_.size()));
    K_aa_.setFromTriplets(entries.begin(), entries.end());
    std::vector<std::int64_t> node_start;  // nodes are stored whole or not at all
    for (const std::int64_t first : stiffness.node_start) {
      if (first == K_.rows()) break;
      if (!is_stored_[static_cast<std::size_t>(first)]) {
        node_start.push_back(number[static_cast<std::size_t>(first)]);
      }
    }
    node_start.push_back(static_cast<std::int64_t>(other_.size()));
    factor_ = std::make_unique<Factor>(K_aa_, node_start);
    factor_->factorize();
  }

  /// Fills in the other dofs of u, in which they are zero.
  void complete(Vector& u) const {
    if (other_.empty()) return;
    const Vector f = K_.selfadjointView<Eigen::Lower>() * u;
    std::vector<double> f_a;
    for (const std::int64_t dof : other_) f_a.push_back(-f[dof]);
    const std::vector<double> u_a = factor_->solve(f_a);
    for (std::size_t k = 0; k < other_.size(); ++k) u[other_[k]] = u_a[k];
  }

 private:
  const SparseMatrix& K_;
  std::vector<std::uint8_t> is_stored_;
  std::vector<std::int64_t> other_;  // the dofs that are not stored, ascending
  SparseMatrix K_aa_;
  std::unique_ptr<Factor> factor_;
};

std::vector<Check> check_probes(const Model& model, const Bounds& bounds) {
  Check probes{"probes", 0.0, bounds.probe}, energy{"energy", 0.0, bounds.probe};
  for (const Probe& probe : model.probes) {
    const auto n = static_cast<Eigen::Index>(probe.force.size());
    const Eigen::Map<const Vector> f(probe.force.data(), n), u(probe.displacement.data(), n);
    const Vector Xi_f = multiply(model.greens, f);
    const double work = f.dot(Xi_f);
    probes.error = std::max(probes.error, relative_error(Xi_f, u));
    energy.error = std::max(energy.error, work > 0.0 ? std::abs(work - f.dot(u)) / work : INFINITY);
  }
  return {probes, energy};
}

std::vector<Check> check_columns(const Model& model, const Stiffness& stiffness, const Factor& factor,
                                 const Bounds& bounds, int samples) {
  std::vector<std::int64_t> stored_dofs;  // dof of K of each stored dof, -1 where it is held
  const int d = model.dimension();
  for (const Index node : model.stored_nodes) {
    for (int axis = 0; axis < d; ++axis) {
      stored_dofs.push_back(stiffness.free_of_dof[static_cast<std::size_t>(std::int64_t{d} * node + axis)]);
    }
  }
  const Condensation condensation(stiffness, stored_dofs);
  const auto K = stiffness.K.selfadjointView<Eigen::Lower>();
  Vector row_sums = Vector::Zero(stiffness.K.rows());
  for (std::int64_t j = 0; j < stiffness.K.cols(); ++j) {
    for (SparseMatrix::InnerIterator entry(stiffness.K, j); entry; ++entry) {
      row_sums[entry.row()] += std::abs(entry.value());
      if (entry.row() != j) row_sums[j] += std::abs(entry.value());
    }
  }

  Check columns{"columns", 0.0, bounds.column}, residual{"residual", 0.0, bounds.residual};
  std::mt19937_64 random(7);
  for (int sample = 0; sample < samples; ++sample) {
    const auto j = static_cast<std::int64_t>(random() % stored_dofs.size());
    std::vector<double> e(static_cast<std::size_t>(factor.order()), 0.0);
    const std::int64_t loaded = stored_dofs[static_cast<std::size_t>(j)];
    if (loaded >= 0) e[static_cast<std::size_t>(loaded)] = 1.0;
    const std::vector<double> x = factor.solve(e);
    Vector column(model.stored_dofs()), solved(model.stored_dofs()), u = Vector::Zero(factor.order());
    for (std::int64_t i = 0; i < model.stored_dofs(); ++i) {
      const std::int64_t dof = stored_dofs[static_cast<std::size_t>(i)];
      column[i] = model.greens(i, j);
      solved[i] = dof < 0 ? 0.0 : x[static_cast<std::size_t>(dof)];
      if (dof >= 0) u[dof] = column[i];
    }
    if (loaded < 0) {  // nothing may move
      columns.error = std::max(columns.error, column.lpNorm<Eigen::Infinity>());
      continue;
    }
    columns.error = std::max(columns.error, relative_error(column, solved));
    condensation.complete(u);
    const Vector r = K * u - Eigen::Map<const Vector>(e.data(), factor.order());
    residual.error = std::max(residual.error, r.lpNorm<Eigen::Infinity>() /
                                                  (row_sums.maxCoeff() * u.lpNorm<Eigen::Infinity>() + 1.0));
  }
  return {columns, residual};
}

/// The rest state against the loads: K u0 = f on the free dofs, by products of the elements alone.
Check check_rest_state(const Model& model, const Stiffness& stiffness) {
  const int d = model.dimension();
  Vector u(static_cast<Eigen::Index>(stiffness.free_dofs.size())), f(u.size());
  for (Eigen::Index k = 0; k < u.size(); ++k) {
    const std::int64_t dof = stiffness.free_dofs[static_cast<std::size_t>(k)];
    const auto node = static_cast<std::size_t>(dof / d);
    u[k] = model.rest_displacement[node][dof % d];
    f[k] = model.rest_force[node][dof % d] - stiffness.held_force[static_cast<std::size_t>(k)];
  }
  const Vector r = stiffness.K.selfadjointView<Eigen::Lower>() * u - f;
  const double scale = f.lpNorm<Eigen::Infinity>();
  return {"rest state", scale > 0.0 ? r.lpNorm<Eigen::Infinity>() / scale : r.lpNorm<Eigen::Infinity>(),
          1e-8};
}

}  // namespace

bool VerifyReport::passed() const noexcept {
  return stale.empty() &&
         std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.passed(); });
}

VerifyReport verify(const Model& model, const std::filesystem::path& file, int samples) {
  const Bounds bounds(model.greens.precision());
  VerifyReport report;
  report.checks = check_probes(model, bounds);
  const Stiffness stiffness = assemble_stiffness(elastic_body(model));
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  const std::vector<Check> columns = check_columns(model, stiffness, factor, bounds, samples);
  report.checks.insert(report.checks.end(), columns.begin(), columns.end());
  report.checks.push_back(check_rest_state(model, stiffness));
  if (model.dynamics.method != DynamicsMethod::none) {
    const std::vector<Check> dynamics = verify_dynamics(model, stiffness, bounds.column, samples);
    report.checks.insert(report.checks.end(), dynamics.begin(), dynamics.end());
  }
  report.stale = stale_sources(model, file);
  return report;
}

std::string to_text(const VerifyReport& report) {
  std::string text = "checksums  ok (every field, at load)\n";
  for (const Check& check : report.checks) {
    text += fmt::format("{:10} {:6} largest relative error {:.2e}, bound {:.0e}\n", check.name,
                        check.passed() ? "ok" : "FAILED", check.error, check.bound);
  }
  for (const std::string& sentence : report.stale) text += "STALE      " + printable(sentence) + "\n";
  text += report.passed() ? "verified\n" : "NOT verified\n";
  return text;
}

}  // namespace palpate
