// Overlays that are condensed ahead, for the file.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "formats/model.h"
#include "precompute/description/description.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

/// What the overlays of a body will take.
struct OverlayPlan {
  std::vector<Index> centres;     ///< [P] nodes on the surface in the regions that are stored, ascending
  std::int64_t file_bytes = 0;    ///< of their matrices
  std::int64_t memory_bytes = 0;  ///< while they are made and written
};

/// Needs of the model its mesh, surface, scope and what is held. Throws Error (where = `file` and the region)
/// for a region that selects nothing, or nothing that can be touched and is free along some axis.
OverlayPlan plan_overlays(const Model& model, const OverlayRegions& overlay, const std::string& file);

/// Condenses one patch round each centre; the result does not depend on who shares them. `done` is told the
/// share (0..1) of patches that are done; when it returns false, the rest is left out. Needs the materials
/// beside what the plan does. Throws Error for elements that are too flat.
StoredOverlay condense_overlays(const Model& model, const OverlayRegions& overlay,
                                const std::vector<Index>& centres, Sharing& sharing,
                                const std::function<bool(double)>& done);

}  // namespace palpate
