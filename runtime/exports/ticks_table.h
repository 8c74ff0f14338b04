// The ticks of a recording as a table.
#pragma once

#include <span>
#include <string>

#include "formats/recording.h"

namespace palpate {

/// Comma-separated: a line of names, then one for each tick. SI units; force and torque are those on the
/// body. Numbers are the shortest that read back as they are.
[[nodiscard]] std::string ticks_table(std::span<const TickRecord> ticks);

}  // namespace palpate
