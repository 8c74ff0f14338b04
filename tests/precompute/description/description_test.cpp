// model.toml: what is read, and what a person is told when it is wrong.
#include "precompute/description/description.h"

#include <gtest/gtest.h>

#include "precompute/description/read_description.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::description_test {
namespace {

using testing::error_of;
using testing::expect_mentions;
using testing::TempFolder;

const std::string material = "[material]\nyoungs_modulus = 1e4\npoissons_ratio = 0.3\n";
const std::string fixed = "[[fixed]]\nlowest = {axis = \"z\", percent = 5}\n";
const std::string fixed_y = "[[fixed]]\nlowest = {axis = \"y\", percent = 5}\n";
const std::string rectangle = "[geometry]\nrectangle = {size = [1, 2], cells = [2, 3]}\n";
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
  EXPECT_EQ(d.analysis, Analysis::solid);
  EXPECT_EQ(d.thickness, 1.0);
  EXPECT_EQ(d.mesh.element, ElementType::tet4a);
  EXPECT_EQ(d.mesh.mesher, Mesher::tetgen);
  EXPECT_FALSE(d.mesh.edge_length);
  EXPECT_FALSE(d.mesh.remesh);
  EXPECT_EQ(d.mesh.grading, 0.5);
  EXPECT_EQ(d.mesh.radius_edge, 2.0);
  EXPECT_EQ(d.mesh.min_dihedral, 10.0);
  EXPECT_EQ(d.mesh.facet_distance, 0.0);
  EXPECT_EQ(d.mesh.feature_angle, 60.0);
  EXPECT_FALSE(d.mesh.odt);
  EXPECT_FALSE(d.mesh.lloyd);
  EXPECT_TRUE(d.mesh.perturb);
  EXPECT_TRUE(d.mesh.exude);
  ASSERT_EQ(d.materials.size(), 1U);
  EXPECT_EQ(d.materials[0].material.youngs_modulus, 1e4);
  EXPECT_EQ(d.materials[0].material.density, 1000.0);
  EXPECT_EQ(d.materials[0].material.friction, 0.0);
  EXPECT_EQ(d.materials[0].material.initial_strain, (std::array<double, 6>{}));
  EXPECT_TRUE(d.materials[0].regions.empty());
  EXPECT_FALSE(d.materials[0].where);
  ASSERT_EQ(d.fixed.size(), 1U);
  EXPECT_EQ(std::get<SelectLowest>(d.fixed[0].where).axis, 2);
  EXPECT_DOUBLE_EQ(std::get<SelectLowest>(d.fixed[0].where).fraction, 0.05);
  EXPECT_EQ(d.fixed[0].axes, 7);
  EXPECT_EQ(d.fixed[0].displacement, Vec3(0, 0, 0));
  EXPECT_TRUE(d.loads.empty());
  EXPECT_EQ(d.scope, Scope::layers);
  EXPECT_EQ(d.layers, 1);
  EXPECT_FALSE(d.precision) << "as good as it must be";
  EXPECT_FALSE(d.overlay);
  EXPECT_FALSE(d.dynamics);
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
element = "tet10"
mesher = "cgal"
optimize = ["exude", "odt"]
edge_length = 0.005
grading = 0
radius_edge = 3
facet_distance = 0.001
[material]
youngs_modulus = 5000
poissons_ratio = -0.25
density = 1060
friction = 0.125
initial_strain = [1, 2, 3, 4, 5, 6]
[[fixed]]
box = {min = [0, 1, 2], max = [3, 4, 5]}
[[fixed]]
half_space = {point = [1, 2, 3], normal = [0, 0, -1]}
axes = "zx"
displacement = [0.5, 0, -0.25]
[[fixed]]
sphere = {center = [1, 1, 1], radius = 0.5}
[[fixed]]
nodes = [0, 7]
[[fixed]]
tag = 3
[[load]]
nodal_force = [1, 2, 3]
nodes = [4]
[[load]]
traction = [0, 0, -100]
lowest = {axis = "y", percent = 50}
[[load]]
gravity = [0, 0, -9.81]
[storage]
scope = "surface"
precision = "double"
)");
  const ImageGeometry& image = std::get<ImageGeometry>(d.geometry);
  EXPECT_EQ(image.file, folder.path() / "scan.inr.gz");
  EXPECT_EQ(image.labels, (std::vector<int>{255, 127}));
  EXPECT_FALSE(image.regions);
  EXPECT_EQ(d.scale, 0.001);
  EXPECT_EQ(d.mesh.element, ElementType::tet10);
  EXPECT_EQ(d.mesh.mesher, Mesher::cgal);
  EXPECT_TRUE(d.mesh.odt && d.mesh.exude);
  EXPECT_FALSE(d.mesh.lloyd || d.mesh.perturb);
  EXPECT_EQ(d.mesh.edge_length, 0.005);
  EXPECT_EQ(d.mesh.grading, 0.0);
  EXPECT_EQ(d.mesh.radius_edge, 3.0);
  EXPECT_EQ(d.mesh.facet_distance, 0.001);
  const Material& made_of = d.materials.at(0).material;
  EXPECT_EQ(made_of.poissons_ratio, -0.25);
  EXPECT_EQ(made_of.density, 1060.0);
  EXPECT_EQ(made_of.friction, 0.125);
  EXPECT_EQ(made_of.initial_strain, (std::array<double, 6>{1, 2, 3, 4, 5, 6}));
  ASSERT_EQ(d.fixed.size(), 5U);
  EXPECT_EQ(std::get<SelectBox>(d.fixed[0].where).max, Vec3(3, 4, 5));
  EXPECT_EQ(std::get<SelectHalfSpace>(d.fixed[1].where).normal, Vec3(0, 0, -1));
  EXPECT_EQ(std::get<SelectSphere>(d.fixed[2].where).radius, 0.5);
  EXPECT_EQ(std::get<SelectNodes>(d.fixed[3].where).nodes, (std::vector<Index>{0, 7}));
  EXPECT_EQ(std::get<SelectTag>(d.fixed[4].where).tag, 3);
  EXPECT_EQ(d.fixed[1].axes, 0b101);
  EXPECT_EQ(d.fixed[1].displacement, Vec3(0.5, 0, -0.25));
  ASSERT_EQ(d.loads.size(), 3U);
  EXPECT_EQ(std::get<ConcentratedForce>(d.loads[0]).force, Vec3(1, 2, 3));
  EXPECT_EQ(std::get<SelectNodes>(std::get<ConcentratedForce>(d.loads[0]).where).nodes,
            std::vector<Index>{4});
  EXPECT_EQ(std::get<Traction>(d.loads[1]).traction, Vec3(0, 0, -100));
  EXPECT_EQ(std::get<SelectLowest>(std::get<Traction>(d.loads[1]).where).axis, 1);
  EXPECT_EQ(std::get<Gravity>(d.loads[2]).acceleration, Vec3(0, 0, -9.81));
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

TEST(Description, ReadsThePlane) {
  const TempFolder folder;
  const auto plane = [&](const std::string& top, const std::string& geometry) {
    return read(folder, "name = \"p\"\n" + top + "\n[geometry]\n" + geometry + "\n" + material + fixed_y);
  };
  const Description plate = plane("plane = \"strain\"\nthickness = 0.02",
                                  "rectangle = {origin = [1, 2], size = [3, 4], cells = [5, 6]}");
  EXPECT_EQ(plate.analysis, Analysis::plane_strain);
  EXPECT_EQ(plate.thickness, 0.02);
  const auto& shape = std::get<RectangleShape>(plate.geometry);
  EXPECT_EQ(shape.origin, Vec3(1, 2, 0));
  EXPECT_EQ(shape.size, Vec3(3, 4, 0));
  EXPECT_EQ(shape.cells, (std::array<int, 2>{5, 6}));
  EXPECT_EQ(plate.scope, Scope::full);  // unless told otherwise
  EXPECT_EQ(plate.fixed.at(0).axes, 3);
  EXPECT_EQ(std::get<SelectLowest>(plate.fixed[0].where).axis, 1);

  const Description frame = plane("plane = \"stress\"",
                                  "polygon = {points = [[0, 0], [9, 0], [0, 9]], "
                                  "holes = [[[1, 1], [2, 1], [1, 2]], [[3, 3], [4, 3], [3, 4.5]]]}\n"
                                  "[mesh]\nedge_length = 1\noptimize = [\"lloyd\"]");
  EXPECT_EQ(frame.analysis, Analysis::plane_stress);
  EXPECT_EQ(frame.thickness, 1.0);
  const auto& polygon = std::get<PolygonGeometry>(frame.geometry);
  EXPECT_EQ(polygon.points, (std::vector<Vec3>{{0, 0, 0}, {9, 0, 0}, {0, 9, 0}}));
  ASSERT_EQ(polygon.holes.size(), 2U);
  EXPECT_EQ(polygon.holes[1].at(2), Vec3(3, 4.5, 0));
  EXPECT_TRUE(frame.mesh.lloyd);
  EXPECT_FALSE(frame.mesh.odt || frame.mesh.perturb || frame.mesh.exude);

  const Description picture =
      plane("plane = \"stress\"", "picture = \"body.png\"\nscale = 0.001\n[mesh]\nedge_length = 1");
  EXPECT_EQ(std::get<PictureGeometry>(picture.geometry).file, folder.path() / "body.png");
  EXPECT_FALSE(picture.mesh.lloyd || picture.mesh.perturb || picture.mesh.exude);
  EXPECT_TRUE(
      std::holds_alternative<VolumeGeometry>(plane("plane = \"stress\"", "volume = \"plate.msh\"").geometry));
}

TEST(Description, ReadsOverlays) {
  const TempFolder folder;
  const std::string head = "name = \"a\"\n" + box + material + fixed + "[storage]\nlayers = 4\n";
  const Description usual = read(folder, head + "[overlay]\n[[overlay.region]]\ntag = 2\n");
  ASSERT_TRUE(usual.overlay);
  EXPECT_EQ(usual.overlay->refinement, 3);
  EXPECT_EQ(usual.overlay->rings, 2);
  const Description d = read(folder, head + R"([overlay]
refinement = 2
rings = 4
[[overlay.region]]
sphere = {center = [1, 2, 3], radius = 0.5}
[[overlay.region]]
lowest = {axis = "z", percent = 25}
)");
  EXPECT_EQ(d.overlay->refinement, 2);
  EXPECT_EQ(d.overlay->rings, 4);
  ASSERT_EQ(d.overlay->regions.size(), 2U);
  EXPECT_EQ(std::get<SelectSphere>(d.overlay->regions[0]).center, Vec3(1, 2, 3));
  EXPECT_EQ(std::get<SelectLowest>(d.overlay->regions[1]).fraction, 0.25);
}

TEST(Description, WithoutGreensFunctionsNeedsNothingFixed) {
  const TempFolder folder;
  const std::string head = "name = \"a\"\n" + box + material;
  const Description bare = read(folder, head + "[storage]\nscope = \"none\"\n");
  EXPECT_EQ(bare.scope, Scope::none);
  EXPECT_TRUE(bare.fixed.empty());
  EXPECT_EQ(read(folder, head + fixed + "[storage]\nscope = \"none\"\n").fixed.size(), 1U);
  for (const auto& [more, words] :
       {std::pair("precision = \"double\"\n", "precision is about Green's functions"),
        std::pair("compression = \"h2\"\n", "compression is about"), std::pair("layers = 2\n", "layers"),
        std::pair("[dynamics]\n", "[dynamics] needs Green's functions"),
        std::pair("[overlay]\nrings = 1\n[[overlay.region]]\ntag = 2\n", "[overlay] needs")}) {
    try {
      read(folder, head + "[storage]\nscope = \"none\"\n" + more);
      ADD_FAILURE() << more;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
}

TEST(Description, ReadsDynamics) {
  const TempFolder folder;
  const std::string head = "name = \"a\"\n" + box + material + fixed + "[storage]\nscope = \"full\"\n";
  const Description usual = read(folder, head + "[dynamics]\n");
  ASSERT_TRUE(usual.dynamics);
  EXPECT_FALSE(usual.dynamics->method);
  EXPECT_FALSE(usual.dynamics->modes);
  EXPECT_FALSE(usual.dynamics->lumped);
  EXPECT_EQ(usual.dynamics->newmark.time_step, 0.001);
  EXPECT_EQ(usual.dynamics->newmark.alpha, 0.25);
  EXPECT_EQ(usual.dynamics->newmark.delta, 0.5);
  EXPECT_EQ(usual.dynamics->damping.mass, 0.0);
  EXPECT_EQ(usual.dynamics->damping.stiffness, 0.0);
  const Description packed = read(folder, head + R"([dynamics]
method = "packed"
time_step = 0.002
delta = 0.6
alpha = 0.3025
mass = "lumped"
damping = {stiffness = 1e-4}
)");
  EXPECT_EQ(packed.dynamics->method, DynamicsMethod::packed);
  EXPECT_TRUE(packed.dynamics->lumped);
  EXPECT_EQ(packed.dynamics->newmark.time_step, 0.002);
  EXPECT_EQ(packed.dynamics->newmark.alpha, 0.3025);
  EXPECT_EQ(packed.dynamics->newmark.delta, 0.6);
  EXPECT_EQ(packed.dynamics->damping.mass, 0.0);
  EXPECT_EQ(packed.dynamics->damping.stiffness, 1e-4);
}

/// zeta = (a / omega + b omega) / 2 at both frequencies.
TEST(Description, DampingRatiosAreThoseAtTheirFrequencies) {
  const TempFolder folder;
  const Description d = read(folder, "name = \"a\"\n" + box + material + fixed + R"([dynamics]
method = "modal"
modes = 7
damping = {ratios = [0.05, 0.08], frequencies = [20, 2]}
)");
  EXPECT_EQ(d.dynamics->modes, 7);
  const Rayleigh damping = d.dynamics->damping;
  const auto ratio = [&](double hertz) {
    const double omega = 2.0 * std::acos(-1.0) * hertz;
    return (damping.mass / omega + damping.stiffness * omega) / 2.0;
  };
  EXPECT_NEAR(ratio(20.0), 0.05, 1e-12);
  EXPECT_NEAR(ratio(2.0), 0.08, 1e-12);
}

TEST(Description, ReadsVectorsOfThePlane) {
  const TempFolder folder;
  const Description d = read(folder, "name = \"p\"\nplane = \"stress\"\n" + rectangle + material +
                                         "initial_strain = [1, 2, 3, 4]\n" + R"(
[[fixed]]
box = {min = [0, 1], max = [2, 3]}
axes = "y"
displacement = [0, 0.5]
[[fixed]]
half_space = {point = [1, 2], normal = [0, 1]}
[[fixed]]
sphere = {center = [3, 4], radius = 5}
[[load]]
gravity = [0, -9.81]
)");
  EXPECT_EQ(d.materials.at(0).material.initial_strain, (std::array<double, 6>{1, 2, 3, 4, 0, 0}));
  EXPECT_EQ(std::get<SelectBox>(d.fixed.at(0).where).max, Vec3(2, 3, 0));
  EXPECT_EQ(d.fixed[0].axes, 2);
  EXPECT_EQ(d.fixed[0].displacement, Vec3(0, 0.5, 0));
  EXPECT_EQ(std::get<SelectHalfSpace>(d.fixed.at(1).where).normal, Vec3(0, 1, 0));
  EXPECT_EQ(std::get<SelectSphere>(d.fixed.at(2).where).center, Vec3(3, 4, 0));
  EXPECT_EQ(std::get<Gravity>(d.loads.at(0)).acceleration, Vec3(0, -9.81, 0));
}

TEST(Description, ReadsMaterials) {
  const TempFolder folder;
  const Description d = read(folder, R"(
name = "nodule"
geometry.image = "scan.inr"
mesh.edge_length = 1
[[material]]
youngs_modulus = 1
poissons_ratio = 0.1
regions = [127, 85]
[[material]]
youngs_modulus = 2
poissons_ratio = 0.2
friction = 0.5
sphere = {center = [0, 0, 1], radius = 2}
[[material]]
youngs_modulus = 3
poissons_ratio = 0.3
)" + fixed);
  ASSERT_EQ(d.materials.size(), 3U);
  EXPECT_EQ(d.materials[0].regions, (std::vector<Index>{127, 85}));
  EXPECT_EQ(d.materials[1].material.youngs_modulus, 2.0);
  EXPECT_EQ(d.materials[0].material.friction, 0.0);
  EXPECT_EQ(d.materials[1].material.friction, 0.5);
  EXPECT_EQ(std::get<SelectSphere>(d.materials[1].where.value()).radius, 2.0);
  EXPECT_TRUE(d.materials[2].regions.empty() && !d.materials[2].where);
  EXPECT_TRUE(std::get<ImageGeometry>(d.geometry).regions);
}

TEST(Description, ReadsElementsAndMeshers) {
  const TempFolder folder;
  const auto options = [&](const std::string& geometry, const std::string& mesh) {
    return read(folder,
                "name = \"e\"\n[geometry]\n" + geometry + "\n[mesh]\n" + mesh + "\n" + material + fixed)
        .mesh;
  };
  const std::string surface = "surface = \"a.off\"", image = "image = \"a.inr\"";
  EXPECT_EQ(options(surface, "").mesher, Mesher::tetgen);
  const MeshOptions cgal = options(surface, "mesher = \"cgal\"\nfeature_angle = 30\nfacet_distance = 2");
  EXPECT_EQ(cgal.mesher, Mesher::cgal);
  EXPECT_EQ(cgal.feature_angle, 30.0);
  EXPECT_EQ(cgal.facet_distance, 2.0);
  EXPECT_TRUE(cgal.perturb && cgal.exude);
  EXPECT_FALSE(cgal.odt || cgal.lloyd);
  const MeshOptions plain = options(surface, "mesher = \"cgal\"\noptimize = []");
  EXPECT_FALSE(plain.odt || plain.lloyd || plain.perturb || plain.exude);
  EXPECT_EQ(options(image, "edge_length = 1").mesher, Mesher::cgal);
  EXPECT_EQ(options(image, "edge_length = 1\nmesher = \"tetgen\"\nmin_dihedral = 5").mesher, Mesher::tetgen);
  EXPECT_EQ(options("box = {size = [1, 1, 1], cells = [1, 1, 1]}", "element = \"hex8\"").element,
            ElementType::hex8);
  EXPECT_EQ(options("sphere = {radius = 1, cells_across = 2}", "element = \"tet10\"").element,
            ElementType::tet10);
  EXPECT_EQ(options("volume = \"a.msh\"", "element = \"tet4\"").element, ElementType::tet4);
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
const std::string region = "[[overlay.region]]\nnodes = [1]\n";
std::string with_overlay(const std::string& lines) {
  return with_storage("scope = \"layers\"\nlayers = 2\n[overlay]\n" + lines);
}
/// Line 10 is the first of the table.
std::string with_dynamics(const std::string& lines) {
  return "name = \"a\"\n" + box + material + fixed + "[dynamics]\n" + lines + "\n";
}
std::string with_image_mesh(const std::string& lines) {
  return with_geometry("image = \"i.inr\"\n[mesh]\n" + lines);
}
std::string with_surface_mesh(const std::string& lines) {
  return with_geometry("surface = \"a.off\"\n[mesh]\n" + lines);
}
/// Line 4 is the geometry.
std::string in_plane(const std::string& geometry, const std::string& fixing = fixed_y) {
  return "name = \"a\"\nplane = \"stress\"\n[geometry]\n" + geometry + "\n" + material + fixing;
}
std::string in_plate(const std::string& fixing) {
  return in_plane("rectangle = {size = [1, 2], cells = [2, 3]}", fixing);
}
std::string with_materials(const std::string& first, const std::string& second) {
  const std::string entry = "[[material]]\nyoungs_modulus = 1\npoissons_ratio = 0.3\n";
  return "name = \"a\"\n" + box + entry + first + "\n" + entry + second + "\n" + fixed;
}
std::string with_load(const std::string& lines) {
  return "name = \"a\"\n" + box + material + fixed + "[[load]]\n" + lines + "\n";
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
    {"RangeGoesDown",
     with_geometry("image = \"a.inr\"\nrange = [200, -100]"),
     {"model.toml:4:", "range goes down"}},
    {"RangeAndLabels",
     with_geometry("image = \"a.inr\"\nlabels = [1]\nrange = [0, 100]"),
     {"labels and range"}},
    {"RangeOfASphere",
     with_geometry("sphere = {radius = 1, cells_across = 2}\nrange = [0, 1]"),
     {"range applies to images only"}},
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
    {"CellsAcrossTooMany",
     with_geometry("sphere = {radius = 1, cells_across = 2147483647}"),
     {"cells_across", "too many cells", "357913941"}},
    {"CellsAcrossACylinderTooMany",
     with_geometry("cylinder = {radius = 1, height = 1, cells_across = 2147483647, cells_along = 1}"),
     {"cells_across", "too many cells"}},
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
    {"UnknownMesher",
     with_image_mesh("edge_length = 1\nmesher = \"netgen\""),
     {"model.toml:6:10", "netgen", "\"cgal\" or \"tetgen\""}},
    {"MesherOfBox",
     with_geometry("box = {size = [1, 1, 1], cells = [1, 1, 1]}\n[mesh]\nmesher = \"cgal\""),
     {"model.toml:5:10", "mesher does not apply", "box"}},
    {"OptimizeOfTetgen",
     with_surface_mesh("optimize = [\"odt\"]"),
     {"model.toml:5:12", "optimize does not apply", "mesher \"tetgen\"", "set mesher = \"cgal\""}},
    {"RemeshOfCgal",
     with_surface_mesh("mesher = \"cgal\"\nremesh = true"),
     {"model.toml:6:10", "remesh does not apply", "mesher \"cgal\"", "set mesher = \"tetgen\""}},
    {"FeaturesOfImage",
     with_image_mesh("edge_length = 1\nfeature_angle = 60"),
     {"feature_angle does not apply", "image"}},
    {"FeatureAngleTooLarge",
     with_surface_mesh("mesher = \"cgal\"\nfeature_angle = 200"),
     {"feature_angle must be from 0 to 180, not 200"}},
    {"UnknownOptimization",
     with_image_mesh("edge_length = 1\noptimize = [\"exude\", \"loyd\"]"),
     {"model.toml:6:22", "\"loyd\"", "\"lloyd\" of odt, lloyd, perturb, exude"}},
    {"OptimizeIsText",
     with_image_mesh("edge_length = 1\noptimize = \"odt\""),
     {"model.toml:6:12", "optimize must be [a list of texts]"}},
    {"OdtAndLloyd",
     with_image_mesh("edge_length = 1\noptimize = [\"lloyd\", \"odt\"]"),
     {"model.toml:6:12", "both \"odt\" and \"lloyd\""}},
    {"ElementUnknown",
     with_image_mesh("element = \"tet5\""),
     {"model.toml:5:11", "tet5", "\"tet4\" or \"tet10\""}},
    {"ElementOfImage",
     with_image_mesh("element = \"hex8\""),
     {"model.toml:5:11", "hex8", "image", "\"tet4\" or \"tet10\""}},
    {"ElementOfBox",
     with_geometry("box = {size = [1, 1, 1], cells = [1, 1, 1]}\n[mesh]\nelement = \"quad4\""),
     {"quad4", "box", "\"tet4\", \"tet10\" or \"hex8\""}},
    {"ElementIsFacet",
     with_geometry("volume = \"a.msh\"\n[mesh]\nelement = \"tri6\""),
     {"tri6", "volume", "\"tri3\""}},
    {"PlaneMissing",
     "name = \"a\"\n" + rectangle + material + fixed_y,
     {"plane is missing", "rectangle", "\"strain\""}},
    {"PlaneOfBox",
     "name = \"a\"\nplane = \"stress\"\n" + box + material + fixed,
     {"model.toml:2:9", "box", "in space"}},
    {"PlaneUnknown",
     "name = \"a\"\nplane = \"sterss\"\n" + rectangle + material + fixed_y,
     {"model.toml:2:9", "\"sterss\"", "\"stress\" or \"strain\""}},
    {"ThicknessOfBox",
     "name = \"a\"\nthickness = 1\n" + box + material + fixed,
     {"model.toml:2:13", "thickness", "in space"}},
    {"ThicknessZero",
     "name = \"a\"\nplane = \"stress\"\nthickness = 0\n" + rectangle + material + fixed_y,
     {"model.toml:3:13", "thickness must be greater than 0"}},
    {"RectangleInSpace",
     in_plane("rectangle = {size = [1, 1, 1], cells = [1, 1]}"),
     {"model.toml:4:21", "size must be [two numbers]"}},
    {"RectangleCellsZero",
     in_plane("rectangle = {size = [1, 1], cells = [0, 1]}"),
     {"cells must be at least 1, not 0"}},
    {"RectangleSizeZero",
     in_plane("rectangle = {size = [1, 0], cells = [1, 1]}"),
     {"size must be greater than 0"}},
    {"PolygonOfTwo",
     in_plane("polygon = {points = [[0, 0], [1, 1]]}"),
     {"model.toml:4:21", "at least three points"}},
    {"PolygonInSpace",
     in_plane("polygon = {points = [[0, 0], [1, 1], [0, 1, 0]]}"),
     {"model.toml:4:38", "points [x, y]"}},
    {"PolygonOfTexts",
     in_plane("polygon = {points = [[0, 0], [1, 1], [0, \"1\"]]}"),
     {"model.toml:4:42", "points must be a number"}},
    {"HolesAreNotNested",
     in_plane("polygon = {points = [[0, 0], [1, 1], [0, 1]], holes = [[0, 0], [1, 1], [0, 1]]}"),
     {"holes must be a list of at least three points"}},
    {"PolygonWithoutEdge",
     in_plane("polygon = {points = [[0, 0], [1, 1], [0, 1]]}"),
     {"model.toml", "no edge_length"}},
    {"PictureWithoutEdge", in_plane("picture = \"a.png\""), {"no edge_length"}},
    {"PictureOfQuads",
     in_plane("picture = \"a.png\"\n[mesh]\nedge_length = 1\nelement = \"quad4\""),
     {"model.toml:7:11", "quad4", "picture", "use \"tri3\""}},
    {"OdtInThePlane",
     in_plane("picture = \"a.png\"\n[mesh]\nedge_length = 1\noptimize = [\"odt\"]"),
     {"model.toml:7:13", "\"odt\"", "\"lloyd\" only"}},
    {"RadiusEdgeInThePlane",
     in_plane("picture = \"a.png\"\n[mesh]\nedge_length = 1\nradius_edge = 2"),
     {"radius_edge does not apply", "picture", "grading"}},
    {"SelectionOfThree",
     in_plate("[[fixed]]\nbox = {min = [0, 0, 0], max = [1, 1, 1]}"),
     {"model.toml:9:14", "[[fixed]] box min must be [two numbers]"}},
    {"LowestZInThePlane",
     in_plate("[[fixed]]\nlowest = {axis = \"z\", percent = 5}"),
     {"model.toml:9:18", "\"z\"", "\"x\" or \"y\""}},
    {"AxesInThePlane",
     in_plate("[[fixed]]\nnodes = [1]\naxes = \"z\""),
     {"model.toml:10:8", "axes is \"z\"", "\"xy\""}},
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
    {"FrictionNegative",
     with_material("youngs_modulus = 1\npoissons_ratio = 0\nfriction = -0.1"),
     {"model.toml:7:12", "[material] friction must be 0 or more, not -0.1"}},
    {"FrictionInf",
     with_material("youngs_modulus = 1\npoissons_ratio = 0\nfriction = inf"),
     {"friction is not a finite"}},
    {"SecondFrictionNegative",
     with_materials("regions = [1]", "friction = -2"),
     {"friction must be 0 or more, not -2"}},
    {"DensityZero",
     with_material("youngs_modulus = 1\npoissons_ratio = 0\ndensity = 0"),
     {"density must be greater than 0"}},
    {"InitialStrainOfThree",
     with_material("youngs_modulus = 1\npoissons_ratio = 0\ninitial_strain = [0, 0, 0]"),
     {"model.toml:7:18", "initial_strain must be [six numbers]"}},
    {"InitialStrainInThePlane",
     in_plate("initial_strain = [0, 0, 0]\n" + fixed_y),
     {"model.toml:8:18", "initial_strain must be [four numbers]"}},
    {"NoMaterial", "name = \"a\"\n" + box + fixed, {"material is missing"}},
    {"MaterialsEmpty",
     "name = \"a\"\nmaterial = []\n" + box + fixed,
     {"model.toml:2:12", "at least one table", "[[material]]"}},
    {"MaterialIsNumber",
     "name = \"a\"\nmaterial = [1]\n" + box + fixed,
     {"model.toml:2:13", "must be a table"}},
    {"TwoRests",
     with_materials("", ""),
     {"model.toml:8:1", "[[material]] number 2 is for the rest", "number 1", "regions"}},
    {"TwoClaims",
     with_materials("regions = [1]\nlowest = {axis = \"z\", percent = 5}", ""),
     {"model.toml:8:10", "[[material]] has both regions and lowest"}},
    {"NoRegions", with_materials("regions = []", ""), {"model.toml:7:11", "regions is empty"}},
    {"MaterialByTag",
     with_materials("tag = 1", ""),
     {"model.toml:7:1", "\"tag\"", "regions, box, half_space"}},
    {"SecondMaterialIncompressible",
     "name = \"a\"\n" + box + "[[material]]\nyoungs_modulus = 1\npoissons_ratio = 0.3\nregions = [1]\n" +
         "[[material]]\nyoungs_modulus = 1\npoissons_ratio = 0.5\n" + fixed,
     {"model.toml:10:18", "between -1 and 1/2"}},
    {"NotFixed", with_fixed(""), {"no region is fixed", "[[fixed]]"}},
    {"FixedEmpty", "name = \"a\"\nfixed = []\n" + box + material, {"model.toml:2:", "at least one table"}},
    {"FixedSaysNothing", with_fixed("[[fixed]]"), {"[[fixed]] has none of box", "half_space"}},
    {"FixedTwoKinds", with_fixed("[[fixed]]\ntag = 1\nnodes = [1]"), {"both nodes and tag"}},
    {"FixedUnknown", with_fixed("[[fixed]]\nplane = 1"), {"model.toml:8:1", "\"plane\""}},
    {"FixedIsTable",
     with_fixed("[fixed]\nnodes = [1]"),
     {"model.toml:7:1", "list of at least one table", "[[fixed]]"}},
    {"AxesUnknown",
     with_fixed("[[fixed]]\nnodes = [1]\naxes = \"xw\""),
     {"model.toml:9:8", "\"xw\"", "\"xyz\""}},
    {"AxesEmpty", with_fixed("[[fixed]]\nnodes = [1]\naxes = \"\""), {"axes is \"\""}},
    {"MovedAlongFreeAxis",
     with_fixed("[[fixed]]\nnodes = [1]\naxes = \"xz\"\ndisplacement = [0, 0.1, 0]"),
     {"model.toml:10:16", "along y is 0.1", "axes \"xz\"", "add y"}},
    {"MovedInThePlane",
     in_plate("[[fixed]]\nnodes = [1]\ndisplacement = [0, 0.1, 0]"),
     {"model.toml:10:16", "displacement must be [two numbers]"}},
    {"LoadSaysNothing", with_load(""), {"model.toml:9:1", "none of nodal_force, traction, gravity"}},
    {"LoadOfTwoKinds",
     with_load("traction = [1, 0, 0]\ngravity = [1, 0, 0]"),
     {"model.toml:11:11", "both traction and gravity"}},
    {"LoadUnknown", with_load("pressure = 1"), {"model.toml:10:1", "\"pressure\""}},
    {"LoadNowhere", with_load("nodal_force = [1, 0, 0]"), {"model.toml:9:1", "none of box", "lowest"}},
    {"LoadTwice",
     with_load("traction = [1, 0, 0]\ntag = 1\nnodes = [1]"),
     {"model.toml:11:7", "both nodes and tag"}},
    {"GravitySomewhere",
     with_load("gravity = [0, 0, -9.81]\ntag = 1"),
     {"model.toml:11:7", "gravity acts on the whole body", "remove tag"}},
    {"GravityIsNumber", with_load("gravity = 9.81"), {"model.toml:10:11", "gravity must be [three numbers]"}},
    {"LoadIsTable",
     "name = \"a\"\n" + box + material + fixed + "[load]\ngravity = [0, 0, 1]\n",
     {"model.toml:9:1", "list of at least one table", "[[load]]"}},
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
    {"OverlayUnknownKey",
     with_overlay("ring = 2\n" + region),
     {"model.toml:13:", "\"ring\"", "[overlay]", "\"rings\""}},
    {"OverlayRefinementOne",
     with_overlay("refinement = 1\n" + region),
     {"model.toml:13:", "[overlay] refinement must be from 2 to 16, not 1"}},
    {"OverlayRingsTooMany",
     with_overlay("rings = 17\n" + region),
     {"[overlay] rings must be from 1 to 16, not 17"}},
    {"OverlayDeeperThanStored",
     with_overlay("rings = 3\n" + region),
     {"model.toml:13:", "[overlay] rings reaches 3 layers", "[storage] keeps 2", "layers = 3"}},
    {"OverlayOfSurface",
     with_storage("scope = \"surface\"\n[overlay]\nrings = 1\n" + region),
     {"reaches 1 layer of", "keeps none"}},
    {"OverlayWithoutRegion", with_overlay("rings = 1\n"), {"[overlay] has no region", "[[overlay.region]]"}},
    {"OverlayRegionIsTable",
     with_overlay("[overlay.region]\nnodes = [1]\n"),
     {"[overlay] region must be a list of at least one table"}},
    {"OverlayRegionUnknown",
     with_overlay("[[overlay.region]]\nnode = [1]\n"),
     {"\"node\"", "[[overlay.region]]", "\"nodes\""}},
    {"OverlayRegionSaysNothing",
     with_overlay("[[overlay.region]]\n"),
     {"[[overlay.region]] has none of box"}},
    {"DynamicsUnknownKey",
     with_dynamics("timestep = 0.001"),
     {"model.toml:10:1", "\"timestep\"", "[dynamics]", "\"time_step\""}},
    {"DynamicsIsList",
     "name = \"a\"\n" + box + material + fixed + "[[dynamics]]\nmodes = 3\n",
     {"model.toml:9:1", "dynamics must be a table"}},
    {"DynamicsBadMethod",
     with_dynamics("method = \"implicit\""),
     {"model.toml:10:10", "\"implicit\"", "\"auto\", \"packed\" or \"modal\""}},
    {"DynamicsPackedOfLayers",
     with_dynamics("method = \"packed\""),
     {"model.toml:10:10", "needs every free dof", "scope = \"full\" in [storage]"}},
    {"DynamicsNoTime",
     with_dynamics("time_step = 0"),
     {"model.toml:10:13", "[dynamics] time_step must be greater than 0, not 0"}},
    {"DynamicsTimeBackwards",
     with_dynamics("time_step = -0.001"),
     {"model.toml:10:13", "time_step must be greater than 0, not -0.001"}},
    {"DynamicsTimeNan", with_dynamics("time_step = nan"), {"model.toml:10:13", "not a finite number"}},
    {"DynamicsDeltaSmall",
     with_dynamics("delta = 0.49"),
     {"model.toml:10:9", "delta must be at least 0.5, not 0.49", "energy grows"}},
    {"DynamicsAlphaSmall",
     with_dynamics("alpha = 0.2"),
     {"model.toml:10:9", "alpha must be at least (delta + 1/2)^2 / 4 = 0.25, not 0.2", "set alpha = 0.25"}},
    {"DynamicsAlphaSmallForDelta",
     with_dynamics("delta = 0.6"),
     {"model.toml:9:1", "= 0.3025, not 0.25", "set alpha = 0.3025"}},
    {"DynamicsBadMass",
     with_dynamics("mass = \"diagonal\""),
     {"model.toml:10:8", "\"diagonal\"", "\"consistent\" or \"lumped\""}},
    {"DynamicsDampingIsNumber",
     with_dynamics("damping = 0.1"),
     {"model.toml:10:11", "damping must be a table"}},
    {"DynamicsDampingUnknownKey",
     with_dynamics("damping = {ratio = 0.1}"),
     {"model.toml:10:12", "\"ratio\"", "[dynamics] damping", "\"ratios\""}},
    {"DynamicsDampingMassNegative",
     with_dynamics("damping = {mass = -1, stiffness = 0.1}"),
     {"model.toml:10:19", "[dynamics] damping mass must be 0 or more, not -1"}},
    {"DynamicsDampingStiffnessNegative",
     with_dynamics("damping = {stiffness = -0.1}"),
     {"model.toml:10:24", "[dynamics] damping stiffness must be 0 or more, not -0.1"}},
    {"DynamicsDampingTwice",
     with_dynamics("damping = {mass = 1, ratios = [0.1, 0.1], frequencies = [1, 2]}"),
     {"model.toml:10:19", "damping mass is given beside ratios"}},
    {"DynamicsRatiosWithoutFrequencies",
     with_dynamics("damping = {ratios = [0.1, 0.1]}"),
     {"model.toml:10:11", "[dynamics] damping frequencies is missing"}},
    {"DynamicsFrequenciesWithoutRatios",
     with_dynamics("damping = {frequencies = [1, 2]}"),
     {"[dynamics] damping ratios is missing"}},
    {"DynamicsOneRatio",
     with_dynamics("damping = {ratios = [0.1], frequencies = [1, 2]}"),
     {"damping ratios must be [two numbers]"}},
    {"DynamicsRatioNegative",
     with_dynamics("damping = {ratios = [0.1, -0.1], frequencies = [1, 2]}"),
     {"model.toml:10:21", "ratios must be 0 or more, not -0.1"}},
    {"DynamicsFrequencyZero",
     with_dynamics("damping = {ratios = [0.1, 0.1], frequencies = [0, 2]}"),
     {"model.toml:10:47", "frequencies must be greater than 0, not 0"}},
    {"DynamicsFrequenciesEqual",
     with_dynamics("damping = {ratios = [0.1, 0.2], frequencies = [2, 2]}"),
     {"model.toml:10:47", "frequencies are equal: 2"}},
    {"DynamicsRatiosGiveNegativeStiffness",
     with_dynamics("damping = {ratios = [0.1, 0.001], frequencies = [2, 20]}"),
     {"model.toml:10:21", "0.1 at 2 Hz and 0.001 at 20 Hz give stiffness = -", "negative damping"}},
    {"DynamicsRatiosGiveNegativeMass",
     with_dynamics("damping = {ratios = [0.001, 0.1], frequencies = [2, 20]}"),
     {"model.toml:10:21", "give mass = -", "negative damping"}},
    {"DynamicsNoModes", with_dynamics("modes = 0"), {"model.toml:10:9", "modes must be at least 1, not 0"}},
    {"DynamicsHalfAMode", with_dynamics("modes = 1.5"), {"model.toml:10:9", "modes must be a whole number"}},
    {"DynamicsModesOfPacked",
     with_storage("scope = \"full\"\n[dynamics]\nmethod = \"packed\"\nmodes = 7"),
     {"model.toml:13:9", "modes applies to method \"modal\" only"}},
    {"BadPrecision", with_storage("precision = \"half\""), {"\"half\"", "\"auto\"", "\"single\""}},
};

INSTANTIATE_TEST_SUITE_P(Cases, BadDescription, ::testing::ValuesIn(bad_cases),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(Description, MissingFile) {
  const TempFolder folder;
  expect_mentions(error_of([&] { read_description(folder.path() / "none.toml"); }),
                  {"none.toml", "No such file", "path of a model.toml"});
  expect_mentions(error_of([&] { read_description(folder.path()); }), {"is a folder"});
}

TEST(Description, LongTextsAreQuotedInShort) {
  const TempFolder folder;
  const std::string huge(70'000, 'w');  // no letter of an axis
  for (const std::string& text :
       {"name = \"a\"\n" + huge + " = 1\n" + box + material + fixed,
        "name = \"" + huge + "/\"\n" + box + material + fixed,
        "name = \"a\"\n" + box + "[mesh]\nelement = \"" + huge + "\"\n" + material + fixed,
        "name = \"a\"\n[geometry]\nsurface = \"" + huge + "\"\n" + material + fixed,
        "name = \"a\"\n[geometry]\nsurface = \"a\\u0000.off\"\n" + material + fixed,
        "name = \"a\"\n" + box + material + fixed + "axes = \"" + huge + "\"\n",
        "name = \"a\"\n" + box + material + fixed + "[storage]\nscope = \"" + huge + "\"\n"}) {
    const std::string error = error_of([&] { read(folder, text); });
    expect_mentions(error, {"model.toml"});
    EXPECT_LT(error.size(), 600U) << error;
  }
}

}  // namespace
}  // namespace palpate::description_test
