// The ticks of a recording as a table.
#pragma once

#include <string>

#include "formats/recording.h"

namespace palpate {

/// A tick as a line of numbers, comma-separated, under `ticks_header`. SI units; force and torque are those
/// on the body. Numbers are the shortest that read back as they are.
[[nodiscard]] std::string ticks_line(const TickRecord& tick);

}  // namespace palpate
