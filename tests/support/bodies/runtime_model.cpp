#include "tests/support/bodies/runtime_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "meshes/element.h"
#include "meshes/generate.h"
#include "meshes/surface.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::test {
namespace {

template <class T>
PackedGreens pack_as(const Eigen::MatrixXd& matrix, Precision precision,
                     std::shared_ptr<const SmoothPart> smooth = nullptr) {
  auto packed = std::make_shared<std::vector<T>>();
  packed->reserve(static_cast<std::size_t>(packed_size(matrix.rows())));
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    for (Eigen::Index i = j; i < matrix.rows(); ++i) packed->push_back(static_cast<T>(matrix(i, j)));
  }
  return {std::shared_ptr<const void>(packed, packed->data()), matrix.rows(), precision, std::move(smooth)};
}

std::vector<Eigen::Index> dofs_of(int dimension, std::span<const Index> nodes) {
  std::vector<Eigen::Index> dofs;
  for (const Index node : nodes) {
    for (Eigen::Index axis = 0; axis < dimension; ++axis)
      dofs.push_back(dimension * Eigen::Index{node} + axis);
  }
  return dofs;
}

/// The block of K's inverse at the dofs `kept`: the inverse of what is left of K once the dofs `inner`, all
/// others, are eliminated.
Eigen::MatrixXd inverse_at(const Eigen::MatrixXd& K, const std::vector<Eigen::Index>& kept,
                           const std::vector<Eigen::Index>& inner) {
  Eigen::MatrixXd left = K(kept, kept);
  if (!inner.empty()) {
    const Eigen::LLT<Eigen::MatrixXd> factor(K(inner, inner));
    const Eigen::MatrixXd Y = factor.matrixL().solve(K(inner, kept));
    left.selfadjointView<Eigen::Lower>().rankUpdate(Y.transpose(), -1.0);
  }
  return inverse_of(left);
}

double height(const Model& model, std::size_t node) {
  return model.mesh.nodes[node][model.dimension() - 1];
}

}  // namespace

Mesh unit_mesh(ElementType element, int cells) {
  if (traits(element).dimension == 2) return generate(RectangleShape{.cells = {cells, cells}}, element);
  const BoxShape box{.cells = {cells, cells, cells}};
  return element == ElementType::hex8 ? generate(box, element) : with_elements(generate(box), element, "box");
}

Eigen::MatrixXd assemble_stiffness(const Model& model) {
  const auto order = static_cast<Eigen::Index>(model.mesh.nodes.size()) * model.dimension();
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(order, order);
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const std::vector<Eigen::Index> dofs = dofs_of(model.dimension(), model.mesh.element_nodes(e));
    const auto material = static_cast<std::size_t>(model.material_of_element[static_cast<std::size_t>(e)]);
    K(dofs, dofs) +=
        element_stiffness(model.mesh.element, element_nodes(model.mesh, e),
                          elasticity_matrix(model.materials[material], model.analysis), model.thickness);
  }
  return K;
}

PackedGreens pack(const Eigen::MatrixXd& matrix, Precision precision) {
  if (precision == Precision::single_precision) return pack_as<float>(matrix, precision);
  if (precision == Precision::double_precision) return pack_as<double>(matrix, precision);
  auto smooth = std::make_shared<SmoothPart>();
  smooth->terms = 11;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> entry(-0.5, 0.5);
  for (Eigen::Index k = 0; k < smooth->terms * matrix.rows(); ++k) smooth->rows.push_back(entry(random));
  Eigen::MatrixXd remainder = matrix;
  for (Eigen::Index j = 0; j < matrix.cols(); ++j)
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) remainder(i, j) -= (*smooth)(i, j);
  return pack_as<float>(remainder, precision, smooth);
}

Eigen::MatrixXd random_definite(Eigen::Index order, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  Eigen::MatrixXd A(order, order);
  for (Eigen::Index j = 0; j < order; ++j) {
    for (Eigen::Index i = j; i < order; ++i) A(i, j) = A(j, i) = entry(random);
    A(j, j) = static_cast<double>(order) + entry(random);
  }
  return A;
}

Model bake(Mesh mesh, const std::function<bool(const Vec3&)>& clamped, Scope scope, Precision precision,
           bool scrambled) {
  Model model;
  model.name = "box";
  model.mesh = std::move(mesh);
  const int d = model.dimension();
  model.analysis = d == 3 ? Analysis::solid : Analysis::plane_stress;
  model.materials = {{.youngs_modulus = 1.0, .poissons_ratio = 0.3, .density = 1000.0}};
  model.material_of_element.assign(static_cast<std::size_t>(model.mesh.elements()), 0);
  model.scope = scope;
  model.layers = 0;
  const Surface surface = extract_surface(model.mesh);
  model.surface = surface_simplices(surface);
  model.rest_force.assign(model.mesh.nodes.size(), Vec3::Zero());
  model.rest_displacement.assign(model.mesh.nodes.size(), Vec3::Zero());

  const auto all_axes = static_cast<std::uint8_t>((1U << d) - 1U);
  std::vector<Index> inner;
  for (Index node = 0; node < static_cast<Index>(model.mesh.nodes.size()); ++node) {
    const bool held = clamped(model.mesh.nodes[static_cast<std::size_t>(node)]);
    model.fixed.push_back(held ? all_axes : std::uint8_t{0});
    if (held) continue;
    const bool is_kept =
        scope == Scope::full || std::binary_search(surface.nodes.begin(), surface.nodes.end(), node);
    (is_kept ? model.stored_nodes : inner).push_back(node);
  }
  if (scrambled) std::shuffle(model.stored_nodes.begin(), model.stored_nodes.end(), std::mt19937(7));
  model.greens = pack(
      inverse_at(assemble_stiffness(model), dofs_of(d, model.stored_nodes), dofs_of(d, inner)), precision);
  return model;
}

Model unit_model(ElementType element, int cells, Scope scope, Precision precision) {
  static std::map<std::tuple<ElementType, int, Scope, Precision>, Model> baked;  // most suites want one again
  const auto [entry, is_new] = baked.try_emplace({element, cells, scope, precision});
  if (is_new) {
    const int up = traits(element).dimension - 1;
    entry->second = bake(
        unit_mesh(element, cells), [up](const Vec3& node) { return node[up] < 1e-12; }, scope, precision);
  }
  return entry->second;
}

Model two_materials(ElementType element, int cells) {
  Model model = unit_model(element, cells, Scope::full, Precision::double_precision);
  model.materials.push_back(model.materials.front());
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    double height = 0.0;
    for (const Index node : model.mesh.element_nodes(e)) height += model.mesh.nodes[node].z();
    if (height < 0.5 * static_cast<double>(model.mesh.element_nodes(e).size()))
      model.material_of_element[e] = 1;
  }
  return model;
}

Model unit_model(int dimension, int cells, Scope scope, Precision precision) {
  return unit_model(dimension == 2 ? ElementType::quad4 : ElementType::tet4, cells, scope, precision);
}

Model round_model(int dimension) {
  if (dimension == 3) {
    Mesh mesh = generate(CylinderShape{.cells_across = 8, .cells_along = 4});
    return bake(
        std::move(mesh), [](const Vec3& node) { return std::abs(node.z() - 0.5) > 0.5 - 1e-12; },
        Scope::surface, Precision::double_precision);
  }
  Mesh mesh = generate(RectangleShape{.cells = {16, 4}});
  for (Vec3& node : mesh.nodes) {
    const double angle = std::numbers::pi * (1.0 - node.x());
    node = 0.5 * (1.0 + node.y()) * Vec3(std::cos(angle), std::sin(angle), 0.0);
  }
  return bake(
      std::move(mesh), [](const Vec3& node) { return node.norm() < 0.5 + 1e-12; }, Scope::surface,
      Precision::double_precision);
}

Vec3 upright(int dimension, double x, double y, double z) {
  return dimension == 2 ? Vec3(x, z, 0.0) : Vec3(x, y, z);
}

Vec3 top_middle(int dimension) {
  return upright(dimension, 0.5, 0.5, 1.0);
}

void set_rest(Model& model, double size) {
  for (std::size_t node = 0; node < model.mesh.nodes.size(); ++node) {
    const double h = height(model, node);
    model.rest_displacement[node] = size * h * upright(model.dimension(), 0.5, -0.25, -h);
  }
}

}  // namespace palpate::test
