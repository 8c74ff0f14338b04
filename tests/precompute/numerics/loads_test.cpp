// Loads and the rest state against closed forms, for every kind of element.
#include "precompute/numerics/loads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "meshes/averaged_strain.h"
#include "meshes/element.h"
#include "tests/support/bodies/precompute_kinds.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::loads_test {
namespace {

using test::Kind;

constexpr double E = 3.0e4, nu = 0.3, G = E / 2.0 / (1.0 + nu);
const Material tissue{E, nu, 1100.0};
const Vec3 size(0.3, 0.1, 0.2);  ///< of the bars; in the plane without the last

class LoadedKind : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, LoadedKind, testing::ValuesIn(test::all_kinds), test::name_of);

/// Nodes with x[axis] = place.
SelectBox face(int axis, double place) {
  SelectBox box{Vec3::Constant(-1.0), Vec3::Constant(1.0)};
  box.min[axis] = box.max[axis] = place;
  return box;
}

/// A description and its body, put together by hand, and the rest state that comes out.
struct Loaded {
  Kind kind;
  Description description;
  MeshedBody body;
  std::vector<Vec3> loads;     ///< [N] what nodal_loads gives
  std::vector<Vec3> u0;        ///< [N] what rest_displacement gives
  std::vector<Vec3> internal;  ///< [N] force that the strained elements take at each node

  Loaded(const Kind& of, Mesh mesh, const Material& material) : kind(of) {
    description.file = "model.toml";
    description.analysis = kind.analysis;
    description.thickness = kind.dimension() == 2 ? 0.02 : 1.0;
    description.materials = {{material, {}, {}}};
    body.mesh = std::move(mesh);
    body.surface = extract_surface(body.mesh);
    body.material_of_element.assign(static_cast<std::size_t>(body.mesh.elements()), 0);
    body.fixed.assign(body.mesh.nodes.size(), 0);
    body.prescribed.assign(body.mesh.nodes.size(), Vec3::Zero());
  }

  /// Holds nodes along an axis, displaced by this much.
  Loaded& hold(const Selection& where, int axis, double displacement = 0.0) {
    const std::vector<std::uint8_t> selected = select_nodes(body.mesh, where, "test");
    for (std::size_t node = 0; node < selected.size(); ++node) {
      if (selected[node] == 0) continue;
      body.fixed[node] = static_cast<std::uint8_t>(body.fixed[node] | 1 << axis);
      body.prescribed[node][axis] = displacement;
    }
    return *this;
  }

  /// Holds the faces x = 0, y = 0 (and z = 0) against moving across themselves: free to stretch and contract.
  Loaded& hold_on_rollers() {
    for (int axis = 0; axis < kind.dimension(); ++axis) hold(face(axis, 0.0), axis);
    return *this;
  }

  /// Elements whose centroid is beyond this x are of a second material.
  Loaded& beyond(double x, const Material& material) {
    description.materials.push_back({material, {}, {}});
    for (Index e = 0; e < body.mesh.elements(); ++e) {
      if (element_nodes(body.mesh, e).col(0).mean() > x) {
        body.material_of_element[static_cast<std::size_t>(e)] = 1;
      }
    }
    return *this;
  }

  void solve() {
    std::vector<Material> materials;
    for (const MaterialPart& part : description.materials) materials.push_back(part.material);
    const Stiffness stiffness =
        assemble_stiffness({body.mesh, kind.analysis, description.thickness, materials,
                            body.material_of_element, body.fixed, body.prescribed});
    Factor factor(stiffness.K, stiffness.node_start);
    factor.factorize();
    loads = nodal_loads(description, body);
    u0 = rest_displacement(factor, stiffness, loads, body.prescribed, kind.dimension());
    find_internal_forces();
  }

  /// Displacement of the nodes of an element, node-major. [d nodes]
  [[nodiscard]] Eigen::VectorXd element_displacement(Index e) const {
    const Eigen::Index d = kind.dimension();
    Eigen::VectorXd u(d * traits(kind.element).nodes);
    Eigen::Index row = 0;
    for (const Index node : body.mesh.element_nodes(e)) {
      u.segment(d * row++, d) = u0[static_cast<std::size_t>(node)].head(d);
    }
    return u;
  }

  [[nodiscard]] const Material& material_of(Index e) const {
    const Index number = body.material_of_element[static_cast<std::size_t>(e)];
    return description.materials[static_cast<std::size_t>(number)].material;
  }

  void find_internal_forces() {
    const Eigen::Index d = kind.dimension();
    internal.assign(body.mesh.nodes.size(), Vec3::Zero());
    if (kind.element == ElementType::tet4a) {
      const auto add = [&](const StrainDomain& domain) {
        Eigen::VectorXd u(3 * std::ssize(domain.nodes));
        Eigen::Index row = 0;
        for (const Index node : domain.nodes) u.segment<3>(3 * row++) = u0[static_cast<std::size_t>(node)];
        const Material& material = description.materials[static_cast<std::size_t>(domain.material)].material;
        const Eigen::VectorXd force = domain_stiffness(domain, material) * u;
        row = 0;
        for (const Index node : domain.nodes)
          internal[static_cast<std::size_t>(node)] += force.segment<3>(3 * row++);
      };
      for_each_edge_domain(body.mesh, body.material_of_element, add);
      for_each_node_domain(body.mesh, body.material_of_element, add);
      return;
    }
    for (Index e = 0; e < body.mesh.elements(); ++e) {
      const ElementMatrix K =
          element_stiffness(kind.element, element_nodes(body.mesh, e),
                            elasticity_matrix(material_of(e), kind.analysis), description.thickness);
      const Eigen::VectorXd force = K * element_displacement(e);
      Eigen::Index row = 0;
      for (const Index node : body.mesh.element_nodes(e)) {
        internal[static_cast<std::size_t>(node)].head(d) += force.segment(d * row++, d);
      }
    }
  }

  [[nodiscard]] Vec3 total_load() const {
    Vec3 total = Vec3::Zero();
    for (const Vec3& f : loads) total += f;
    return total;
  }

  /// Force of the supports on the nodes held along an axis, all together or those of a selection.
  [[nodiscard]] double reaction(int axis, const Selection& where = SelectBox{Vec3::Constant(-1.0),
                                                                             Vec3::Constant(1.0)}) const {
    const std::vector<std::uint8_t> selected = select_nodes(body.mesh, where, "test");
    double total = 0.0;
    for (std::size_t node = 0; node < loads.size(); ++node) {
      if (selected[node] == 0 || (body.fixed[node] >> axis & 1) == 0) continue;
      total += internal[node][axis] - loads[node][axis];
    }
    return total;
  }

  /// Largest difference between u0 and the exact displacement, of its largest value.
  template <class Exact>
  [[nodiscard]] double error(Exact exact) const {
    double largest = 0.0, difference = 0.0;
    for (std::size_t node = 0; node < u0.size(); ++node) {
      Vec3 expected = exact(body.mesh.nodes[node]);
      if (kind.dimension() == 2) expected.z() = 0.0;
      largest = std::max(largest, expected.norm());
      difference = std::max(difference, (u0[node] - expected).norm());
    }
    return difference / largest;
  }

  /// Area of the face across an axis.
  [[nodiscard]] double area(int axis) const {
    const double depth = kind.dimension() == 2 ? description.thickness : size[2];
    return axis == 0 ? size[1] * depth : axis == 1 ? size[0] * depth : size[0] * size[1];
  }
};

Loaded bar(const Kind& kind, const Material& material = tissue) {
  return {kind, test::distorted_block(kind.element, size, {4, 3, 3}), material};
}

/// Lateral contraction and stiffness E' of a bar that is pulled: plane strain cannot contract across the
/// plane.
double contraction(Analysis analysis) {
  return analysis == Analysis::plane_strain ? nu / (1.0 - nu) : nu;
}
double axial_modulus(Analysis analysis) {
  return analysis == Analysis::plane_strain ? E / (1.0 - nu * nu) : E;
}

// --- gravity ---

/// A bar of nu = 0 clamped at x = 0 and stretched along x by its own weight: u = rho g (L x - x^2 / 2) / E.
struct Hanging {
  double error;          ///< of the nodes, of the largest displacement
  double weight, holds;  ///< total load and reaction of the clamp [N]
};
Hanging hang(const Kind& kind, int refined) {
  const Material light{E, 0.0, 1100.0};
  constexpr double g = 9.81;
  Loaded model(kind, test::block(kind.element, size, {6 * refined, 2 * refined, 4 * refined}), light);
  for (int axis = 0; axis < kind.dimension(); ++axis) model.hold(face(0, 0.0), axis);
  model.description.loads = {Gravity{{g, 0.0, 0.0}}};
  model.solve();
  const double error = model.error(
      [&](const Vec3& x) { return Vec3(light.density * g / E * (size.x() - x.x() / 2.0) * x.x(), 0, 0); });
  return {error, model.total_load().x(), -model.reaction(0)};
}

TEST_P(LoadedKind, HangingBar) {
  const double depth = GetParam().dimension() == 2 ? 0.02 : size.z(),
               weight = 1100.0 * 9.81 * size.x() * size.y() * depth;
  const Hanging bar = hang(GetParam(), 2);
  EXPECT_NEAR(bar.weight, weight, 1e-13 * weight);
  EXPECT_NEAR(bar.holds, weight, 1e-10 * weight);
  switch (GetParam().element) {
    case ElementType::tet10:  // its space contains the solution
    case ElementType::quad4:  // rows of linear elements on a regular mesh, which are exact at the nodes
    case ElementType::hex8:
      EXPECT_LT(bar.error, 1e-10);
      break;
    default: {  // a slanted side makes the constant stresses of a cell bend it: order 2 in its size
      const Hanging fine = hang(GetParam(), 4);
      EXPECT_LT(fine.error, 0.02);
      // where the bar is held, averages are one-sided
      EXPECT_GT(bar.error / fine.error, GetParam().element == ElementType::tet4a ? 2.5 : 3.0);
    }
  }
}

// --- traction ---

TEST_P(LoadedKind, UniformTensionIsExact) {
  constexpr double pull = 250.0;
  const double E_bar = axial_modulus(GetParam().analysis), side = contraction(GetParam().analysis);
  for (int axis = 0; axis < GetParam().dimension(); ++axis) {
    Loaded model = bar(GetParam());
    model.hold_on_rollers();
    model.description.loads = {Traction{pull * Vec3::Unit(axis), face(axis, size[axis])}};
    model.solve();
    EXPECT_LT(model.error([&](const Vec3& x) -> Vec3 {
      return pull / E_bar * ((1.0 + side) * x[axis] * Vec3::Unit(axis) - side * x);
    }),
              1e-11);
    const double force = pull * model.area(axis);
    EXPECT_NEAR(model.total_load()[axis], force, 1e-13 * force);
    EXPECT_NEAR(model.reaction(axis), -force, 1e-11 * force);
    EXPECT_NEAR(model.reaction(axis, face(axis, 0.0)), -force, 1e-11 * force);
  }
}

TEST_P(LoadedKind, NodalForcesAreAddedAsTheyAre) {
  Loaded model = bar(GetParam());
  model.hold_on_rollers();
  const std::vector<Index> nodes = {3, 7};
  model.description.loads = {ConcentratedForce{{0.1, -0.2, 0.0}, SelectNodes{nodes}},
                             ConcentratedForce{{0.0, 0.5, 0.0}, SelectNodes{{7}}}};
  model.solve();
  EXPECT_EQ(model.loads[3], Vec3(0.1, -0.2, 0.0));
  EXPECT_EQ(model.loads[7], Vec3(0.1, 0.3, 0.0));
  EXPECT_NEAR((model.total_load() - Vec3(0.2, 0.1, 0.0)).norm(), 0.0, 1e-15);
  EXPECT_NEAR(model.reaction(0), -0.2, 1e-11);
  EXPECT_NEAR(model.reaction(1), -0.1, 1e-11);
}

// One element thick: the sides between two tagged faces have all their nodes on them, and are loaded all the
// same only where they are tagged.
TEST_P(LoadedKind, ATagLoadsItsFacetsAlone) {
  Loaded model(GetParam(), test::block(GetParam().element, size, {4, 1, 3}), tissue);
  Mesh& mesh = model.body.mesh;
  for (Index facet = 0; facet < model.body.surface.count(); ++facet) {
    const std::span<const Index> nodes = model.body.surface.facet_nodes(facet);
    const auto lies_at = [&](double y) {
      return std::all_of(nodes.begin(), nodes.end(), [&](Index node) {
        return std::abs(mesh.nodes[static_cast<std::size_t>(node)].y() - y) < 1e-9;
      });
    };
    if (!lies_at(0.0) && !lies_at(size.y())) continue;
    mesh.tagged_facets.insert(mesh.tagged_facets.end(), nodes.rbegin(), nodes.rend());
    mesh.facet_tags.push_back(5);
  }
  model.description.loads = {Traction{{100.0, 0.0, 0.0}, SelectTag{5}}};
  Vec3 total = Vec3::Zero();
  for (const Vec3& f : nodal_loads(model.description, model.body)) total += f;
  const double force = 2.0 * 100.0 * model.area(1);
  EXPECT_NEAR(total.x(), force, 1e-12 * force);
}

TEST(Traction, SelectionWithoutAWholeFacetIsRefused) {
  Loaded model = bar({ElementType::tet4, Analysis::solid});
  model.description.loads = {Gravity{{0, 0, -9.81}}, Traction{{0, 0, 1.0}, SelectNodes{{0}}}};
  const Error error = test::error_of([&] { nodal_loads(model.description, model.body); });
  EXPECT_TRUE(test::contains(error.what(), "no whole facet")) << error.what();
  EXPECT_TRUE(test::contains(error.where(), "model.toml: [[load]] number 2")) << error.where();
  EXPECT_FALSE(error.hint().empty());
}

// --- initial strain ---

/// Supports that take rigid motions and nothing else: the origin, then two axes and one axis of two corners.
Loaded& hold_statically_determinate(Loaded& model) {
  const auto corner = [](const Vec3& x) { return SelectSphere{x, 1e-6}; };
  const int d = model.kind.dimension();
  for (int axis = 0; axis < d; ++axis) model.hold(corner(Vec3::Zero()), axis);
  for (int axis = 1; axis < d; ++axis) model.hold(corner({size.x(), 0, 0}), axis);
  if (d == 3) model.hold(corner({0, size.y(), 0}), 2);
  return model;
}

TEST_P(LoadedKind, FreeExpansionIsFreeOfStress) {
  const Kind kind = GetParam();
  Material swollen = tissue;
  swollen.initial_strain = {0.01, -0.02, 0.03, 0.004, 0.005, -0.006};
  Loaded model = bar(kind, swollen);
  hold_statically_determinate(model);
  model.solve();
  Mat3 gradient;  // of the displacement that these supports allow
  gradient << 0.01, 0.004, -0.006, 0.0, -0.02, 0.005, 0.0, 0.0, 0.03;
  if (kind.analysis == Analysis::plane_strain) {  // the strain that is kept away across shows in the plane
    gradient(0, 0) += nu * 0.03;
    gradient(1, 1) += nu * 0.03;
  }
  if (kind.dimension() == 2) gradient.col(2).setZero();
  EXPECT_LT(model.error([&](const Vec3& x) -> Vec3 { return gradient * x; }), 1e-11);
  for (int axis = 0; axis < kind.dimension(); ++axis) {
    for (std::size_t node = 0; node < model.loads.size(); ++node) {
      EXPECT_NEAR(model.internal[node][axis], model.loads[node][axis], 1e-12 * E)
          << "reaction at node " << node;
    }
  }
  const ElasticityMatrix D = elasticity_matrix(swollen, kind.analysis);
  const Eigen::VectorXd sigma0 = initial_stress(swollen, kind.analysis);
  for (Index e = 0; e < model.body.mesh.elements(); ++e) {
    const Eigen::VectorXd u = model.element_displacement(e);
    const ElementNodes x = element_nodes(model.body.mesh, e);
    for (const QuadraturePoint& q : quadrature(kind.element)) {
      const Eigen::MatrixXd B = strain_matrix(mapped_gradients(kind.element, x, q.xi).gradients);
      ASSERT_LT((D * (B * u) - sigma0).norm(), 1e-10 * sigma0.norm()) << "element " << e;
    }
  }
}

// --- prescribed displacements ---

TEST_P(LoadedKind, StretchedBar) {
  constexpr double stretch = 0.004;
  Loaded model = bar(GetParam());
  model.hold_on_rollers().hold(face(0, size.x()), 0, stretch);
  model.solve();
  const double side = contraction(GetParam().analysis), strain = stretch / size.x();
  EXPECT_LT(
      model.error([&](const Vec3& x) -> Vec3 { return strain * Vec3(x.x(), -side * x.y(), -side * x.z()); }),
      1e-11);
  const double force = axial_modulus(GetParam().analysis) * strain * model.area(0);
  EXPECT_NEAR(model.reaction(0, face(0, size.x())), force, 1e-11 * force);
  EXPECT_NEAR(model.reaction(0, face(0, 0.0)), -force, 1e-11 * force);
}

TEST_P(LoadedKind, SimpleShear) {
  constexpr double shear = 0.03;
  Loaded model = bar(GetParam());
  for (int axis = 0; axis < GetParam().dimension(); ++axis) {
    model.hold(face(1, 0.0), axis).hold(face(1, size.y()), axis, axis == 0 ? shear * size.y() : 0.0);
  }
  model.hold(face(0, 0.0), 1).hold(face(0, size.x()), 1);  // take the shear stress of the ends
  model.solve();
  EXPECT_LT(model.error([&](const Vec3& x) -> Vec3 { return shear * x.y() * Vec3::UnitX(); }), 1e-11);
  const double force = G * shear * model.area(1);
  EXPECT_NEAR(model.reaction(0, face(1, size.y())), force, 1e-11 * force);
  EXPECT_NEAR(model.reaction(0, face(1, 0.0)), -force, 1e-11 * force);
}

// --- several materials ---

TEST_P(LoadedKind, TwoMaterialsInSeries) {
  const Material soft{E, 0.0, 900.0}, stiff{8.0 * E, 0.0, 1300.0};
  constexpr double pull = 250.0, g = 9.81;
  const double middle = size.x() / 2.0;
  Loaded model(GetParam(), test::block(GetParam().element, size, {4, 3, 3}), soft);
  model.beyond(middle, stiff).hold_on_rollers();
  model.description.loads = {Traction{{pull, 0, 0}, face(0, size.x())}};
  model.solve();
  EXPECT_LT(model.error([&](const Vec3& x) {
    return Vec3(pull * (std::min(x.x(), middle) / E + std::max(x.x() - middle, 0.0) / (8.0 * E)), 0, 0);
  }),
            1e-11);

  model.description.loads = {Gravity{{0, -g, 0}}};
  model.solve();
  const double half_volume = middle * model.area(0), weight = (900.0 + 1300.0) * g * half_volume,
               moment = (900.0 * 0.5 + 1300.0 * 1.5) * middle * g * half_volume;
  EXPECT_NEAR(model.total_load().y(), -weight, 1e-12 * weight);
  EXPECT_NEAR(model.reaction(1), weight, 1e-10 * weight);
  double found = 0.0;
  for (std::size_t node = 0; node < model.loads.size(); ++node) {
    found -= model.body.mesh.nodes[node].x() * model.loads[node].y();
  }
  EXPECT_NEAR(found, moment, 1e-12 * moment);
}

TEST_P(LoadedKind, OneOfTwoMaterialsSwellsAlongTheBar) {
  const Material dry{E, 0.0, 900.0};
  Material wet{8.0 * E, 0.0, 1300.0};
  wet.initial_strain[0] = 0.02;
  const double middle = size.x() / 2.0;
  Loaded model(GetParam(), test::block(GetParam().element, size, {4, 3, 3}), dry);
  model.beyond(middle, wet).hold_on_rollers();
  model.solve();
  EXPECT_LT(model.error([&](const Vec3& x) { return Vec3(0.02 * std::max(x.x() - middle, 0.0), 0, 0); }),
            1e-11);
}

// --- all together ---

TEST_P(LoadedKind, EveryFreeNodeIsInEquilibriumUnderAllSortsOfLoads) {
  Material swollen = tissue;
  swollen.initial_strain = {0.01, -0.02, 0.03, 0.004, 0.005, -0.006};
  Loaded model = bar(GetParam(), swollen);
  for (int axis = 0; axis < GetParam().dimension(); ++axis)
    model.hold(face(0, 0.0), axis, 0.001 * (1 + axis));
  model.hold(face(0, size.x()), 1, -0.002);
  const Vec3 traction(120.0, -40.0, 0.0), acceleration(-2.0, 9.0, 0.0), nodal(0.02, 0.05, 0.0);
  model.description.loads = {Traction{traction, face(1, size.y())}, Gravity{acceleration},
                             ConcentratedForce{nodal, SelectNodes{{5}}}};
  model.solve();
  double largest = 0.0, residual = 0.0;
  for (std::size_t node = 0; node < model.loads.size(); ++node) {
    largest = std::max(largest, model.internal[node].norm());
    for (int axis = 0; axis < GetParam().dimension(); ++axis) {
      if ((model.body.fixed[node] >> axis & 1) != 0) {
        EXPECT_EQ(model.u0[node][axis], model.body.prescribed[node][axis]);
      } else {
        residual = std::max(residual, std::abs(model.internal[node][axis] - model.loads[node][axis]));
      }
    }
  }
  EXPECT_LT(residual, 1e-10 * largest);
  const double volume = size.x() * model.area(0);
  const Vec3 total = traction * model.area(1) + acceleration * 1100.0 * volume + nodal;
  EXPECT_LT((model.total_load() - total).norm(), 1e-12 * total.norm());
  EXPECT_NEAR(model.reaction(0), -total.x(), 1e-10 * total.norm());
  EXPECT_NEAR(model.reaction(1), -total.y(), 1e-10 * total.norm());
}

TEST_P(LoadedKind, StretchedBarOfTwoMaterialsAsDescribed) {
  const Kind kind = GetParam();
  constexpr double stretch = 0.004;
  Description description;
  description.file = "model.toml";
  if (kind.dimension() == 2) {
    description.geometry = RectangleShape{Vec3::Zero(), {300.0, 100.0, 0.0}, {4, 3}};
  } else {
    description.geometry = BoxShape{Vec3::Zero(), {300.0, 100.0, 200.0}, {4, 3, 3}};
  }
  description.scale = 1e-3;
  description.mesh.element = kind.element;
  description.analysis = kind.analysis;
  description.thickness = kind.dimension() == 2 ? 0.02 : 1.0;
  SelectBox half{Vec3::Constant(-1.0), Vec3::Constant(1.0)};
  half.max.x() = 0.15;
  description.materials = {{{8.0 * E, 0.0, 1300.0}, {}, {}}, {{E, 0.0, 900.0}, {}, half}};
  for (int axis = 0; axis < kind.dimension(); ++axis) {
    description.fixed.push_back({face(axis, 0.0), static_cast<std::uint8_t>(1 << axis), Vec3::Zero()});
  }
  description.fixed.push_back({face(0, size.x()), 1, Vec3(stretch, 0.0, 0.0)});

  MeshedBody body = mesh_body(description, [](const std::string&) {});
  Loaded model(kind, body.mesh, tissue);
  model.description = description;
  model.body = std::move(body);
  model.solve();
  const double force = stretch * model.area(0) / (0.15 / E + 0.15 / (8.0 * E));
  EXPECT_LT(model.error([&](const Vec3& x) {
    return Vec3(force / model.area(0) * (std::min(x.x(), 0.15) / E + std::max(x.x() - 0.15, 0.0) / (8.0 * E)),
                0.0, 0.0);
  }),
            1e-11);
  EXPECT_NEAR(model.reaction(0, face(0, size.x())), force, 1e-11 * force);
}

}  // namespace
}  // namespace palpate::loads_test
