// Readers of volume meshes: the same two tetrahedra in every format, and each of them spoiled.
#include <gtest/gtest.h>

#include <iterator>
#include <locale>
#include <regex>

#include "meshes/readers/volume_mesh.h"
#include "meshes/readers/vtu_writer.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::reader_test {
namespace {

using test::contains;
using test::error_of;

// Node 2 of the Gmsh files has tag 40: tags may have gaps.
const std::string gmsh2 = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
3 7 "body"
$EndPhysicalNames
$Nodes
5
1 0 0 0
9 1.5 0 0
40 0 +1 0
3 0 0 1e0
4 1 1 1
$EndNodes
$Elements
5
1 15 2 0 1 1
2 1 2 0 1 1 9
3 2 2 5 1 1 40 9
4 4 2 7 1 1 9 40 3
5 4 2 8 1 9 40 3 4
$EndElements
)";

const std::string gmsh4 = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
1 1 1 2
1 0 0 0 0
1 0 0 0 1 0 0 0 2 1 -1
1 0 0 0 1 1 0 1 -5 1 1
1 0 0 0 1 1 1 1 7 1 1
2 0 0 0 1 1 1 2 8 9 1 1
$EndEntities
$Nodes
2 5 1 40
2 1 1 2
1
9
0 0 0 0.25 0.5
1.5 0 0 0.25 0.5
3 1 0 3
40
3
4
0 1 0
0 0 1
1 1 1
$EndNodes
$Elements
4 4 1 5
1 1 1 1
2 1 9
2 1 2 1
3 1 40 9
3 1 4 1
4 1 9 40 3
3 2 4 1
5 9 40 3 4
$EndElements
)";

const std::string medit = R"(MeshVersionFormatted 2
Dimension
3
# the nodes
Vertices
5
0 0 0 1
1.5 0 0 1
0 1 0 1
0 0 1 1
1 1 1 0
Edges
1
1 2 0
Triangles
2
1 3 2 5
1 2 4 0
Corners
2
1
2
Tetrahedra
2
1 2 3 4 7
2 3 4 5 8
End
)";

const std::string node = R"(# made by hand
5  3  1  1
1  0 0 0  0.5 1
2  1.5 0 0  0.5 1  # a comment
3  0 1 0  0.5 1
4  0 0 1  0.5 1
5  1 1 1  0.5 0
)";
const std::string ele = "2  4  1\n1  1 2 3 4  7\n2  2 3 4 5  8.0\n# end\n";
const std::string face = "2  1\n1  1 3 2  5  1 -1\n2  1 2 4  0  1 -1\n";

const std::string vtk = R"(# vtk DataFile Version 3.0
two tetrahedra
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 5 double
0 0 0  1.5 0 0  0 1 0  0 0 1
1 1 1
CELLS 3 14
4 0 1 2 3
3 0 2 1
4 1 2 3 4
CELL_TYPES 3
10
5
10
CELL_DATA 3
SCALARS x float
)";

const std::string vtk5 = R"(# vtk DataFile Version 5.1
two tetrahedra
ASCII
DATASET UNSTRUCTURED_GRID
FIELD FieldData 1
TIME 1 1 double
0.25
POINTS 5 double
0 0 0  1.5 0 0  0 1 0  0 0 1
1 1 1
METADATA
INFORMATION 0

CELLS 3 8
OFFSETS vtktypeint64
0 4 8
CONNECTIVITY vtktypeint64
0 1 2 3 1 2 3 4
CELL_TYPES 2
10 10
)";

const std::vector<Index> two_tetrahedra = {0, 1, 2, 3, 1, 2, 3, 4};

void expect_two_tetrahedra(const Mesh& mesh, bool has_regions, bool has_tags) {
  ASSERT_EQ(mesh.nodes.size(), 5u);
  EXPECT_EQ(mesh.nodes[1], Vec3(1.5, 0, 0));
  EXPECT_EQ(mesh.nodes[2], Vec3(0, 1, 0));
  EXPECT_EQ(mesh.nodes[4], Vec3(1, 1, 1));
  EXPECT_EQ(mesh.element, ElementType::tet4);
  EXPECT_EQ(mesh.connectivity, two_tetrahedra);
  EXPECT_EQ(mesh.regions, has_regions ? (std::vector<Index>{7, 8}) : (std::vector<Index>{0, 0}));
  EXPECT_EQ(mesh.tagged_facets, has_tags ? (std::vector<Index>{0, 2, 1}) : std::vector<Index>{});
  EXPECT_EQ(mesh.facet_tags, has_tags ? std::vector<Index>{5} : std::vector<Index>{});
}

std::string with_windows_line_ends(const std::string& text) {
  return std::regex_replace(text, std::regex("\n"), "\r\n");
}

TEST(VolumeMesh, EveryFormatGivesTheSameMesh) {
  const test::ScratchFolder folder;
  const auto read = [&](const std::string& name, const std::string& text) {
    return read_volume_mesh(folder.write(name, text));
  };
  expect_two_tetrahedra(read("a.msh", gmsh2), true, true);
  expect_two_tetrahedra(read("a.msh", with_windows_line_ends(gmsh2)), true, true);
  expect_two_tetrahedra(read("b.msh", gmsh4), true, true);
  expect_two_tetrahedra(read("b.msh", with_windows_line_ends(gmsh4)), true, true);
  expect_two_tetrahedra(read("a.mesh", medit), true, true);
  expect_two_tetrahedra(read("a.mesh", with_windows_line_ends(medit)), true, true);
  expect_two_tetrahedra(read("a.vtk", vtk), false, false);
  expect_two_tetrahedra(read("a.vtk", with_windows_line_ends(vtk)), false, false);
  expect_two_tetrahedra(read("b.vtk", vtk5), false, false);
  expect_two_tetrahedra(read("b.vtk", with_windows_line_ends(vtk5)), false, false);
}

TEST(VolumeMesh, TetgenByEitherNameOrTheStem) {
  const test::ScratchFolder folder;
  const auto node_file = folder.write("liver.1.node", node), element_file = folder.write("liver.1.ele", ele);
  expect_two_tetrahedra(read_volume_mesh(node_file), true, false);
  const auto face_file = folder.write("liver.1.face", face);
  expect_two_tetrahedra(read_volume_mesh(node_file), true, true);
  expect_two_tetrahedra(read_volume_mesh(element_file), true, true);
  expect_two_tetrahedra(read_volume_mesh(folder.path() / "liver.1"), true, true);
}

TEST(VolumeMesh, TetgenCountsFromZeroToo) {
  const test::ScratchFolder folder;
  (void)folder.write("a.ele", "2 4 0\n0 0 1 2 3\n1 1 2 3 4\n");
  expect_two_tetrahedra(
      read_volume_mesh(folder.write("a.node", "5 3 0 0\n0 0 0 0\n1 1.5 0 0\n2 0 1 0\n3 0 0 1\n4 1 1 1\n")),
      false, false);
}

TEST(VolumeMesh, TetgenCountsFromWhereItBegins) {
  const test::ScratchFolder folder;
  const auto nodes = folder.write("a.NODE", "5 3 0 0\n10 0 0 0\n11 1.5 0 0\n12 0 1 0\n13 0 0 1\n14 1 1 1\n");
  (void)folder.write("a.ELE", "2 4 1\n1 10 11 12 13 7\n2 11 12 13 14 8\n");
  expect_two_tetrahedra(read_volume_mesh(nodes), true, false);
  (void)folder.write("a.ELE", "2 4 2\n1 10 11 12 13 7 1\n2 11 12 13 14 8 2\n");
  const Error several = error_of([&] { read_volume_mesh(nodes); });
  EXPECT_TRUE(contains(several.what(), "2 attributes"));
}

TEST(VolumeMesh, EndingsMayBeCapitals) {
  const test::ScratchFolder folder;
  expect_two_tetrahedra(read_volume_mesh(folder.write("A.MSH", gmsh2)), true, true);
  expect_two_tetrahedra(read_volume_mesh(folder.write("A.Vtk", vtk)), false, false);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(VolumeMesh, GmshsParametersOfNodesArePassedOver) {
  const test::ScratchFolder folder;
  std::string text = replaced(gmsh2, "$Nodes", "$ParametricNodes");
  text = replaced(text, "$EndNodes", "$EndParametricNodes");
  text = replaced(text, "9 1.5 0 0", "9 1.5 0 0 1 4 0.25");
  expect_two_tetrahedra(read_volume_mesh(folder.write("a.msh", text)), true, true);
}

TEST(VolumeMesh, RegionsOfVtkAreInItsCellData) {
  const test::ScratchFolder folder;
  const auto regions = [&](const std::string& data) {
    return read_volume_mesh(folder.write("a.vtk", replaced(vtk, "CELL_DATA 3\nSCALARS x float\n", data)))
        .regions;
  };
  const std::vector<Index> given = {7, 8}, none = {0, 0};
  EXPECT_EQ(regions("CELL_DATA 3\nSCALARS anything int 1\nLOOKUP_TABLE default\n7 0 8\n"), given);
  EXPECT_EQ(regions("CELL_DATA 3\nSCALARS anything int\n7\n0\n8\n"), given);
  EXPECT_EQ(regions("CELL_DATA 3\nSCALARS Region double 1\nLOOKUP_TABLE default\n7.0 0 8\n"), given);
  EXPECT_EQ(
      regions(
          "POINT_DATA 5\nVECTORS u double\n1 2 3 4 5 6 7 8 9 10 11 12 13 14 15\nSCALARS n int\n1 2 3 4 5\n"
          "CELL_DATA 3\nFIELD FieldData 2\ngmsh:physical 1 3 int\n7 0 8\ngmsh:geometrical 1 3 int\n"
          "1 2 3\n"),
      given);
  EXPECT_EQ(regions("CELL_DATA 3\nSCALARS x double\nLOOKUP_TABLE default\n7 0 8\n"), none);
  EXPECT_EQ(regions("CELL_DATA 3\nFIELD FieldData 2\na 1 3 int\n7 0 8\nb 1 3 int\n1 2 3\n"), none);
  EXPECT_EQ(regions("CELL_DATA 3\nFIELD FieldData 1\na 1 2 int\n7 0\n"), none);
  MeshGroups groups;
  read_volume_mesh(
      folder.write("b.vtk", replaced(vtk, "CELL_DATA 3\nSCALARS x float\n",
                                     "CELL_DATA 3\nFIELD FieldData 2\na 1 3 int\n7 0 8\nb 1 3 int\n"
                                     "1 2 3\n")),
      &groups);
  EXPECT_TRUE(contains(groups.hint, "several arrays"));
}

TEST(VolumeMesh, AllGroupsOfGmshAreKept) {
  const test::ScratchFolder folder;
  for (const bool parts : {false, true}) {
    MeshGroups groups;
    const std::string entities =
        parts ? "$PartitionedEntities\n2\n1 5 1\n0 0 0 2\n1 3 9 1 1 0 0 0 1 1 1 2 3 4 0\n"
                "2 3 9 2 1 2 0 0 0 1 1 1 1 4 0\n$EndPartitionedEntities\n"
              : "$Entities\n0 0 0 2\n1 0 0 0 1 1 1 2 3 4 0\n2 0 0 0 1 1 1 1 -4 0\n$EndEntities\n";
    const Mesh mesh = read_volume_mesh(
        folder.write("a.msh",
                     "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 4 \"a b\"\n"
                     "$EndPhysicalNames\n" +
                         entities +
                         "$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1.5 0 0\n0 1 0\n0 0 1\n1 1 1\n"
                         "$EndNodes\n$Elements\n2 2 1 2\n3 1 4 1\n1 1 2 3 4\n3 2 4 1\n2 2 3 4 5\n"
                         "$EndElements\n"),
        &groups);
    EXPECT_EQ(mesh.regions, (std::vector<Index>{3, 4}));
    EXPECT_EQ(groups.more, (std::vector<std::pair<std::size_t, Index>>{{0, 4}}));
    EXPECT_EQ(groups.number_of, (std::map<std::string, Index>{{"a b", 4}}));
  }
}

/// 1.234,5: what a German desktop sets.
struct DecimalComma : std::numpunct<char> {
  [[nodiscard]] char do_decimal_point() const override { return ','; }
  [[nodiscard]] char do_thousands_sep() const override { return '.'; }
  [[nodiscard]] std::string do_grouping() const override { return "\3"; }
};

TEST(VolumeMesh, NumbersDoNotDependOnTheLocale) {
  const test::ScratchFolder folder;
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new DecimalComma));
  const Mesh mesh = read_volume_mesh(folder.write("a.msh", gmsh2));
  write_vtu(folder.path() / "a.vtu", std::vector<Vec3>(1234, Vec3::Zero()), mesh.element, mesh.connectivity,
            {});
  std::locale::global(before);
  EXPECT_EQ(mesh.nodes[1].x(), 1.5);
  std::ifstream vtu(folder.path() / "a.vtu", std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(vtu), {});
  EXPECT_TRUE(contains(text, "NumberOfPoints=\"1234\""));
}

/// One replacement in a good file, the line where it is noticed and what the message must hold.
struct Spoiled {
  const char* name;
  const std::string* text;
  std::string from, to;
  int line;
  const char* says;
};

TEST(VolumeMesh, SpoiledFilesAreRefusedWithTheirLine) {
  const Spoiled cases[] = {
      // Gmsh 2.2
      {"a.msh", &gmsh2, "2.2 0 8", "2.2 1 8", 2, "binary"},
      {"a.msh", &gmsh2, "2.2 0 8", "4 0 8", 2, "version is 4"},
      {"a.msh", &gmsh2, "$MeshFormat", "solid", 1, "'solid' stands where $MeshFormat"},
      {"a.msh", &gmsh2, "9 1.5 0 0", "9 nan 0 0", 11, "finite"},
      {"a.msh", &gmsh2, "9 1.5 0 0", "9 1e999 0 0", 11, "1e999"},
      {"a.msh", &gmsh2, "9 1.5 0 0", "9 1,5 0 0", 11, "'1,5' stands where a coordinate"},
      {"a.msh", &gmsh2, "9 1.5 0 0", "1 1.5 0 0", 11, "node 1 stands twice"},
      {"a.msh", &gmsh2, "$Nodes\n5", "$Nodes\n4", 14, "$EndNodes"},
      {"a.msh", &gmsh2, "$Nodes\n5", "$Nodes\n6", 15, "'$EndNodes' stands where a node number"},
      {"a.msh", &gmsh2, "$Nodes\n5", "$Nodes\n999999999", 9, "bytes are left"},
      {"a.msh", &gmsh2, "$Nodes\n5", "$Nodes\n99999999999999999999", 9, "'99999999999999999999'"},
      {"a.msh", &gmsh2, "$Nodes\n5", "$Nodes\n-5", 9, "-5"},
      {"a.msh", &gmsh2, "1 9 40 3\n", "1 9 40 77\n", 21, "node 77 does not exist"},
      {"a.msh", &gmsh2, "5 4 2 8 1 9 40 3 4", "5 5 2 8 1 9 40 3 4 1 9 40 3", 23, "1 tet4 and 1 hex8"},
      {"a.msh", &gmsh2, "5 4 2 8 1", "5 6 2 8 1", 22, "type 6"},
      {"a.msh", &gmsh2, "5 4 2 8 1 9 40 3 4", "5 11 2 8 1 9 40 3 4", 23, "where a node number"},
      {"a.msh", &gmsh2, "$EndElements\n", "", 23, "$EndElements"},
      {"a.msh", &gmsh2, "$EndPhysicalNames", "$EndOther", 7, "$EndPhysicalNames"},
      {"a.msh", &gmsh2, "4 4 2 7 1 1 9 40 3\n5 4 2 8 1 9 40 3 4", "4 15 2 0 1 1\n5 2 2 0 1 1 9 3", 23,
       "surface of 2 tri3"},
      {"a.msh", &gmsh2, "3 2 2 5 1 1 40 9\n4 4 2 7 1 1 9 40 3\n5 4 2 8 1 9 40 3 4",
       "3 15 2 0 1 1\n4 15 2 0 1 1\n5 15 2 0 1 3", 23, "no elements that a body"},
      {"a.msh", &gmsh2, "3 2 2 5 1 1 40 9", "3 3 2 5 1 1 40 9 3", 23, "1 quad4 facets"},
      // Gmsh 4.1
      {"b.msh", &gmsh4, "2 5 1 40", "2 6 1 40", 25, "5 nodes, not 6"},
      {"b.msh", &gmsh4, "4 4 1 5", "4 3 1 5", 36, "4 elements, not 3"},
      {"b.msh", &gmsh4, "5 9 40 3 4", "5 9 40 3 400", 36, "node 400 does not exist"},
      {"b.msh", &gmsh4, "3 2 4 1\n", "3 2 7 1\n", 35, "type 7"},
      {"b.msh", &gmsh4, "2 1 2 1\n3 1 40 9", "4 1 2 1\n3 1 40 9", 31, "4, which is not in 0 to 3"},
      {"b.msh", &gmsh4, "1 1 1 1 7 1 1\n", "1 1 1 2147483648 7 1 1\n", 9, "2147483648"},
      // Medit
      {"a.mesh", &medit, "Dimension\n3", "Dimension\n4", 3, "4, which is not in 2 to 3"},
      {"a.mesh", &medit, "Dimension\n3", "Dimension\n2", 10, "where a keyword"},
      {"a.mesh", &medit, "MeshVersionFormatted", "OFF", 1, "'OFF'"},
      {"a.mesh", &medit, "1.5 0 0 1", "1.5 0 inf 1", 8, "finite"},
      {"a.mesh", &medit, "Vertices\n5", "Vertices\n4", 11, "where a keyword"},
      {"a.mesh", &medit, "Vertices\n5", "Vertices\n6", 12, "'Edges' stands where a coordinate"},
      {"a.mesh", &medit, "2 3 4 5 8", "2 3 4 6 8", 26, "6, which is not in 1 to 5"},
      {"a.mesh", &medit, "2 3 4 5 8", "2 3 4 0 8", 26, "0, which is not in 1 to 5"},
      {"a.mesh", &medit, "1 3 2 5", "1 3 x 5", 17, "'x'"},
      {"a.mesh", &medit, "Tetrahedra", "TetrahedraP2", 24, "TetrahedraP2, which are not read"},
      {"a.mesh", &medit, "Tetrahedra\n2\n1 2 3 4 7\n",
       "Tetrahedra\n1\n1 2 3 4 7\nHexahedra\n1\n1 2 3 4 5 1 2 3 0\nPrisms 1\n", 29, "Prisms"},
      {"a.mesh", &medit, "End\n", "Hexahedra\n1\n1 2 3 4 5 1 2 3 0\n", 29, "2 tet4 and 1 hex8"},
      {"a.mesh", &medit, "Tetrahedra\n2\n1 2 3 4 7\n2 3 4 5 8\n", "", 23, "surface of 2 tri3"},
      {"a.mesh", &medit, "2 3 4 5 8\nEnd\n", "2 3 4 5\n\n\n\n", 30, "file ends where"},
      // VTK
      {"a.vtk", &vtk, "# vtk DataFile", "# not DataFile", 1, "vtk DataFile Version"},
      {"a.vtk", &vtk, "ASCII", "TEXT", 3, "neither ASCII nor BINARY"},
      {"a.vtk", &vtk, "UNSTRUCTURED_GRID", "POLYDATA", 4, "POLYDATA"},
      {"a.vtk", &vtk, "1 1 1\n", "1 -nan 1\n", 7, "finite"},
      {"a.vtk", &vtk, "4 1 2 3 4", "4 1 2 3 5", 11, "5, which is not in 0 to 4"},
      {"a.vtk", &vtk, "4 1 2 3 4", "4 1 2 3 -1", 11, "-1, which is not in 0 to 4"},
      {"a.vtk", &vtk, "CELL_TYPES 3\n10\n5", "CELL_TYPES 3\n10\n10", 14,
       "cell 1 has 3 nodes, but its type is 10"},
      {"a.vtk", &vtk, "CELL_TYPES 3\n10\n5", "CELL_TYPES 3\n13\n5", 13, "type 13"},
      {"a.vtk", &vtk, "CELL_TYPES 3\n10\n5", "CELL_TYPES 3\n24\n5", 13, "its type is 24, which has 10"},
      {"a.vtk", &vtk, "CELL_TYPES 3", "CELL_TYPES 2", 12, "2 cell types for 3 cells"},
      {"a.vtk", &vtk, "POINTS 5", "POINTS 6", 8, "'CELLS' stands where a coordinate"},
      {"a.vtk", &vtk, "CELL_TYPES 3", "POINTS 1 double\n0 0 0\nCELL_TYPES 3", 12, "POINTS stands twice"},
      {"a.vtk", &vtk, "POINTS 5", "PINTS 5", 5, "'PINTS' stands where POINTS"},
      {"b.vtk", &vtk5, "0 4 8", "0 4 9", 16, "9, which is not in 4 to 8"},
      {"b.vtk", &vtk5, "0 4 8", "0 9 8", 16, "9, which is not in 0 to 8"},
      {"b.vtk", &vtk5, "3 1 2 3 4\n", "3 1 2 3 8\n", 18, "8, which is not in 0 to 4"},
      {"b.vtk", &vtk5, "0 4 8", "0 3 8", 20, "cell 0 has 3 nodes"},
      {"b.vtk", &vtk5, "METADATA\nINFORMATION 0\n\n", "METADATA\n", 19, "no elements"},
  };
  const test::ScratchFolder folder;
  for (const Spoiled& bad : cases) {
    SCOPED_TRACE(std::string(bad.name) + ": " + bad.from + " -> " + bad.to);
    std::string text = *bad.text;
    const std::size_t place = text.find(bad.from);
    ASSERT_NE(place, std::string::npos);
    const auto file = folder.write(bad.name, text.replace(place, bad.from.size(), bad.to));
    const Error error = error_of([&] { read_volume_mesh(file); });
    EXPECT_TRUE(contains(error.what(), bad.says)) << error.what();
    EXPECT_EQ(error.where(), file.string() + ":" + std::to_string(bad.line)) << error.what();
    EXPECT_FALSE(error.hint().empty());
  }
}

TEST(VolumeMesh, SpoiledTetgenFilesAreRefusedWithTheirLine) {
  const struct {
    const std::string* text;  // of the three
    std::string from, to;
    const char* where;
    const char* says;
  } cases[] = {
      {&node, "5  3  1  1", "5  2  1  1", "a.node:2", "not three-dimensional"},
      {&node, "5  3  1  1", "6  3  1  1", "a.node:8", "file ends"},
      {&node, "5  3  1  1", "0  3  1  1", "a.node:2", "no nodes"},
      {&node, "1  0 0 0", "2  0 0 0", "a.node:4", "next node number is 2"},
      {&node, "3  0 1 0", "4  0 1 0", "a.node:5", "next node number is 4"},
      {&node, "3  0 1 0", "3  0 inf 0", "a.node:5", "finite"},
      {&ele, "2  4  1", "2  8  1", "a.ele:1", "elements of 8 nodes"},
      {&ele, "2  4  1", "2  10  1", "a.ele:2", "7, which is not in 1 to 5"},
      {&ele, "2  4  1", "3  4  1", "a.ele:5", "file ends"},
      {&ele, "2  4  1", "0  4  1", "a.ele:1", "surface of 2 tri3"},
      {&ele, "1 2 3 4", "1 2 3 6", "a.ele:2", "6, which is not in 1 to 5"},
      {&ele, "8.0", "8.5", "a.ele:3", "not a whole number"},
      {&face, "1 3 2", "1 3 0", "a.face:2", "0, which is not in 1 to 5"},
      {&face, "2  1\n", "3  1\n", "a.face:4", "file ends"},
  };
  for (const auto& bad : cases) {
    SCOPED_TRACE(bad.from + " -> " + bad.to);
    const test::ScratchFolder folder;
    for (const auto& [name, good] : {std::pair{"a.node", &node}, {"a.ele", &ele}, {"a.face", &face}}) {
      std::string text = *good;
      if (good == bad.text) text.replace(text.find(bad.from), bad.from.size(), bad.to);
      (void)folder.write(name, text);
    }
    const Error error = error_of([&] { read_volume_mesh(folder.path() / "a.node"); });
    EXPECT_TRUE(contains(error.what(), bad.says)) << error.what();
    EXPECT_EQ(error.where(), (folder.path() / bad.where).string()) << error.what();
  }
}

/// A file cut short anywhere is refused or, where only what is not needed is missing, read as it was.
TEST(VolumeMesh, FilesCutShortAnywhereAreNeverMisread) {
  const test::ScratchFolder folder;
  for (const auto& [name, text] : {std::pair{"a.msh", &gmsh2},
                                   {"b.msh", &gmsh4},
                                   {"a.mesh", &medit},
                                   {"a.vtk", &vtk},
                                   {"b.vtk", &vtk5}}) {
    std::size_t cuts = 0, refused = 0;
    for (std::size_t length = 0; length < text->size(); length += length + 80 < text->size() ? 7 : 1) {
      ++cuts;
      const auto file = folder.write(name, text->substr(0, length));
      try {
        const Mesh mesh = read_volume_mesh(file);
        EXPECT_EQ(mesh.nodes.size(), 5u) << name << " cut to " << length;
        EXPECT_EQ(mesh.connectivity, two_tetrahedra) << name << " cut to " << length;
      } catch (const Error& error) {
        ++refused;
        EXPECT_TRUE(contains(error.where(), name)) << error.where();
      }
    }
    EXPECT_GT(refused, cuts / 2) << name;
  }
}

TEST(VolumeMesh, MissingEmptyAndUnknownFiles) {
  const test::ScratchFolder folder;
  for (const char* name : {"none.msh", "none.mesh", "none.vtk", "none.node"}) {
    const Error error = error_of([&] { read_volume_mesh(folder.path() / name); });
    EXPECT_TRUE(contains(error.what(), "No such file")) << error.what();
    EXPECT_TRUE(contains(error.where(), name));
  }
  for (const char* name : {"a.msh", "a.mesh", "a.vtk", "a.node"}) {
    const Error error = error_of([&] { read_volume_mesh(folder.write(name, " \n\n")); });
    EXPECT_TRUE(contains(error.what(), "empty")) << error.what();
  }
  std::filesystem::create_directory(folder.path() / "folder.msh");
  EXPECT_THROW(read_volume_mesh(folder.path() / "folder.msh"), Error);
  const Error unknown = error_of([&] { read_volume_mesh(folder.write("a.stp", "x")); });
  EXPECT_TRUE(contains(unknown.what(), "'.stp'"));
  EXPECT_TRUE(contains(unknown.hint(), ".msh"));
}

}  // namespace
}  // namespace palpate::reader_test
