// Exception for Green's functions that cannot be compressed.
#pragma once

#include "base/error.h"

namespace palpate {

/// Thrown, by all processes that divide the work, if Green's functions cannot be compressed to the tolerance;
/// nothing else is wrong with the body.
class OutOfReach : public Error {
 public:
  using Error::Error;
};

}  // namespace palpate
