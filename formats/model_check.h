// What must hold of a model before it is written and after it is read.
#pragma once

#include <string>

#include "formats/field_counts.h"

namespace palpate {

/// Counts of a model in memory.
Counts counts_of(const Model& model, std::string where);

/// Proves what involves several fields: an analysis that fits the elements, valid materials and thickness, a
/// plane body in z = 0, elements that are nowhere inverted, surface simplices with distinct corners, stored
/// nodes that are free along some axis and named once, none with scope none, patches in their order round
/// stored nodes of the surface. Sizes are right and values in their ranges already.
/// Throws Error (where = `where`) naming the field.
void check_model(const Model& model, const std::string& where);

/// Share of the body's size: the largest displacement that linear elasticity is for.
inline constexpr double small_strain = 0.1;

/// Whether loads take the body at rest beyond small strain, and what is probably wrong then; else empty.
[[nodiscard]] std::string rest_warning(const Model& model);

}  // namespace palpate
