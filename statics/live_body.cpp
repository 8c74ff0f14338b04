#include "statics/live_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <string>
#include <utility>

#include "base/error.h"
#include "formats/model.h"
#include "meshes/element.h"

namespace palpate {
namespace {

[[noreturn]] void refuse(const std::string& what, const char* hint) {
  throw Error(what, "live body", hint);
}

void check_from_zero(const char* what, double value) {
  if (value >= 0.0) return;
  refuse(fmt::format("{} is {}, and it must be 0 or more", what, value), "give a number from 0 on");
}

/// Engineering strain [xx yy zz xy yz zx] as a tensor.
Mat3 strain_tensor(const std::array<double, 6>& strain) {
  Mat3 tensor;
  tensor << strain[0], 0.5 * strain[3], 0.5 * strain[5],  //
      0.5 * strain[3], strain[1], 0.5 * strain[4],        //
      0.5 * strain[5], 0.5 * strain[4], strain[2];
  return tensor;
}

/// Loads of a file without the forces that represent initial strain, which the laws include themselves.
std::vector<Vec3> loads_alone(const Model& model) {
  std::vector<Vec3> loads = model.rest_force;
  if (loads.empty()) return loads;
  const Mesh& mesh = model.mesh;
  const int d = mesh.dimension();
  for (Index e = 0; e < mesh.elements(); ++e) {
    const Material& material = model.materials[static_cast<std::size_t>(model.material_of_element[e])];
    const auto& strain = material.initial_strain;
    if (std::all_of(strain.begin(), strain.end(), [](double s) { return s == 0.0; })) continue;
    const ElementVector f = element_stress_force(mesh.element, element_nodes(mesh, e),
                                                 initial_stress(material, model.analysis), model.thickness);
    Eigen::Index k = 0;
    for (const Index node : mesh.element_nodes(e)) loads[node].head(d) -= f.segment(d * k++, d);
  }
  return loads;
}

}  // namespace

LiveInput live_input(const Model& model) {
  return {.mesh = model.mesh,
          .analysis = model.analysis,
          .thickness = model.thickness,
          .materials = model.materials,
          .material_of_element = model.material_of_element,
          .fixed = model.fixed,
          .held_displacement = model.rest_displacement,
          .load = loads_alone(model)};
}

struct LiveBody::LatePattern {
  std::once_flag is_made;
  TangentPattern pattern;
};

LiveBody::LiveBody(LiveInput input, const LiveOptions& options)
    : input_(std::move(input)), options_(options), pattern_(std::make_shared<LatePattern>()) {
  check();
  number_dofs();
  for (const Material& material : input_.materials) {
    constants_.push_back(law_constants(material, input_.analysis));
    Mat3& strain = initial_strain_.emplace_back(strain_tensor(material.initial_strain));
    if (input_.analysis == Analysis::plane_stress) strain(2, 2) = 0.0;  // free in plane stress
  }
  find_points();
  find_loads();
}

const TangentPattern& LiveBody::pattern() const {
  std::call_once(pattern_->is_made, [&] {
    pattern_->pattern =
        TangentPattern(input_.mesh.connectivity, nodes_per_element_, dimension(), free_of_dof_, free_dofs());
  });
  return pattern_->pattern;
}

void LiveBody::check() const {
  const Plasticity& plastic = options_.plasticity;
  check_from_zero("the yield strain", plastic.yield);
  check_from_zero("the creep rate", plastic.creep);
  check_from_zero("the largest plastic strain", plastic.maximum);
  check_from_zero("damping by mass", options_.damping.mass);
  check_from_zero("damping by stiffness", options_.damping.stiffness);
  if (!options_.gravity.allFinite()) refuse("gravity is not a number", "give it in m/s^2");
  const bool has_strain = options_.law != LiveLaw::neo_hookean;
  if (plastic.flows() && !has_strain) {
    refuse(fmt::format("the {} law does not flow", name_of(options_.law)),
           "plasticity is for the corotational and the linear law");
  }
  for (const Material& material : input_.materials) {
    const auto& strain = material.initial_strain;
    if (!has_strain && std::any_of(strain.begin(), strain.end(), [](double s) { return s != 0.0; })) {
      refuse(fmt::format("the {} law has no place for initial strain", name_of(options_.law)),
             "take the corotational law");
    }
  }
}

void LiveBody::number_dofs() {
  const auto d = static_cast<std::size_t>(dimension());
  const std::size_t nodes = input_.mesh.nodes.size();
  free_of_dof_.assign(d * nodes, -1);
  rest_.resize(static_cast<Eigen::Index>(d * nodes));
  start_.resize(rest_.size());
  for (std::size_t dof = 0; dof < d * nodes; ++dof) {
    const std::size_t node = dof / d, axis = dof % d;
    const auto at = static_cast<Eigen::Index>(dof);
    rest_[at] = start_[at] = input_.mesh.nodes[node][static_cast<Eigen::Index>(axis)];
    const bool held = !input_.fixed.empty() && ((input_.fixed[node] >> axis) & 1U) != 0;
    if (!held) {
      free_of_dof_[dof] = static_cast<Index>(dof_of_free_.size());
      dof_of_free_.push_back(static_cast<Index>(dof));
    } else if (!input_.held_displacement.empty()) {
      start_[at] += input_.held_displacement[node][static_cast<Eigen::Index>(axis)];
    }
  }
}

void LiveBody::find_points() {
  const Mesh& mesh = input_.mesh;
  nodes_per_element_ = traits(mesh.element).nodes;
  const std::span<const QuadraturePoint> rule = quadrature(mesh.element);
  points_ = static_cast<int>(rule.size());
  for (Index e = 0; e < mesh.elements(); ++e) {
    const ElementNodes x = element_nodes(mesh, e);
    for (const QuadraturePoint& point : rule) {
      const MappedGradients at = mapped_gradients(mesh.element, x, point.xi);
      weight_.push_back(point.weight * at.determinant * input_.thickness);
      for (Eigen::Index node = 0; node < nodes_per_element_; ++node) {
        for (Eigen::Index axis = 0; axis < 3; ++axis)
          gradient_.push_back(axis < at.gradients.cols() ? at.gradients(node, axis) : 0.0);
      }
    }
  }
}

void LiveBody::find_loads() {
  const Mesh& mesh = input_.mesh;
  const int d = dimension();
  mass_.setZero(rest_.size());
  for (Index e = 0; e < mesh.elements(); ++e) {
    const double density = input_.materials[input_.material_of_element[e]].density;
    const ShapeValues mass =
        element_lumped_mass(mesh.element, element_nodes(mesh, e), density, input_.thickness);
    for (Eigen::Index k = 0; k < mass.size(); ++k)
      mass_.segment(d * Eigen::Index{mesh.element_nodes(e)[k]}, d).array() += mass[k];
  }
  load_.resize(rest_.size());
  for (Eigen::Index dof = 0; dof < load_.size(); ++dof) {
    load_[dof] = mass_[dof] * options_.gravity[dof % d];
    if (!input_.load.empty()) load_[dof] += input_.load[dof / d][dof % d];
  }
}

}  // namespace palpate
