// An elastic body made by hand, for the tests of assembly and Green's functions.
#pragma once

#include <utility>
#include <vector>

#include "precompute/numerics/assembly.h"

namespace palpate::test {

/// Owns what an StiffnessInput refers to: one material everywhere and nothing held until told otherwise.
struct ElasticCase {
  Mesh mesh;
  std::vector<Material> materials;
  Analysis analysis = Analysis::solid;
  double thickness = 1.0;
  std::vector<Index> material_of_element;
  std::vector<std::uint8_t> fixed;
  std::vector<Vec3> prescribed;

  ElasticCase(Mesh of, const Material& material)
      : mesh(std::move(of)),
        materials{material},
        analysis(mesh.dimension() == 2 ? Analysis::plane_stress : Analysis::solid),
        material_of_element(static_cast<std::size_t>(mesh.elements()), 0),
        fixed(mesh.nodes.size(), 0),
        prescribed(mesh.nodes.size(), Vec3::Zero()) {}

  /// Holds the nodes for which is_fixed(x) along the axes of the mask.
  template <class IsFixed>
  ElasticCase& hold(IsFixed is_fixed, std::uint8_t mask) {
    for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
      if (is_fixed(mesh.nodes[node])) fixed[node] = static_cast<std::uint8_t>(fixed[node] | mask);
    }
    return *this;
  }

  [[nodiscard]] StiffnessInput body() const {
    return {mesh, analysis, thickness, materials, material_of_element, fixed, prescribed};
  }
};

}  // namespace palpate::test
