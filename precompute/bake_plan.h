// Work and resources of a bake, known and reported before anything is solved.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/journal.h"
#include "precompute/assembled_body.h"
#include "precompute/bake_run.h"
#include "precompute/compressed_greens.h"
#include "precompute/numerics/dynamics.h"
#include "precompute/numerics/overlay_regions.h"
#include "precompute/plan.h"

namespace palpate {

// Names of stages.
inline constexpr const char* factor_stage = "factorising K";
inline constexpr const char* overlay_stage = "overlays";
inline constexpr const char* modes_stage = "looking for modes";
inline constexpr const char* precision_stage = "choosing the precision";
inline constexpr const char* write_stage = "writing the file";

/// Plan for a body.
struct BakePlan {
  Plan plan;
  Plan packed{};  ///< for every entry, if compression is planned
  std::optional<CompressionPlan> compression{};
  OverlayPlan overlays{};
  DynamicsPlan dynamics{};
  std::optional<BakePart> part{};  ///< requested part: the same columns of all matrices
};

/// Plans all stages, hands the factor to all processes where that is asked for or where one of them cannot
/// hold it, and says what it will take. Throws Error where memory will not do.
BakePlan plan_bake(const BakeRun& run, const MeshedModel& meshed, AssembledBody& body);

/// The stages that follow the plan, by so many ranks.
std::vector<Stage> stages_of(const BakePlan& bake, int jobs, int ranks);

/// Continues with every entry after "auto" has found compression out of reach.
void fall_back(const BakeRun& run, const std::string& why, const AssembledBody& body, Model& model,
               BakePlan& bake);

}  // namespace palpate
