// Keys of model.toml, table by table: readers accept only these, and the reference lists them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/toml_table.h"

namespace palpate {

/// A key as the reference shows it.
struct ModelKey {
  std::string_view key;
  std::string_view unit;        ///< empty if it has none
  std::string otherwise;        ///< value if it is left out
  std::string meaning;          ///< text of the reference
  bool is_alternative = false;  ///< exactly one of the table's alternative keys is given
};

/// A table of model.toml; meshes/material_fields.h has the constants of a material.
struct KeyTable {
  std::string_view title;  ///< "[mesh]"; "" is the top level, "[geometry] box" a table within a table
  std::vector<ModelKey> keys;
};

/// Title of the keys that select nodes, which several tables have in common.
inline constexpr std::string_view selection_title = "selection";

/// Each table once, in the order of the reference.
[[nodiscard]] const std::vector<KeyTable>& key_tables();

/// Keys that a table may have, in that order.
[[nodiscard]] Keys keys_of(std::string_view title);
/// Alternative keys, of which one is given.
[[nodiscard]] Keys alternatives_of(std::string_view title);

}  // namespace palpate
