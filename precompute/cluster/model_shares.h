// Several models over the ranks.
#pragma once

#include <string>
#include <vector>

#include "precompute/bake.h"
#include "precompute/team.h"

namespace palpate {

/// Which models all ranks bake together, one after the other, and which each rank bakes alone.
struct ModelShares {
  std::vector<std::string> by_all;
  std::vector<std::vector<std::string>> by_rank;
};

/// Models whose seconds are well above a rank's share of all are by all; of the others each goes, the longest
/// first, to the rank that has the least to do. `seconds` [models] are those of one rank.
ModelShares share_models(const std::vector<std::string>& models, const std::vector<double>& seconds,
                         int ranks);

/// Plans the models, some in each rank, and shares them. Throws Error for a model that cannot be planned.
ModelShares share_models(const std::vector<std::string>& models, const BakeOptions& options, Team& team);

/// What came of the models that ranks baked alone; in the leader.
struct SideBySide {
  std::vector<std::string> entries;  ///< of the report
  int status = 0;
};

/// Each rank bakes its own, and prints a line for each. An error of one does not keep the others.
SideBySide bake_side_by_side(const ModelShares& shares, const BakeOptions& options, Team& team);

}  // namespace palpate
