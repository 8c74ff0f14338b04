#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "meshes/material_fields.h"
#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

const Keys claim_kinds = alternatives_of("[material]");

/// Reads one constant if given; in the plane a list has no strains out of the plane.
void read_field(const TomlTable& material, const MaterialField& field, std::span<double> values,
                int dimension) {
  if (!field.required && !material.has(field.key)) return;
  if (values.size() == 1) {
    values[0] = material.number(field.key);
  } else {
    std::ranges::copy(material.numbers(field.key, dimension == 3 ? values.size() : 4), values.begin());
  }
  for (const double value : values) {
    if (field.range.contains(value)) continue;
    material.fail(
        field.key,
        fmt::format("{} must be {}, not {}", material.name_of(field.key), field.range.words, shown(value)),
        std::string(field.hint));
  }
}

MaterialPart read_material(const TomlTable& material, int dimension) {
  MaterialPart part;
  for_each_material_field(part.material, [&](const MaterialField& field, std::span<double> values) {
    read_field(material, field, values, dimension);
  });
  const std::string_view claim = material.at_most_one_of(claim_kinds);
  if (claim == "regions") {
    std::tie(part.regions, part.region_names) = material.integers_and_texts(claim);
  } else if (!claim.empty()) {
    part.where = read_selection(material, claim, dimension);
  }
  return part;
}

bool is_rest(const MaterialPart& part) {
  return part.regions.empty() && part.region_names.empty() && !part.where;
}

}  // namespace

std::vector<MaterialPart> read_materials(const TomlTable& root, int dimension) {
  Keys keys = claim_kinds;
  for_each_material_field(Material{}, [&](const MaterialField& field, auto) { keys.push_back(field.key); });
  if (root.is_table("material") || !root.has("material")) {
    return {read_material(root.table("material", keys), dimension)};
  }
  std::vector<MaterialPart> parts;
  std::size_t rest = 0;  // number of the entry that takes the rest
  for (const TomlTable& entry :
       root.tables("material", keys, "write one [material], or several [[material]]")) {
    parts.push_back(read_material(entry, dimension));
    if (!is_rest(parts.back())) {
      continue;
    }
    if (rest != 0) {
      entry.fail("",
                 "[[material]] number " + std::to_string(parts.size()) +
                     " is for the rest of the body, as number " + std::to_string(rest) + " is already",
                 "give one of them " + comma_list(claim_kinds));
    }
    rest = parts.size();
  }
  return parts;
}

}  // namespace palpate
