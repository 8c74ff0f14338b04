#include "precompute/description/keys_json.h"

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "base/words.h"
#include "meshes/material_fields.h"
#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

Json tables_json() {
  Json all = Json::array();
  for (const KeyTable& table : key_tables()) {
    Json keys = Json::array();
    for (const ModelKey& key : table.keys) {
      keys.push_back(
          {{"key", key.key}, {"unit", key.unit}, {"otherwise", key.otherwise}, {"meaning", key.meaning}});
    }
    all.push_back({{"title", table.title}, {"keys", std::move(keys)}});
  }
  return all;
}

Json constants_json() {
  Json all = Json::array();
  for_each_material_field(Material{}, [&](const MaterialField& field, std::span<const double> values) {
    const std::string usual = values.size() > 1 ? "none" : shown(values[0]);
    all.push_back({{"key", field.key},
                   {"unit", field.unit},
                   {"otherwise", field.required ? "required" : usual},
                   {"meaning", field.meaning}});
  });
  return all;
}

/// Kinds of geometry; one without a choice of meshers has keys for the mesher "".
Json geometries_json() {
  Json all = Json::array();
  for (const std::string_view kind : alternatives_of("[geometry]")) {
    const Keys meshers = meshers_of(kind);
    Json keys = Json::object();
    for (const std::string_view mesher : meshers.empty() ? Keys{""} : meshers)
      keys[std::string(mesher)] = mesh_keys_of(kind, mesher);
    all.push_back(
        {{"kind", kind}, {"elements", elements_of(kind)}, {"meshers", meshers}, {"keys", std::move(keys)}});
  }
  return all;
}

}  // namespace

Json keys_json() {
  return {{"tables", tables_json()}, {"material", constants_json()}, {"geometries", geometries_json()}};
}

}  // namespace palpate
