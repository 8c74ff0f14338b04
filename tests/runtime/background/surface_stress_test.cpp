// Stress on the surface against fields whose stress is known, and against the stress of the elements behind
// it.
#include "runtime/background/surface_stress.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "meshes/element.h"
#include "meshes/generate.h"
#include "meshes/surface.h"
#include "runtime/background/element_stress.h"
#include "runtime/body/patch_maker.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::surface_stress_test {
namespace {

using Field = std::function<Vec3(const Vec3&)>;
using TensorField = std::function<Mat3(const Vec3&)>;

/// A body of which one node alone is stored: all that stress needs of it is its mesh.
Model without_greens(
    Mesh mesh, const std::function<bool(const Vec3&)>& held = [](const Vec3&) { return false; }) {
  Model model;
  model.name = "body";
  model.mesh = std::move(mesh);
  const int d = model.dimension();
  model.analysis = d == 3 ? Analysis::solid : Analysis::plane_stress;
  model.thickness = d == 3 ? 1.0 : 0.25;
  model.materials = {{.youngs_modulus = 7.0, .poissons_ratio = 0.4}};
  model.material_of_element.assign(static_cast<std::size_t>(model.mesh.elements()), 0);
  const Surface surface = extract_surface(model.mesh);
  model.surface = surface_simplices(surface);
  model.rest_force.assign(model.mesh.nodes.size(), Vec3::Zero());
  model.rest_displacement.assign(model.mesh.nodes.size(), Vec3::Zero());
  for (const Vec3& node : model.mesh.nodes)
    model.fixed.push_back(held(node) ? static_cast<std::uint8_t>((1U << d) - 1U) : std::uint8_t{0});
  for (const Index node : surface.nodes) {
    if (model.stored_nodes.empty() && model.fixed[static_cast<std::size_t>(node)] == 0)
      model.stored_nodes = {node};
  }
  model.greens = test::pack(Eigen::MatrixXd::Identity(d, d), Precision::double_precision);
  return model;
}

Mesh box(ElementType element, int cells) {
  if (traits(element).dimension == 2)
    return generate(RectangleShape{.size = {1.3, 0.8, 0.0}, .cells = {cells, cells}}, element);
  const BoxShape shape{.size = {1.3, 0.8, 1.0}, .cells = {cells, cells, cells}};
  return element == ElementType::hex8 ? generate(shape, element)
                                      : with_elements(generate(shape), element, "box");
}

/// Turned, so that no facet lies along an axis.
Mesh turned_box(ElementType element, int cells) {
  Mesh mesh = box(element, cells);
  const Vec3 axis = mesh.dimension() == 2 ? Vec3::UnitZ() : Vec3(1.0, 2.0, -0.5).normalized();
  for (Vec3& node : mesh.nodes) node = Eigen::AngleAxisd(0.7, axis) * node;
  return mesh;
}

/// sigma = D (eps - eps_0) component by component as Hooke's law has it: E eps = (1 + nu) sigma - nu tr.
Mat3 stress_of_strain(const Material& m, Analysis analysis, Mat3 strain) {
  const auto& e = m.initial_strain;
  Mat3 initial;
  initial << e[0], e[3] / 2, e[5] / 2,  //
      e[3] / 2, e[1], e[4] / 2,         //
      e[5] / 2, e[4] / 2, e[2];
  strain -= initial;
  const double E = m.youngs_modulus, nu = m.poissons_ratio;
  if (analysis != Analysis::solid) strain(0, 2) = strain(1, 2) = strain(2, 0) = strain(2, 1) = 0.0;
  if (analysis == Analysis::plane_stress) strain(2, 2) = -nu / (1 - nu) * (strain(0, 0) + strain(1, 1));
  return E / (1 + nu) * (strain + nu / (1 - 2 * nu) * strain.trace() * Mat3::Identity());
}

/// As rest_force has it.
void add_load_of_initial_strain(Model& model) {
  const int d = model.dimension();
  const StressVector stress = initial_stress(model.materials[0], model.analysis);
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const ElementVector f =
        element_stress_force(model.mesh.element, element_nodes(model.mesh, e), stress, model.thickness);
    Eigen::Index k = 0;
    for (const Index node : model.mesh.element_nodes(e))
      model.rest_force[static_cast<std::size_t>(node)].head(d) += f.segment(d * k++, d);
  }
}

Vec3 normal_of(const Mesh& mesh, std::span<const Index> facet) {
  const auto at = [&](std::size_t k) { return mesh.nodes[static_cast<std::size_t>(facet[k])]; };
  const Vec3 along = at(1) - at(0);
  if (mesh.dimension() == 2) return Vec3(along.y(), -along.x(), 0.0).normalized();
  return along.cross(at(2) - at(0)).normalized();
}

/// Nodes whose facets lie in one plane, with their normal.
std::map<Index, Vec3> flat_nodes(const Mesh& mesh) {
  std::map<Index, Vec3> normals;
  std::vector<Index> bent;
  const Surface surface = extract_surface(mesh);
  for (Index f = 0; f < surface.count(); ++f) {
    const Vec3 normal = normal_of(mesh, surface.facet_nodes(f));
    for (const Index node : surface.facet_nodes(f)) {
      const auto [found, is_new] = normals.emplace(node, normal);
      if ((found->second - normal).norm() > 1e-9) bent.push_back(node);
    }
  }
  for (const Index node : bent) normals.erase(node);
  return normals;
}

struct Known {
  ElementType element;
  Analysis analysis;
};

class SurfaceStressOf : public testing::TestWithParam<Known> {
 protected:
  [[nodiscard]] Model model() const {
    Model model = without_greens(turned_box(GetParam().element, 3));
    model.analysis = GetParam().analysis;
    model.materials[0].initial_strain = {0.01, -0.02, 0.03, 0.02, 0.01, -0.03};
    if (model.dimension() == 2)
      model.materials[0].initial_strain[4] = model.materials[0].initial_strain[5] = 0.0;
    add_load_of_initial_strain(model);
    return model;
  }
};

void expect_exact(const Model& of, const Field& u, const TensorField& stress) {
  const Body body(of);
  SurfaceStress surface(body);
  const std::size_t S = body.surface_rest_positions().size();
  std::vector<Vec3> displacement(S), force(S, Vec3::Zero());
  std::vector<Stress> result(S);
  const std::map<Index, Vec3> flat = flat_nodes(of.mesh);
  ASSERT_GT(flat.size(), 3U);
  for (std::size_t k = 0; k < S; ++k) {
    const Index node = body.surface_mesh_nodes()[k];
    const Vec3& x = of.mesh.nodes[static_cast<std::size_t>(node)];
    displacement[k] = u(x);
    const auto found = flat.find(node);
    if (found != flat.end()) force[k] = surface.areas()[k] * stress(x) * found->second;
  }
  surface.evaluate(displacement, force, nullptr, result);
  for (std::size_t k = 0; k < S; ++k) {
    const Index node = body.surface_mesh_nodes()[k];
    if (!flat.contains(node)) continue;
    const Stress expected = stress_of(stress(of.mesh.nodes[static_cast<std::size_t>(node)]));
    ASSERT_LE((result[k] - expected).norm(), 1e-12 * (1.0 + expected.norm()))
        << k << ": " << result[k].transpose() << " not " << expected.transpose();
  }
}

TEST_P(SurfaceStressOf, LinearDisplacementIsExact) {
  const Model of = model();
  Mat3 gradient;
  gradient << 0.02, -0.07, 0.03,  //
      0.05, -0.04, 0.06,          //
      0.01, 0.08, 0.09;
  if (of.dimension() == 2) gradient.row(2) = gradient.col(2).transpose() = Vec3::Zero().transpose();
  const Mat3 strain = 0.5 * (gradient + gradient.transpose());
  const Mat3 stress = stress_of_strain(of.materials[0], of.analysis, strain);
  expect_exact(
      of, [&](const Vec3& x) { return Vec3(Vec3(0.3, -0.2, 0.0) + gradient * x); },
      [&](const Vec3&) { return stress; });
}

INSTANTIATE_TEST_SUITE_P(Elements, SurfaceStressOf,
                         testing::Values(Known{ElementType::tet4, Analysis::solid},
                                         Known{ElementType::tet10, Analysis::solid},
                                         Known{ElementType::hex8, Analysis::solid},
                                         Known{ElementType::tri3, Analysis::plane_stress},
                                         Known{ElementType::quad4, Analysis::plane_strain}));

TEST(SurfaceStress, OfAQuadraticDisplacementIsExactAtTheNodesOfQuadraticFacets) {
  const Model of = without_greens(turned_box(ElementType::tet10, 2));
  const auto u = [](const Vec3& x) {
    return Vec3(x.x() * x.y() - 2 * x.z() * x.z(), x.y() * x.z() + x.x() * x.x(),
                3 * x.x() * x.z() - x.y() * x.y());
  };
  const auto stress = [&](const Vec3& x) {
    Mat3 gradient;
    gradient << x.y(), x.x(), -4 * x.z(),  //
        2 * x.x(), x.z(), x.y(),           //
        3 * x.z(), -2 * x.y(), 3 * x.x();
    const Mat3 strain = 0.5 * (gradient + gradient.transpose());
    return stress_of_strain(of.materials[0], of.analysis, strain);
  };
  expect_exact(of, u, stress);
}

// Also where sides meet in an edge, if nothing pulls at either of them.
TEST(SurfaceStress, OfAPulledBarIsExactAtItsEdges) {
  for (const ElementType element :
       {ElementType::tri3, ElementType::quad4, ElementType::tet4, ElementType::tet10, ElementType::hex8}) {
    const Model of = without_greens(box(element, 3));
    const Body body(of);
    SurfaceStress stress(body);
    std::vector<Vec3> u;
    for (const Index node : body.surface_mesh_nodes()) {
      const Vec3& x = of.mesh.nodes[static_cast<std::size_t>(node)];
      u.emplace_back(x.x() / 7.0, -0.4 * x.y() / 7.0, -0.4 * x.z() / 7.0);
    }
    std::vector<Stress> result(u.size());
    stress.evaluate(u, std::vector<Vec3>(u.size(), Vec3::Zero()), nullptr, result);
    for (std::size_t k = 0; k < u.size(); ++k) {
      if (const double x = 7.0 * u[k].x(); x < 1e-9 || x > 1.3 - 1e-9) continue;
      ASSERT_LE((result[k] - Stress::Unit(0)).norm(), 1e-13) << traits(element).name << ' ' << k;
      ASSERT_NEAR(von_mises(result[k]), 1.0, 1e-13);
    }
  }
}

// The loads' own: an even pressure on all sides, weight, and strain that is there from the first, as one
// nodal force.
TEST(SurfaceStress, OfAPressureOnAllSidesIsExact) {
  constexpr double p = 0.3;
  for (const ElementType element :
       {ElementType::tri3, ElementType::quad4, ElementType::tet4, ElementType::tet10, ElementType::hex8}) {
    Model of = without_greens(turned_box(element, 3));
    of.materials[0].initial_strain = {0.01, 0.01, 0.01, 0, 0, 0};
    const Surface surface = extract_surface(of.mesh);
    for (Index f = 0; f < surface.count(); ++f) {
      const auto nodes = surface.facet_nodes(f);
      const ShapeValues shares =
          facet_shape_integrals(surface.facet, positions(of.mesh, nodes), of.thickness);
      for (std::size_t k = 0; k < nodes.size(); ++k)
        of.rest_force[static_cast<std::size_t>(nodes[k])] -=
            p * shares[static_cast<Eigen::Index>(k)] * normal_of(of.mesh, nodes);
    }
    add_load_of_initial_strain(of);
    for (Index e = 0; e < of.mesh.elements(); ++e) {
      const ShapeValues shares = element_shape_integrals(element, element_nodes(of.mesh, e), of.thickness);
      Eigen::Index k = 0;
      for (const Index node : of.mesh.element_nodes(e))
        of.rest_force[static_cast<std::size_t>(node)] += 1000.0 * shares[k++] * Vec3(0.3, -9.0, 0.0);
    }
    const Mat3 stretched = stress_of_strain(of.materials[0], of.analysis, Mat3::Zero());
    const Mat3 unit =
        stress_of_strain({.youngs_modulus = 7.0, .poissons_ratio = 0.4}, of.analysis, Mat3::Identity());
    const double strain = (-p - stretched(0, 0)) / unit(0, 0);  // that gives -p I
    const Body body(of);
    SurfaceStress stress(body);
    const std::size_t S = body.surface_rest_positions().size();
    std::vector<Vec3> u;
    for (const Index node : body.surface_mesh_nodes())
      u.push_back(strain * of.mesh.nodes[static_cast<std::size_t>(node)]);
    std::vector<Stress> result(S);
    stress.evaluate(u, std::vector<Vec3>(S, Vec3::Zero()), nullptr, result);
    const std::map<Index, Vec3> flat = flat_nodes(of.mesh);
    for (std::size_t k = 0; k < S; ++k) {
      if (!flat.contains(body.surface_mesh_nodes()[k])) continue;
      Stress expected;
      expected << -p, -p, of.dimension() == 3 ? -p : 0.0, 0, 0, 0;
      ASSERT_LE((result[k] - expected).norm(), 1e-11)
          << traits(element).name << ' ' << k << ": " << result[k].transpose();
    }
  }
}

/// Nodal forces [N] of the nodes of a mesh by an even stress inside, on all of its surface that is not held.
enum class Acts { by_facets, by_simplices };  // as a load does, or as contact
std::vector<Vec3> forces_of(const Model& of, const Mat3& stress, Acts acts) {
  std::vector<Vec3> force(of.mesh.nodes.size(), Vec3::Zero());
  const auto add = [&](ElementType type, std::span<const Index> nodes) {
    const ShapeValues shares = facet_shape_integrals(type, positions(of.mesh, nodes), of.thickness);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      force[static_cast<std::size_t>(nodes[k])] +=
          shares[static_cast<Eigen::Index>(k)] * stress * normal_of(of.mesh, nodes);
  };
  const Surface surface = extract_surface(of.mesh);
  const auto d = static_cast<std::size_t>(of.dimension());
  const std::size_t cut = of.surface.size() / d / static_cast<std::size_t>(surface.count());
  for (Index f = 0; f < surface.count(); ++f) {
    unsigned held = ~0U;
    for (const Index node : surface.facet_nodes(f)) held &= of.fixed[static_cast<std::size_t>(node)];
    if (held != 0) continue;
    if (acts == Acts::by_facets) {
      add(surface.facet, surface.facet_nodes(f));
      continue;
    }
    for (std::size_t k = 0; k < cut; ++k)
      add(d == 3 ? ElementType::tri3 : ElementType::line2,
          std::span(of.surface).subspan(d * (cut * static_cast<std::size_t>(f) + k), d));
  }
  return force;
}

/// Largest error of the stress at any node, edges and corners too, of its size.
double error_of_even_stress(Model of, const Mat3& strain, Acts acts) {
  if (of.dimension() == 3) of.analysis = Analysis::solid;
  const Mat3 stress = stress_of_strain(of.materials[0], of.analysis, strain);
  const std::vector<Vec3> force = forces_of(of, stress, acts);
  if (acts == Acts::by_facets) of.rest_force = force;
  const Body body(of);
  SurfaceStress surface(body);
  std::vector<Vec3> u, contact;
  for (const Index node : body.surface_mesh_nodes()) {
    u.push_back(strain * of.mesh.nodes[static_cast<std::size_t>(node)]);
    contact.push_back(acts == Acts::by_facets ? Vec3(Vec3::Zero()) : force[static_cast<std::size_t>(node)]);
  }
  std::vector<Stress> result(u.size());
  surface.evaluate(u, contact, nullptr, result);
  double error = 0.0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    if (result[k].allFinite()) error = std::max(error, (result[k] - stress_of(stress)).norm());
  }
  return error / stress.norm();
}

/// Strains of an even stress: along one direction, from all sides, shear, and all that together.
std::vector<Mat3> even_strains(int dimension) {
  Mat3 along, shear, all;
  along << 0.1, 0, 0, 0, -0.04, 0, 0, 0, -0.04;
  shear << 0, 0.1, 0, 0.1, 0, 0, 0, 0, 0;
  all << 0.02, -0.07, 0.03, -0.07, -0.04, 0.06, 0.03, 0.06, 0.09;
  std::vector<Mat3> strains = {along, -0.1 * Mat3::Identity(), shear, all};
  for (Mat3& strain : strains) {
    if (dimension == 2) strain.row(2) = strain.col(2).transpose() = Vec3::Zero().transpose();
  }
  return strains;
}

// At the edges where sides meet that are pulled at differently, and at the corners: a node's force is that of
// all of them.
TEST(SurfaceStress, OfAnEvenStressIsExactAtEdgesAndCorners) {
  for (const ElementType element :
       {ElementType::tri3, ElementType::quad4, ElementType::tet4, ElementType::tet10, ElementType::hex8}) {
    for (const Acts acts : {Acts::by_facets, Acts::by_simplices}) {
      for (const int cells : {2, 3, 5}) {
        const Model of = without_greens(turned_box(element, cells));
        for (const Mat3& strain : even_strains(of.dimension())) {
          EXPECT_LT(error_of_even_stress(of, strain, acts), 1e-11)
              << traits(element).name << ", " << cells << " cells, "
              << (acts == Acts::by_facets ? "load" : "contact") << '\n'
              << strain;
        }
      }
    }
  }
}

// Beside a side whose traction nobody knows.
TEST(SurfaceStress, OfAnEvenStressIsExactAtTheEdgesOfWhatIsHeld) {
  for (const unsigned held : {7U, 2U}) {
    Model of = without_greens(box(ElementType::tet10, 3), [](const Vec3& x) { return x.y() < 1e-9; });
    for (std::uint8_t& axes : of.fixed) axes = axes != 0 ? static_cast<std::uint8_t>(held) : std::uint8_t{0};
    for (const Mat3& strain : even_strains(3))
      EXPECT_LT(error_of_even_stress(of, strain, Acts::by_facets), 1e-11) << strain;
  }
}

// Of a sheet one element thick all nodes of the rim are at edges, of a bar of one element all nodes are.
TEST(SurfaceStress, OfAnEvenStressIsFoundOnThinBodies) {
  for (const ElementType element : {ElementType::tet4, ElementType::hex8}) {
    for (const std::array<int, 3>& cells : {std::array{4, 5, 1}, std::array{5, 1, 1}}) {
      const BoxShape shape{.size = {1.3, 0.8, 0.2}, .cells = cells};
      const Model of =
          without_greens(element == ElementType::hex8 ? generate(shape, element)
                                                      : with_elements(generate(shape), element, "box"));
      const bool is_bar = cells[1] == 1;
      const std::vector<Mat3> strains = even_strains(3);
      for (std::size_t k = 0; k < strains.size(); ++k) {
        // With no node inside any side shear cannot be told from pressure on the side beside.
        if (is_bar && k > 1) continue;
        EXPECT_LT(error_of_even_stress(of, strains[k], Acts::by_facets), is_bar ? 0.05 : 1e-11)
            << traits(element).name << ' ' << cells[1] << '\n'
            << strains[k];
      }
    }
  }
}

// What presses on one side alone is that side's, also at its edge, whatever is round the corner.
TEST(SurfaceStress, OfAPressureAtAnEdgeIsThatOfThePressedSide) {
  const Model of = without_greens(box(ElementType::tet4, 4));
  const Body body(of);
  SurfaceStress surface(body);
  const std::size_t S = body.surface_mesh_nodes().size();
  std::vector<Vec3> u(S, Vec3::Zero()), force(S, Vec3::Zero());
  std::vector<Stress> result(S);
  std::size_t pressed = 0;
  for (std::size_t k = 0; k < S; ++k) {
    const Vec3& x = of.mesh.nodes[static_cast<std::size_t>(body.surface_mesh_nodes()[k])];
    if ((x - Vec3(0.65, 0.8, 1.0)).norm() < 1e-9) pressed = k;  // in the middle of an edge of the top
  }
  force[pressed] = Vec3(0.0, 0.0, -1.0);
  surface.evaluate(u, force, nullptr, result);
  // Half of the node's facets, by area, are on the top, where all the force is; the mean is of both sides.
  double top = 0.0, beside = 0.0;
  const Surface facets = extract_surface(of.mesh);
  for (Index f = 0; f < facets.count(); ++f) {
    const auto nodes = facets.facet_nodes(f);
    const Index node = body.surface_mesh_nodes()[pressed];
    if (std::find(nodes.begin(), nodes.end(), node) == nodes.end()) continue;
    const double area = facet_shape_integrals(facets.facet, positions(of.mesh, nodes), 1.0).sum();
    (normal_of(of.mesh, nodes).z() > 0.5 ? top : beside) += area;
  }
  const double pressure = 1.0 / (top / 3.0);
  EXPECT_NEAR(result[pressed][2], -pressure * top / (top + beside), 0.03 * pressure);
}

TEST(SurfaceStress, IsNotKnownWhereAllIsHeld) {
  const auto bottom = [](const Vec3& x) { return x.z() < 1e-9; };
  Model of = without_greens(box(ElementType::tet4, 3), bottom);
  for (const unsigned held : {7U, 4U}) {  // along all axes; on rollers
    for (std::uint8_t& axes : of.fixed) axes = axes != 0 ? static_cast<std::uint8_t>(held) : std::uint8_t{0};
    const Body body(of);
    SurfaceStress stress(body);
    const std::size_t S = body.surface_rest_positions().size();
    std::vector<Stress> result(S);
    stress.evaluate(std::vector<Vec3>(S, Vec3::Zero()), std::vector<Vec3>(S, Vec3::Zero()), nullptr, result);
    int unknown = 0;
    for (std::size_t k = 0; k < S; ++k) {
      const Vec3& x = of.mesh.nodes[static_cast<std::size_t>(body.surface_mesh_nodes()[k])];
      const bool is_below =
          bottom(x) && x.x() > 1e-9 && x.x() < 1.3 - 1e-9 && x.y() > 1e-9 && x.y() < 0.8 - 1e-9;
      ASSERT_EQ(std::isnan(von_mises(result[k])), is_below) << x.transpose();
      unknown += is_below ? 1 : 0;
    }
    EXPECT_EQ(unknown, 4);
  }
}

/// u [N] of a body under forces on some of its top [N].
struct Solved {
  std::vector<Vec3> u, force;
};

Solved solve(const Model& model, const std::function<Vec3(const Vec3&)>& pressure) {
  const int d = model.dimension();
  Solved solved{std::vector<Vec3>(model.mesh.nodes.size(), Vec3::Zero()),
                std::vector<Vec3>(model.mesh.nodes.size(), Vec3::Zero())};
  const Surface surface = extract_surface(model.mesh);
  const auto corners = static_cast<std::size_t>(d);
  for (std::size_t at = 0; at < model.surface.size(); at += corners) {
    const auto nodes = std::span(model.surface).subspan(at, corners);
    const ShapeValues shares = facet_shape_integrals(d == 3 ? ElementType::tri3 : ElementType::line2,
                                                     positions(model.mesh, nodes), model.thickness);
    for (std::size_t k = 0; k < corners; ++k) {
      const auto node = static_cast<std::size_t>(nodes[k]);
      if (std::abs(normal_of(model.mesh, nodes)[d - 1] - 1.0) < 1e-9)
        solved.force[node] += shares[static_cast<Eigen::Index>(k)] * pressure(model.mesh.nodes[node]);
    }
  }
  std::vector<Eigen::Index> number(static_cast<std::size_t>(d) * model.mesh.nodes.size(), -1);
  Eigen::Index free = 0;
  for (std::size_t dof = 0; dof < number.size(); ++dof) {
    const auto axis = dof % static_cast<std::size_t>(d);
    if ((model.fixed[dof / static_cast<std::size_t>(d)] >> axis & 1U) == 0) number[dof] = free++;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const ElementMatrix K =
        element_stiffness(model.mesh.element, element_nodes(model.mesh, e),
                          elasticity_matrix(model.materials[0], model.analysis), model.thickness);
    std::vector<Eigen::Index> dofs;
    for (const Index node : model.mesh.element_nodes(e))
      for (int axis = 0; axis < d; ++axis) dofs.push_back(number[static_cast<std::size_t>(d * node + axis)]);
    for (Eigen::Index i = 0; i < K.rows(); ++i) {
      for (Eigen::Index j = 0; j < K.cols(); ++j) {
        const Eigen::Index row = dofs[static_cast<std::size_t>(i)],
                           column = dofs[static_cast<std::size_t>(j)];
        if (row >= 0 && column >= 0) entries.emplace_back(row, column, K(i, j));
      }
    }
  }
  Eigen::SparseMatrix<double> K(free, free);
  K.setFromTriplets(entries.begin(), entries.end());
  Eigen::VectorXd f(free);
  for (std::size_t dof = 0; dof < number.size(); ++dof) {
    if (number[dof] >= 0)
      f[number[dof]] = solved.force[dof / static_cast<std::size_t>(d)]
                                   [static_cast<Eigen::Index>(dof % static_cast<std::size_t>(d))];
  }
  const Eigen::VectorXd u = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(K).solve(f);
  for (std::size_t dof = 0; dof < number.size(); ++dof) {
    if (number[dof] >= 0)
      solved.u[dof / static_cast<std::size_t>(d)]
              [static_cast<Eigen::Index>(dof % static_cast<std::size_t>(d))] = u[number[dof]];
  }
  return solved;
}

/// sigma = D B u of the elements at their nodes, mean by volume.
std::vector<Stress> volume_mean(const Model& model, const std::vector<Vec3>& u) {
  const int d = model.dimension();
  std::vector<Stress> sum(u.size(), Stress::Zero());
  std::vector<double> weight(u.size());
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const ElementNodes x = element_nodes(model.mesh, e);
    const auto nodes = model.mesh.element_nodes(e);
    const double volume = element_volume(model.mesh.element, x);
    ElementVector u_e(d * x.rows());
    for (Eigen::Index k = 0; k < x.rows(); ++k)
      u_e.segment(d * k, d) = u[static_cast<std::size_t>(nodes[static_cast<std::size_t>(k)])].head(d);
    for (std::size_t p = 0; p < nodes.size(); ++p) {
      const StrainMatrix B = strain_matrix(
          mapped_gradients(model.mesh.element, x, reference_nodes(model.mesh.element)[p]).gradients);
      const StressVector s = elasticity_matrix(model.materials[0], model.analysis) * (B * u_e);
      Stress stress = Stress::Zero();
      if (d == 3) {
        stress = s;
      } else {
        const double across = model.analysis == Analysis::plane_strain ? 0.4 * (s[0] + s[1]) : 0.0;
        stress << s[0], s[1], across, s[2], 0, 0;
      }
      sum[static_cast<std::size_t>(nodes[p])] += volume * stress;
      weight[static_cast<std::size_t>(nodes[p])] += volume;
    }
  }
  for (std::size_t node = 0; node < sum.size(); ++node) sum[node] /= weight[node];
  return sum;
}

/// A block that stands on its clamped bottom.
Model block(ElementType element, int cells) {
  const int up = traits(element).dimension - 1;
  Model model = without_greens(box(element, cells), [up](const Vec3& x) { return x[up] < 1e-9; });
  if (element == ElementType::quad4) model.analysis = Analysis::plane_strain;
  return model;
}

/// Its displacement, pressed and rubbed over the middle of its top.
Solved solve_pressed(const Model& block) {
  const bool in_space = block.dimension() == 3;
  return solve(block, [in_space](const Vec3& x) -> Vec3 {
    const double r2 = (x - Vec3(0.65, in_space ? 0.4 : x.y(), x.z())).squaredNorm() / 0.09;
    const Vec3 force = in_space ? Vec3(0.2, 0.0, -1.0) : Vec3(0.2, -1.0, 0.0);
    return (r2 < 1.0 ? (1.0 - r2) * (1.0 - r2) : 0.0) * force;
  });
}

/// Von Mises stress [N] of the surface nodes.
std::map<Index, double> of_surface(const Model& model, const Solved& solved) {
  const Body body(model);
  SurfaceStress surface(body);
  std::vector<Vec3> u, force;
  for (const Index node : body.surface_mesh_nodes()) {
    u.push_back(solved.u[static_cast<std::size_t>(node)]);
    force.push_back(solved.force[static_cast<std::size_t>(node)]);
  }
  std::vector<Stress> stress(u.size());
  surface.evaluate(u, force, nullptr, stress);
  std::map<Index, double> result;
  for (std::size_t k = 0; k < u.size(); ++k) result[body.surface_mesh_nodes()[k]] = von_mises(stress[k]);
  return result;
}

/// Root mean square of a - b over surface nodes away from the clamp, as a share of that of b.
template <class A, class B>
double difference(const Model& model, const A& a, const B& b) {
  double of_difference = 0.0, of_all = 0.0;
  for (const Index node : extract_surface(model.mesh).nodes) {
    if (model.mesh.nodes[static_cast<std::size_t>(node)][model.dimension() - 1] < 0.3) continue;
    of_difference += std::pow(a(node) - b(node), 2);
    of_all += std::pow(b(node), 2);
  }
  return std::sqrt(of_difference / of_all);
}

TEST(SurfaceStress, ConvergesToThatOfTheElements) {
  struct Case {
    ElementType element;
    std::vector<int> cells;
    double most;  // of the finest
  };
  for (const Case& tested :
       {Case{ElementType::tet4, {4, 8}, 0.38}, Case{ElementType::hex8, {4, 8}, 0.33},
        Case{ElementType::tet10, {2, 4}, 0.35}, Case{ElementType::tri3, {12, 24, 48}, 0.09},
        Case{ElementType::quad4, {12, 24, 48}, 0.12}}) {
    double before = 1e9;
    for (const int cells : tested.cells) {
      const Model of = block(tested.element, cells);
      const Solved solved = solve_pressed(of);
      const std::vector<Stress> elements = volume_mean(of, solved.u);
      std::map<Index, double> surface = of_surface(of, solved);
      const double now = difference(
          of, [&](Index node) { return surface[node]; },
          [&](Index node) { return von_mises(elements[static_cast<std::size_t>(node)]); });
      EXPECT_LT(now, before) << traits(tested.element).name;
      before = now;
    }
    EXPECT_LT(before, tested.most) << traits(tested.element).name;
  }
}

// What the elements say at the surface is one-sided, of first order; the surface with its traction is of
// second. The truth is that of the elements of a mesh eight times as fine.
TEST(SurfaceStress, IsNearerToTheTruthThanTheElementsAre) {
  for (const ElementType element : {ElementType::tri3, ElementType::quad4}) {
    constexpr int coarse = 24, finer = 8;
    const Model of = block(element, coarse), fine = block(element, finer * coarse);
    const Solved solved = solve_pressed(of);
    const std::vector<Stress> elements = volume_mean(of, solved.u);
    const std::vector<Stress> truth = volume_mean(fine, solve_pressed(fine).u);
    std::map<Index, double> surface = of_surface(of, solved);
    const auto true_at = [&](Index node) {
      const Index row = node / (coarse + 1), column = node % (coarse + 1);  // numbered x fastest
      return von_mises(truth[static_cast<std::size_t>(finer * (row * (finer * coarse + 1) + column))]);
    };
    const double by_surface = difference(
        of, [&](Index node) { return surface[node]; }, true_at);
    const double by_elements = difference(
        of, [&](Index node) { return von_mises(elements[static_cast<std::size_t>(node)]); }, true_at);
    EXPECT_LT(by_surface, 0.06) << traits(element).name;
    EXPECT_GT(by_elements, 0.15) << traits(element).name;
  }
}

TEST(ElementStress, IsTheVolumeMean) {
  for (const Analysis analysis : {Analysis::plane_stress, Analysis::plane_strain}) {
    Model of = without_greens(box(ElementType::quad4, 3));
    of.analysis = analysis;
    for (Vec3& node : of.mesh.nodes) node.x() += 0.1 * node.y() * node.x();
    std::vector<Vec3> u;
    for (const Vec3& x : of.mesh.nodes) u.emplace_back(x.x() * x.y(), std::sin(x.x()), 0.0);
    const std::vector<Stress> expected = volume_mean(of, u);
    std::vector<Stress> result(u.size());
    element_stress(of).apply(u, result);
    for (std::size_t node = 0; node < u.size(); ++node)
      ASSERT_LE((result[node] - expected[node]).norm(), 1e-12 * expected[node].norm()) << node;
    of.materials[0].initial_strain = {0.01, 0.02, 0.03, 0.04, 0, 0};
    element_stress(of).apply(std::vector<Vec3>(u.size(), Vec3::Zero()), result);
    const Stress initial = stress_of(stress_of_strain(of.materials[0], analysis, Mat3::Zero()));
    ASSERT_LE((result[0] - initial).norm(), 1e-13);
  }
}

// With an overlay at an edge of the body: on the patch as on the body's own elements.
TEST(SurfaceStress, OfAnEvenStressIsExactAtTheEdgesOfARefinedSurface) {
  for (const ElementType element : {ElementType::tri3, ElementType::tet4, ElementType::hex8}) {
    for (const Acts acts : {Acts::by_facets, Acts::by_simplices}) {
      if (acts == Acts::by_simplices && element == ElementType::hex8)
        continue;  // see the last lines of the next
      Model model = test::unit_model(element, 4, Scope::full, Precision::double_precision);
      const int d = model.dimension();
      for (const Mat3& strain : even_strains(d)) {
        const Mat3 expected = stress_of_strain(model.materials[0], model.analysis, strain);
        if (acts == Acts::by_facets) model.rest_force = forces_of(model, expected, acts);
        const Body body(model, {}, 3);
        const Index centre = body.nearest_surface_node(test::upright(d, 1.0, 1.0, 1.0)).node;
        const auto patch = PatchMaker(body, 2).make({&centre, 1});
        SurfaceStress surface(body);
        const std::vector<Vec3> x = body.surface_in_mesh();
        std::vector<Vec3> u, force(x.size(), Vec3::Zero());
        for (const Vec3& at : x) u.push_back(strain * at);
        if (acts == Acts::by_simplices) {
          const auto corners = static_cast<std::size_t>(d);
          for (std::size_t at = 0; at < body.simplices().size(); at += corners) {
            const auto nodes = body.simplices().subspan(at, corners);
            ElementNodes place(d, 3);
            bool is_bottom = true;
            for (std::size_t k = 0; k < corners; ++k) {
              place.row(static_cast<Eigen::Index>(k)) = x[static_cast<std::size_t>(nodes[k])].transpose();
              is_bottom = is_bottom && x[static_cast<std::size_t>(nodes[k])][d - 1] < 1e-9;
            }
            if (is_bottom) continue;
            const Vec3 along = place.row(1) - place.row(0);
            const Vec3 normal = d == 2 ? Vec3(along.y(), -along.x(), 0.0).normalized()
                                       : Vec3(along.cross(Vec3(place.row(2) - place.row(0)))).normalized();
            const ShapeValues shares = facet_shape_integrals(d == 3 ? ElementType::tri3 : ElementType::line2,
                                                             place, model.thickness);
            for (std::size_t k = 0; k < corners; ++k)
              force[static_cast<std::size_t>(nodes[k])] +=
                  shares[static_cast<Eigen::Index>(k)] * expected * normal;
          }
        }
        std::vector<Stress> result(x.size());
        surface.evaluate(u, force, patch.get(), result);
        int at_edges = 0;
        for (const Index node : patch->surface_nodes()) {
          const auto k = static_cast<std::size_t>(node);
          if (x[k][d - 1] < 0.25) continue;  // where the sides end at what is held
          int on = 0;
          for (int axis = 0; axis < d; ++axis) on += x[k][axis] > 1 - 1e-9 ? 1 : 0;
          at_edges += on > 1 ? 1 : 0;
          ASSERT_LE((result[k] - stress_of(expected)).norm(), 1e-11 * expected.norm())
              << traits(element).name << ' ' << x[k].transpose() << ": " << result[k].transpose();
        }
        EXPECT_GE(at_edges, d == 2 ? 1 : 10);
      }
    }
  }
}

// With an overlay, of any linear displacement: on the patch, at its rim and beside it.
TEST(SurfaceStress, OfALinearDisplacementIsExactOnARefinedSurface) {
  for (const ElementType element : {ElementType::tri3, ElementType::tet4, ElementType::hex8}) {
    const Body body(test::unit_model(element, 4, Scope::full, Precision::double_precision), {}, 3);
    const int d = body.dimension();
    const Index centre = body.nearest_surface_node(test::top_middle(d)).node;
    const auto patch = PatchMaker(body, 1).make({&centre, 1});
    Mat3 gradient;
    gradient << 0.02, -0.07, 0.03, 0.05, -0.04, 0.06, 0.01, 0.08, 0.09;
    if (d == 2) gradient.row(2) = gradient.col(2).transpose() = Vec3::Zero().transpose();
    const Mat3 strain = 0.5 * (gradient + gradient.transpose());
    const Mat3 expected = stress_of_strain(body.model().materials[0], body.model().analysis, strain);
    SurfaceStress surface(body);
    const std::vector<Vec3> x = body.surface_in_mesh();
    const Vec3 up = Vec3::Unit(d - 1);
    const auto is_flat = [&](const Vec3& at) {
      for (int axis = 0; axis + 1 < d; ++axis)
        if (at[axis] < 1e-9 || at[axis] > 1 - 1e-9) return false;
      return at[d - 1] > 1 - 1e-9;
    };
    std::vector<Vec3> u, force(x.size(), Vec3::Zero());
    for (const Vec3& at : x) u.push_back(gradient * at);
    for (const Index node : patch->surface_nodes()) {
      const auto k = static_cast<std::size_t>(node);
      force[k] = surface.areas()[k] * expected * up;
    }
    std::vector<Stress> result(x.size()), beside(x.size());
    surface.evaluate(u, force, patch.get(), result);
    int on_patch = 0;
    for (const Index node : patch->surface_nodes()) {
      const auto k = static_cast<std::size_t>(node);
      if (!is_flat(x[k])) continue;
      ++on_patch;
      ASSERT_LE((result[k] - stress_of(expected)).norm(), 1e-13)
          << traits(element).name << ' ' << x[k].transpose();
    }
    EXPECT_GT(on_patch, d == 2 ? 5 : 30);
    // Beside it nothing acts on the surface: what differs is the traction's part, the same everywhere.
    surface.evaluate(u, std::vector<Vec3>(x.size(), Vec3::Zero()), nullptr, beside);
    const auto k = static_cast<std::size_t>(body.surface_node_of_stored(centre));
    for (std::size_t node = 0; node < x.size(); ++node) {
      bool is_inner = is_flat(x[node]);
      for (int axis = 0; axis + 1 < d; ++axis)
        is_inner &= x[node][axis] > 0.25 - 1e-9 && x[node][axis] < 0.75 + 1e-9;
      if (is_inner) {
        ASSERT_LE((beside[node] - beside[k]).norm(), 1e-13) << x[node].transpose();
      }
    }
    EXPECT_LE(std::abs(beside[k][d - 1]), 1e-13) << "no traction there";
    if (element == ElementType::hex8) continue;  // its weights are not those of the simplices
    for (std::size_t node = 0; node < x.size(); ++node) {
      if (is_flat(x[node])) force[node] = surface.areas()[node] * expected * up;
    }
    surface.evaluate(u, force, nullptr, beside);
    EXPECT_LE((beside[k] - stress_of(expected)).norm(), 1e-13) << "without a patch the body's nodes bear it";
  }
}

}  // namespace
}  // namespace palpate::surface_stress_test
