// The keys of model.toml, table by table: readers know no others, and the reference lists them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/toml_table.h"

namespace palpate {

/// A key as the reference shows it.
struct ModelKey {
  std::string_view key;
  std::string_view unit;        ///< empty for what has none
  std::string otherwise;        ///< what holds where it is left out
  std::string meaning;          ///< as the documentation tells it
  bool is_alternative = false;  ///< of these keys of a table one is given
};

/// A table of model.toml; the constants of a material stand in meshes/material_fields.h.
struct KeyTable {
  std::string_view title;  ///< "[mesh]"; "" is the top level, "[geometry] box" a table within a table
  std::vector<ModelKey> keys;
};

/// The title under which the ways to select nodes stand, which several tables share.
inline constexpr std::string_view selection_title = "selection";

/// Each table once, in the order of the reference.
[[nodiscard]] const std::vector<KeyTable>& key_tables();

/// What a table may hold, in that order.
[[nodiscard]] Keys keys_of(std::string_view title);
/// Keys of which one is given.
[[nodiscard]] Keys alternatives_of(std::string_view title);

}  // namespace palpate
