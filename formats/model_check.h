// Checks of a model before it is written and after it is read.
#pragma once

#include <string>

#include "formats/field_counts.h"

namespace palpate {

/// Counts of a model in memory.
Counts counts_of(const Model& model, std::string where);

/// Checks conditions on several fields: an analysis that fits the elements, valid materials and thickness, a
/// plane body in z = 0, no inverted elements, surface simplices with distinct corners, stored nodes that are
/// free along some axis and listed once, none with scope none, patches in order around stored nodes of the
/// surface. Assumes sizes and value ranges are checked. Throws Error (where = `where`) naming the field.
void check_model(const Model& model, const std::string& where);

/// Largest displacement, relative to the body's size, up to which linear elasticity counts as valid.
inline constexpr double small_strain = 0.1;

/// Warning if loads take the body at rest beyond small strain, with the probable mistake; else empty.
[[nodiscard]] std::string rest_warning(const Model& model);

}  // namespace palpate
