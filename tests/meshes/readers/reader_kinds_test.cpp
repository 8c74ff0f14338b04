// Readers of volume meshes: elements of every kind, and files of which the body cannot be told.
#include <gtest/gtest.h>

#include "meshes/check.h"
#include "meshes/element.h"
#include "meshes/readers/volume_mesh.h"
#include "meshes/surface.h"
#include "tests/support/bodies/meshes_bodies.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::reader_kinds_test {
namespace {

using test::contains;
using test::error_of;
using test::node_of;

Mesh read(const std::string& name, const std::string& text) {
  const test::ScratchFolder folder;
  return read_volume_mesh(folder.write(name, text));
}

std::string gmsh(const std::string& nodes, const std::string& elements) {
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + nodes + "$EndNodes\n$Elements\n" + elements +
         "$EndElements\n";
}

// A tetrahedron with corners 1 to 4 and, in Gmsh's order, the middles of 01 12 20 30 23 13.
const std::string tet10_nodes =
    "10\n1 0 0 0\n2 2 0 0\n3 0 2 0\n4 0 0 2\n5 1 0 0\n6 1 1 0\n7 0 1 0\n8 0 0 1\n9 0 1 1\n10 1 0 1\n";
const std::string tet10_element = "3 11 2 7 1 1 2 3 4 5 6 7 8 9 10\n";

/// Every middle lies where its place in VTK's order says, and the body is sound.
void expect_second_order(Mesh mesh, Index elements) {
  ASSERT_EQ(mesh.element, ElementType::tet10);
  ASSERT_EQ(mesh.elements(), elements);
  const int edges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
  for (Index e = 0; e < elements; ++e) {
    const ElementNodes x = element_nodes(mesh, e);
    for (int i = 0; i < 6; ++i) {
      EXPECT_EQ(x.row(4 + i), (x.row(edges[i][0]) + x.row(edges[i][1])) / 2)
          << "element " << e << " edge " << i;
    }
  }
  for (Index t = 0; t < static_cast<Index>(mesh.facet_tags.size()); ++t) {
    const auto facet = mesh.tagged_facet(t);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(node_of(mesh, facet[3 + i]),
                Vec3((node_of(mesh, facet[i]) + node_of(mesh, facet[(i + 1) % 3])) / 2));
    }
  }
  orient_elements(mesh, "");
}

TEST(SecondOrder, GmshsOrderOfTheMiddles) {
  const std::string line = "1 8 2 3 1 1 2 5\n", facet = "2 9 2 5 1 1 3 2 7 6 5\n";
  const Mesh mesh = read("a.msh", gmsh(tet10_nodes, "3\n" + line + facet + tet10_element));
  expect_second_order(mesh, 1);
  EXPECT_EQ(mesh.regions, std::vector<Index>{7});
  EXPECT_EQ(mesh.facet_tags, std::vector<Index>{5});
  EXPECT_EQ(mesh.tagged_facets, (std::vector<Index>{0, 2, 1, 6, 5, 4}));
}

TEST(SecondOrder, GmshsNewerFormat) {
  const std::string text =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 1\n1 0 0 0 2 2 0 1 5 0\n1 0 0 0 2 2 2 1 7 0\n"
      "$EndEntities\n$Nodes\n1 10 1 10\n3 1 0 10\n1\n2\n3\n4\n5\n6\n7\n8\n9\n10\n"
      "0 0 0\n2 0 0\n0 2 0\n0 0 2\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n0 1 1\n1 0 1\n$EndNodes\n"
      "$Elements\n2 2 1 2\n2 1 9 1\n1 1 3 2 7 6 5\n3 1 11 1\n2 1 2 3 4 5 6 7 8 9 10\n$EndElements\n";
  const Mesh mesh = read("a.msh", text);
  expect_second_order(mesh, 1);
  EXPECT_EQ(mesh.regions, std::vector<Index>{7});
  EXPECT_EQ(mesh.tagged_facets, (std::vector<Index>{0, 2, 1, 6, 5, 4}));
}

TEST(SecondOrder, FacetsGivenByTheirCornersFindTheirMiddles) {
  const Mesh mesh = read("a.msh", gmsh(tet10_nodes, "2\n1 2 2 5 1 4 1 2\n" + tet10_element));
  expect_second_order(mesh, 1);
  ASSERT_EQ(mesh.facet_tags, std::vector<Index>{5});
  std::vector<Index> nodes = mesh.tagged_facets;
  std::sort(nodes.begin(), nodes.end());
  EXPECT_EQ(nodes, (std::vector<Index>{0, 1, 3, 4, 7, 9}));
  const Error error =
      error_of([] { read("a.msh", gmsh(tet10_nodes, "2\n1 2 2 5 1 4 1 5\n" + tet10_element)); });
  EXPECT_TRUE(contains(error.what(), "3, 0, 4")) << error.what();
  EXPECT_TRUE(contains(error.what(), "not a side")) << error.what();
}

TEST(SecondOrder, MissingMiddlesAreNoticed) {
  const std::string short_element = "3 11 2 7 1 1 2 3 4 5 6 7 8 9\n";
  const Error error = error_of([&] { read("a.msh", gmsh(tet10_nodes, "1\n" + short_element)); });
  EXPECT_TRUE(contains(error.what(), "'$EndElements' stands where a node number")) << error.what();
  const Error vtk = error_of([] {
    read("a.vtk",
         "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
         "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n24\n");
  });
  EXPECT_TRUE(contains(vtk.what(), "cell 0 has 4 nodes, but its type is 24, which has 10")) << vtk.what();
}

/// A file whose last two middles are in another order is read; then its elements have no volume.
TEST(SecondOrder, MiddlesInTheWrongOrderAreNoticed) {
  Mesh mesh = read("a.msh", gmsh(tet10_nodes, "1\n3 11 2 7 1 1 2 3 4 5 6 7 8 10 9\n"));
  const Error error = error_of([&] { orient_elements(mesh, ""); });
  EXPECT_TRUE(contains(error.what(), "zero volume")) << error.what();
  EXPECT_TRUE(contains(error.hint(), "wrong order")) << error.hint();
}

// What TetGen 1.5.0 writes with -pYo2nnfA for two tetrahedra on a triangle (three after its edge flip).
const std::string tetgen_node = R"(15  3  0  0
   1    0  0  0
   2    1  0  0
   3    0  1  0
   4    0  0  1
   5    1  1  1
   6    0.5  0.5  1
   7    0.5  0.5  0.5
   8    0  0.5  0
   9    0  0.5  0.5
  10    0.5  1  0.5
  11    0  0  0.5
  12    1  0.5  0.5
  13    0.5  0  0
  14    0.5  0.5  0
  15    0.5  0  0.5
# Generated by pYo2nnfA
)";
const std::string tetgen_ele = R"(3  10  1
    1       1     3     4     5      6     7     8     9    10    11    1
    2       1     3     5     2     12    13     8    10    14     7    1
    3       4     1     5     2     12    15    11     7    13     6    1
# Generated by pYo2nnfA
)";
const std::string tetgen_face = R"(9  1
    1      5     4     3     9    10     6  9        1     -1
    2      5     1     4    11     6     7  0        1      3
    3      3     1     5     7    10     8  0        1      2
    4      3     4     1    11     8     9  7        1     -1
    5      2     5     3    10    14    12  8        2     -1
    6      2     1     5     7    12    13  0        2      3
    7      3     1     2    13    14     8  5        2     -1
    8      2     4     5     6    12    15  10        3     -1
    9      1     4     2    15    13    11  6        3     -1
# Generated by pYo2nnfA
)";

TEST(SecondOrder, TetgensOrderOfTheMiddles) {
  const test::ScratchFolder folder;
  const auto node = folder.write("two.node", tetgen_node);
  (void)folder.write("two.ele", tetgen_ele);
  (void)folder.write("two.face", tetgen_face);
  Mesh mesh = read_volume_mesh(node);
  expect_second_order(mesh, 3);
  EXPECT_EQ(mesh.regions, (std::vector<Index>{1, 1, 1}));
  EXPECT_EQ(mesh.facet_tags, (std::vector<Index>{9, 7, 8, 5, 10, 6}));
  orient_elements(mesh, "");
  EXPECT_EQ(extract_surface(mesh).count(), 6);
  // Without the two elements beside each face (no -nn), and faces that list corners alone, with and without.
  for (const char* text : {"1 1\n1 3 4 1 11 8 9 7\n", "1 1\n1 3 4 1 7\n", "1 1\n1 3 4 1 7 1 -1\n"}) {
    (void)folder.write("two.face", text);
    const Mesh with_corners = read_volume_mesh(node);
    expect_second_order(with_corners, 3);
    EXPECT_EQ(with_corners.facet_tags, std::vector<Index>{7});
  }
}

const std::string cube_nodes = "8\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n";

void expect_cube(Mesh mesh, bool has_tags) {
  EXPECT_EQ(mesh.element, ElementType::hex8);
  EXPECT_EQ(mesh.connectivity, (std::vector<Index>{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(orient_elements(mesh, ""), 0u);
  if (!has_tags) return;
  EXPECT_EQ(mesh.regions, std::vector<Index>{7});
  EXPECT_EQ(mesh.tagged_facets, (std::vector<Index>{3, 2, 1, 0}));
  EXPECT_EQ(mesh.facet_tags, std::vector<Index>{5});
}

TEST(Hexahedra, InGmshMeditAndVtk) {
  expect_cube(
      read("a.msh", gmsh(cube_nodes, "3\n1 3 2 5 1 4 3 2 1\n2 3 2 0 1 5 6 7 8\n3 5 2 7 1 1 2 3 4 5 6 7 8\n")),
      true);
  expect_cube(read("a.mesh",
                   "MeshVersionFormatted 2\nDimension 3\nVertices 8\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n"
                   "0 0 1 0\n1 0 1 0\n1 1 1 0\n0 1 1 0\nQuadrilaterals 2\n4 3 2 1 5\n5 6 7 8 0\n"
                   "Hexahedra 1\n1 2 3 4 5 6 7 8 7\nEnd\n"),
              true);
  expect_cube(read("a.vtk",
                   "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n"
                   "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1\nCELLS 2 14\n4 0 1 2 3\n"
                   "8 0 1 2 3 4 5 6 7\nCELL_TYPES 2\n9\n12\n"),
              false);
}

TEST(Hexahedra, TaggedTrianglesAreNotTheirSides) {
  const Error error =
      error_of([] { read("a.msh", gmsh(cube_nodes, "2\n1 2 2 5 1 1 2 3\n2 5 2 7 1 1 2 3 4 5 6 7 8\n")); });
  EXPECT_TRUE(contains(error.what(), "1 tri3 facets")) << error.what();
  EXPECT_TRUE(contains(error.what(), "hex8 elements are quad4")) << error.what();
}

/// `z` of four nodes.
std::string square_nodes(const std::string& z, const std::string& last_z) {
  return "5\n1 0 0 " + z + "\n2 1 0 " + z + "\n3 1 1 " + z + "\n4 0 1 " + last_z + "\n5 0 0 9\n";
}

const std::string two_triangles = "4\n1 1 2 5 1 1 2\n2 1 2 0 1 2 3\n3 2 2 7 1 1 2 3\n4 2 2 8 1 1 3 4\n";

TEST(Plane, TrianglesWithTaggedLinesMoveToZero) {
  for (const char* z : {"0", "3.25"}) {
    const Mesh mesh = read("a.msh", gmsh(square_nodes(z, z), two_triangles));
    EXPECT_EQ(mesh.element, ElementType::tri3);
    EXPECT_EQ(mesh.connectivity, (std::vector<Index>{0, 1, 2, 0, 2, 3}));
    EXPECT_EQ(mesh.regions, (std::vector<Index>{7, 8}));
    EXPECT_EQ(mesh.tagged_facets, (std::vector<Index>{0, 1}));
    EXPECT_EQ(mesh.facet_tags, std::vector<Index>{5});
    for (const Vec3& x : mesh.nodes) EXPECT_EQ(x.z(), 0.0);
  }
}

TEST(Plane, QuadrilateralsInEveryFormat) {
  const auto expect_square = [](const Mesh& mesh, bool has_tags) {
    EXPECT_EQ(mesh.element, ElementType::quad4);
    EXPECT_EQ(mesh.connectivity, (std::vector<Index>{0, 1, 2, 3}));
    EXPECT_EQ(mesh.nodes[2], Vec3(1, 1, 0));
    EXPECT_EQ(mesh.regions, std::vector<Index>{has_tags ? 7 : 0});
    EXPECT_EQ(mesh.tagged_facets, has_tags ? (std::vector<Index>{2, 3}) : std::vector<Index>{});
  };
  const std::string points = "0 0 2 1 0 2 1 1 2 0 1 2\n";
  expect_square(read("a.msh", gmsh(square_nodes("2", "2"), "2\n1 1 2 5 1 3 4\n2 3 2 7 1 1 2 3 4\n")), true);
  const std::string sections = "Edges 2\n3 4 5\n1 2 0\nQuadrilaterals 1\n1 2 3 4 7\nEnd\n";
  expect_square(
      read("a.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices 4\n0 0 2 0\n1 0 2 0\n1 1 2 0\n0 1 2 0\n" +
                         sections),
      true);
  expect_square(
      read("a.mesh",
           "MeshVersionFormatted 2\nDimension 2\nVertices 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + sections),
      true);
  expect_square(
      read("a.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n" +
                        points + "CELLS 2 8\n4 0 1 2 3\n2 0 1\nCELL_TYPES 2\n9\n3\n"),
      false);
}

TEST(Plane, ASurfaceIsNotABody) {
  const Error error = error_of([] { read("a.msh", gmsh(square_nodes("0", "0.5"), two_triangles)); });
  EXPECT_TRUE(contains(error.what(), "surface of 2 tri3 (z from 0 to 0.5)")) << error.what();
  EXPECT_TRUE(contains(error.hint(), "surface =")) << error.hint();
  EXPECT_TRUE(contains(error.hint(), "STL")) << error.hint();
}

TEST(Plane, MixedKindsAreCounted) {
  const Error error = error_of([] {
    read("a.msh", gmsh(square_nodes("0", "0"),
                       "3\n1 2 2 0 1 1 2 3\n2 2 2 0 1 1 3 4\n"
                       "3 3 2 0 1 1 2 3 4\n"));
  });
  EXPECT_TRUE(contains(error.what(), "plane elements of more than one kind: 2 tri3 and 1 quad4"))
      << error.what();
  EXPECT_TRUE(contains(error.hint(), "one of these kinds")) << error.hint();
}

TEST(Plane, SecondOrderTrianglesAreRefused) {
  const Error error = error_of([] { read("a.msh", gmsh(tet10_nodes, "1\n1 9 2 0 1 1 2 3 5 6 7\n")); });
  EXPECT_TRUE(contains(error.what(), "1 tri6")) << error.what();
  EXPECT_TRUE(contains(error.hint(), "tri3 or quad4")) << error.hint();
}

TEST(VolumeMesh, NamesThatNoFileCanHaveAreRefused) {
  const std::string name = "body." + std::string(300, 'x');
  const Error error = error_of([&] { read_volume_mesh(name); });
  EXPECT_TRUE(contains(error.what(), "extension '.xxx")) << error.what();
  EXPECT_LT(std::string(error.what()).size(), 200U);
}

}  // namespace
}  // namespace palpate::reader_kinds_test
