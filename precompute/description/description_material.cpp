#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

const Keys claim_kinds = {"regions", "box", "half_space", "sphere", "lowest"};

/// In space [xx yy zz xy yz zx], in the plane [xx yy zz xy].
std::array<double, 6> read_initial_strain(const TomlTable& material, int dimension) {
  const std::vector<double> values = material.numbers("initial_strain", dimension == 3 ? 6 : 4);
  std::array<double, 6> strain{};
  std::copy(values.begin(), values.end(), strain.begin());
  return strain;
}

MaterialPart read_material(const TomlTable& material, int dimension) {
  MaterialPart part;
  part.material.youngs_modulus = material.positive("youngs_modulus");
  part.material.poissons_ratio = material.number("poissons_ratio");
  part.material.density = material.positive("density", part.material.density);
  if (!(part.material.poissons_ratio > -1.0 && part.material.poissons_ratio < 0.5)) {
    material.fail("poissons_ratio",
                  material.name_of("poissons_ratio") + " must lie between -1 and 1/2, both excluded, not " +
                      shown(part.material.poissons_ratio),
                  "nearly incompressible tissue is 0.45 to 0.49");
  }
  part.material.friction = material.number("friction", part.material.friction);
  if (part.material.friction < 0.0) {
    material.fail("friction",
                  material.name_of("friction") + " must be 0 or more, not " + shown(part.material.friction),
                  "give Coulomb's coefficient, e.g. 0.2 for wet tissue");
  }
  if (material.has("initial_strain")) {
    part.material.initial_strain = read_initial_strain(material, dimension);
  }
  const std::string_view claim = material.at_most_one_of(claim_kinds);
  if (claim == "regions") {
    part.regions = material.integers(claim);
  } else if (!claim.empty()) {
    part.where = read_selection(material, claim, dimension);
  }
  return part;
}

bool is_rest(const MaterialPart& part) {
  return part.regions.empty() && !part.where;
}

}  // namespace

std::vector<MaterialPart> read_materials(const TomlTable& root, int dimension) {
  Keys keys = {"youngs_modulus", "poissons_ratio", "density", "friction", "initial_strain"};
  keys.insert(keys.end(), claim_kinds.begin(), claim_kinds.end());
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
