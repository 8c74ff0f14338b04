// Selections of nodes and elements.
#include <gtest/gtest.h>

#include "meshes/edge_middles.h"
#include "meshes/element.h"
#include "meshes/selection.h"
#include "tests/support/bodies/meshes_bodies.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::select_test {
namespace {

using test::block;
using test::contains;
using test::error_of;

std::vector<std::size_t> marked(const std::vector<std::uint8_t>& marks) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i] != 0) result.push_back(i);
  }
  return result;
}

TEST(Select, EachKindOfSelection) {
  const Mesh mesh =
      generate(BoxShape{Vec3::Zero(), Vec3::Constant(0.3), {3, 3, 3}});  // 0.1 apart: not exact in binary
  const auto where = [&](auto inside) {
    std::vector<std::size_t> nodes;
    for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
      const Vec3 grid = (10.0 * mesh.nodes[node]).array().round();
      if (inside(grid)) nodes.push_back(node);
    }
    return nodes;
  };
  const auto select = [&](const Selection& selection) { return marked(select_nodes(mesh, selection, "")); };
  EXPECT_EQ(select(SelectBox{Vec3(0.1, 0.1, 0.0), Vec3(0.2, 0.3, 0.1)}),
            where([](const Vec3& g) { return g.x() >= 1 && g.x() <= 2 && g.y() >= 1 && g.z() <= 1; }));
  EXPECT_EQ(select(SelectHalfSpace{Vec3(0, 0.2, 0), Vec3(0, 5, 0)}),
            where([](const Vec3& g) { return g.y() >= 2; }));
  EXPECT_EQ(select(SelectSphere{Vec3::Zero(), 0.1}), where([](const Vec3& g) { return g.norm() <= 1; }));
  EXPECT_EQ(select(SelectNodes{{7, 3, 7}}), (std::vector<std::size_t>{3, 7}));
  EXPECT_EQ(select(SelectLowest{2, 1.0 / 3.0}), where([](const Vec3& g) { return g.z() <= 1; }));
  EXPECT_EQ(select(SelectLowest{0, 0.0}), where([](const Vec3& g) { return g.x() == 0; }));
}

TEST(Select, MiddlesOfEdgesBetweenListedNodes) {
  const Mesh corners = block(ElementType::tet4), mesh = with_elements(corners, ElementType::tet10, "");
  const auto on_face = [](const Vec3& x) { return x.z() < 1e-9; };
  SelectNodes listed;
  std::vector<std::size_t> face;  // of all nodes, middles too
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!on_face(mesh.nodes[node])) continue;
    face.push_back(node);
    if (node < corners.nodes.size()) listed.nodes.push_back(static_cast<Index>(node));
  }
  EXPECT_EQ(marked(select_nodes(mesh, listed, "")), face);
  EXPECT_EQ(middles_between(mesh, listed.nodes).size(), face.size() - listed.nodes.size());
  EXPECT_EQ(marked(select_nodes(corners, listed, "")).size(), listed.nodes.size());
  EXPECT_TRUE(middles_between(mesh, std::vector<Index>(face.begin(), face.end())).empty());
  EXPECT_EQ(marked(select_nodes(mesh, SelectNodes{{listed.nodes[0]}}, "")).size(), 1U);
}

TEST(Select, NodesByTagOfAnyKindOfFacet) {
  Mesh mesh = block(ElementType::tet4);
  mesh.tagged_facets = {0, 1, 6, 6, 7, 1, 2, 3, 8};
  mesh.facet_tags = {3, 3, 11};
  EXPECT_EQ(marked(select_nodes(mesh, SelectTag{3}, "")), (std::vector<std::size_t>{0, 1, 6, 7}));
  const Error unknown = error_of([&] { select_nodes(mesh, SelectTag{4}, "model.toml:9"); });
  EXPECT_TRUE(contains(unknown.what(), "tag 4"));
  EXPECT_TRUE(contains(unknown.hint(), "3, 11")) << unknown.hint();
  EXPECT_EQ(unknown.where(), "model.toml:9");
  mesh.tagged_facets.clear();
  mesh.facet_tags.clear();
  EXPECT_TRUE(contains(error_of([&] { select_nodes(mesh, SelectTag{4}, ""); }).hint(), "no tagged"));

  Mesh plane = block(ElementType::quad4);
  plane.tagged_facets = {3, 4, 4, 9};
  plane.facet_tags = {1, 2};
  EXPECT_EQ(marked(select_nodes(plane, SelectTag{2}, "")), (std::vector<std::size_t>{4, 9}));
}

/// Independent of the kind: the elements on one side of a plane between cells fill half the block.
TEST(Select, ElementsByTheirCentres) {
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    const Mesh mesh = block(type);
    const double volume = test::block_volume(type);
    const auto selected_volume = [&](const Selection& selection) {
      const std::vector<std::uint8_t> marks = select_elements(mesh, selection, "");
      EXPECT_EQ(marks.size(), static_cast<std::size_t>(mesh.elements()));
      double sum = 0.0;
      for (const std::size_t e : marked(marks)) {
        sum += element_volume(type, element_nodes(mesh, static_cast<Index>(e)));
      }
      return sum;
    };
    EXPECT_NEAR(selected_volume(SelectHalfSpace{Vec3(0.1, 0, 0), Vec3(1, 0, 0)}), 0.75 * volume, 1e-15);
    EXPECT_NEAR(selected_volume(SelectBox{Vec3(0, 0.1, -1), Vec3(0.3, 1, 1)}), 0.375 * volume, 1e-15);
    EXPECT_NEAR(selected_volume(SelectLowest{0, 0.5}), 0.5 * volume, 1e-15);
    EXPECT_NEAR(selected_volume(SelectSphere{Vec3(0, 0.1, 0.1), 10.0}), volume, 1e-15);
  }
}

TEST(Select, ElementsOutsideASphereStay) {
  const Mesh mesh = block(ElementType::hex8);  // centres 0.05, 0.15, ...
  EXPECT_EQ(marked(select_elements(mesh, SelectSphere{Vec3(0.05, 0.05, 0.05), 0.1}, "")),
            (std::vector<std::size_t>{0, 1, 4, 8}));
}

TEST(Select, NodesAndTagsDoNotSelectElements) {
  const Mesh mesh = block(ElementType::tet10);
  for (const Selection& selection : {Selection(SelectNodes{{0}}), Selection(SelectTag{1})}) {
    const Error error = error_of([&] { select_elements(mesh, selection, "material 2"); });
    EXPECT_TRUE(contains(error.what(), "cannot select elements")) << error.what();
    EXPECT_EQ(error.where(), "material 2");
    EXPECT_TRUE(contains(error.hint(), "half_space")) << error.hint();
  }
}

TEST(Select, EmptySelectionsAndUnknownNodesAreRefused) {
  const Mesh mesh = block(ElementType::tet4);
  const Selection far = SelectSphere{Vec3(5, 5, 5), 0.1}, between = SelectSphere{Vec3(0.1, 0.1, 0.1), 1e-3};
  const Error empty = error_of([&] { select_nodes(mesh, far, "fixed 2"); });
  EXPECT_TRUE(contains(empty.what(), "no node"));
  EXPECT_EQ(empty.where(), "fixed 2");
  EXPECT_TRUE(contains(empty.hint(), "(0.4, 0.2, 0.2)")) << empty.hint();
  EXPECT_TRUE(contains(error_of([&] { select_nodes(mesh, SelectNodes{}, ""); }).what(), "no node"));
  EXPECT_NO_THROW(select_nodes(mesh, between, ""));
  EXPECT_TRUE(contains(error_of([&] { select_elements(mesh, between, ""); }).what(), "no element"));
  for (const Index node : {-1, 45}) {
    const Error error = error_of([&] { select_nodes(mesh, SelectNodes{{0, node}}, ""); });
    EXPECT_TRUE(contains(error.what(), "0 to 44")) << error.what();
  }
}

}  // namespace
}  // namespace palpate::select_test
