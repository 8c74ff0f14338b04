// Overlays condensed in advance, for the file.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "formats/model.h"
#include "precompute/description/description.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

/// Estimated requirements of a body's overlays.
struct OverlayPlan {
  std::vector<Index> centres;     ///< [P] stored nodes on the surface in the regions, ascending
  std::int64_t file_bytes = 0;    ///< of their matrices
  std::int64_t memory_bytes = 0;  ///< while they are computed and written
};

/// Plans overlays. Needs the model's mesh, surface, scope and held nodes. Throws Error (where = `file` and
/// the region) for a region that selects nothing, or nothing that can be touched and is free along some axis.
OverlayPlan plan_overlays(const Model& model, const OverlayRegions& overlay, const std::string& file);

/// Condenses one patch around each centre; the result does not depend on how the patches are divided. `done`
/// gets the finished fraction (0..1) of patches; if it returns false, the rest is left out. Needs the
/// materials besides what plan_overlays does. Throws Error for elements that are too flat.
StoredOverlay condense_overlays(const Model& model, const OverlayRegions& overlay,
                                const std::vector<Index>& centres, Sharing& sharing,
                                const std::function<bool(double)>& done);

}  // namespace palpate
