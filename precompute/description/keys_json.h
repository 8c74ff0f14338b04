// Keys of model.toml as data.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace palpate {

/// All tables with their keys, the constants of a material, and the elements, meshers and keys of [mesh] for
/// each kind of geometry.
[[nodiscard]] nlohmann::ordered_json keys_json();

}  // namespace palpate
