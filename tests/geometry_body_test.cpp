// From model.toml to a checked body; the sample models.
#include <gtest/gtest.h>

#include "precompute/body.h"
#include "tests/geometry_shapes.h"

namespace palpate {
namespace {

using testing::error_of;
using testing::expect_mentions;
using testing::TempFolder;
using testing::volume;

const std::filesystem::path models = std::filesystem::path(PALPATE_SOURCE_DIR) / "meshes" / "models";

void ignore(const std::string& /*text*/) {}

MeshedBody body_of(const std::filesystem::path& model) {
  return mesh_body(read_description(model), ignore);
}

std::string model(const std::string& geometry,
                  const std::string& fixed = "lowest = {axis = \"z\", percent = 20}") {
  return "name = \"m\"\n[geometry]\n" + geometry +
         "\n[material]\nyoungs_modulus = 1e4\npoissons_ratio = 0.3\n[[fixed]]\n" + fixed + "\n";
}

std::size_t count_fixed(const MeshedBody& body) {
  return static_cast<std::size_t>(std::count(body.fixed.begin(), body.fixed.end(), 1));
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

struct Sample {
  std::string name;
  int nodes, tets, fixed;
  double volume, tolerance;
};

TEST(Models, GeneratedOnesHaveTheirSizes) {
  const Sample samples[] = {
      {"cube", 7 * 7 * 7, 6 * 216, 49, 1.0, 1e-12},
      {"beam", 21 * 5 * 5, 6 * 320, 25, 0.2 * 0.04 * 0.04, 1e-12},
      {"beam15", 1024, 6 * 735, 64, 0.15 * 0.07 * 0.07, 1e-12},
      {"beam24", 3025, 6 * 2400, 121, 0.24 * 0.1 * 0.1, 1e-12},
  };
  for (const Sample& sample : samples) {
    const MeshedBody body = body_of(models / sample.name / "model.toml");
    EXPECT_EQ(body.mesh.nodes.size(), testing::at(sample.nodes)) << sample.name;
    EXPECT_EQ(body.mesh.tets.size(), testing::at(sample.tets)) << sample.name;
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
  ASSERT_EQ(body.notes.size(), 1U);
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

TEST(Body, InputFiles) {
  const TempFolder folder;
  const auto files = [&](const std::string& geometry) {
    return input_files(read_description(folder.write("model.toml", model(geometry))));
  };
  EXPECT_TRUE(files("sphere = {radius = 1, cells_across = 2}").empty());
  EXPECT_EQ(files("surface = \"a.off\""), std::vector<std::filesystem::path>{folder.path() / "a.off"});
  EXPECT_EQ(files("volume = \"a.msh\""), std::vector<std::filesystem::path>{folder.path() / "a.msh"});
}

TEST(Body, FixedIsTheUnion) {
  const TempFolder folder;
  const std::string box = "box = {size = [1, 1, 1], cells = [2, 2, 2]}";
  const MeshedBody body = body_of(folder.write(
      "model.toml",
      model(box, "lowest = {axis = \"z\", percent = 1}\n[[fixed]]\nlowest = {axis = \"x\", percent = 1}")));
  EXPECT_EQ(count_fixed(body), 9U + 9U - 3U);
}

TEST(Body, BadSelections) {
  const TempFolder folder;
  const std::string box = "box = {size = [1, 1, 1], cells = [2, 2, 2]}";
  const auto error = [&](const std::string& fixed) {
    return error_of([&] { body_of(folder.write("model.toml", model(box, fixed))); });
  };
  expect_mentions(error("sphere = {center = [5, 5, 5], radius = 0.1}"), {"model.toml: [[fixed]] number 1"});
  expect_mentions(error("nodes = [27]"), {"[[fixed]] number 1", "27"});
  expect_mentions(error("tag = 4"), {"[[fixed]] number 1", "4"});
  expect_mentions(error("nodes = [0, 1, 2]"), {"model.toml"});  // on one line: it could turn
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
}  // namespace palpate
