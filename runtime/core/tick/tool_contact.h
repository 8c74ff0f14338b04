// Contact of one tool.
#pragma once

#include <limits>

#include "runtime/core/tick/state.h"

namespace palpate {

/// Contact of one tool with the surface in this tick.
struct ToolContact {
  Index number;  ///< number of the tool
  Core core;
  double margin;          ///< [m]
  double lost;            ///< a core that is deeper than this is lost in the body [m]
  Index usable = 0;       ///< simplices of scratch.detection.found whose nodes are in the near field
  bool is_known = true;   ///< scratch.detection.pairs have the nearest points of the core's origin
  Index first_candidate;  ///< first candidate of this tool
  double nearest_distance = std::numeric_limits<double>::infinity();  ///< of the core's origin [m]
  bool inside = false;  ///< the core's origin is behind the surface
};

/// Makes candidates, in scratch.detection, of the contact points of one tool with one simplex. `nearest`: the
/// pair of the core's origin.
void touch_simplex(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
                   const TouchingPair& nearest) noexcept;

}  // namespace palpate
