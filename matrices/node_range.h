// Ranges of nodes.
#pragma once

#include "base/vectors.h"

namespace palpate {

/// Nodes [first, end).
struct NodeRange {
  Index first = 0, end = 0;
};

}  // namespace palpate
