#include "runtime/background/surface_stress.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <utility>

#include "meshes/element.h"
#include "meshes/surface.h"
#include "meshes/topology.h"
#include "runtime/live/live_model.h"

namespace palpate {
namespace {

constexpr double rounding_strain = 1e-12;  // below which a strain in a turned frame is none

unsigned held_axes(const Model& model, Index mesh_node) {
  return model.fixed[mesh_node] & ((1U << model.dimension()) - 1U);
}

/// Normal and gradients of a facet at a point.
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

/// Coefficients of a material's law at a point of a facet.
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

/// Integrals of the shape functions of a tri6 are zero at its corners, and so are the corner forces under a
/// uniform pressure. Mid-side nodes pass a part to the ends of their edges, so that a uniform pressure has
/// uniform quotients: those of the linear simplices into which a tri6 is divided.
template <class T, class At>
void spread_middles(std::span<const Index> nodes, std::vector<std::uint8_t>& done, const At& at) {
  for (std::size_t k = 3; k < nodes.size(); ++k) {
    if (!done.empty() && std::exchange(done[nodes[k]], std::uint8_t{1}) != 0) continue;
    T& middle = at(k);
    const T part = 0.125 * middle;
    middle -= 2.0 * part;
    at(k - 3) += part;
    at((k - 2) % 3) += part;
  }
}

}  // namespace

bool parts_turn(const Body& body) noexcept {
  if (body.live() != nullptr) return body.live()->body.options().law != LiveLaw::linear;
  return body.contact_model() == ContactModel::two_level;
}

SurfaceStress::SurfaceStress(const Body& body)
    : body_(body),
      position_(body.surface_in_mesh()),
      facet_type_(traits(body.model().mesh.element).facet),
      body_force_(body.surface_mesh_nodes().size()),
      turn_(parts_turn(body) ? body.surface_mesh_nodes().size() : 0),
      in_patch_(body.model().mesh.elements()),
      on_patch_(position_.size()),
      weight_(position_.size()) {
  for (const Material& material : body.model().materials) {
    laws_.emplace_back(material, body.model().analysis);
    rounding_ = std::min(rounding_, rounding_strain * material.youngs_modulus);
  }
  number_facets();
  measure();
  find_traction_of_loads();
  if (body.refinement() > 1) refine_sides();
  make_rows();
}

SurfaceStress::Facet SurfaceStress::facet(std::size_t number) const noexcept {
  const auto width = static_cast<std::size_t>(traits(facet_type_).nodes);
  const Index material = body_.model().material_of_element[element_[number]];
  return {facet_type_, std::span(facet_nodes_).subspan(width * number, width), &laws_[material]};
}

SurfaceStress::Facet SurfaceStress::simplex(std::size_t number, std::size_t of) const noexcept {
  const auto d = static_cast<std::size_t>(body_.dimension());
  return {d == 3 ? ElementType::tri3 : ElementType::line2, body_.simplices().subspan(d * number, d),
          facet(of).law};
}

ElementNodes SurfaceStress::positions_of(std::span<const Index> nodes) const noexcept {
  ElementNodes x(static_cast<Eigen::Index>(nodes.size()), 3);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    x.row(static_cast<Eigen::Index>(k)) = position_[nodes[k]].transpose();
  return x;
}

void SurfaceStress::number_facets() {
  const Model& model = body_.model();
  std::vector<Index> number(model.mesh.nodes.size(), -1);
  for (std::size_t k = 0; k < body_nodes(); ++k)
    number[body_.surface_mesh_nodes()[k]] = static_cast<Index>(k);
  for (const ElementSide& side : boundary_sides(model.mesh)) {
    unsigned held = ~0U;
    for (const Index node : side_nodes(model.mesh, side)) {
      facet_nodes_.push_back(number[node]);
      held &= held_axes(model, node);
    }
    element_.push_back(side.element);
    known_.push_back(held == 0 ? 1 : 0);
  }
  for (const Index parent : body_.fine_surface().parents) parents_.push_back(number[parent]);
  simplices_of_facet_ = body_.surface_friction().size() / facets();
}

Vec3 SurfaceStress::normal_of(const Facet& facet) const noexcept {
  const std::span<const Vec3> at = reference_nodes(facet.type);
  Vec3 middle = Vec3::Zero();
  for (const Vec3& xi : at) middle += xi / static_cast<double>(at.size());
  return tangent_at(facet.type, positions_of(facet.nodes), middle).normal;
}

/// Returns the contributions [simplices x d] to the area of the nodes.
std::vector<double> SurfaceStress::simplex_areas(std::span<const Index> simplices) const {
  const auto d = static_cast<std::size_t>(body_.dimension());
  const ElementType type = d == 3 ? ElementType::tri3 : ElementType::line2;
  std::vector<double> areas;
  areas.reserve(simplices.size());
  for (std::size_t k = 0; k < simplices.size(); k += d) {
    const ShapeValues shares =
        facet_shape_integrals(type, positions_of(simplices.subspan(k, d)), body_.model().thickness);
    areas.insert(areas.end(), shares.begin(), shares.end());
  }
  return areas;
}

void SurfaceStress::measure() {
  const std::vector<double> areas = simplex_areas(body_.simplices());
  area_.assign(position_.size(), 0.0);
  for (std::size_t k = 0; k < areas.size(); ++k) area_[body_.simplices()[k]] += areas[k];
  std::vector<Vec3> normals;
  for (std::size_t f = 0; f < facets(); ++f) normals.push_back(normal_of(facet(f)));
  sides_.emplace(body_nodes(), facet_nodes_, normals);
}

/// Returns the forces of the loads on the surface nodes [N].
std::vector<Vec3> SurfaceStress::nodal_forces_of_loads() const {
  const Model& model = body_.model();
  const int d = model.dimension();
  const ElementType type = model.mesh.element;
  // Initial strain is a load without a traction.
  std::vector<Vec3> force = model.rest_force;
  std::vector<double> mass(force.size());
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const auto number = static_cast<std::size_t>(model.material_of_element[e]);
    const Material& material = model.materials[number];
    const ElementNodes x = element_nodes(model.mesh, e);
    const ElementVector f =
        element_stress_force(type, x, initial_stress(material, model.analysis), model.thickness);
    const ShapeValues shares = element_shape_integrals(type, x, model.thickness);
    Eigen::Index k = 0;
    for (const Index node : model.mesh.element_nodes(e)) {
      force[node].head(d) -= f.segment(d * k, d);
      mass[node] += material.density * shares[k++];
    }
  }
  std::vector<std::uint8_t> is_inside(force.size(), 1);
  for (const Index node : body_.surface_mesh_nodes()) is_inside[node] = 0;
  Vec3 weight = Vec3::Zero();
  double inside = 0.0;
  for (std::size_t node = 0; node < force.size(); ++node) {
    if (is_inside[node] == 0) continue;
    weight += mass[node] * force[node];
    inside += mass[node] * mass[node];
  }
  const Vec3 acceleration = inside > 0.0 ? Vec3(weight / inside) : Vec3(Vec3::Zero());
  std::vector<Vec3> of_surface;
  for (const Index node : body_.surface_mesh_nodes())
    of_surface.push_back(force[node] - mass[node] * acceleration);
  return of_surface;
}

void SurfaceStress::find_traction_of_loads() {
  const Model& model = body_.model();
  std::vector<Vec3> force = nodal_forces_of_loads();
  std::vector<double> areas;
  std::vector<std::uint8_t> done(body_nodes()), none;
  for (std::size_t f = 0; f < facets(); ++f) {
    const Facet facet = this->facet(f);
    ShapeValues shares = facet_shape_integrals(facet.type, positions_of(facet.nodes), model.thickness);
    if (known_[f] == 0) shares.setZero();
    if (facet.type == ElementType::tri6 && known_[f] != 0) {
      spread_middles<double>(facet.nodes, none,
                             [&](std::size_t k) -> double& { return shares[static_cast<Eigen::Index>(k)]; });
      spread_middles<Vec3>(facet.nodes, done, [&](std::size_t k) -> Vec3& { return force[facet.nodes[k]]; });
    }
    areas.insert(areas.end(), shares.begin(), shares.end());
  }
  const SideTractions tractions(*sides_, areas);
  for (std::size_t place = 0; place < sides_->places(); ++place)
    load_traction_.push_back(tractions.at(static_cast<Index>(place), force));
}

/// Computes the sides of the refined surface, and the loads' tractions there by the facets' shape functions.
void SurfaceStress::refine_sides() {
  const auto d = static_cast<std::size_t>(body_.dimension());
  const std::span<const Index> simplices = body_.simplices();
  const FineSurface& fine = body_.fine_surface();
  std::vector<Vec3> normals;
  for (std::size_t k = 0; k < simplices.size() / d; ++k)
    normals.push_back(normal_of(simplex(k, k / simplices_of_facet_)));
  fine_sides_.emplace(position_.size(), simplices, normals);
  fine_tractions_.emplace(*fine_sides_, simplex_areas(simplices));
  fine_load_traction_.assign(fine_sides_->places(), Vec3::Zero());
  const std::size_t width = sides_->width();
  for (std::size_t k = 0; k < simplices.size(); ++k) {
    const auto node = static_cast<std::size_t>(simplices[k]);
    Vec3& traction = fine_load_traction_[fine_sides_->places_of_facets()[k]];
    traction.setZero();  // all simplices of a side give the same
    const std::size_t of_facet = width * (k / (d * simplices_of_facet_));
    const auto nodes = std::span(facet_nodes_).subspan(of_facet, width);
    for (auto j = static_cast<std::size_t>(fine.first[node]);
         j < static_cast<std::size_t>(fine.first[node + 1]); ++j) {
      const auto found = std::find(nodes.begin(), nodes.end(), parents_[j]);
      if (found == nodes.end()) continue;
      const Index place =
          sides_->places_of_facets()[of_facet + static_cast<std::size_t>(found - nodes.begin())];
      traction += fine.weights[j] * load_traction_[place];
    }
  }
}

void SurfaceStress::make_rows() {
  // Contact forces act on the nodes of the simplices into which the facets are divided.
  const auto d = static_cast<std::size_t>(body_.dimension());
  const std::size_t width = sides_->width();
  const std::vector<Index> simplices =
      surface_simplices({.facet = facet_type_, .facets = facet_nodes_, .nodes = {}});
  const std::vector<double> of_simplices = simplex_areas(simplices);
  std::vector<double> areas(facet_nodes_.size());
  const std::size_t cut = simplices.size() / d / facets();  // simplices per facet
  for (std::size_t k = 0; k < simplices.size(); ++k) {
    const std::size_t first = width * (k / (d * cut));
    const auto nodes = std::span(facet_nodes_).subspan(first, width);
    const auto found = std::find(nodes.begin(), nodes.end(), simplices[k]);
    areas[first + static_cast<std::size_t>(found - nodes.begin())] += of_simplices[k];
  }
  const SideTractions tractions(*sides_, areas);

  StressMean mean(body_nodes());
  std::vector<std::map<Index, StressBlock>> by_force(body_nodes());  // stress of nodes by each node's force
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
      const Index node = facet.nodes[p];
      const Index place = sides_->places_of_facets()[width * f + p];
      mean.add(node, area, facet.nodes, blocks, law.constant() + law.by_traction() * load_traction_[place]);
      tractions.for_each(place, [&](Index of, const Mat3& matrix) {
        const auto [found, is_new] = by_force[of].emplace(node, StressBlock::Zero());
        found->second += area * law.by_traction() * matrix;
      });
      weight[node] += area;
    }
  }
  rows_ = mean.rows();
  first_of_force_.push_back(0);
  for (const std::map<Index, StressBlock>& of_node : by_force) {
    for (const auto& [row, block] : of_node) {
      row_of_force_.push_back(row);
      by_force_.emplace_back(block / weight[row]);
    }
    first_of_force_.push_back(row_of_force_.size());
  }
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
      body_force_[parents_[k]] += fine.weights[k] * contact_force[node];
  }
  const bool turns = !turn_.empty();
  if (turns) {
    rows_.apply_turned(position_, body_.dimension() == 2, u, turn_, stress);
    for (Stress& value : stress)  // or a body at rest would show what is left of its rotations
      if (value.cwiseAbs().maxCoeff() < rounding_) value.setZero();
  } else {
    rows_.apply(u, stress);
  }
  for (std::size_t node = 0; node < nodes; ++node) {
    if (body_force_[node].isZero(0.0)) continue;
    for (std::size_t k = first_of_force_[node]; k < first_of_force_[node + 1]; ++k) {
      const auto row = static_cast<std::size_t>(row_of_force_[k]);
      const Vec3 force = turns ? Vec3(turn_[row].transpose() * body_force_[node]) : body_force_[node];
      stress[row].noalias() += by_force_[k] * force;
    }
  }
  for (std::size_t node = nodes; node < position_.size(); ++node) {
    stress[node].setZero();
    for (auto k = static_cast<std::size_t>(fine.first[node]);
         k < static_cast<std::size_t>(fine.first[node + 1]); ++k)
      stress[node] += fine.weights[k] * stress[parents_[k]];
  }
  if (patch != nullptr) evaluate_patch(u, contact_force, *patch, stress);
}

void SurfaceStress::evaluate_patch(std::span<const Vec3> u, std::span<const Vec3> contact_force,
                                   const Patch& patch, std::span<Stress> stress) noexcept {
  for (const Index element : patch.elements()) in_patch_[element] = 1;
  for (const Index node : patch.surface_nodes()) {
    const auto at = static_cast<std::size_t>(node);
    on_patch_[at] = 1;
    weight_[at] = 0.0;
    stress[at].setZero();
  }
  for (std::size_t f = 0; f < facets(); ++f) {
    if (known_[f] == 0) continue;
    if (in_patch_[element_[f]] == 0) {
      const Facet facet = this->facet(f);
      add(
          facet, [&](std::size_t p) { return place_on_patch(f, facet.nodes[p]); }, u, contact_force, stress);
      continue;
    }
    for (std::size_t k = f * simplices_of_facet_; k < (f + 1) * simplices_of_facet_; ++k) {
      const auto places = fine_sides_->places_of_facets().subspan(fine_sides_->width() * k);
      add(
          simplex(k, f), [&](std::size_t p) { return static_cast<std::size_t>(places[p]); }, u, contact_force,
          stress);
    }
  }
  for (const Index node : patch.surface_nodes()) {
    const auto at = static_cast<std::size_t>(node);
    on_patch_[at] = 0;
    stress[at] /= weight_[at];  // 0 / 0 if no facet counts
  }
  for (const Index element : patch.elements()) in_patch_[element] = 0;
}

/// Index, among the patch's values, of a node of a facet on the refined surface.
std::size_t SurfaceStress::place_on_patch(std::size_t facet, Index node) const noexcept {
  if (!fine_sides_->is_creased(node)) return static_cast<std::size_t>(node);
  const std::size_t count = fine_sides_->width() * simplices_of_facet_;
  const auto nodes = fine_sides_->facet_nodes().subspan(count * facet, count);
  const auto found = std::find(nodes.begin(), nodes.end(), node);
  return static_cast<std::size_t>(
      fine_sides_->places_of_facets()[count * facet + static_cast<std::size_t>(found - nodes.begin())]);
}

/// Adds the stress of a facet at its nodes on the patch.
template <class PlaceOf>
void SurfaceStress::add(const Facet& facet, const PlaceOf& place_of, std::span<const Vec3> u,
                        std::span<const Vec3> contact_force, std::span<Stress> sum) noexcept {
  const auto on_patch = [&](Index node) { return on_patch_[node] != 0; };
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
                        u[facet.nodes[j]];
    const std::size_t place = place_of(p);
    here.noalias() += law.by_traction() * (fine_load_traction_[place] +
                                           fine_tractions_->at(static_cast<Index>(place), contact_force));
    sum[node] += area * here;
    weight_[node] += area;
  }
}

}  // namespace palpate
