// Bound on the error of forces due to compressed Green's functions.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "matrices/error_bound.h"
#include "runtime/core/body/nodal_load.h"

namespace palpate {

class ElasticBody;
class NearField;
struct ContactRow;

/// Workspace of the bound.
struct GreensErrorScratch {
  GreensErrorScratch(const ElasticBody& body, const NearField& near);

  std::optional<ErrorBound> bound;  ///< empty if the Green's functions are not compressed
  std::vector<double> near_force;   ///< [d near nodes] change by a motion of the tool [N/m]
  NodalLoad stored_force;           ///< near_force on stored nodes
};

/// Stores the forces of a tick.
void begin_greens_error(const NearField& near, GreensErrorScratch& work) noexcept;

/// Returns a bound on the error of the force on a tool along an axis [N]. `force_change` [rows]: change of
/// the forces of `rows` by a motion of the tool along it [N/m].
[[nodiscard]] double greens_error(NearField& near, GreensErrorScratch& work, std::span<const ContactRow> rows,
                                  std::span<const double> force_change) noexcept;

}  // namespace palpate
