// The keys of model.toml as data.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace palpate {

/// All tables with their keys, the constants of a material, and which elements, meshers and keys of [mesh]
/// each kind of geometry has.
[[nodiscard]] nlohmann::ordered_json keys_json();

}  // namespace palpate
