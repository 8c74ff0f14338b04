// model.toml: what is read, and what a person is told when it is wrong.
#include <gtest/gtest.h>

#include "precompute/description.h"
#include "tests/geometry_shapes.h"

namespace palpate {
namespace {

using testing::error_of;
using testing::expect_mentions;
using testing::TempFolder;

const std::string material = "[material]\nyoungs_modulus = 1e4\npoissons_ratio = 0.3\n";
const std::string fixed = "[[fixed]]\nlowest = {axis = \"z\", percent = 5}\n";
const std::string box = "[geometry]\nbox = {size = [1, 2, 3], cells = [2, 3, 4]}\n";

Description read(const TempFolder& folder, const std::string& text) {
  return read_description(folder.write("model.toml", text));
}

TEST(Description, ReadsDefaults) {
  const TempFolder folder;
  const std::string text = "name = \"a\"\n" + box + material + fixed;
  const Description d = read(folder, text);
  EXPECT_EQ(d.name, "a");
  EXPECT_EQ(d.text, text);
  EXPECT_EQ(d.scale, 1.0);
  const BoxShape& shape = std::get<BoxShape>(d.geometry);
  EXPECT_EQ(shape.origin, Vec3(0, 0, 0));
  EXPECT_EQ(shape.size, Vec3(1, 2, 3));
  EXPECT_EQ(shape.cells, (std::array<int, 3>{2, 3, 4}));
  EXPECT_EQ(d.material.youngs_modulus, 1e4);
  EXPECT_EQ(d.material.density, 1000.0);
  ASSERT_EQ(d.fixed.size(), 1U);
  EXPECT_EQ(std::get<SelectLowest>(d.fixed[0]).axis, 2);
  EXPECT_DOUBLE_EQ(std::get<SelectLowest>(d.fixed[0]).fraction, 0.05);
  EXPECT_EQ(d.scope, Scope::layers);
  EXPECT_EQ(d.layers, 1);
  EXPECT_EQ(d.precision, Precision::single_precision);
}

TEST(Description, ReadsEveryKey) {
  const TempFolder folder;
  const Description d = read(folder, R"(
name = "all"
[geometry]
image = "sub/../scan.inr.gz"
labels = [255, 127]
scale = 0.001
[mesh]
mesher = "cgal"
edge_length = 0.005
grading = 0
radius_edge = 3
facet_distance = 0.001
[material]
youngs_modulus = 5000
poissons_ratio = -0.25
density = 1060
[[fixed]]
box = {min = [0, 1, 2], max = [3, 4, 5]}
[[fixed]]
half_space = {point = [1, 2, 3], normal = [0, 0, -1]}
[[fixed]]
sphere = {center = [1, 1, 1], radius = 0.5}
[[fixed]]
nodes = [0, 7]
[[fixed]]
tag = 3
[storage]
scope = "surface"
precision = "double"
)");
  const ImageGeometry& image = std::get<ImageGeometry>(d.geometry);
  EXPECT_EQ(image.file, folder.path() / "scan.inr.gz");
  EXPECT_EQ(image.labels, (std::vector<int>{255, 127}));
  EXPECT_EQ(d.scale, 0.001);
  EXPECT_EQ(d.mesh.edge_length, 0.005);
  EXPECT_EQ(d.mesh.grading, 0.0);
  EXPECT_EQ(d.mesh.radius_edge, 3.0);
  EXPECT_EQ(d.mesh.facet_distance, 0.001);
  EXPECT_EQ(d.material.poissons_ratio, -0.25);
  EXPECT_EQ(d.material.density, 1060.0);
  ASSERT_EQ(d.fixed.size(), 5U);
  EXPECT_EQ(std::get<SelectBox>(d.fixed[0]).max, Vec3(3, 4, 5));
  EXPECT_EQ(std::get<SelectHalfSpace>(d.fixed[1]).normal, Vec3(0, 0, -1));
  EXPECT_EQ(std::get<SelectSphere>(d.fixed[2]).radius, 0.5);
  EXPECT_EQ(std::get<SelectNodes>(d.fixed[3]).nodes, (std::vector<Index>{0, 7}));
  EXPECT_EQ(std::get<SelectTag>(d.fixed[4]).tag, 3);
  EXPECT_EQ(d.scope, Scope::surface);
  EXPECT_EQ(d.layers, 0);
  EXPECT_EQ(d.precision, Precision::double_precision);
}

TEST(Description, ReadsTheOtherGeometries) {
  const TempFolder folder;
  const auto geometry = [&](const std::string& line) {
    return read(folder, "name = \"g\"\n[geometry]\n" + line + "\n" + material + fixed);
  };
  const Description surface =
      geometry("surface = \"a.stl\"\n[mesh]\nremesh = true\nedge_length = 1\nmin_dihedral = 5");
  EXPECT_EQ(std::get<SurfaceGeometry>(surface.geometry).file, folder.path() / "a.stl");
  EXPECT_TRUE(surface.mesh.remesh);
  EXPECT_EQ(surface.mesh.min_dihedral, 5.0);
  EXPECT_EQ(std::get<VolumeGeometry>(geometry("volume = \"/b/c.msh\"").geometry).file, "/b/c.msh");
  const auto cylinder = std::get<CylinderShape>(
      geometry("cylinder = {radius = 1, height = 2, cells_across = 4, cells_along = 5}").geometry);
  EXPECT_EQ(cylinder.radius + cylinder.height + cylinder.cells_across + cylinder.cells_along, 12.0);
  const auto sphere = std::get<SphereShape>(geometry("sphere = {radius = 3, cells_across = 6}").geometry);
  EXPECT_EQ(sphere.radius + sphere.cells_across, 9.0);
}

struct BadCase {
  const char* name;
  std::string text;
  std::vector<std::string> mentions;
};

class BadDescription : public ::testing::TestWithParam<BadCase> {};

TEST_P(BadDescription, SaysWhatIsWrongAndWhere) {
  const TempFolder folder;
  expect_mentions(error_of([&] { read(folder, GetParam().text); }), GetParam().mentions);
}

std::string with_geometry(const std::string& lines) {
  return "name = \"a\"\n[geometry]\n" + lines + "\n" + material + fixed;
}
std::string with_material(const std::string& lines) {
  return "name = \"a\"\n" + box + "[material]\n" + lines + "\n" + fixed;
}
std::string with_fixed(const std::string& lines) {
  return "name = \"a\"\n" + box + material + lines + "\n";
}
std::string with_storage(const std::string& lines) {
  return "name = \"a\"\n" + box + material + fixed + "[storage]\n" + lines + "\n";
}
std::string with_image_mesh(const std::string& lines) {
  return with_geometry("image = \"i.inr\"\n[mesh]\n" + lines);
}

const BadCase bad_cases[] = {
    {"Syntax", "name = \n", {"model.toml:1:", "not valid TOML"}},
    {"UnknownTopKey",
     "name = \"a\"\nmaterail = 1\n" + box + fixed,
     {"model.toml:2:1", "materail", "\"material\""}},
    {"UnknownKey",
     with_material("youngs_modulus = 1\npoisons_ratio = 0.3"),
     {"model.toml:6:1", "poisons_ratio", "[material]", "\"poissons_ratio\""}},
    {"UnknownNestedKey",
     with_geometry("box = {size = [1, 1, 1], cell = [1, 1, 1]}"),
     {"model.toml:3:", "\"cell\"", "[geometry] box", "\"cells\""}},
    {"NoName", box + material + fixed, {"name is missing"}},
    {"NameIsPath", "name = \"a/b\"\n" + box + material + fixed, {"model.toml:1:8", "a/b"}},
    {"NoGeometry", "name = \"a\"\n" + material + fixed, {"geometry is missing"}},
    {"EmptyGeometry", with_geometry(""), {"model.toml:2:", "surface, image, volume, box"}},
    {"TwoGeometries",
     with_geometry("surface = \"a.off\"\nimage = \"b.inr\""),
     {"model.toml:4:", "surface and image"}},
    {"SurfaceIsNumber", with_geometry("surface = 3"), {"model.toml:3:11", "surface must be a text"}},
    {"LabelsOfBox",
     with_geometry("sphere = {radius = 1, cells_across = 2}\nlabels = [1]"),
     {"model.toml:4:", "labels"}},
    {"NoLabels",
     with_geometry("image = \"a.inr\"\nlabels = []\n[mesh]\nedge_length = 1"),
     {"model.toml:4:", "empty"}},
    {"LabelIsFraction",
     with_geometry("image = \"a.inr\"\nlabels = [1.5]"),
     {"labels must be a whole number"}},
    {"ScaleZero",
     with_geometry("surface = \"a.off\"\nscale = 0"),
     {"model.toml:4:9", "scale", "greater than 0"}},
    {"ScaleNan", with_geometry("surface = \"a.off\"\nscale = nan"), {"model.toml:4:", "scale", "finite"}},
    {"SizeOfTwo",
     with_geometry("box = {size = [1, 1], cells = [1, 1, 1]}"),
     {"size must be [three numbers]"}},
    {"SizeNegative",
     with_geometry("box = {size = [1, -1, 1], cells = [1, 1, 1]}"),
     {"size must be greater than 0"}},
    {"CellsZero",
     with_geometry("box = {size = [1, 1, 1], cells = [1, 0, 1]}"),
     {"cells must be at least 1, not 0"}},
    {"CellsTooMany",
     with_geometry("box = {size = [1, 1, 1], cells = [9999, 9999, 9999]}"),
     {"too many cells"}},
    {"CellsOdd", with_geometry("sphere = {radius = 1, cells_across = 5}"), {"even", "not 5", "use 6"}},
    {"MeshOfBox",
     with_geometry("box = {size = [1, 1, 1], cells = [1, 1, 1]}\n[mesh]\ngrading = 1"),
     {"model.toml:5:11", "grading does not apply", "box"}},
    {"RemeshOfImage",
     with_image_mesh("edge_length = 1\nremesh = true"),
     {"model.toml:6:", "remesh does not apply", "image"}},
    {"DistanceOfSurface",
     with_geometry("surface = \"a.off\"\n[mesh]\nfacet_distance = 1"),
     {"facet_distance does not apply", "surface"}},
    {"WrongMesher",
     with_image_mesh("edge_length = 1\nmesher = \"tetgen\""),
     {"model.toml:6:", "tetgen", "use mesher = \"cgal\""}},
    {"ImageWithoutEdge", with_image_mesh("grading = 1"), {"model.toml", "no edge_length"}},
    {"RemeshWithoutEdge", with_geometry("surface = \"a.off\"\n[mesh]\nremesh = true"), {"no edge_length"}},
    {"RemeshIsText",
     with_geometry("surface = \"a.off\"\n[mesh]\nremesh = \"yes\""),
     {"remesh must be true or false"}},
    {"EdgeNegative", with_image_mesh("edge_length = -0.1"), {"edge_length must be greater than 0, not -0.1"}},
    {"GradingNegative",
     with_image_mesh("edge_length = 1\ngrading = -1"),
     {"grading must be from 0 to 10, not -1"}},
    {"RadiusEdgeSmall",
     with_image_mesh("edge_length = 1\nradius_edge = 0.5"),
     {"radius_edge must be from 1"}},
    {"NoYoungsModulus",
     with_material("poissons_ratio = 0.3"),
     {"model.toml:4:", "youngs_modulus is missing"}},
    {"YoungsModulusZero",
     with_material("youngs_modulus = 0\npoissons_ratio = 0.3"),
     {"model.toml:5:18", "youngs_modulus must be greater than 0"}},
    {"YoungsModulusInf",
     with_material("youngs_modulus = inf\npoissons_ratio = 0.3"),
     {"youngs_modulus is not a finite"}},
    {"YoungsModulusText",
     with_material("youngs_modulus = \"1e4\"\npoissons_ratio = 0.3"),
     {"must be a number"}},
    {"Incompressible",
     with_material("youngs_modulus = 1\npoissons_ratio = 0.5"),
     {"model.toml:6:", "between -1 and 1/2", "0.5"}},
    {"PoissonMinusOne", with_material("youngs_modulus = 1\npoissons_ratio = -1"), {"between -1 and 1/2"}},
    {"DensityZero",
     with_material("youngs_modulus = 1\npoissons_ratio = 0\ndensity = 0"),
     {"density must be greater than 0"}},
    {"NotFixed", with_fixed(""), {"no region is fixed", "[[fixed]]"}},
    {"FixedEmpty", "name = \"a\"\nfixed = []\n" + box + material, {"model.toml:2:", "at least one region"}},
    {"FixedSaysNothing", with_fixed("[[fixed]]"), {"[[fixed]] says nothing", "half_space"}},
    {"FixedTwoKinds", with_fixed("[[fixed]]\ntag = 1\nnodes = [1]"), {"both nodes and tag"}},
    {"FixedUnknown", with_fixed("[[fixed]]\nplane = 1"), {"model.toml:8:1", "\"plane\""}},
    {"BoxReversed",
     with_fixed("[[fixed]]\nbox = {min = [0, 0, 1], max = [1, 1, 0]}"),
     {"min is greater than max"}},
    {"NormalZero",
     with_fixed("[[fixed]]\nhalf_space = {point = [0, 0, 0], normal = [0, 0, 0]}"),
     {"zero vector"}},
    {"NodesEmpty", with_fixed("[[fixed]]\nnodes = []"), {"nodes is empty"}},
    {"NodeTooLarge", with_fixed("[[fixed]]\nnodes = [3000000000]"), {"out of range", "3000000000"}},
    {"BadAxis", with_fixed("[[fixed]]\nlowest = {axis = \"w\", percent = 5}"), {"model.toml:8:", "\"w\""}},
    {"PercentTooLarge", with_fixed("[[fixed]]\nlowest = {axis = \"x\", percent = 101}"), {"percent is 101"}},
    {"BadScope", with_storage("scope = \"all\""), {"model.toml:10:", "\"all\"", "\"full\""}},
    {"LayersOfSurface",
     with_storage("scope = \"surface\"\nlayers = 2"),
     {"layers applies to scope \"layers\" only"}},
    {"LayersZero", with_storage("layers = 0"), {"layers must be at least 1"}},
    {"BadPrecision", with_storage("precision = \"half\""), {"\"half\"", "\"single\""}},
};

INSTANTIATE_TEST_SUITE_P(Cases, BadDescription, ::testing::ValuesIn(bad_cases),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(Description, MissingFile) {
  const TempFolder folder;
  expect_mentions(error_of([&] { read_description(folder.path() / "none.toml"); }),
                  {"none.toml", "cannot read"});
  expect_mentions(error_of([&] { read_description(folder.path()); }), {"cannot read"});
}

}  // namespace
}  // namespace palpate
