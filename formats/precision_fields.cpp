#include "formats/precision_fields.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "formats/field_counts.h"

namespace palpate {
namespace {

PackedGreens only_smooth(const Model& model, const std::vector<double>& values) {
  const std::int64_t n = model.stored_dofs();
  auto smooth = std::make_shared<SmoothPart>();
  smooth->terms = std::ssize(values) / n;
  smooth->rows = values;
  return {nullptr, n, Precision::split_precision, std::move(smooth)};
}

void check_smooth(const Model& model, const PackedGreens& matrix, Precision precision,
                  const std::string& path, const std::string& where) {
  const SmoothPart* smooth = matrix.smooth().get();
  if ((smooth != nullptr) != (precision == Precision::split_precision))
    refuse(where, path + (smooth == nullptr ? " is missing" : " is there without split precision"));
  if (smooth == nullptr) return;
  const std::int64_t n = model.stored_dofs();
  const int d = model.dimension();
  if (smooth->terms < 1 || smooth->terms > most_smooth_terms)
    refuse(where, path + " has " + std::to_string(smooth->terms) + " terms, only 1 to " +
                      std::to_string(most_smooth_terms) + " are possible");
  if (std::ssize(smooth->rows) != n * smooth->terms)
    refuse(where, path + " does not have a row for each of " + std::to_string(n) + " stored dofs");
  for (std::int64_t dof = 0; dof < n; ++dof) {
    const Index node = model.stored_nodes[static_cast<std::size_t>(dof / d)];
    if ((model.fixed[static_cast<std::size_t>(node)] >> dof % d & 1) == 0) continue;
    const double* row = smooth->row(dof);
    if (std::any_of(row, row + smooth->terms, [](double w) { return w != 0.0; }))
      refuse(where, path + ": row " + std::to_string(dof) + " is not zero, though its dof is held");
  }
}

void check_errors(const ForceErrors& errors, Precision precision, const std::string& path,
                  const std::string& where) {
  if (errors.any() && errors[precision] < 0.0)
    refuse(where, path + " has none of the precision that is stored");
}

}  // namespace

void put_greens_smooth(Model& model, const std::vector<double>& values) {
  model.greens = only_smooth(model, values);
}

void put_inverse_smooth(Model& model, const std::vector<double>& values) {
  model.dynamics.inverse = only_smooth(model, values);
}

void put_errors(ForceErrors& errors, const std::vector<double>& values) {
  for (const double error : values)
    if (!(error >= 0.0 || error == ForceErrors::not_measured))
      throw Unreadable{"holds " + std::to_string(error) + ", neither an error nor -1 for none"};
  std::copy(values.begin(), values.end(), errors.of_precision.begin());
}

std::string precision_warning(const Model& model, Precision precision) {
  const double error = std::max(model.force_errors[precision], model.dynamics.force_errors[precision]);
  if (!(error > good_force_error)) return {};
  std::array<char, 32> figure{};
  std::snprintf(figure.data(), figure.size(), std::isinf(error) ? "without bound" : "by up to %.1e", error);
  return std::string("contact forces of neighbouring nodes are wrong ") + figure.data() +
         " of the largest in " + name_of(precision) + " precision" +
         (precision == Precision::double_precision
              ? ": the body is too slender or its materials too different for more"
              : "; leave [storage] precision at \"auto\" and precompute it again");
}

void check_precision(const Model& model, Precision precision, const std::string& where) {
  check_smooth(model, model.greens, precision, "/greens/smooth", where);
  check_errors(model.force_errors, precision, greens_errors_path, where);
  if (model.dynamics.method != DynamicsMethod::packed) return;
  check_smooth(model, model.dynamics.inverse, precision, "/dynamics/smooth", where);
  check_errors(model.dynamics.force_errors, precision, inverse_errors_path, where);
}

}  // namespace palpate
