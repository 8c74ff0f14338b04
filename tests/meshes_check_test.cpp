// Checks before assembly, and selections.
#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "meshes/check.h"
#include "meshes/generate.h"
#include "meshes/selection.h"
#include "tests/meshes_files.h"

namespace palpate {
namespace {

using test::contains;
using test::error_of;

Mesh box() {
  return generate(BoxShape{Vec3::Zero(), Vec3(0.4, 0.2, 0.2), {4, 2, 2}});
}

std::vector<std::uint8_t> marks(const Mesh& mesh, const std::vector<std::size_t>& nodes) {
  std::vector<std::uint8_t> result(mesh.nodes.size(), 0);
  for (const std::size_t node : nodes) result[node] = 1;
  return result;
}

std::vector<std::size_t> marked(const std::vector<std::uint8_t>& marks) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i] != 0) result.push_back(i);
  }
  return result;
}

TEST(Check, AGoodMeshIsLeftAsItIs) {
  Mesh mesh = box();
  const Mesh before = mesh;
  EXPECT_EQ(orient_elements(mesh, ""), 0u);
  EXPECT_EQ(remove_unused_nodes(mesh), 0u);
  EXPECT_EQ(mesh.tets, before.tets);
  EXPECT_EQ(mesh.nodes, before.nodes);
  EXPECT_NO_THROW(check_connected(mesh, ""));
}

TEST(Check, AMeshOfTheOtherSignIsTurnedRound) {
  Mesh mesh = box();
  for (Tet& tet : mesh.tets) std::swap(tet[0], tet[1]);
  EXPECT_EQ(orient_elements(mesh, ""), mesh.tets.size());
  EXPECT_EQ(orient_elements(mesh, ""), 0u);
}

TEST(Check, BadElementsAreNamedWithTheirPlace) {
  const struct {
    void (*spoil)(Mesh&);
    std::vector<const char*> says;
  } cases[] = {
      {[](Mesh& m) { m.tets.clear(); }, {"no tetrahedra"}},
      {[](Mesh& m) { m.tets[5][2] = 45; }, {"element 5", "node 45", "0 to 44"}},
      {[](Mesh& m) { m.tets[5][2] = -1; }, {"element 5", "node -1"}},
      {[](Mesh& m) { m.nodes[3].y() = std::numeric_limits<double>::quiet_NaN(); }, {"node 3", "finite"}},
      {[](Mesh& m) { m.nodes[3].y() = std::numeric_limits<double>::infinity(); }, {"node 3", "finite"}},
      {[](Mesh& m) { m.tets[7][1] = m.tets[7][0]; }, {"element 7", "zero volume", "("}},
      {[](Mesh& m) { std::swap(m.tets[9][0], m.tets[9][1]); }, {"1 of 96", "inverted", "element 9", "(0.1"}}};
  for (const auto& bad : cases) {
    Mesh mesh = box();
    bad.spoil(mesh);
    const Error error = error_of([&] { orient_elements(mesh, "body.msh"); });
    for (const char* part : bad.says)
      EXPECT_TRUE(contains(error.what(), part)) << error.what() << " / " << part;
    EXPECT_EQ(error.where(), "body.msh");
    EXPECT_FALSE(error.hint().empty());
  }
}

TEST(Check, FlatElementIsFoundAtAnySize) {
  for (const double size : {1e-6, 1.0, 1e6}) {
    Mesh mesh;
    mesh.nodes = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {0.3 * size, 0.3 * size, 0}};
    mesh.tets = {{0, 1, 2, 3}};
    EXPECT_TRUE(contains(error_of([&] { orient_elements(mesh, ""); }).what(), "zero volume"));
    mesh.nodes[3].z() = 1e-3 * size;
    EXPECT_EQ(orient_elements(mesh, ""), 0u);
  }
}

TEST(Check, UnusedNodesGoAndTheRestKeepsItsOrder) {
  Mesh mesh = box();
  const Mesh before = mesh;
  mesh.nodes.insert(mesh.nodes.begin(), {9, 9, 9});
  mesh.nodes.emplace_back(8, 8, 8);
  for (Tet& tet : mesh.tets) {
    for (Index& node : tet) ++node;
  }
  mesh.tagged_boundary = {{{1, 2, 6}, 4}, {{0, 1, 2}, 4}};  // the second is on an unused node
  EXPECT_EQ(remove_unused_nodes(mesh), 2u);
  EXPECT_EQ(mesh.nodes, before.nodes);
  EXPECT_EQ(mesh.tets, before.tets);
  ASSERT_EQ(mesh.tagged_boundary.size(), 1u);
  EXPECT_EQ(mesh.tagged_boundary[0].nodes, (Triangle{0, 1, 5}));
}

TEST(Check, DisconnectedPartsAreCounted) {
  Mesh mesh = box();
  const Mesh other = generate(BoxShape{Vec3(1, 1, 1), Vec3::Ones(), {1, 1, 1}});
  const auto shift = static_cast<Index>(mesh.nodes.size());
  mesh.nodes.insert(mesh.nodes.end(), other.nodes.begin(), other.nodes.end());
  for (Tet tet : other.tets) {
    for (Index& node : tet) node += shift;
    mesh.tets.push_back(tet);
  }
  const Error error = error_of([&] { check_connected(mesh, "body.msh"); });
  for (const char* part : {"2 disconnected parts", "96 elements at (", "6 elements at (1."}) {
    EXPECT_TRUE(contains(error.what(), part)) << error.what();
  }
}

TEST(Check, PartsThatTouchOnlyInANodeAreNotConnected) {
  Mesh mesh;
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  mesh.tets = {{0, 1, 2, 3}, {0, 4, 5, 6}};
  EXPECT_TRUE(contains(error_of([&] { check_connected(mesh, ""); }).what(), "2 disconnected parts"));
}

TEST(Check, AMotionThatIsLeftIsNamed) {
  const Mesh mesh = box();  // 5 x 3 x 3 nodes
  std::vector<std::size_t> all(mesh.nodes.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const struct {
    std::vector<std::size_t> fixed;
    std::vector<const char*> says;
  } cases[] = {{{}, {"nothing is fixed"}},
               {all, {"every node is fixed"}},
               {{2}, {"rigid motion", "one point", "(0.2, 0, 0)"}},
               {{0, 4}, {"rigid motion", "line through (0.2, 0, 0)", "along"}},
               {{0, 1, 2, 3, 4}, {"rigid motion", "line through"}}};
  for (const auto& bad : cases) {
    const Error error = error_of([&] { check_held(mesh, marks(mesh, bad.fixed), "model.toml"); });
    for (const char* part : bad.says) EXPECT_TRUE(contains(error.what(), part)) << error.what();
    EXPECT_TRUE(contains(error.hint(), "fixed")) << error.hint();
  }
  EXPECT_NO_THROW(check_held(mesh, marks(mesh, {0, 4, 5}), ""));
}

TEST(Check, HeldDoesNotDependOnSizeOrPlace) {
  for (const double size : {1e-4, 1.0, 1e4}) {
    Mesh mesh = box();
    for (Vec3& x : mesh.nodes) x = size * (x + Vec3(30, -20, 10));
    EXPECT_NO_THROW(check_held(mesh, marks(mesh, {0, 1, 5}), ""));
    EXPECT_TRUE(contains(error_of([&] {
                           check_held(mesh, marks(mesh, {0, 1, 2}), "");
                         }).what(),
                         "rigid motion"));
  }
}

TEST(Check, ScaleWarning) {
  const auto warning = [](double size) {
    return scale_warning(generate(BoxShape{Vec3::Zero(), Vec3::Constant(size), {1, 1, 1}}));
  };
  EXPECT_TRUE(warning(0.2).empty());
  EXPECT_TRUE(warning(10.0).empty());
  EXPECT_TRUE(warning(1e-3).empty());
  EXPECT_TRUE(contains(warning(200.0), "200"));
  EXPECT_TRUE(contains(warning(2e-4), "0.0002"));
}

TEST(Select, EachKind) {
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

TEST(Select, ByTag) {
  Mesh mesh = box();
  mesh.tagged_boundary = {{{0, 1, 6}, 3}, {{6, 7, 1}, 3}, {{2, 3, 8}, 11}};
  EXPECT_EQ(marked(select_nodes(mesh, SelectTag{3}, "")), (std::vector<std::size_t>{0, 1, 6, 7}));
  const Error unknown = error_of([&] { select_nodes(mesh, SelectTag{4}, "model.toml:9"); });
  EXPECT_TRUE(contains(unknown.what(), "tag 4"));
  EXPECT_TRUE(contains(unknown.hint(), "3, 11")) << unknown.hint();
  EXPECT_EQ(unknown.where(), "model.toml:9");
  mesh.tagged_boundary.clear();
  EXPECT_TRUE(contains(error_of([&] { select_nodes(mesh, SelectTag{4}, ""); }).hint(), "no tagged"));
}

TEST(Select, EmptySelectionsAndUnknownNodesAreRefused) {
  const Mesh mesh = box();
  const Error empty = error_of([&] { select_nodes(mesh, SelectSphere{Vec3(5, 5, 5), 0.1}, "fixed 2"); });
  EXPECT_TRUE(contains(empty.what(), "no node"));
  EXPECT_EQ(empty.where(), "fixed 2");
  EXPECT_TRUE(contains(empty.hint(), "(0.4, 0.2, 0.2)")) << empty.hint();
  EXPECT_TRUE(contains(error_of([&] { select_nodes(mesh, SelectNodes{}, ""); }).what(), "no node"));
  for (const Index node : {-1, 45}) {
    const Error error = error_of([&] { select_nodes(mesh, SelectNodes{{0, node}}, ""); });
    EXPECT_TRUE(contains(error.what(), "0 to 44")) << error.what();
  }
}

}  // namespace
}  // namespace palpate
