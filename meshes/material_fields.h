// The table of a material's constants. Description, baked file, checks, inspection and documentation walk it,
// so that a constant added here is read, stored, loaded, checked and shown.
#pragma once

#include <span>
#include <string_view>

#include "base/number_range.h"
#include "meshes/material.h"

namespace palpate {

/// One constant of a material, or several under one name.
struct MaterialField {
  std::string_view key;      ///< key in model.toml
  std::string_view dataset;  ///< baked dataset, a row per material; neighbours in the table may share one
  std::string_view symbol;   ///< name in the output of inspect
  std::string_view unit;     ///< SI, empty for a pure number
  bool required = false;     ///< if not, the default of `Material` applies when it is left out
  NumberRange range{};
  std::string_view meaning;  ///< text of the reference
  std::string_view hint;     ///< hint for a value that is missing or out of range
};

/// Calls visit(field, numbers) for each constant, in the order of the baked file; `numbers` is a span of the
/// material's own members. A member added to Material must be named here, else nothing compiles.
template <class SomeMaterial, class Visitor>
void for_each_material_field(SomeMaterial&& material, Visitor&& visit) {
  auto& [youngs_modulus, poissons_ratio, density, friction, initial_strain] = material;
  constexpr NumberRange compressible{-1.0, 0.5, false, false, "between -1 and 1/2, both excluded"};
  visit(MaterialField{"youngs_modulus", "/material/isotropic", "E", "Pa", true, positive_number, "E > 0",
                      "give Young's modulus in pascals, e.g. 5e3 for soft tissue"},
        std::span(&youngs_modulus, 1));
  visit(MaterialField{"poissons_ratio", "/material/isotropic", "nu", "", true, compressible, "−1 < ν < 1/2",
                      "nearly incompressible tissue is 0.45 to 0.49"},
        std::span(&poissons_ratio, 1));
  visit(MaterialField{"density", "/material/isotropic", "density", "kg/m^3", false, positive_number, "> 0",
                      "give it in kg/m^3, e.g. 1060 for tissue"},
        std::span(&density, 1));
  visit(
      MaterialField{"friction", "/material/friction", "friction", "", false, number_from_zero,
                    "Coulomb's coefficient between the material's surface and a tool, ≥ 0; 0 is frictionless",
                    "give Coulomb's coefficient, e.g. 0.2 for wet tissue"},
      std::span(&friction, 1));
  visit(MaterialField{"initial_strain", "/material/initial_strain", "initial strain", "", false, any_number,
                      "strain at which the material is free of stress: `[xx, yy, zz, xy, yz, zx]`, in the "
                      "plane `[xx, yy, zz, xy]`; shear is γ = 2ε",
                      "give six numbers, in the plane four"},
        std::span(initial_strain));
}

}  // namespace palpate
