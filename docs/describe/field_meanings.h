// What the reference says of the datasets and attributes of files. Their types and shapes come from the
// tables that writer and reader walk.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace palpate {

/// A dataset by its path, or an attribute by its name.
struct FieldMeaning {
  std::string_view path;
  std::string_view meaning;
};

[[nodiscard]] std::span<const FieldMeaning> model_attribute_meanings();
[[nodiscard]] std::span<const FieldMeaning> model_field_meanings();
[[nodiscard]] std::span<const FieldMeaning> recording_attribute_meanings();

}  // namespace palpate
