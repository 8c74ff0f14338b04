// What the stages of a tick cost.
#pragma once

#include "runtime/body/body.h"
#include "runtime/core/tick/step.h"

namespace palpate::test {

/// Times [s].
struct TickStages {
  double find = 0.0;      ///< contact points, and the near nodes that are new
  double assemble = 0.0;  ///< W and b
  double solve = 0.0;
  double displace = 0.0;   ///< forces to the near nodes and their displacement
  double linearise = 0.0;  ///< the local model
};

/// Times the stages of the first pass of a tick that takes the one tool of `state` to `pose`. What a tick
/// does besides is left out: following the device, grabs, moving the surface. `state` is not fit for further
/// ticks.
TickStages time_stages(const Body& body, State& state, const ToolPose& pose);

}  // namespace palpate::test
