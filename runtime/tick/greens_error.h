// How far off forces may be by what compressed Green's functions lack.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "matrices/error_bound.h"
#include "runtime/body/nodal_load.h"

namespace palpate {

class Body;
class NearField;
struct ContactRow;

/// Workspace of it.
struct GreensErrorScratch {
  GreensErrorScratch(const Body& body, const NearField& near);

  std::optional<ErrorBound> bound;  ///< none where the Green's functions are not compressed
  std::vector<double> near_force;   ///< [d near nodes] what a motion of the tool adds [N/m]
  NodalLoad stored_force;           ///< the same on stored nodes
};

/// Takes the forces that a tick has found.
void begin_greens_error(const NearField& near, GreensErrorScratch& work) noexcept;

/// The most that the force on a tool may be off by along an axis [N]: `force_change` [rows] is by how much
/// the forces of `rows` answer to a motion of the tool along it [N/m].
[[nodiscard]] double greens_error(NearField& near, GreensErrorScratch& work, std::span<const ContactRow> rows,
                                  std::span<const double> force_change) noexcept;

}  // namespace palpate
