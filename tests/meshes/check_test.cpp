// Checks before assembly.
#include "meshes/check.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <limits>
#include <numeric>
#include <random>

#include "meshes/element.h"
#include "meshes/surface.h"
#include "meshes/topology.h"
#include "tests/support/bodies/meshes_bodies.h"
#include "tests/support/files/meshes_files.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::check_test {
namespace {

using test::block;
using test::contains;
using test::error_of;

constexpr std::uint8_t x_axis = 1, y_axis = 2, z_axis = 4, every_axis = 7;

/// (node, axes) of some nodes.
using Held = std::vector<std::pair<std::size_t, std::uint8_t>>;

std::vector<std::uint8_t> masks(const Mesh& mesh, const Held& held) {
  std::vector<std::uint8_t> result(mesh.nodes.size(), 0);
  for (const auto& [node, axes] : held) result[node] |= axes;
  return result;
}

Held held_everywhere(const Mesh& mesh, std::uint8_t axes) {
  Held held;
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) held.emplace_back(node, axes);
  return held;
}

TEST(MeshCheck, AGoodMeshIsLeftAsItIs) {
  for (const ElementType type : body_elements) {
    Mesh mesh = block(type);
    const Mesh before = mesh;
    EXPECT_EQ(orient_elements(mesh, ""), 0u);
    EXPECT_EQ(remove_unused_nodes(mesh), 0u);
    EXPECT_EQ(mesh.connectivity, before.connectivity);
    EXPECT_EQ(mesh.nodes, before.nodes);
    EXPECT_NO_THROW(check_connected(mesh, ""));
  }
}

/// A mirror image has every element inside out.
TEST(MeshCheck, AMeshOfTheOtherSignIsTurnedRound) {
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    Mesh mesh = block(type);
    const Mesh before = mesh;
    for (Vec3& x : mesh.nodes) x.x() = -x.x();
    EXPECT_EQ(orient_elements(mesh, ""), static_cast<std::size_t>(mesh.elements()));
    EXPECT_EQ(orient_elements(mesh, ""), 0u);
    double volume = 0.0;
    for (Index e = 0; e < mesh.elements(); ++e) {
      const auto nodes = mesh.element_nodes(e), nodes_before = before.element_nodes(e);
      EXPECT_TRUE(std::is_permutation(nodes.begin(), nodes.end(), nodes_before.begin()));
      const ElementNodes x = element_nodes(mesh, e);
      EXPECT_GT(smallest_determinant(type, x), 0.0);
      volume += element_volume(type, x);
      // Straight elements: the map is affine, so it takes the reference nodes to the nodes.
      if (type == ElementType::hex8 || type == ElementType::quad4) continue;
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const Vec3 xi = reference_nodes(type)[i];
        Vec3 image = x.row(0).transpose();
        for (int k = 0; k < mesh.dimension(); ++k) image += xi[k] * (x.row(1 + k) - x.row(0)).transpose();
        EXPECT_LT((image - test::node_of(mesh, nodes[i])).norm(), 1e-15);
      }
    }
    EXPECT_NEAR(volume, test::block_volume(type), 1e-15);
  }
}

/// The order of nodes is the file's affair; that elements lie on both sides of what they share is not.
TEST(MeshCheck, SingleElementsAreTurnedAndFoldsRefused) {
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    Mesh mesh = block(type);
    const Surface before = extract_surface(mesh);
    const std::span<const std::uint8_t> order = reversed_nodes(type);
    std::size_t reversed = 0;
    for (Index e = 0; e < mesh.elements(); e += 2, ++reversed) {
      const std::vector<Index> nodes(mesh.element_nodes(e).begin(), mesh.element_nodes(e).end());
      for (std::size_t i = 0; i < order.size(); ++i)
        mesh.connectivity[static_cast<std::size_t>(e) * order.size() + i] = nodes[order[i]];
    }
    EXPECT_EQ(orient_elements(mesh, ""), reversed);
    EXPECT_EQ(orient_elements(mesh, ""), 0u);
    EXPECT_EQ(extract_surface(mesh).nodes, before.nodes);
  }
  Mesh folded;
  folded.nodes = {
      {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.2, 0.2, 0.5}};  // the last belongs below z = 0
  folded.connectivity = {0, 1, 2, 3, 0, 2, 1, 4};
  EXPECT_EQ(orient_elements(folded, ""), 1u);
  EXPECT_TRUE(contains(error_of([&] { extract_surface(folded); }).what(), "two elements overlap"));
}

TEST(MeshCheck, BadElementsAreNamedWithTheirPlace) {
  const struct {
    void (*spoil)(Mesh&);
    std::vector<const char*> says;
  } cases[] = {
      {[](Mesh& m) { m.connectivity.clear(); }, {"no elements"}},
      {[](Mesh& m) { m.connectivity[5 * 4 + 2] = 45; }, {"element 5", "node 45", "0 to 44"}},
      {[](Mesh& m) { m.connectivity[5 * 4 + 2] = -1; }, {"element 5", "node -1"}},
      {[](Mesh& m) { m.nodes[3].y() = std::numeric_limits<double>::quiet_NaN(); }, {"node 3", "finite"}},
      {[](Mesh& m) { m.nodes[3].y() = std::numeric_limits<double>::infinity(); }, {"node 3", "finite"}},
      {[](Mesh& m) { m.connectivity[7 * 4 + 1] = m.connectivity[7 * 4]; },
       {"element 7", "zero volume", "("}}};
  for (const auto& bad : cases) {
    Mesh mesh = block(ElementType::tet4);
    bad.spoil(mesh);
    const Error error = error_of([&] { orient_elements(mesh, "body.msh"); });
    for (const char* part : bad.says)
      EXPECT_TRUE(contains(error.what(), part)) << error.what() << " / " << part;
    EXPECT_EQ(error.where(), "body.msh");
    EXPECT_FALSE(error.hint().empty());
  }
}

TEST(MeshCheck, FlatElementIsFoundAtAnySize) {
  for (const double size : {1e-6, 1.0, 1e6}) {
    Mesh mesh;
    mesh.nodes = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {0.3 * size, 0.3 * size, 0}};
    mesh.connectivity = {0, 1, 2, 3};
    EXPECT_TRUE(contains(error_of([&] { orient_elements(mesh, ""); }).what(), "zero volume"));
    mesh.nodes[3].z() = 1e-3 * size;
    EXPECT_EQ(orient_elements(mesh, ""), 0u);
    Mesh plane;
    plane.element = ElementType::tri3;
    plane.nodes = {{0, 0, 0}, {size, 0, 0}, {0.4 * size, 0, 0}};
    plane.connectivity = {0, 1, 2};
    EXPECT_TRUE(contains(error_of([&] { orient_elements(plane, ""); }).what(), "zero area"));
    plane.nodes[2].y() = 1e-3 * size;
    EXPECT_EQ(orient_elements(plane, ""), 0u);
  }
}

/// Their volume is positive, but the map is not one to one.
TEST(MeshCheck, FoldedElementsAreRefused) {
  Mesh quad = generate(RectangleShape{});
  quad.nodes[3] = Vec3(0.4, 0.4, 0);  // a dart: its corner turns inwards
  EXPECT_TRUE(
      contains(error_of([&] { orient_elements(quad, "a.msh"); }).what(), "element 0 near (0.35, 0.35)"));
  quad.nodes[3] = Vec3(0.5, 0.5, 0);  // a triangle
  EXPECT_TRUE(contains(error_of([&] { orient_elements(quad, ""); }).what(), "folded or flat"));
  quad.nodes[3] = Vec3(0.6, 0.6, 0);
  EXPECT_EQ(orient_elements(quad, ""), 0u);

  Mesh hex = generate(BoxShape{}, ElementType::hex8);
  hex.nodes[7] = Vec3(0.2, 0.2, 0.2);
  EXPECT_TRUE(contains(error_of([&] { orient_elements(hex, ""); }).what(), "folded"));
  hex.nodes[7] = Vec3(0.8, 0.8, 0.8);
  EXPECT_EQ(orient_elements(hex, ""), 0u);

  Mesh tet;
  tet.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  tet.connectivity = {0, 1, 2, 3};
  tet = with_elements(tet, ElementType::tet10, "");
  tet.nodes[4].x() = 0.8;  // beyond three quarters of the edge the corner folds
  const Error error = error_of([&] { orient_elements(tet, ""); });
  EXPECT_TRUE(contains(error.what(), "folded")) << error.what();
  EXPECT_TRUE(contains(error.hint(), "middles")) << error.hint();
  tet.nodes[4].x() = 0.6;
  EXPECT_EQ(orient_elements(tet, ""), 0u);
}

TEST(MeshCheck, UnusedNodesGoAndTheRestKeepsItsOrder) {
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    Mesh mesh = block(type);
    const Mesh before = mesh;
    mesh.nodes.insert(mesh.nodes.begin(), {9, 9, 9});
    mesh.nodes.emplace_back(8, 8, 8);
    for (Index& node : mesh.connectivity) ++node;
    const auto width = static_cast<std::size_t>(traits(traits(type).facet).nodes);
    for (std::size_t i = 0; i < 2 * width; ++i) {  // the second is on an unused node
      mesh.tagged_facets.push_back(static_cast<Index>(i < width ? i + 1 : i - width));
    }
    mesh.facet_tags = {4, 5};
    EXPECT_EQ(remove_unused_nodes(mesh), 2u);
    EXPECT_EQ(mesh.nodes, before.nodes);
    EXPECT_EQ(mesh.connectivity, before.connectivity);
    EXPECT_EQ(mesh.facet_tags, std::vector<Index>{4});
    std::vector<Index> kept(width);
    std::iota(kept.begin(), kept.end(), 0);
    EXPECT_EQ(mesh.tagged_facets, kept);
  }
}

TEST(MeshCheck, DisconnectedPartsAreCounted) {
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    Mesh mesh = block(type);
    const Index elements = mesh.elements(), shift = static_cast<Index>(mesh.nodes.size());
    for (Index i = 0; i < shift; ++i) mesh.nodes.emplace_back(test::node_of(mesh, i) + Vec3(1, 1, 0));
    const std::vector<Index> first = mesh.connectivity;
    for (const Index node : first) mesh.connectivity.push_back(node + shift);
    const Error error = error_of([&] { check_connected(mesh, "body.msh"); });
    for (const std::string& part :
         {std::string("2 disconnected parts"), std::to_string(elements) + " elements at (0.",
          std::to_string(elements) + " elements at (1."}) {
      EXPECT_TRUE(contains(error.what(), part)) << error.what();
    }
    EXPECT_EQ(error.where(), "body.msh");
  }
}

TEST(MeshCheck, PartsThatTouchOnlyInANodeAreNotConnected) {
  Mesh mesh;
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  mesh.connectivity = {0, 1, 2, 3, 0, 4, 5, 6};
  EXPECT_TRUE(contains(error_of([&] { check_connected(mesh, ""); }).what(), "2 disconnected parts"));
  mesh.element = ElementType::tri3;
  mesh.connectivity = {0, 1, 2, 0, 4, 5};
  EXPECT_TRUE(contains(error_of([&] { check_connected(mesh, ""); }).what(), "2 disconnected parts"));
}

TEST(HeldMesh, AMotionThatIsLeftIsNamed) {
  const Mesh solid = block(ElementType::tet4);  // 5 x 3 x 3 nodes, 0.1 m apart, x fastest
  const Mesh plane = block(ElementType::quad4);
  const struct {
    const Mesh& mesh;
    Held held;
    std::vector<const char*> says;
  } cases[] = {
      {solid, {}, {"nothing is fixed"}},
      {solid, held_everywhere(solid, every_axis), {"every node is fixed"}},
      {solid, {{2, every_axis}}, {"3 rigid motions", "about the point (0.2, 0, 0)", "every direction"}},
      {solid,
       {{0, every_axis}, {4, every_axis}},
       {"a rigid motion", "turn about the axis", "along (1, 0, 0)"}},
      {solid,
       {{0, every_axis}, {2, every_axis}, {7, y_axis}, {4, every_axis}},
       {"a rigid motion", "through (0.", "0, 0) m along (1, 0, 0)"}},
      {solid, held_everywhere(solid, x_axis), {"3 rigid motions", "slide along y and z"}},
      {solid, held_everywhere(solid, x_axis | y_axis), {"a rigid motion", "slide along z"}},
      {solid, {{0, x_axis | z_axis}, {4, z_axis}, {40, x_axis}}, {"slide along y"}},
      // A hinge along z at x = 0.4, y = 0.1.
      {solid,
       {{9, x_axis | y_axis}, {39, every_axis}},
       {"a rigid motion", "turn about the axis through (0.4, 0.1,", "along (0, 0, 1)"}},
      // The edge x = y = 0 is held against all but its own turning.
      {solid,
       {{0, every_axis}, {30, x_axis | y_axis}},
       {"a rigid motion", "through (0, 0,", "along (0, 0, 1)"}},
      {plane, held_everywhere(plane, x_axis | y_axis), {"every node is fixed"}},
      {plane, {{0, z_axis}}, {"nothing is fixed"}},
      {plane, {{7, x_axis | y_axis}}, {"a rigid motion", "turn about the point (0.2, 0.1) m"}},
      {plane, held_everywhere(plane, y_axis), {"a rigid motion", "slide along x"}},
      {plane, {{0, y_axis}}, {"2 rigid motions", "slide along x"}},
      // Rollers across x = 0.2 and across y = 0.1.
      {plane, {{2, y_axis}, {5, x_axis}}, {"a rigid motion", "turn about the point (0.2, 0.1) m"}},
  };
  for (const auto& bad : cases) {
    const Error error = error_of([&] { check_held(bad.mesh, masks(bad.mesh, bad.held), "model.toml"); });
    for (const char* part : bad.says)
      EXPECT_TRUE(contains(error.what(), part)) << error.what() << " / " << part;
    EXPECT_EQ(error.where(), "model.toml");
    EXPECT_TRUE(contains(error.hint(), "[[fixed]]")) << error.hint();
  }
}

TEST(HeldMesh, EnoughIsEnough) {
  const Mesh solid = block(ElementType::tet4), plane = block(ElementType::tri3);
  for (const Held& held : std::vector<Held>{{{0, every_axis}, {4, every_axis}, {5, every_axis}},
                                            {{0, every_axis}, {4, y_axis | z_axis}, {10, z_axis}},  // 3-2-1
                                            held_everywhere(solid, every_axis & ~z_axis)}) {
    Held all = held;
    all.emplace_back(1, z_axis);
    EXPECT_NO_THROW(check_held(solid, masks(solid, all), ""));
  }
  EXPECT_NO_THROW(check_held(plane, masks(plane, {{0, x_axis | y_axis}, {4, y_axis}}), ""));
  EXPECT_NO_THROW(check_held(plane, masks(plane, {{0, x_axis}, {5, x_axis}, {4, y_axis}}), ""));
}

TEST(HeldMesh, DoesNotDependOnSizeOrPlace) {
  for (const double size : {1e-4, 1.0, 1e4}) {
    Mesh mesh = block(ElementType::tet4);
    for (Vec3& x : mesh.nodes) x = size * (x + Vec3(30, -20, 10));
    const Held enough = {{0, every_axis}, {1, every_axis}, {5, every_axis}},
               on_a_line = {{0, every_axis}, {1, every_axis}, {2, every_axis}};
    EXPECT_NO_THROW(check_held(mesh, masks(mesh, enough), ""));
    EXPECT_TRUE(
        contains(error_of([&] { check_held(mesh, masks(mesh, on_a_line), ""); }).what(), "turn about"));
  }
}

/// A rotation about the axis that the message names moves no held dof. Returns whether it names one.
bool named_axis_is_right(const Mesh& mesh, const std::vector<std::uint8_t>& fixed,
                         const std::string& message) {
  const std::size_t place = message.find("turn about the axis through");
  if (place == std::string::npos) return false;
  Vec3 p, w;
  EXPECT_EQ(std::sscanf(message.c_str() + place,  // NOLINT(cert-err34-c): the count tells
                        "turn about the axis through (%lf, %lf, %lf) m along (%lf, %lf, %lf)", &p.x(), &p.y(),
                        &p.z(), &w.x(), &w.y(), &w.z()),
            6);
  for (std::size_t node = 0; node < fixed.size(); ++node) {
    const Vec3 moves = w.cross(mesh.nodes[node] - p);
    for (int axis = 0; axis < 3; ++axis) {
      const double held_moves = (fixed[node] >> axis & 1) != 0 ? moves[axis] : 0.0;
      EXPECT_NEAR(held_moves, 0.0, 3e-3) << message;  // the message has four digits
    }
  }
  return true;
}

/// The stiffness of the free dofs is singular exactly where a rigid motion is left.
void compare_with_stiffness(const Mesh& mesh, Analysis analysis) {
  const int d = mesh.dimension();
  const auto dofs = static_cast<Eigen::Index>(d * static_cast<int>(mesh.nodes.size()));
  const ElasticityMatrix D = elasticity_matrix(Material{1.0, 0.3, 1.0}, analysis);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(dofs, dofs);
  for (Index e = 0; e < mesh.elements(); ++e) {
    const auto nodes = mesh.element_nodes(e);
    std::vector<Eigen::Index> place;
    for (const Index node : nodes) {
      for (int axis = 0; axis < d; ++axis) place.push_back(d * node + axis);
    }
    K(place, place) += element_stiffness(mesh.element, element_nodes(mesh, e), D, 1.0);
  }
  std::mt19937 random(7);
  int held_fully = 0, left = 0, axes = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::uint8_t> fixed(mesh.nodes.size(), 0);
    const int bits = 1 + static_cast<int>(random() % (d == 2 ? 4 : 9));
    for (int i = 0; i < bits; ++i) {
      fixed[random() % fixed.size()] |= static_cast<std::uint8_t>(1u << random() % static_cast<unsigned>(d));
    }
    std::vector<Eigen::Index> free;
    for (Eigen::Index dof = 0; dof < dofs; ++dof) {
      if ((fixed[static_cast<std::size_t>(dof / d)] >> dof % d & 1) == 0) free.push_back(dof);
    }
    const Eigen::VectorXd values = test::eigenvalues_of(K(free, free));
    const auto zeros = (values.array() < 1e-10 * values.maxCoeff()).count();
    if (zeros == 0) {
      ++held_fully;
      EXPECT_NO_THROW(check_held(mesh, fixed, ""));
    } else {
      ++left;
      const Error error = error_of([&] { check_held(mesh, fixed, ""); });
      const std::string count =
          zeros == 1 ? "a rigid motion is" : std::to_string(zeros) + " rigid motions are";
      EXPECT_TRUE(contains(error.what(), count)) << error.what() << ", but there are " << zeros;
      if (named_axis_is_right(mesh, fixed, error.what())) ++axes;
    }
  }
  EXPECT_GT(held_fully, 20);
  EXPECT_GT(left, 20);
  EXPECT_TRUE(d == 2 || axes > 20) << axes;
}

TEST(HeldMesh, AgreesWithTheStiffness) {
  compare_with_stiffness(generate(BoxShape{Vec3(1, 2, 3), Vec3(1, 0.7, 0.5), {2, 1, 1}}), Analysis::solid);
  compare_with_stiffness(generate(RectangleShape{Vec3(1, 2, 0), Vec3(1, 0.7, 0), {2, 2}}),
                         Analysis::plane_stress);
}

TEST(MeshCheck, ScaleWarning) {
  const auto warning = [](double size, double scale = 1.0) {
    return scale_warning(generate(BoxShape{Vec3::Zero(), Vec3::Constant(size), {1, 1, 1}}), scale);
  };
  EXPECT_TRUE(warning(0.2).empty());
  EXPECT_TRUE(warning(10.0).empty());
  EXPECT_TRUE(warning(1e-3).empty());
  EXPECT_TRUE(contains(warning(200.0), "is 200 m long"));
  EXPECT_TRUE(contains(warning(200.0), "scale = 0.001 under [geometry] (now 1), which makes it 0.2 m"));
  EXPECT_TRUE(contains(warning(20.0, 0.01), "scale = 1e-05"));
  EXPECT_TRUE(contains(warning(2e-4, 0.001), "is 0.0002 m long"));
  EXPECT_TRUE(contains(warning(2e-4, 0.001), "scale = 1 under [geometry] (now 0.001), which makes it 0.2 m"));
  for (const double size : {1e-5, 1e5}) {  // no scale is likely
    EXPECT_TRUE(contains(warning(size), "check scale under [geometry]"));
    EXPECT_FALSE(contains(warning(size), "write scale"));
  }
}

}  // namespace
}  // namespace palpate::check_test
