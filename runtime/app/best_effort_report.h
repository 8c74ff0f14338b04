// Report on ticks whose force was a best effort.
#pragma once

#include <cstdint>
#include <string>

#include "base/json_text.h"
#include "runtime/loop/best_effort.h"

namespace palpate {

nlohmann::ordered_json to_json(const BestEffort& best_effort);

/// Describes their number, the causes and the error of the force; `ticks`: ticks of the whole run. Empty if
/// there were none.
std::string in_words(const BestEffort& best_effort, std::int64_t ticks);

/// True if a warning is due: more than 0.1 % of the ticks, or an error of more than 2 % of the force.
bool is_grave(const BestEffort& best_effort, std::int64_t ticks);

}  // namespace palpate
