#include "runtime/surface_stress.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

unsigned held_axes(const Model& model, Index mesh_node) {
  return model.fixed[static_cast<std::size_t>(mesh_node)] & ((1U << model.dimension()) - 1U);
}

/// Of a facet at a point.
struct Tangent {
  Vec3 normal;
  ShapeGradients gradients;  // [nodes, 3] along the facet [1/m]
};

Tangent tangent_at(ElementType type, const ElementNodes& x, const Vec3& xi) noexcept {
  const ShapeGradients reference = reference_gradients(type, xi);
  if (reference.cols() == 1) {
    const Vec3 along = x.transpose() * reference;
    return {Vec3(along.y(), -along.x(), 0.0).normalized(),
            reference * along.transpose() / along.squaredNorm()};
  }
  const Eigen::Matrix<double, 3, 2> J = x.transpose() * reference;
  const Eigen::Matrix2d metric = J.transpose() * J;
  return {Vec3(J.col(0)).cross(Vec3(J.col(1))).normalized(), reference * metric.inverse() * J.transpose()};
}

/// What a material says at a point of a facet.
struct FacetLaw {
  FacetLaw(const HookesLaw& of, const Vec3& normal) noexcept
      : law(of),
        n(normal),
        P(Mat3::Identity() - normal * normal.transpose()),
        ratio(of.lambda / (of.lambda + 2.0 * of.mu)) {
    if (law.is_plane) P(2, 2) = 0.0;
  }

  [[nodiscard]] StressBlock by_displacement(const Vec3& gradient) const noexcept {
    return stress_by_displacement(law, 2.0 * law.mu * ratio, P, gradient);
  }
  [[nodiscard]] StressBlock by_traction() const noexcept {
    StressBlock block;
    for (int axis = 0; axis < 3; ++axis) {
      const Mat3 shear = n * Vec3::Unit(axis).transpose();
      block.col(axis) = stress_of(n[axis] * (ratio * P - n * n.transpose()) + shear + shear.transpose());
    }
    law.complete(block);
    return block;
  }
  [[nodiscard]] Stress constant() const noexcept {
    Stress stress = stress_of(ratio * n.dot(law.initial * n) * P - P * law.initial * P);
    law.complete(stress);
    return stress;
  }

  const HookesLaw& law;
  Vec3 n;
  Mat3 P;
  double ratio;
};

/// Integrals of the shape functions of a tri6 are zero at its corners, and so are its corners' forces under
/// an even pressure. Middles give a part to the ends of their edges, so that an even pressure has even
/// quotients: those of the linear simplices that a tri6 is cut into.
template <class T, class At>
void spread_middles(std::span<const Index> nodes, std::vector<std::uint8_t>& done, const At& at) {
  for (std::size_t k = 3; k < nodes.size(); ++k) {
    if (!done.empty() && std::exchange(done[static_cast<std::size_t>(nodes[k])], std::uint8_t{1}) != 0)
      continue;
    T& middle = at(k);
    const T part = 0.125 * middle;
    middle -= 2.0 * part;
    at(k - 3) += part;
    at((k - 2) % 3) += part;
  }
}

}  // namespace

SurfaceStress::SurfaceStress(const Body& body)
    : body_(body),
      position_(body.surface_in_mesh()),
      facet_type_(traits(body.model().mesh.element).facet),
      body_force_(body.surface_mesh_nodes().size()),
      in_patch_(static_cast<std::size_t>(body.model().mesh.elements())),
      on_patch_(position_.size()),
      weight_(position_.size()) {
  for (const Material& material : body.model().materials) laws_.emplace_back(material, body.model().analysis);
  number_facets();
  measure();
  find_traction_of_loads();
  make_rows();
}

SurfaceStress::Facet SurfaceStress::facet(std::size_t number) const noexcept {
  const auto width = static_cast<std::size_t>(traits(facet_type_).nodes);
  const Index material = body_.model().material_of_element[static_cast<std::size_t>(element_[number])];
  return {facet_type_, std::span(facet_nodes_).subspan(width * number, width),
          &laws_[static_cast<std::size_t>(material)]};
}

SurfaceStress::Facet SurfaceStress::simplex(std::size_t number, std::size_t of) const noexcept {
  const auto d = static_cast<std::size_t>(body_.dimension());
  return {d == 3 ? ElementType::tri3 : ElementType::line2, body_.simplices().subspan(d * number, d),
          facet(of).law};
}

ElementNodes SurfaceStress::positions_of(std::span<const Index> nodes) const noexcept {
  ElementNodes x(static_cast<Eigen::Index>(nodes.size()), 3);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    x.row(static_cast<Eigen::Index>(k)) = position_[static_cast<std::size_t>(nodes[k])].transpose();
  return x;
}

void SurfaceStress::number_facets() {
  const Model& model = body_.model();
  std::vector<Index> number(model.mesh.nodes.size(), -1);
  for (std::size_t k = 0; k < body_nodes(); ++k)
    number[static_cast<std::size_t>(body_.surface_mesh_nodes()[k])] = static_cast<Index>(k);
  for (const ElementSide& side : boundary_sides(model.mesh)) {
    unsigned held = ~0U;
    for (const Index node : side_nodes(model.mesh, side)) {
      facet_nodes_.push_back(number[static_cast<std::size_t>(node)]);
      held &= held_axes(model, node);
    }
    element_.push_back(side.element);
    known_.push_back(held == 0 ? 1 : 0);
  }
  for (const Index parent : body_.fine_surface().parents)
    parents_.push_back(number[static_cast<std::size_t>(parent)]);
  simplices_of_facet_ = body_.surface_friction().size() / facets();
}

void SurfaceStress::measure() {
  const Model& model = body_.model();
  const auto d = static_cast<std::size_t>(model.dimension());
  const ElementType type = d == 3 ? ElementType::tri3 : ElementType::line2;
  const auto areas = [&](std::span<const Index> simplices, std::size_t count, const auto& position) {
    std::vector<double> area(count);
    for (std::size_t at = 0; at < simplices.size(); at += d) {
      ElementNodes x(static_cast<Eigen::Index>(d), 3);
      for (std::size_t k = 0; k < d; ++k)
        x.row(static_cast<Eigen::Index>(k)) = position(simplices[at + k]).transpose();
      const ShapeValues shares = facet_shape_integrals(type, x, model.thickness);
      for (std::size_t k = 0; k < d; ++k)
        area[static_cast<std::size_t>(simplices[at + k])] += shares[static_cast<Eigen::Index>(k)];
    }
    return area;
  };
  area_ = areas(body_.simplices(), position_.size(),
                [&](Index node) { return position_[static_cast<std::size_t>(node)]; });
  const std::vector<double> of_mesh = areas(model.surface, model.mesh.nodes.size(), [&](Index node) {
    return model.mesh.nodes[static_cast<std::size_t>(node)];
  });
  for (const Index node : body_.surface_mesh_nodes())
    body_area_.push_back(of_mesh[static_cast<std::size_t>(node)]);
}

void SurfaceStress::find_traction_of_loads() {
  const Model& model = body_.model();
  const int d = model.dimension();
  const ElementType type = model.mesh.element;
  // Initial strain is a load without a traction.
  std::vector<Vec3> force = model.rest_force;
  std::vector<double> mass(force.size());
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const auto number = static_cast<std::size_t>(model.material_of_element[static_cast<std::size_t>(e)]);
    const Material& material = model.materials[number];
    const ElementNodes x = element_nodes(model.mesh, e);
    const ElementVector f =
        element_stress_force(type, x, initial_stress(material, model.analysis), model.thickness);
    const ShapeValues shares = element_shape_integrals(type, x, model.thickness);
    Eigen::Index k = 0;
    for (const Index node : model.mesh.element_nodes(e)) {
      force[static_cast<std::size_t>(node)].head(d) -= f.segment(d * k, d);
      mass[static_cast<std::size_t>(node)] += material.density * shares[k++];
    }
  }
  std::vector<std::uint8_t> is_inside(force.size(), 1);
  for (const Index node : body_.surface_mesh_nodes()) is_inside[static_cast<std::size_t>(node)] = 0;
  Vec3 weight = Vec3::Zero();
  double inside = 0.0;
  for (std::size_t node = 0; node < force.size(); ++node) {
    if (is_inside[node] == 0) continue;
    weight += mass[node] * force[node];
    inside += mass[node] * mass[node];
  }
  const Vec3 acceleration = inside > 0.0 ? Vec3(weight / inside) : Vec3(Vec3::Zero());
  std::vector<Vec3> traction;
  for (const Index node : body_.surface_mesh_nodes())
    traction.push_back(force[static_cast<std::size_t>(node)] -
                       mass[static_cast<std::size_t>(node)] * acceleration);

  std::vector<double> area(body_nodes());
  std::vector<std::uint8_t> done(body_nodes()), none;
  for (std::size_t f = 0; f < facets(); ++f) {
    if (known_[f] == 0) continue;
    const Facet facet = this->facet(f);
    const ElementNodes x = positions_of(facet.nodes);
    ShapeValues shares = facet_shape_integrals(facet.type, x, model.thickness);
    if (facet.type == ElementType::tri6) {
      spread_middles<double>(facet.nodes, none,
                             [&](std::size_t k) -> double& { return shares[static_cast<Eigen::Index>(k)]; });
      spread_middles<Vec3>(facet.nodes, done, [&](std::size_t k) -> Vec3& {
        return traction[static_cast<std::size_t>(facet.nodes[k])];
      });
    }
    for (std::size_t k = 0; k < facet.nodes.size(); ++k)
      area[static_cast<std::size_t>(facet.nodes[k])] += shares[static_cast<Eigen::Index>(k)];
  }
  for (std::size_t node = 0; node < traction.size(); ++node) {
    if (area[node] > 0.0) {
      traction[node] /= area[node];
    } else {
      traction[node].setZero();
    }
  }
  const FineSurface& fine = body_.fine_surface();
  load_traction_.assign(position_.size(), Vec3::Zero());
  for (std::size_t node = 0; node < position_.size(); ++node) {
    for (auto k = static_cast<std::size_t>(fine.first[node]);
         k < static_cast<std::size_t>(fine.first[node + 1]); ++k)
      load_traction_[node] += fine.weights[k] * traction[static_cast<std::size_t>(parents_[k])];
  }
}

void SurfaceStress::make_rows() {
  StressMean mean(body_nodes());
  by_traction_.assign(body_nodes(), StressBlock::Zero());
  std::vector<double> weight(body_nodes());
  std::vector<StressBlock> blocks;
  for (std::size_t f = 0; f < facets(); ++f) {
    if (known_[f] == 0) continue;
    const Facet facet = this->facet(f);
    const ElementNodes x = positions_of(facet.nodes);
    const double area = facet_shape_integrals(facet.type, x, 1.0).sum();
    for (std::size_t p = 0; p < facet.nodes.size(); ++p) {
      const Tangent tangent = tangent_at(facet.type, x, reference_nodes(facet.type)[p]);
      const FacetLaw law(*facet.law, tangent.normal);
      blocks.clear();
      for (std::size_t j = 0; j < facet.nodes.size(); ++j)
        blocks.push_back(
            law.by_displacement(tangent.gradients.row(static_cast<Eigen::Index>(j)).transpose()));
      const auto node = static_cast<std::size_t>(facet.nodes[p]);
      mean.add(facet.nodes[p], area, facet.nodes, blocks,
               law.constant() + law.by_traction() * load_traction_[node]);
      by_traction_[node] += area * law.by_traction();
      weight[node] += area;
    }
  }
  for (std::size_t node = 0; node < weight.size(); ++node) by_traction_[node] /= weight[node];
  rows_ = mean.rows();
}

void SurfaceStress::evaluate(std::span<const Vec3> u, std::span<const Vec3> contact_force, const Patch* patch,
                             std::span<Stress> stress) noexcept {
  const FineSurface& fine = body_.fine_surface();
  const std::size_t nodes = body_nodes();
  std::fill(body_force_.begin(), body_force_.end(), Vec3::Zero());
  for (std::size_t node = 0; node < position_.size(); ++node) {
    if (contact_force[node].isZero(0.0)) continue;
    for (auto k = static_cast<std::size_t>(fine.first[node]);
         k < static_cast<std::size_t>(fine.first[node + 1]); ++k)
      body_force_[static_cast<std::size_t>(parents_[k])] += fine.weights[k] * contact_force[node];
  }
  rows_.apply(u, stress);
  for (std::size_t node = 0; node < nodes; ++node) {
    if (!body_force_[node].isZero(0.0))
      stress[node].noalias() += by_traction_[node] * (body_force_[node] / body_area_[node]);
  }
  for (std::size_t node = nodes; node < position_.size(); ++node) {
    stress[node].setZero();
    for (auto k = static_cast<std::size_t>(fine.first[node]);
         k < static_cast<std::size_t>(fine.first[node + 1]); ++k)
      stress[node] += fine.weights[k] * stress[static_cast<std::size_t>(parents_[k])];
  }
  if (patch != nullptr) evaluate_patch(u, contact_force, *patch, stress);
}

void SurfaceStress::evaluate_patch(std::span<const Vec3> u, std::span<const Vec3> contact_force,
                                   const Patch& patch, std::span<Stress> stress) noexcept {
  for (const Index element : patch.elements()) in_patch_[static_cast<std::size_t>(element)] = 1;
  for (const Index node : patch.surface_nodes()) {
    const auto at = static_cast<std::size_t>(node);
    on_patch_[at] = 1;
    weight_[at] = 0.0;
    stress[at].setZero();
  }
  for (std::size_t f = 0; f < facets(); ++f) {
    if (known_[f] == 0) continue;
    if (in_patch_[static_cast<std::size_t>(element_[f])] == 0) {
      add(facet(f), u, contact_force, stress);
      continue;
    }
    for (std::size_t k = 0; k < simplices_of_facet_; ++k)
      add(simplex(f * simplices_of_facet_ + k, f), u, contact_force, stress);
  }
  for (const Index node : patch.surface_nodes()) {
    const auto at = static_cast<std::size_t>(node);
    on_patch_[at] = 0;
    stress[at] /= weight_[at];  // 0 / 0 where no facet counts
  }
  for (const Index element : patch.elements()) in_patch_[static_cast<std::size_t>(element)] = 0;
}

/// Adds what a facet says at those of its nodes that are on the patch.
void SurfaceStress::add(const Facet& facet, std::span<const Vec3> u, std::span<const Vec3> contact_force,
                        std::span<Stress> sum) noexcept {
  const auto on_patch = [&](Index node) { return on_patch_[static_cast<std::size_t>(node)] != 0; };
  if (std::none_of(facet.nodes.begin(), facet.nodes.end(), on_patch)) return;
  const ElementNodes x = positions_of(facet.nodes);
  double area = 0.0;
  for (const QuadraturePoint& q : quadrature(facet.type))
    area += q.weight * facet_measure(facet.type, x, q.xi);
  for (std::size_t p = 0; p < facet.nodes.size(); ++p) {
    const auto node = static_cast<std::size_t>(facet.nodes[p]);
    if (on_patch_[node] == 0) continue;
    const Tangent tangent = tangent_at(facet.type, x, reference_nodes(facet.type)[p]);
    const FacetLaw law(*facet.law, tangent.normal);
    Stress here = law.constant();
    for (std::size_t j = 0; j < facet.nodes.size(); ++j)
      here.noalias() += law.by_displacement(tangent.gradients.row(static_cast<Eigen::Index>(j)).transpose()) *
                        u[static_cast<std::size_t>(facet.nodes[j])];
    here.noalias() += law.by_traction() * (load_traction_[node] + contact_force[node] / area_[node]);
    sum[node] += area * here;
    weight_[node] += area;
  }
}

}  // namespace palpate
