// From model.toml to a checked body; the sample models.
#include <gtest/gtest.h>

#include <map>

#include "meshes/element.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/meshed_body.h"
#include "tests/support/bodies/geometry_shapes.h"
#include "tests/support/documentation.h"
#include "tests/support/folders.h"

namespace palpate::body_test {
namespace {

using testing::error_of;
using testing::expect_mentions;
using testing::TempFolder;
using Elements = std::vector<Index>;

const std::filesystem::path models = palpate::test::source_file("meshes/models");

void ignore(const std::string& /*text*/) {}

MeshedBody body_of(const std::filesystem::path& model) {
  return mesh_body(read_description(model), ignore);
}

const std::string soft = "youngs_modulus = 1e4\npoissons_ratio = 0.3\n";
const std::string one_material = "[material]\n" + soft;
const std::string block = "box = {size = [1, 1, 1], cells = [2, 2, 2]}";
/// Two tetrahedra of regions 5 and 9 that share a side.
const std::string two_tets =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 "
    "1\n$EndNodes\n"
    "$Elements\n2\n1 4 2 5 1 1 2 3 4\n2 4 2 9 1 2 3 4 5\n$EndElements\n";
/// Unit square of two triangles.
const std::string two_triangles =
    "MeshVersionFormatted 2\nDimension 2\nVertices\n4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
    "Triangles\n2\n1 2 3 1\n1 3 4 2\nEnd\n";

/// Description in space, or after `top` = "plane = ..." in the plane.
std::string model(const std::string& geometry,
                  const std::string& fixed = "lowest = {axis = \"z\", percent = 20}",
                  const std::string& materials = one_material, const std::string& top = "") {
  return "name = \"m\"\n" + top + "\n[geometry]\n" + geometry + "\n" + materials + "\n[[fixed]]\n" + fixed +
         "\n";
}

/// [[material]] tables with these further lines.
std::string materials(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += "[[material]]\n" + soft + line + "\n";
  }
  return text;
}

std::string plate(const std::string& geometry,
                  const std::string& fixed = "lowest = {axis = \"y\", percent = 1}") {
  return model(geometry, fixed, one_material, "plane = \"stress\"");
}

/// Nodes held along every axis.
std::size_t count_fixed(const MeshedBody& body) {
  return static_cast<std::size_t>(
      std::count(body.fixed.begin(), body.fixed.end(), body.mesh.dimension() == 3 ? 7 : 3));
}

/// In the plane the area.
double volume(const Mesh& mesh) {
  double sum = 0.0;
  for (Index e = 0; e < mesh.elements(); ++e) {
    sum += element_volume(mesh.element, element_nodes(mesh, e));
  }
  return sum;
}

Vec3 centroid(const Mesh& mesh, Index e) {
  Vec3 sum = Vec3::Zero();
  const int corners = traits(mesh.element).corners;
  for (int i = 0; i < corners; ++i) {
    sum += mesh.nodes[testing::at(mesh.element_nodes(e)[testing::at(i)])];
  }
  return sum / corners;
}

TEST(Models, AllAreReadable) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(models)) {
    if (entry.is_directory()) {
      EXPECT_EQ(read_description(entry.path() / "model.toml").name, entry.path().filename());
      ++count;
    }
  }
  EXPECT_GE(count, 6);
}

/// The models that docs/model-toml.md shows, by name. What it shows of a part is made whole.
std::map<std::string, std::string> shown_models() {
  std::map<std::string, std::string> shown;
  for (std::string text : test::fenced_blocks("docs/model-toml.md", "toml")) {
    const auto lacks = [&](const std::string& key) { return text.find(key) == std::string::npos; };
    const std::string plane = lacks("picture =") ? "" : "plane = \"stress\"\n";
    if (!text.starts_with("name = "))
      text = "name = \"part" + std::to_string(shown.size()) + "\"\n" + plane + text;
    if (lacks("[geometry]")) text += "[geometry]\n" + block + "\n";
    if (lacks("[material]") && lacks("[[material]]")) text += one_material;
    if (lacks("[[fixed]]")) text += "[[fixed]]\nlowest = {axis = \"y\", percent = 5}\n";
    shown[text.substr(8, text.find('"', 8) - 8)] = text;
  }
  return shown;
}

TEST(Models, ThoseOfTheBookAreDescriptions) {
  const std::map<std::string, std::string> shown = shown_models();
  EXPECT_GE(shown.size(), 10U);
  for (const auto& [name, text] : shown)
    EXPECT_NO_THROW(EXPECT_EQ(parse_description(text, "model.toml").name, name)) << text;
}

TEST(Models, NoduleOfTheBook) {
  const TempFolder folder;
  const MeshedBody nodule = body_of(folder.write("model.toml", shown_models()["nodule"]));
  EXPECT_EQ(nodule.mesh.elements(), 32 * 24 * 16);
  const auto stiff = std::count(nodule.material_of_element.begin(), nodule.material_of_element.end(), 1);
  // Its centre is a node and its radius three cells: a cell of each octant counts by its half odd numbers
  // a^2 + b^2 + c^2 <= 9, which 17 of 27 triples of 1/2, 3/2, 5/2 meet.
  EXPECT_EQ(stiff, 8 * 17);
}

TEST(Models, StretchedPlateOfTheBook) {
  const TempFolder folder;
  const MeshedBody plate = body_of(folder.write("model.toml", shown_models()["stretched"]));
  EXPECT_NEAR(volume(plate.mesh), 0.04 * 0.02 - 0.004 * 0.004, 1e-9);
  for (std::size_t i = 0; i < plate.mesh.nodes.size(); ++i) {
    const Vec3& x = plate.mesh.nodes[i];
    EXPECT_EQ(plate.fixed[i], (x.x() == 0.0 || x.x() == 0.04 ? 1 : 0) + (x.norm() == 0.0 ? 2 : 0)) << x;
    EXPECT_EQ(plate.prescribed[i], Vec3(x.x() == 0.04 ? 1e-4 : 0.0, 0.0, 0.0)) << x;
  }
}

struct Sample {
  std::string name;
  int nodes, elements, fixed;
  double volume, tolerance;
};

TEST(Models, GeneratedOnesHaveTheirSizes) {
  const Sample samples[] = {
      {"cube", 7 * 7 * 7, 6 * 216, 49, 1.0, 1e-12},
      {"beam", 21 * 5 * 5, 6 * 320, 25, 0.2 * 0.04 * 0.04, 1e-12},
      {"beam15", 1024, 6 * 735, 64, 0.15 * 0.07 * 0.07, 1e-12},
      {"beam24", 3025, 6 * 2400, 121, 0.24 * 0.1 * 0.1, 1e-12},
      {"plate", 25, 16, 5, 1.0, 1e-12},
  };
  for (const Sample& sample : samples) {
    const MeshedBody body = body_of(models / sample.name / "model.toml");
    EXPECT_EQ(body.mesh.nodes.size(), testing::at(sample.nodes)) << sample.name;
    EXPECT_EQ(body.mesh.elements(), sample.elements) << sample.name;
    EXPECT_EQ(count_fixed(body), testing::at(sample.fixed)) << sample.name;
    EXPECT_NEAR(volume(body.mesh), sample.volume, sample.tolerance) << sample.name;
    EXPECT_TRUE(body.notes.empty()) << sample.name;
  }
  const MeshedBody ball = body_of(models / "sphere" / "model.toml");
  EXPECT_NEAR(volume(ball.mesh), 4.0 / 3.0 * M_PI * std::pow(0.05, 3), 0.05 * volume(ball.mesh));
}

TEST(Body, SurfaceIsScaledAndMeshed) {
  const TempFolder folder;
  folder.write("cube.off", testing::off(testing::fine_cube(2, 50.0)));
  const MeshedBody body = body_of(folder.write("model.toml", model("surface = \"cube.off\"\nscale = 0.001")));
  EXPECT_NEAR(volume(body.mesh), std::pow(0.05, 3), 1e-12);
  EXPECT_EQ(body.surface.nodes.size(), 98U);
  EXPECT_EQ(body.fixed.size(), body.mesh.nodes.size());
  EXPECT_GE(count_fixed(body), 25U);
}

TEST(Body, LengthsAreMetresAfterScaling) {
  const TempFolder folder;
  folder.write("cube.off", testing::off(testing::cube(50.0)));
  const MeshedBody body = body_of(folder.write(
      "model.toml",
      model("surface = \"cube.off\"\nscale = 0.001\n[mesh]\nremesh = true\nedge_length = 0.01")));
  EXPECT_GT(body.surface.nodes.size(), 100U);  // 150 cm^2 in triangles of 1 cm: about 175
  EXPECT_LT(body.surface.nodes.size(), 350U);
}

TEST(Body, WarnsAboutTheScale) {
  const TempFolder folder;
  folder.write("cube.off", testing::off(testing::cube(50.0)));
  const MeshedBody body = body_of(folder.write("model.toml", model("surface = \"cube.off\"")));
  testing::expect_mentions(body.warning, {"50 m", "scale = 0.001", "0.05 m"});
}

TEST(Body, VolumeMeshIsTaken) {
  const TempFolder folder;
  folder.write("one.node", "5 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 9 9 9\n");
  folder.write("one.ele", "1 4 0\n0 0 1 2 3\n");
  const Description description =
      read_description(folder.write("model.toml", model("volume = \"one.ele\"", "nodes = [0, 1, 2]")));
  const MeshedBody body = mesh_body(description, ignore);
  EXPECT_EQ(body.mesh.nodes.size(), 4U);
  ASSERT_EQ(body.notes.size(), 1U);
  expect_mentions(body.notes[0], {"removed 1 nodes"});
  EXPECT_EQ(input_files(description),
            (std::vector<std::filesystem::path>{folder.path() / "one.node", folder.path() / "one.ele"}));
}

TEST(Body, NumbersOfNodesThatWouldShiftAreRefused) {
  const TempFolder folder;
  folder.write("one.node", "5 3 0 0\n0 9 9 9\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n");
  folder.write("one.ele", "1 4 0\n0 1 2 3 4\n");
  expect_mentions(error_of([&] {
                    body_of(folder.write("model.toml", model("volume = \"one.ele\"", "nodes = [1, 2, 3]")));
                  }),
                  {"one.ele", "1 nodes that no element uses", "select by box"});
  body_of(folder.write("model.toml", model("volume = \"one.ele\"")));
}

/// Two tetrahedra, the first in two groups, with names.
const char* const grouped_msh = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
3 1 "all of it"
3 2 "lesion"
2 2 "skin"
$EndPhysicalNames
$Nodes
5
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
5 1 1 1
$EndNodes
$Elements
3
1 4 2 1 1 1 2 3 4
2 4 2 1 1 2 3 4 5
3 4 2 2 1 2 3 4 5
$EndElements
)";

TEST(Body, GroupsAreRegionsByNumberAndByName) {
  const TempFolder folder;
  folder.write("a.msh", grouped_msh);
  const auto body = [&](const std::string& first, const std::string& second) {
    return body_of(
        folder.write("model.toml",
                     "name = \"a\"\n[geometry]\nvolume = \"a.msh\"\n[[material]]\nyoungs_modulus = 1\n"
                     "poissons_ratio = 0.3\n" +
                         first + "\n[[material]]\nyoungs_modulus = 2\npoissons_ratio = 0.3\n" + second +
                         "\n[[fixed]]\nlowest = {axis = \"z\", percent = 1}\n"));
  };
  for (const char* const lesion : {"regions = [2]", "regions = [\"lesion\"]"})
    EXPECT_EQ(body("", lesion).material_of_element, (std::vector<Index>{0, 1})) << lesion;
  expect_mentions(error_of([&] { body("", "regions = [3]"); }),
                  {"no element has the region 3", "1 (all of it), 2 (lesion)"});
  expect_mentions(error_of([&] { body("", "regions = [\"skin\"]"); }),
                  {"no element has the region \"skin\""});
  expect_mentions(error_of([&] { body("regions = [1]", "regions = [2]"); }),
                  {"overlapping regions", "1 and 2", "[[material]] number 1 and number 2"});
}

TEST(Body, WhatAPersonWouldHardlyHaveWantedIsTold) {
  const TempFolder folder;
  const auto doubts = [&](const std::string& geometry, const std::string& fixed) {
    return body_of(folder.write("model.toml", model(geometry, fixed))).doubts;
  };
  const std::string low = "lowest = {axis = \"z\", percent = 10}";
  EXPECT_TRUE(doubts("box = {size = [1, 1, 1], cells = [5, 5, 5]}", low).empty());
  const std::vector<std::string> plate = doubts("box = {size = [20, 20, 1], cells = [10, 10, 1]}", low);
  ASSERT_EQ(plate.size(), 2U);
  expect_mentions(plate[0], {"50 % of the nodes are held (121 of 242)", "[[fixed]]"});
  expect_mentions(plate[1], {"one element thick", "100 %"});
  const std::vector<std::string> flat =
      doubts("box = {size = [1000, 1, 1], cells = [2, 3, 3]}", "lowest = {axis = \"x\", percent = 1}");
  ASSERT_FALSE(flat.empty());
  expect_mentions(flat.back(), {"all but flat", "shape 0.00"});
}

TEST(Body, InputFiles) {
  const TempFolder folder;
  const auto files = [&](const std::string& geometry) {
    return input_files(read_description(folder.write("model.toml", model(geometry))));
  };
  EXPECT_TRUE(files("sphere = {radius = 1, cells_across = 2}").empty());
  EXPECT_EQ(files("surface = \"a.off\""), std::vector<std::filesystem::path>{folder.path() / "a.off"});
  EXPECT_EQ(files("volume = \"a.msh\""), std::vector<std::filesystem::path>{folder.path() / "a.msh"});
  EXPECT_EQ(input_files(read_description(
                folder.write("model.toml", plate("picture = \"a.png\"\n[mesh]\nedge_length = 1")))),
            std::vector<std::filesystem::path>{folder.path() / "a.png"});
}

TEST(Body, FixedIsTheUnion) {
  const TempFolder folder;
  const MeshedBody body = body_of(folder.write(
      "model.toml",
      model(block, "lowest = {axis = \"z\", percent = 1}\n[[fixed]]\nlowest = {axis = \"x\", percent = 1}")));
  EXPECT_EQ(count_fixed(body), 9U + 9U - 3U);
}

TEST(Body, AxesAndDisplacements) {
  const TempFolder folder;
  const MeshedBody body = body_of(folder.write(
      "model.toml", model(block,
                          "lowest = {axis = \"z\", percent = 1}\naxes = \"xz\"\ndisplacement = [0.5, 0, 0]\n"
                          "[[fixed]]\nlowest = {axis = \"x\", percent = 1}\naxes = \"y\"\n"
                          "displacement = [0, -0.25, 0]")));
  for (std::size_t i = 0; i < body.mesh.nodes.size(); ++i) {
    const bool low = body.mesh.nodes[i].z() == 0.0, left = body.mesh.nodes[i].x() == 0.0;
    EXPECT_EQ(body.fixed[i], (low ? 0b101 : 0) + (left ? 0b010 : 0)) << i;
    EXPECT_EQ(body.prescribed[i], Vec3(low ? 0.5 : 0.0, left ? -0.25 : 0.0, 0.0)) << i;
  }
}

TEST(Body, FixedMayOverlapWhereTheyAgree) {
  const TempFolder folder;
  const auto both = [&](const std::string& second) {
    return body_of(folder.write("model.toml", model(block,
                                                    "lowest = {axis = \"z\", percent = 1}\n[[fixed]]\n"
                                                    "lowest = {axis = \"x\", percent = 1}\n" +
                                                        second)));
  };
  EXPECT_EQ(count_fixed(both("displacement = [0, 0, 0]")), 15U);
  const MeshedBody body = both("axes = \"x\"");
  EXPECT_EQ(count_fixed(body), 9U);
  EXPECT_EQ(std::count(body.fixed.begin(), body.fixed.end(), 1), 6);
  expect_mentions(
      error_of([&] { both("displacement = [0, 0.125, 0]"); }),
      {"model.toml: [[fixed]] number 2", "node 0 ", "along y at 0.125 m", "at 0 m by [[fixed]] number 1"});
}

TEST(Body, BadSelections) {
  const TempFolder folder;
  const auto error = [&](const std::string& fixed) {
    return error_of([&] { body_of(folder.write("model.toml", model(block, fixed))); });
  };
  expect_mentions(error("sphere = {center = [5, 5, 5], radius = 0.1}"), {"model.toml: [[fixed]] number 1"});
  expect_mentions(error("nodes = [27]"), {"[[fixed]] number 1", "27"});
  expect_mentions(error("tag = 4"), {"[[fixed]] number 1", "4"});
  expect_mentions(error("nodes = [0, 1, 2]"), {"model.toml"});  // on one line: it could turn
}

TEST(Body, ElementsOfGeneratedBodies) {
  const TempFolder folder;
  const auto body = [&](const std::string& element) {
    return body_of(folder.write("model.toml", model(block + "\n[mesh]\nelement = \"" + element + "\"")));
  };
  const MeshedBody hex8 = body("hex8"), tet4 = body("tet4"), tet10 = body("tet10");
  EXPECT_EQ(hex8.mesh.element, ElementType::hex8);
  EXPECT_EQ(hex8.mesh.elements(), 8);
  EXPECT_EQ(hex8.surface.count(), 24);
  EXPECT_EQ(tet4.mesh.nodes.size(), 27U);
  EXPECT_EQ(tet10.mesh.element, ElementType::tet10);
  EXPECT_EQ(tet10.mesh.elements(), 48);
  EXPECT_EQ(tet10.mesh.nodes.size(), 125U);  // a Kuhn mesh has an edge for each half step
  EXPECT_EQ(count_fixed(tet10), 25U);
  EXPECT_NEAR(volume(tet10.mesh), 1.0, 1e-14);

  const auto square = [&](const std::string& element) {
    return body_of(
        folder.write("model.toml", plate("rectangle = {size = [1, 2], cells = [3, 4]}\nscale = 0.5\n"
                                         "[mesh]\nelement = \"" +
                                         element + "\"")));
  };
  EXPECT_EQ(square("quad4").mesh.elements(), 12);
  EXPECT_EQ(square("tri3").mesh.elements(), 24);
  EXPECT_NEAR(volume(square("tri3").mesh), 0.5, 1e-14);
}

TEST(Body, ElementsOfFiles) {
  const TempFolder folder;
  folder.write("two.msh", two_tets);
  const auto body = [&](const std::string& element) {
    return body_of(folder.write(
        "model.toml",
        model("volume = \"two.msh\"\n[mesh]\nelement = \"" + element + "\"", "nodes = [0, 1, 2]")));
  };
  EXPECT_EQ(body("tet4").mesh.nodes.size(), 5U);
  EXPECT_EQ(body("tet10").mesh.nodes.size(), 14U);  // nine edges
  EXPECT_EQ(count_fixed(body("tet4")), 3U);
  EXPECT_TRUE(body("tet4").notes.empty());
  EXPECT_EQ(count_fixed(body("tet10")), 6U);  // middles of the three edges of the side
  ASSERT_EQ(body("tet10").notes.size(), 1U);
  expect_mentions(body("tet10").notes.front(), {"[[fixed]] number 1", "3 listed nodes", "middles"});
  EXPECT_EQ(body("tet10").mesh.regions, (Elements{5, 9}));
  expect_mentions(error_of([&] { body("hex8"); }), {"two.msh", "tet4", "hex8"});
}

TEST(Body, FilesInThePlane) {
  const TempFolder folder;
  folder.write("square.mesh", two_triangles);
  folder.write("two.msh", two_tets);
  const MeshedBody body = body_of(folder.write("model.toml", plate("volume = \"square.mesh\"")));
  EXPECT_EQ(body.mesh.element, ElementType::tri3);
  EXPECT_EQ(body.surface.count(), 4);
  EXPECT_EQ(count_fixed(body), 2U);
  expect_mentions(error_of([&] { body_of(folder.write("model.toml", model("volume = \"square.mesh\""))); }),
                  {"square.mesh", "lies in the plane (tri3)", "plane = \"stress\"", "model.toml"});
  expect_mentions(error_of([&] { body_of(folder.write("model.toml", plate("volume = \"two.msh\""))); }),
                  {"two.msh", "is in space (tet4)", "remove plane", "model.toml"});
}

TEST(Body, PolygonsAndPictures) {
  const TempFolder folder;
  const MeshedBody frame = body_of(folder.write(
      "model.toml",
      plate("polygon = {points = [[0, 0], [10, 0], [10, 10], [0, 10]], "
            "holes = [[[4, 4], [6, 4], [6, 6], [4, 6]]]}\nscale = 0.01\n[mesh]\nedge_length = 0.01")));
  EXPECT_NEAR(volume(frame.mesh), 0.01 - 0.0004, 1e-12);
  EXPECT_EQ(frame.mesh.element, ElementType::tri3);
  EXPECT_GE(frame.mesh.elements(), 100);  // of 1 cm: about 2.3 a square centimetre
  EXPECT_LE(frame.mesh.elements(), 500);

  std::string picture = "P1\n12 12\n";  // 1 is black
  for (int i = 0; i < 144; ++i) {
    const bool body = i % 12 >= 2 && i % 12 < 10 && i / 12 >= 1 && i / 12 < 7;
    picture += body ? "0 " : "1 ";
  }
  folder.write("body.pbm", picture);
  const MeshedBody square = body_of(folder.write(
      "model.toml", plate("picture = \"body.pbm\"\nscale = 0.001\n[mesh]\nedge_length = 0.002")));
  EXPECT_NEAR(volume(square.mesh), 48e-6, 5e-6);
  EXPECT_NEAR(square.mesh.nodes.at(0).z(), 0.0, 0.0);
}

TEST(Body, SurfaceByCgal) {
  const TempFolder folder;
  folder.write("cube.off", testing::off(testing::cube(50.0)));
  const MeshedBody body = body_of(
      folder.write("model.toml", model("surface = \"cube.off\"\nscale = 0.001\n[mesh]\nmesher = \"cgal\"\n"
                                       "edge_length = 0.01\nelement = \"tet10\"")));
  EXPECT_EQ(body.mesh.element, ElementType::tet10);
  EXPECT_NEAR(volume(body.mesh), std::pow(0.05, 3), 1e-7);  // its edges are kept
  EXPECT_GT(body.surface.nodes.size(), 200U);               // meshed anew: the cube has eight
}

TEST(Body, FacetDistanceIsMetresAfterScaling) {
  const TempFolder folder;
  folder.write("ball.off", testing::off(testing::ball(2)));
  const auto nodes = [&](const std::string& scale, const std::string& edge, const std::string& distance) {
    return body_of(folder.write("model.toml", model("surface = \"ball.off\"\nscale = " + scale +
                                                    "\n[mesh]\nmesher = \"cgal\"\n" + "edge_length = " +
                                                    edge + "\nfacet_distance = " + distance)))
        .mesh.nodes.size();
  };
  EXPECT_EQ(nodes("0.5", "0.25", "0.0625"), nodes("1", "0.5", "0.125"));
  EXPECT_NE(nodes("0.5", "0.25", "0.0625"), nodes("1", "0.5", "0.0625"));
}

TEST(Materials, ByRegion) {
  const TempFolder folder;
  folder.write("two.msh", two_tets);
  const auto of = [&](const std::vector<std::string>& lines) {
    return body_of(folder.write("model.toml",
                                model("volume = \"two.msh\"", "nodes = [0, 1, 2]", materials(lines))))
        .material_of_element;
  };
  EXPECT_EQ(of({"regions = [9]", "regions = [5]"}), (Elements{1, 0}));
  EXPECT_EQ(of({"", "regions = [5]"}), (Elements{1, 0}));
  EXPECT_EQ(of({"regions = [5, 9]"}), (Elements{0, 0}));
  EXPECT_EQ(of({"sphere = {center = [1, 1, 1], radius = 1}", ""}), (Elements{1, 0}));
  const auto error = [&](const std::vector<std::string>& lines) { return error_of([&] { of(lines); }); };
  expect_mentions(error({"regions = [9]"}), {"model.toml: missing material", "1 elements of region 5",
                                             "(0.25, 0.25, 0.25) m", "regions = [5]", "for the rest"});
  expect_mentions(error({"", "regions = [5, 7]"}),
                  {"model.toml: [[material]] number 2", "no element has the region 7", "5, 9"});
  expect_mentions(error({"regions = [5, 9]", "regions = [9]"}),
                  {"model.toml: [[material]] number 2", "overlapping regions",
                   "number 1 and number 2 both claim 1", "(0.5, 0.5, 0.5) m"});
  expect_mentions(error({"regions = [5]", "regions = [9]", ""}),
                  {"model.toml: [[material]] number 3", "others claim every element"});
}

TEST(Materials, ByPlace) {
  const TempFolder folder;
  const auto body = [&](const std::vector<std::string>& lines) {
    return body_of(
        folder.write("model.toml", model(block, "lowest = {axis = \"z\", percent = 1}", materials(lines))));
  };
  const MeshedBody layered = body({"half_space = {point = [0, 0, 0.5], normal = [0, 0, 1]}", "",
                                   "box = {min = [0, 0, 0], max = [0.5, 0.5, 0.5]}"});
  for (Index e = 0; e < layered.mesh.elements(); ++e) {
    const Vec3 x = centroid(layered.mesh, e);
    EXPECT_EQ(layered.material_of_element[testing::at(e)], x.z() > 0.5                  ? 0
                                                           : x.x() < 0.5 && x.y() < 0.5 ? 2
                                                                                        : 1);
  }
  const auto error = [&](const std::vector<std::string>& lines) { return error_of([&] { body(lines); }); };
  expect_mentions(
      error({"box = {min = [0, 0, 0], max = [1, 1, 0.5]}", "box = {min = [0, 0, 0], max = [0.5, 1, 1]}"}),
      {"overlapping regions", "both claim 12 elements", ") m"});
  expect_mentions(error({"box = {min = [0, 0, 0], max = [1, 1, 0.5]}"}),
                  {"missing material: no [[material]] claims 24 elements", ") m", "without regions"});
  expect_mentions(error({"", "sphere = {center = [5, 0, 0], radius = 1}"}),
                  {"model.toml: [[material]] number 2"});
}

TEST(Materials, ByLabelOfAnImage) {
  const TempFolder folder;
  std::string image =
      "#INRIMAGE-4#{\nXDIM=14\nYDIM=12\nZDIM=12\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 bits\nSCALE=2**0\n"
      "CPU=decm\nVX=1\nVY=1\nVZ=1\n";
  image.resize(252, '\n');
  image += "##}\n";
  for (int i = 0; i < 14 * 12 * 12; ++i) {  // two cubes of 5 voxels side by side
    const int x = i % 14, y = i / 14 % 12, z = i / 168;
    const bool body = x >= 2 && x < 12 && y >= 3 && y < 8 && z >= 3 && z < 8;
    image += static_cast<char>(!body ? 0 : x < 7 ? 3 : 200);
  }
  folder.write("scan.inr", image);
  const auto body = [&](const std::string& geometry, const std::vector<std::string>& lines) {
    return body_of(
        folder.write("model.toml", model("image = \"scan.inr\"\n" + geometry + "\n[mesh]\nedge_length = 2",
                                         "lowest = {axis = \"z\", percent = 10}", materials(lines))));
  };
  const MeshedBody both = body("", {"regions = [200]", "regions = [3]"});
  for (Index e = 0; e < both.mesh.elements(); ++e) {
    EXPECT_EQ(both.mesh.regions[testing::at(e)], both.material_of_element[testing::at(e)] == 0 ? 200 : 3);
    const double beyond = centroid(both.mesh, e).x() - 6.5;
    if (std::abs(beyond) > 0.5) {  // the interface may be off by that much
      EXPECT_EQ(both.material_of_element[testing::at(e)], beyond > 0.0 ? 0 : 1) << beyond;
    }
  }
  expect_mentions(error_of([&] { body("", {"regions = [3]"}); }),
                  {"missing material", "elements of region 200", "regions = [200]"});
  expect_mentions(error_of([&] {
                    body("labels = [3]", {"regions = [200]", ""});
                  }),
                  {"[[material]] number 1", "no element has the region 200", "the regions 3"});
}

TEST(Body, ReportsProgress) {
  const TempFolder folder;
  folder.write("cube.off", testing::off(testing::cube()));
  std::vector<std::string> lines;
  mesh_body(read_description(folder.write("model.toml", model("surface = \"cube.off\""))),
            [&](const std::string& line) { lines.push_back(line); });
  ASSERT_FALSE(lines.empty());
  expect_mentions(lines[0], {"cube.off"});
}

}  // namespace
}  // namespace palpate::body_test
