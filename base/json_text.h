// JSON as text.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace palpate {

/// `value` (nlohmann::json or ordered_json) on one line; with `indent` on several, that many spaces per
/// level, and with a final newline. Numbers read back to the same bits; infinities and NaN, which JSON lacks,
/// become null. File names may hold any bytes: invalid UTF-8 becomes U+FFFD.
template <class Json>
[[nodiscard]] std::string json_text(const Json& value, int indent = -1) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace) + (indent < 0 ? "" : "\n");
}

}  // namespace palpate
