// Precision of packed matrices in the table of file fields.
#pragma once

#include "formats/model_fields.h"

namespace palpate {

inline constexpr const char* greens_errors_path = "/greens/force_error";
inline constexpr const char* inverse_errors_path = "/dynamics/force_error";

void put_greens_smooth(Model& model, const std::vector<double>& values);
void put_inverse_smooth(Model& model, const std::vector<double>& values);
void put_errors(ForceErrors& errors, const std::vector<double>& values);

/// Smooth parts W of files with split precision; other files have none.
template <class Visitor>
void for_each_smooth_field(const Model& model, Visitor&& visit) {
  const Extent stored_dofs = {Count::stored_nodes, model.dimension(), 0}, terms = {Count::smooth_terms};
  visit(Field<double>{"/greens/smooth",
                      {stored_dofs, terms},
                      [](const Model& m) { return m.greens.smooth()->rows; },
                      put_greens_smooth});
  if (model.dynamics.method == DynamicsMethod::packed) {
    visit(Field<double>{"/dynamics/smooth",
                        {stored_dofs, terms},
                        [](const Model& m) { return m.dynamics.inverse.smooth()->rows; },
                        put_inverse_smooth});
  }
}

/// Measured force errors of Xi.
template <class Visitor>
void visit_greens_errors(Visitor&& visit) {
  visit(Field<double>{greens_errors_path,
                      {{Count::one, 3, 0}},
                      [](const Model& m) {
                        const auto& e = m.force_errors.of_precision;
                        return std::vector<double>(e.begin(), e.end());
                      },
                      [](Model& m, const std::vector<double>& v) { put_errors(m.force_errors, v); },
                      {Count::one, 0, 0},
                      true});
}

/// Measured force errors of K_bar^-1.
template <class Visitor>
void visit_inverse_errors(Visitor&& visit) {
  visit(Field<double>{inverse_errors_path,
                      {{Count::one, 3, 0}},
                      [](const Model& m) {
                        const auto& e = m.dynamics.force_errors.of_precision;
                        return std::vector<double>(e.begin(), e.end());
                      },
                      [](Model& m, const std::vector<double>& v) { put_errors(m.dynamics.force_errors, v); },
                      {Count::one, 0, 0},
                      true});
}

/// Checks that smooth parts exist with split precision only, with a row of at most most_smooth_terms entries
/// for each stored dof, zero if it is held, and that force errors were measured for the stored precision if
/// at all. Throws Error (where = `where`) naming the field.
void check_precision(const Model& model, Precision precision, const std::string& where);

}  // namespace palpate
