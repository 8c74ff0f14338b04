#include "runtime/background/element_stress.h"

#include "meshes/element.h"

namespace palpate {

StressRows element_stress(const Model& model) {
  const ElementType type = model.mesh.element;
  std::vector<HookesLaw> laws;
  for (const Material& material : model.materials) laws.emplace_back(material, model.analysis);
  StressMean mean(model.mesh.nodes.size());
  std::vector<StressBlock> blocks;
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const auto material = static_cast<std::size_t>(model.material_of_element[e]);
    const HookesLaw& law = laws[material];
    const ElementNodes x = element_nodes(model.mesh, e);
    const std::span<const Index> nodes = model.mesh.element_nodes(e);
    const double volume = element_volume(type, x);
    Mat3 all = Mat3::Identity();
    all(2, 2) = law.is_plane ? 0.0 : 1.0;
    Stress constant = -stress_of(law.initial);
    law.complete(constant);
    for (std::size_t p = 0; p < nodes.size(); ++p) {
      const ShapeGradients g = mapped_gradients(type, x, reference_nodes(type)[p]).gradients;
      blocks.clear();
      for (Eigen::Index j = 0; j < g.rows(); ++j) {
        Vec3 gradient = Vec3::Zero();
        gradient.head(g.cols()) = g.row(j).transpose();
        blocks.push_back(stress_by_displacement(law, law.lambda, all, gradient));
      }
      mean.add(nodes[p], volume, nodes, blocks, constant);
    }
  }
  return mean.rows();
}

}  // namespace palpate
