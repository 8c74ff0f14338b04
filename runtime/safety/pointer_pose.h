// What a pointer on a screen says of a tool.
#pragma once

#include "runtime/touch/tool.h"

namespace palpate {

/// Where the pointer wants the tool.
struct PointerPose {
  ToolPose pose;
  bool lifted = false;  ///< it hovers: nothing is felt of the way to where it is let down
};

}  // namespace palpate
