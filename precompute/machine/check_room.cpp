#include "precompute/machine/check_room.h"

#include <fmt/format.h>

#include "base/error.h"
#include "precompute/machine/allotment.h"

namespace palpate {

void check_room(double bytes, const std::string& what, const std::string& where, const std::string& hint) {
  const auto free = static_cast<double>(allotted_memory());
  if (free == 0.0 || bytes <= free) return;  // 0: unknown
  throw Error(
      fmt::format("{} takes some {:.3g} GB of memory, {:.3g} GB are free", what, bytes / 1e9, free / 1e9),
      where, hint + ", or use a machine with more memory");
}

}  // namespace palpate
