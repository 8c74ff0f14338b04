// Export of a recording's ticks as a table.
#pragma once

#include <string>

#include "formats/recording.h"

namespace palpate {

/// Returns a tick as a line of comma-separated numbers under `ticks_header`. SI units; force and torque are
/// those on the body. Each number is the shortest text that reads back exactly.
[[nodiscard]] std::string ticks_line(const TickRecord& tick);

}  // namespace palpate
