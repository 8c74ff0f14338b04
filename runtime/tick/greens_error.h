// How far off forces may be by what compressed Green's functions lack.
#pragma once

#include <optional>
#include <vector>

#include "matrices/error_bound.h"
#include "runtime/body/nodal_load.h"

namespace palpate {

class Body;
class NearField;
struct Scratch;
struct ToolState;

/// Workspace of it.
struct GreensErrorScratch {
  GreensErrorScratch(const Body& body, const NearField& near);

  std::optional<ErrorBound> bound;  ///< none where the Green's functions are not compressed
  std::vector<double> near_force;   ///< [d near nodes] what a motion of the tool adds [N/m]
  NodalLoad stored_force;           ///< the same on stored nodes
};

/// Takes the forces that a tick has found.
void begin_greens_error(const NearField& near, Scratch& scratch) noexcept;

/// Takes in how the forces answer to a motion of the tool along an axis (scratch.force_change from `begin`
/// on): adds to the square of tool.greens_error what the force may be off by along that axis.
void note_greens_error(NearField& near, Scratch& scratch, ToolState& tool, Index begin) noexcept;

}  // namespace palpate
