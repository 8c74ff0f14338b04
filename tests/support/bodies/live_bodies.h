// Bodies for the tests of runtime/live.
#pragma once

#include <functional>
#include <random>

#include "meshes/generate.h"
#include "statics/live_forces.h"

namespace palpate::test {

/// A body of one material, free in space.
inline LiveInput live_input_of(Mesh mesh, const Material& material, Analysis analysis = Analysis::solid) {
  LiveInput input{.mesh = std::move(mesh), .analysis = analysis, .materials = {material}};
  if (analysis != Analysis::solid) input.thickness = 0.01;
  input.material_of_element.assign(static_cast<std::size_t>(input.mesh.elements()), 0);
  return input;
}

/// Holds nodes where `where` says so, along the axes of the bits.
inline void hold(LiveInput& input, const std::function<bool(const Vec3&)>& where, std::uint8_t axes) {
  input.fixed.resize(input.mesh.nodes.size());
  for (std::size_t node = 0; node < input.mesh.nodes.size(); ++node) {
    if (where(input.mesh.nodes[node])) input.fixed[node] |= axes;
  }
}

/// A block of 40 x 20 x 20 mm, in the plane 40 x 20 mm, soft as tissue.
inline LiveInput live_block(ElementType type, Analysis analysis = Analysis::solid, double nu = 0.3) {
  const Material material{.youngs_modulus = 5e3, .poissons_ratio = nu, .density = 1000.0};
  if (traits(type).dimension == 2) {
    const auto plane = analysis == Analysis::solid ? Analysis::plane_strain : analysis;
    return live_input_of(generate(RectangleShape{Vec3::Zero(), {0.04, 0.02, 0}, {4, 2}}, type), material,
                         plane);
  }
  Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(0.04, 0.02, 0.02), {4, 2, 2}},
                       type == ElementType::hex8 ? type : ElementType::tet4);
  if (type == ElementType::tet10) mesh = with_elements(std::move(mesh), type, "");
  return live_input_of(std::move(mesh), material);
}

/// Positions of the mesh's nodes, each moved by up to `by` [m] along each axis.
inline Eigen::VectorXd shaken(const LiveBody& body, double by, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> move(-by, by);
  Eigen::VectorXd x = body.rest();
  for (double& at : x) at += move(random);
  return x;
}

/// Symmetric strain of a size at each quadrature point, in the plane within it.
inline std::vector<Mat3> random_strain(const LiveBody& body, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-size, size);
  std::vector<Mat3> strain(static_cast<std::size_t>(body.all_points()));
  for (Mat3& at : strain) {
    const Mat3 A = Mat3::NullaryExpr([&] { return entry(random); });
    at = 0.5 * (A + A.transpose());
    if (body.dimension() == 2) {
      at.row(2).setZero();
      at.col(2).setZero();
    }
  }
  return strain;
}

}  // namespace palpate::test
