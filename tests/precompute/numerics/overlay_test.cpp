// Overlays that are condensed ahead: the file has what the runtime would condense itself.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "base/error.h"
#include "formats/model_file.h"
#include "overlay/condensation.h"
#include "overlay/patch_mesh.h"
#include "precompute/bake.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/overlay_regions.h"

namespace palpate::overlay_test {
namespace {

const std::string block = R"(name = "block"
[geometry]
box = {size = [0.04, 0.04, 0.03], cells = [4, 4, 3]}
[mesh]
element = "tet4"
[[material]]
youngs_modulus = 5000
poissons_ratio = 0.4
[[material]]
youngs_modulus = 20000
poissons_ratio = 0.3
half_space = {point = [0.02, 0, 0], normal = [1, 0, 0]}
[[fixed]]
lowest = {axis = "z", percent = 1}
[[fixed]]
box = {min = [0, 0, 0.03], max = [0, 0.04, 0.03]}
axes = "x"
[storage]
layers = 2
[overlay]
refinement = 2
rings = 2
)";

const std::string plate = R"(name = "plate"
plane = "stress"
thickness = 0.002
[geometry]
rectangle = {size = [0.04, 0.04], cells = [6, 6]}
[material]
youngs_modulus = 5000
poissons_ratio = 0.4
[[fixed]]
lowest = {axis = "y", percent = 1}
[overlay]
refinement = 4
rings = 1
)";

class StoredOverlays : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path baked(const std::string& text, int jobs = 1) const {
    std::ofstream(folder_ / "model.toml") << text;
    const std::filesystem::path file = folder_ / ("jobs" + std::to_string(jobs) + ".palpate.hdf");
    testing::internal::CaptureStderr();
    bake(read_description(folder_ / "model.toml"), {.output = file, .jobs = jobs});
    testing::internal::GetCapturedStderr();
    return file;
  }

  std::string refusal(const std::string& text) const {
    try {
      baked(text);
    } catch (const Error& error) {
      testing::internal::GetCapturedStderr();
      return error.where() + ": " + error.what();
    }
    return "";
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("palpate-overlay-" + std::to_string(getpid()));
};

void expect_what_the_runtime_condenses(const Model& model) {
  const ElementsAtNodes at(model.mesh);
  for (std::size_t k = 0; k < model.overlay.centres.size(); ++k) {
    const Index centre = model.overlay.centres[k];
    const std::vector<Index> elements = rings_round(model.mesh, at, {&centre, 1}, model.overlay.rings);
    const CondensedPatch expected =
        condense(model, make_patch_mesh(model, at, elements, model.overlay.refinement));
    const CondensedPatch& stored = model.overlay.patches[k];
    EXPECT_EQ(stored.surface, expected.surface);
    EXPECT_EQ(stored.G, expected.G) << "node " << centre;
    EXPECT_EQ(stored.T, expected.T) << "node " << centre;
    EXPECT_EQ(stored.compliance, expected.compliance) << "node " << centre;
    EXPECT_GT(stored.compliance.norm(), 0.0);
  }
}

TEST_F(StoredOverlays, AreWhatTheRuntimeWouldCondense) {
  // Regions that overlap; the first has nodes inside the body and held ones too.
  const Model model = load_model(baked(block + R"([[overlay.region]]
half_space = {point = [0, 0, 0.02], normal = [0, 0, 1]}
[[overlay.region]]
sphere = {center = [0.02, 0.02, 0.03], radius = 0.011}
)"));
  EXPECT_EQ(model.overlay.refinement, 2);
  EXPECT_EQ(model.overlay.rings, 2);
  EXPECT_EQ(model.overlay.centres.size(), 25U + 16U);  // the top and the ring of nodes below it
  expect_what_the_runtime_condenses(model);
}

TEST_F(StoredOverlays, AreThereInThePlaneToo) {
  const Model model =
      load_model(baked(plate + "[[overlay.region]]\nhalf_space = {point = [0, 0.04], normal = [0, 1]}\n"));
  EXPECT_EQ(model.overlay.centres.size(), 7U);
  expect_what_the_runtime_condenses(model);
}

TEST_F(StoredOverlays, DoNotDependOnTheJobs) {
  const std::string text = block + "[[overlay.region]]\nlowest = {axis = \"z\", percent = 100}\n";
  const auto bytes = [](const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_EQ(bytes(baked(text, 1)), bytes(baked(text, 3)));
}

TEST_F(StoredOverlays, ArePlannedToTheByte) {
  const std::filesystem::path file =
      baked(block + "[[overlay.region]]\nsphere = {center = [0, 0, 0.03], radius = 0.011}\n");
  const Model model = load_model(file);
  const OverlayPlan plan =
      plan_overlays(model, *read_description(folder_ / "model.toml").overlay, "model.toml");
  EXPECT_EQ(plan.centres, model.overlay.centres);
  std::int64_t entries = 0;
  for (const CondensedPatch& patch : model.overlay.patches)
    entries += packed_size(patch.G.rows()) + patch.T.size() + packed_size(patch.compliance.rows());
  EXPECT_EQ(plan.file_bytes, 8 * entries);
  EXPECT_GT(plan.memory_bytes, plan.file_bytes);
}

TEST_F(StoredOverlays, NeedNodesThatCanBeTouched) {
  const std::string inside = "[[overlay.region]]\nsphere = {center = [0.02, 0.02, 0.01], radius = 0.001}\n";
  EXPECT_NE(
      refusal(block + inside).find("[[overlay.region]] number 1: the selection holds no node of the surface"),
      std::string::npos);
  const std::string held =
      "[[overlay.region]]\nnodes = [99]\n[[overlay.region]]\nhalf_space = {point = [0, 0, 0], normal = [0, "
      "0, -1]}\n";
  EXPECT_NE(
      refusal(block + held).find("[[overlay.region]] number 2: the selection holds no node of the surface"),
      std::string::npos);
  const std::string nothing = "[[overlay.region]]\nsphere = {center = [1, 1, 1], radius = 0.001}\n";
  EXPECT_NE(refusal(block + nothing).find("[[overlay.region]] number 1"), std::string::npos);
}

}  // namespace
}  // namespace palpate::overlay_test
