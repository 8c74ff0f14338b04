// JSON as text.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace palpate {

/// `value` (nlohmann::json or ordered_json) in one line; with `indent` over several, each level that many
/// spaces deeper, and a line's end. Numbers read back to the same bits; infinities and NaN, which JSON does
/// not know, are null. File names may be any bytes: what is not UTF-8 is shown as U+FFFD.
template <class Json>
[[nodiscard]] std::string json_text(const Json& value, int indent = -1) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace) + (indent < 0 ? "" : "\n");
}

}  // namespace palpate
