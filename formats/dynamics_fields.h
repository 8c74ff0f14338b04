// Dynamics in the table of file fields.
#pragma once

#include "formats/model_fields.h"

namespace palpate {

inline constexpr const char* dynamics_group = "/dynamics";
inline constexpr const char* inverse_path = "/dynamics/inverse";

std::vector<double> newmark_of(const Model& model);
void put_newmark(Model& model, const std::vector<double>& values);
void put_method(Model& model, const std::vector<std::int32_t>& values);

/// Datasets of files with dynamics, except the packed inverse, which is mapped; other files do not have the
/// group. The method comes before the fields that depend on it: `model` may be the one that the visitor
/// fills.
template <class Visitor>
void for_each_dynamics_field(const Model& model, Visitor&& visit) {
  using Octets = std::vector<std::uint8_t>;
  using Int32s = std::vector<std::int32_t>;
  using Int64s = std::vector<std::int64_t>;
  using Doubles = std::vector<double>;
  const Extent one = {Count::one}, entries = {Count::matrix_entries}, modes = {Count::modes},
               stored_dofs = {Count::stored_nodes, model.dimension(), 0};
  visit(
      Field<std::int32_t>{"/dynamics/method",
                          {one},
                          [](const Model& m) { return Int32s{static_cast<std::int32_t>(m.dynamics.method)}; },
                          put_method});
  visit(
      Field<std::uint8_t>{"/dynamics/lumped",
                          {one},
                          [](const Model& m) { return Octets{static_cast<std::uint8_t>(m.dynamics.lumped)}; },
                          [](Model& m, const Octets& v) { m.dynamics.lumped = v[0] != 0; },
                          {Count::one, 2, 0}});
  visit(Field<double>{"/dynamics/newmark", {{Count::one, 3, 0}}, newmark_of, put_newmark});
  visit(Field<double>{
      "/dynamics/damping",
      {{Count::one, 2, 0}},
      [](const Model& m) {
        return Doubles{m.dynamics.damping.mass, m.dynamics.damping.stiffness};
      },
      [](Model& m, const Doubles& v) { m.dynamics.damping = {.mass = v[0], .stiffness = v[1]}; }});
  if (model.dynamics.method == DynamicsMethod::packed) {
    visit(Field<std::int32_t>{"/dynamics/matrices/row",
                              {entries},
                              [](const Model& m) { return m.dynamics.matrices.row; },
                              [](Model& m, const Int32s& v) { m.dynamics.matrices.row = v; },
                              stored_dofs});
    visit(Field<std::int64_t>{"/dynamics/matrices/start",
                              {{Count::stored_nodes, model.dimension(), 1}},
                              [](const Model& m) { return m.dynamics.matrices.start; },
                              [](Model& m, const Int64s& v) { m.dynamics.matrices.start = v; },
                              {Count::matrix_entries, 1, 1}});
    visit(Field<double>{"/dynamics/matrices/mass",
                        {entries},
                        [](const Model& m) { return m.dynamics.matrices.mass; },
                        [](Model& m, const Doubles& v) { m.dynamics.matrices.mass = v; }});
    visit(Field<double>{"/dynamics/matrices/damping",
                        {entries},
                        [](const Model& m) { return m.dynamics.matrices.damping; },
                        [](Model& m, const Doubles& v) { m.dynamics.matrices.damping = v; }});
  }
  if (model.dynamics.method == DynamicsMethod::modal) {
    visit(Field<double>{"/dynamics/modes/omega",
                        {{Count::modes, 1, 1}},
                        [](const Model& m) { return m.dynamics.omega; },
                        [](Model& m, const Doubles& v) { m.dynamics.omega = v; },
                        {Count::one, 0, 0},
                        true});
    visit(Field<double>{"/dynamics/modes/shapes",
                        {modes, stored_dofs},
                        [](const Model& m) { return m.dynamics.shapes; },
                        [](Model& m, const Doubles& v) { m.dynamics.shapes = v; }});
  }
}

/// Checks that Newmark's method is stable, that damping is not negative, and that M and C_d or the modes are
/// in order: columns of the lower triangle of all free dofs, ascending frequencies, zeros at held dofs.
/// Assumes sizes and value ranges are checked. Throws Error (where = `where`) naming the field.
void check_dynamics(const Model& model, const std::string& where);

}  // namespace palpate
