// The ticks of a recording as a table.
#pragma once

#include <string>
#include <string_view>

#include "formats/recording.h"

namespace palpate {

/// The line of names that the table begins with.
[[nodiscard]] std::string_view ticks_names() noexcept;

/// A tick as a line of numbers, comma-separated. SI units; force and torque are those on the body. Numbers
/// are the shortest that read back as they are.
[[nodiscard]] std::string ticks_line(const TickRecord& tick);

}  // namespace palpate
