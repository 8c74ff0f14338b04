// That Green's functions cannot be compressed.
#pragma once

#include "base/error.h"

namespace palpate {

/// Thrown, by all processes that share the work alike, where Green's functions cannot be compressed as
/// exactly as they are to be; nothing else is wrong with the body.
class OutOfReach : public Error {
 public:
  using Error::Error;
};

}  // namespace palpate
