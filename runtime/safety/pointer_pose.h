// Tool pose requested by a pointer on a screen.
#pragma once

#include "runtime/core/touch/tool.h"

namespace palpate {

/// Tool pose requested by a pointer.
struct PointerPose {
  ToolPose pose;
  bool lifted = false;  ///< the tool hovers: the path to where it is lowered is not felt
};

}  // namespace palpate
