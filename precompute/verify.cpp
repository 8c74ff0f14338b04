#include "precompute/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "base/printable.h"
#include "formats/model_check.h"
#include "formats/model_file.h"
#include "formats/writer/add_index.h"
#include "precompute/machine/blas_room.h"
#include "precompute/numerics/assembly.h"
#include "precompute/numerics/dynamics.h"
#include "precompute/numerics/factor.h"
#include "precompute/verify_description.h"
#include "precompute/verify_dynamics.h"
#include "precompute/verify_matrix.h"

namespace palpate {
namespace {

using Vector = Eigen::VectorXd;

/// A f, for A as stored.
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
  Vector u = has_float_entries(greens.precision()) ? multiply(greens.as<float>(), f)
                                                   : multiply(greens.as<double>(), f);
  if (greens.smooth() == nullptr) return u;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const SmoothPart& smooth = *greens.smooth();
  const Eigen::Map<const RowMajor> W(smooth.rows.data(), f.size(), smooth.terms);
  return u + W * (W.transpose() * f);
}

double relative_error(const Vector& value, const Vector& reference) {
  return (value - reference).lpNorm<Eigen::Infinity>() / reference.lpNorm<Eigen::Infinity>();
}

/// Bounds of the errors of a file's numbers: the rounding of a stored entry, with a margin for long sums, and
/// for `probe`, which depends on the condition of K, the error of solves.
struct Bounds {
  double probe, residual;
  Bounds(Precision precision, double solver)
      : probe((has_float_entries(precision) ? 1e-4 : 1e-8) + 100.0 * solver),
        residual(has_float_entries(precision) ? 1e-6 : 1e-12) {}
};

/// |K| |u|, from the lower triangle K.
Vector absolute_product(const SparseMatrix& K, const Vector& u) {
  Vector product = Vector::Zero(u.size());
  for (std::int64_t j = 0; j < K.cols(); ++j) {
    for (SparseMatrix::InnerIterator entry(K, j); entry; ++entry) {
      product[entry.row()] += std::abs(entry.value() * u[j]);
      if (entry.row() != j) product[j] += std::abs(entry.value() * u[entry.row()]);
    }
  }
  return product;
}

/// K split into stored (b) and other (a) free dofs, which completes a stored column exactly: u_a = -K_aa^-1
/// K_ab u_b.
class Condensation {
 public:
  Condensation(const Stiffness& stiffness, std::span<const std::int64_t> stored_dofs)
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
    std::vector<std::int64_t> node_start;  // all dofs of a node are stored, or none
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

  /// Computes the other dofs of u, which are zero on entry.
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
  std::vector<std::int64_t> other_;  // dofs that are not stored, ascending
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

/// Checks K times some stored columns, completed by the other dofs.
Check check_residual(const Model& model, const Stiffness& stiffness,
                     std::span<const std::int64_t> stored_dofs, double bound, int samples) {
  const Condensation condensation(stiffness, stored_dofs);
  const auto K = stiffness.K.selfadjointView<Eigen::Lower>();
  const double largest_row = absolute_product(stiffness.K, Vector::Ones(stiffness.K.rows())).maxCoeff();
  Check residual{"residual", 0.0, bound};
  std::mt19937_64 random(7);
  for (int sample = 0; sample < samples; ++sample) {
    const auto j = static_cast<std::int64_t>(random() % stored_dofs.size());
    const std::int64_t loaded = stored_dofs[static_cast<std::size_t>(j)];
    if (loaded < 0) continue;
    Vector u = Vector::Zero(stiffness.K.rows());
    for (std::int64_t i = 0; i < model.stored_dofs(); ++i) {
      const std::int64_t dof = stored_dofs[static_cast<std::size_t>(i)];
      if (dof >= 0) u[dof] = model.greens(i, j);
    }
    condensation.complete(u);
    Vector r = K * u;
    r[loaded] -= 1.0;
    residual.error = std::max(
        residual.error, r.lpNorm<Eigen::Infinity>() / (largest_row * u.lpNorm<Eigen::Infinity>() + 1.0));
  }
  return residual;
}

/// Checks the rest state against the loads: K u0 = f on the free dofs, by products of the elements alone.
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
  if (scale == 0.0) return {"rest state", r.lpNorm<Eigen::Infinity>(), 1e-8};
  // The rounding of K u0 counts if K u0 is a difference of much larger numbers than f.
  const double rounding = 100.0 * std::numeric_limits<double>::epsilon() *
                          absolute_product(stiffness.K, u).lpNorm<Eigen::Infinity>() / scale;
  return {"rest state", r.lpNorm<Eigen::Infinity>() / scale, 1e-8 + rounding};
}

/// Contents of the file that match neither its description nor its HDF5 part.
std::vector<std::string> differences_of(const Model& model, const std::filesystem::path& file) {
  std::vector<std::string> differences = description_differences(model, file);
  if (!is_index_right(file))
    differences.push_back("the file's index differs from what its HDF5 says; palpate-precompute index " +
                          shell_word(file.string()) + " writes it anew");
  return differences;
}

}  // namespace

bool VerifyReport::passed() const noexcept {
  return stale.empty() && differences.empty() &&
         std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.passed(); });
}

VerifyReport verify(const Model& model, const std::filesystem::path& file, int samples) {
  if (model.scope == Scope::none) {
    VerifyReport report;
    report.differences = differences_of(model, file);
    report.stale = stale_sources(model, file);
    return report;
  }
  take_blas_room(1);
  const Stiffness stiffness = assemble_stiffness(stiffness_input(model));
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  const std::vector<std::int64_t> stored_dofs = stored_dofs_of(model, stiffness);
  const double solver = solver_error(factor, stiffness.K, stored_dofs, samples);
  VerifyReport report;
  const auto add = [&report](const std::vector<Check>& checks) {
    report.checks.insert(report.checks.end(), checks.begin(), checks.end());
  };
  if (model.compressed != nullptr) {
    add(verify_compressed(model, factor, stored_dofs, solver, samples));
  } else {
    const Bounds bounds(model.greens.precision(), solver);
    add(check_probes(model, bounds));
    add(verify_matrix(model, model.greens, model.force_errors, factor, stiffness.K, stored_dofs, solver, "",
                      samples));
    add({check_residual(model, stiffness, stored_dofs, bounds.residual, samples)});
  }
  add({check_rest_state(model, stiffness)});
  if (model.dynamics.method != DynamicsMethod::none) add(verify_dynamics(model, stiffness, samples));
  for (const Check& check : report.checks) {
    if (model.compressed == nullptr && check.name.ends_with("touches") && check.error > good_force_error) {
      report.warnings.push_back(
          fmt::format("{}: contact forces of neighbouring nodes are wrong by up to {:.1e} of the largest",
                      check.name, check.error));
    }
  }
  if (const std::string warning = rest_warning(model); !warning.empty()) report.warnings.push_back(warning);
  report.differences = differences_of(model, file);
  report.stale = stale_sources(model, file);
  return report;
}

std::string to_text(const VerifyReport& report) {
  std::string text = "checksums       ok (every field, at load)\n";
  for (const Check& check : report.checks) {
    text += fmt::format("{:15} {:6} largest relative error {:.2e}, bound {:.0e}\n", check.name,
                        check.passed() ? "ok" : "FAILED", check.error, check.bound);
  }
  for (const std::string& sentence : report.warnings) text += "WARNING         " + printable(sentence) + "\n";
  for (const std::string& sentence : report.differences)
    text += "DIFFERS         " + printable(sentence) + "\n";
  for (const std::string& sentence : report.stale) text += "STALE           " + printable(sentence) + "\n";
  text += report.passed() ? "verified\n" : "NOT verified\n";
  return text;
}

}  // namespace palpate
