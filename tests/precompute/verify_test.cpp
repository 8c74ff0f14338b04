// verify must find each part of a file that is not what K says. The loader's checksums are not in the way
// here: the model is spoilt in memory.
#include "precompute/verify.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "formats/model_file.h"
#include "precompute/bake.h"
#include "precompute/description/read_description.h"

namespace palpate::verify_test {
namespace {

constexpr const char* loaded_block = R"(name = "block"
[geometry]
box = {size = [0.1, 0.1, 0.1], cells = [3, 3, 3]}
[material]
youngs_modulus = 5000
poissons_ratio = 0.4
[[fixed]]
lowest = {axis = "z", percent = 1}
[[fixed]]
half_space = {point = [0, 0, 0.1], normal = [0, 0, 1]}
axes = "x"
displacement = [0.002, 0, 0]
[[load]]
gravity = [0, 0, -9.81]
[storage]
scope = "surface"
precision = "double"
)";

class Verify : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    bake_block(loaded_block);
  }

  void bake_block(const std::string& text) {
    std::ofstream(folder_ / "model.toml") << text;
    testing::internal::CaptureStderr();
    bake(read_description(folder_ / "model.toml"), {.output = file_, .jobs = 1, .dry_run = false});
    testing::internal::GetCapturedStderr();
    model_ = load_model(file_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Names of the checks that fail.
  [[nodiscard]] std::vector<std::string> failures() const {
    std::vector<std::string> names;
    for (const Check& check : verify(model_, file_).checks) {
      if (!check.passed()) names.push_back(check.name);
    }
    return names;
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("palpate-verify-" + std::to_string(getpid()));
  const std::filesystem::path file_ = folder_ / "block.palpate.hdf";
  Model model_;
};

TEST_F(Verify, PassesWhatWasBaked) {
  EXPECT_EQ(failures(), std::vector<std::string>());
}

TEST_F(Verify, FindsARestStateThatDoesNotCarryItsLoads) {
  for (Vec3& u : model_.rest_displacement) u.z() *= 1.0 + 1e-6;
  EXPECT_EQ(failures(), std::vector<std::string>{"rest state"});
}

TEST_F(Verify, FindsAnotherPrescribedDisplacement) {
  for (std::size_t node = 0; node < model_.fixed.size(); ++node) {
    if (model_.fixed[node] == 1) model_.rest_displacement[node].x() = 0.0021;
  }
  EXPECT_EQ(failures(), std::vector<std::string>{"rest state"});
}

TEST_F(Verify, FindsAnotherLoad) {
  model_.rest_force.back() += Vec3(0.0, 0.0, 1e-4);
  EXPECT_EQ(failures(), std::vector<std::string>{"rest state"});
}

// Single precision rounds by 6e-8 per entry: a probe that is wrong by a thousandth is no rounding.
TEST_F(Verify, FindsAProbeThatIsWrongByAThousandth) {
  for (const char* precision : {"\"single\"", "\"double\""}) {
    std::string text = loaded_block;
    text.replace(text.find("\"double\""), 8, precision);
    bake_block(text);
    ASSERT_EQ(failures(), std::vector<std::string>());
    for (Probe& probe : model_.probes) {
      for (double& u : probe.displacement) u *= 1.001;
    }
    EXPECT_EQ(failures(), (std::vector<std::string>{"probes", "energy"})) << precision;
  }
}

/// The block with all nodes stored, or those of the surface, and [dynamics].
std::string swinging_block(const std::string& scope, const std::string& dynamics) {
  std::string text = loaded_block;
  text.replace(text.find("\"surface\""), 9, "\"" + scope + "\"");
  return text + "[dynamics]\n" + dynamics;
}

class VerifyPacked : public Verify {
 protected:
  void SetUp() override {
    Verify::SetUp();
    bake_block(swinging_block("full", "method = \"packed\"\ndamping = {mass = 1, stiffness = 1e-3}\n"));
  }
};

TEST_F(VerifyPacked, PassesWhatWasBaked) {
  EXPECT_EQ(model_.dynamics.method, DynamicsMethod::packed);
  EXPECT_EQ(failures(), std::vector<std::string>());
}

TEST_F(VerifyPacked, FindsAnotherTimeStep) {
  model_.dynamics.newmark.time_step *= 1.0 + 1e-6;
  EXPECT_EQ(failures(), (std::vector<std::string>{"inverse columns", "inverse rows"}));
}

TEST_F(VerifyPacked, FindsAnotherMass) {
  model_.dynamics.matrices.mass[0] *= 1.0 + 1e-6;
  EXPECT_EQ(failures(), std::vector<std::string>{"mass"});
}

TEST_F(VerifyPacked, FindsOtherDamping) {
  model_.dynamics.damping.mass *= 1.0 + 1e-6;
  EXPECT_EQ(failures(), (std::vector<std::string>{"damping", "inverse columns", "inverse rows"}));
}

TEST_F(VerifyPacked, FindsAMassThatIsNotLumped) {
  model_.dynamics.lumped = true;
  EXPECT_EQ(failures(), (std::vector<std::string>{"mass", "damping", "inverse columns", "inverse rows",
                                                  "inverse touches"}));
}

class VerifyModal : public Verify, public ::testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    Verify::SetUp();
    bake_block(swinging_block(GetParam(), "method = \"modal\"\nmodes = 9\nmass = \"lumped\"\n"));
  }
};

TEST_P(VerifyModal, PassesWhatWasBaked) {
  ASSERT_EQ(model_.dynamics.modes(), 9);
  EXPECT_EQ(failures(), std::vector<std::string>());
}

TEST_P(VerifyModal, FindsAnotherFrequency) {
  model_.dynamics.omega[8] *= 1.0 - 1e-5;
  const std::vector<std::string> found = failures();
  EXPECT_NE(std::find(found.begin(), found.end(), "modes"), found.end());
}

TEST_P(VerifyModal, FindsAnotherScale) {
  const auto n = static_cast<std::size_t>(model_.stored_dofs());
  for (std::size_t s = 0; s < n; ++s) model_.dynamics.shapes[s] *= 1.0 + 1e-5;
  EXPECT_EQ(failures(), std::vector<std::string>{"modal mass"});
}

TEST_P(VerifyModal, FindsAnotherShape) {
  for (std::size_t s = 0; s < 30; ++s) model_.dynamics.shapes[s] *= 1.0 + 1e-4;
  const std::vector<std::string> found = failures();
  EXPECT_NE(std::find(found.begin(), found.end(), "modes"), found.end());
}

TEST_P(VerifyModal, FindsThatAModeIsMissing) {
  StoredDynamics& dynamics = model_.dynamics;
  const auto n = static_cast<std::ptrdiff_t>(model_.stored_dofs());
  dynamics.omega.erase(dynamics.omega.begin() + 4);
  dynamics.shapes.erase(dynamics.shapes.begin() + 4 * n, dynamics.shapes.begin() + 5 * n);
  EXPECT_EQ(failures(), std::vector<std::string>{"mode count"});
}

INSTANTIATE_TEST_SUITE_P(Scopes, VerifyModal, ::testing::Values("surface", "full"),
                         [](const auto& scope) { return std::string(scope.param); });

TEST_F(Verify, FindsAnotherMaterial) {
  model_.materials[0].youngs_modulus *= 1.0 + 1e-6;
  const std::vector<std::string> found = failures();
  EXPECT_NE(std::find(found.begin(), found.end(), "columns"), found.end());
}

}  // namespace
}  // namespace palpate::verify_test
