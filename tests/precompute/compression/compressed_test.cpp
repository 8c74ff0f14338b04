// Compressed Green's functions from end to end: against the packed ones of the same body, and files that were
// altered.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <numeric>
#include <random>

#include "base/error.h"
#include "matrices/hierarchical_product.h"
#include "precompute/compressed_greens.h"
#include "precompute/description/read_description.h"
#include "precompute/inspect.h"
#include "precompute/verify.h"
#include "runtime/body/body.h"
#include "runtime/body/scaled_model.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/baked_body.h"
#include "tests/support/files/formats_tamper.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::compressed_test {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double tolerance = 0.005;

/// Held at the bottom, with one edge held along x alone, so that nodes are stored with held dofs.
constexpr const char* block = R"(name = "block"
[geometry]
box = {size = [0.15, 0.15, 0.06], cells = [18, 18, 7]}
[material]
youngs_modulus = 5000
poissons_ratio = 0.4
density = 1000
friction = 0.3
[[fixed]]
lowest = {axis = "z", percent = 1}
[[fixed]]
box = {min = [-0.001, -0.001, 0.0], max = [0.001, 0.151, 0.061]}
axes = "x"
[dynamics]
method = "modal"
modes = 12
time_step = 0.001
damping = {ratios = [0.1, 0.1], frequencies = [1.0, 30.0]}
)";

constexpr const char* small = R"(name = "small"
[geometry]
box = {size = [0.1, 0.1, 0.04], cells = [10, 10, 4]}
[material]
youngs_modulus = 5000
poissons_ratio = 0.3
[[fixed]]
lowest = {axis = "z", percent = 1}
)";

std::string stored(const std::string& text, const std::string& how) {
  return text + "[storage]\nscope = \"layers\"\nlayers = 1\n" + how + "\n";
}

std::string refusal(const std::function<void()>& run) {
  try {
    run();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// Baked once for all tests.
const Model& packed() {
  static const Model model =
      test::BakedBody().bake_body(stored(block, "compression = \"none\"\nprecision = \"double\""), 2);
  return model;
}
const Model& compressed() {
  static const Model model = test::BakedBody().bake_body(stored(block, "compression = \"h2\""), 2);
  return model;
}

/// Number of the packed model's stored node for each of the compressed one's.
std::vector<Index> same_nodes() {
  std::vector<Index> of_mesh(packed().mesh.nodes.size(), -1);
  for (std::size_t k = 0; k < packed().stored_nodes.size(); ++k)
    of_mesh[static_cast<std::size_t>(packed().stored_nodes[k])] = static_cast<Index>(k);
  std::vector<Index> result;
  for (const Index node : compressed().stored_nodes)
    result.push_back(of_mesh[static_cast<std::size_t>(node)]);
  return result;
}

Rows dense_block(const std::vector<Index>& nodes) {
  const std::vector<Index> same = same_nodes();
  Rows C(3 * std::ssize(nodes), 3 * std::ssize(nodes));
  for (Eigen::Index i = 0; i < C.rows(); ++i) {
    for (Eigen::Index j = 0; j < C.cols(); ++j) {
      const auto dof = [&](Eigen::Index k) {
        return 3 * std::int64_t{same[static_cast<std::size_t>(nodes[static_cast<std::size_t>(k / 3)])]} +
               k % 3;
      };
      C(i, j) = packed().greens(dof(i), dof(j));
    }
  }
  return C;
}

Rows compressed_block(const std::vector<Index>& nodes) {
  Rows C(3 * std::ssize(nodes), 3 * std::ssize(nodes));
  for (Eigen::Index k = 0; k < std::ssize(nodes); ++k)
    gather_blocks(*compressed().compressed, nodes[static_cast<std::size_t>(k)], nodes,
                  {C.data() + 3 * k * C.cols(), static_cast<std::size_t>(3 * C.cols())});
  return C;
}

TEST(Compressed, EntriesAreThoseOfThePackedMatrix) {
  ASSERT_NE(compressed().compressed, nullptr);
  const HierarchicalMatrix& matrix = *compressed().compressed;
  EXPECT_EQ(compressed().greens.order(), 0);
  ASSERT_GT(matrix.far_pair.size(), 20U);
  std::vector<Index> all(compressed().stored_nodes.size());
  std::iota(all.begin(), all.end(), 0);
  const Rows difference = compressed_block(all) - dense_block(all);
  const Rows dense = dense_block(all);
  double near = 0.0, far = 0.0;
  for (const auto& [row, column] : matrix.near_pair) {
    const auto of = [&](Index c) { return Eigen::seq(3 * matrix.tree.begin(c), 3 * matrix.tree.end(c) - 1); };
    near = std::max(near, (difference(of(row), of(column)).cwiseAbs().array() /
                           (dense(of(row), of(column)).cwiseAbs().array() + 1e-12))
                              .maxCoeff());
  }
  for (Eigen::Index i = 0; i < dense.rows(); ++i) {
    for (Eigen::Index j = 0; j < dense.cols(); ++j)
      if (dense(i, i) > 0.0 && dense(j, j) > 0.0)
        far = std::max(far, std::abs(difference(i, j)) / std::sqrt(dense(i, i) * dense(j, j)));
  }
  EXPECT_LE(near, 1.3e-7) << "entries of near pairs are rounded to single";
  EXPECT_LE(far, 1e-3);
  EXPECT_GT(far, 1e-9) << "nothing was compressed";
  EXPECT_LT(matrix.bytes(), 2 * matrix.order() * matrix.order());
}

TEST(Compressed, HeldDofsHaveZeros) {
  const HierarchicalMatrix& matrix = *compressed().compressed;
  std::vector<Index> all(compressed().stored_nodes.size());
  std::iota(all.begin(), all.end(), 0);
  int held = 0;
  for (const Index k : all) {
    if (compressed()
            .fixed[static_cast<std::size_t>(compressed().stored_nodes[static_cast<std::size_t>(k)])] != 1)
      continue;
    ++held;
    Rows row(3, 3 * std::ssize(all));
    gather_blocks(matrix, k, all, {row.data(), static_cast<std::size_t>(row.size())});
    EXPECT_EQ(row.row(0).cwiseAbs().maxCoeff(), 0.0);
    EXPECT_GT(row.row(1).cwiseAbs().maxCoeff(), 0.0);
  }
  EXPECT_GT(held, 50);
}

TEST(Compressed, ForcesOfTouchesAreWithinTheTolerance) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  std::vector<Index> free;
  for (Index k = 0; k < static_cast<Index>(compressed().stored_nodes.size()); ++k) {
    if (compressed()
            .fixed[static_cast<std::size_t>(compressed().stored_nodes[static_cast<std::size_t>(k)])] == 0)
      free.push_back(k);
  }
  double worst = 0.0;
  for (const std::size_t count : {2U, 10U, 60U}) {
    for (int touch = 0; touch < 10; ++touch) {
      std::shuffle(free.begin(), free.end(), random);
      const std::vector<Index> nodes(free.begin(), free.begin() + static_cast<std::ptrdiff_t>(count));
      const Eigen::VectorXd u =
          Eigen::VectorXd::NullaryExpr(3 * std::ssize(nodes), [&] { return entry(random); });
      const Eigen::VectorXd f = test::solved(compressed_block(nodes), u),
                            f_0 = test::solved(dense_block(nodes), u);
      worst = std::max(worst, (f - f_0).lpNorm<Eigen::Infinity>() / f_0.lpNorm<Eigen::Infinity>());
    }
  }
  EXPECT_LE(worst, tolerance);
  EXPECT_GT(worst, 1e-7);
}

TEST(Compressed, TheCertificateIsInTheFileAndTold) {
  const std::vector<double>& table = compressed().compressed->certificate;
  ASSERT_EQ(table.size(), 24U);
  for (std::size_t row = 0; row < 4; ++row) {
    EXPECT_GE(table[6 * row + 1], 50.0) << "touches";
    EXPECT_LE(table[6 * row + 2], table[6 * row + 3]);
    EXPECT_LE(table[6 * row + 4], tolerance);
    EXPECT_LE(table[6 * row + 5], 0.5) << "of the bound";
  }
  EXPECT_GT(table[6 * 3 + 5], 0.01) << "100 nodes reach as far as far pairs";
  EXPECT_NE(inspect(compressed()).find("100 nodes: median"), std::string::npos) << inspect(compressed());
}

/// The force of a sphere that is pressed in and slides, tick by tick.
struct Slide {
  std::vector<Vec3> force, contact_force;
  std::vector<double> greens_error;
  double largest = 0.0;
};

Slide slide(Model model, double radius = 0.02) {
  const Body body(std::move(model));
  Tool sphere;
  sphere.radius = radius;
  sphere.friction = 0.3;
  sphere.hand_over = std::numeric_limits<double>::infinity();
  State state(body, {.tools = {sphere}});
  ToolPose tool;
  Slide result;
  for (int tick = 0; tick <= 600; ++tick) {
    tool.position =
        Vec3(0.06 + 5e-5 * std::max(0, tick - 300), 0.075, 0.0601 + radius - 2e-5 * std::min(tick, 300));
    step(body, state, tool);
    result.force.push_back(state.tools[0].wrench.force);
    result.contact_force.push_back(state.tools[0].contact_wrench.force);
    result.greens_error.push_back(state.tools[0].greens_error);
    result.largest = std::max(result.largest, result.force.back().norm());
  }
  EXPECT_GE(state.tools[0].contacts, 5);
  return result;
}

TEST(Compressed, TicksAreThoseOfThePackedBody) {
  const Slide expected = slide(packed()), found = slide(compressed());
  ASSERT_GT(expected.largest, 0.05);
  double worst = 0.0;
  for (std::size_t k = 0; k < expected.force.size(); ++k)
    worst = std::max(worst, (found.force[k] - expected.force[k]).norm());
  EXPECT_LE(worst, tolerance * expected.largest);
  EXPECT_GT(worst, 0.0);
}

// A sphere that is pressed in, and one that slides: the state of friction goes its own way.
TEST(Compressed, TheBoundOfATickHolds) {
  const Slide expected = slide(packed(), 0.1), found = slide(compressed(), 0.1);
  double largest = 0.0;
  for (std::size_t k = 0; k < expected.force.size(); ++k) {
    EXPECT_EQ(expected.greens_error[k], 0.0) << "packed functions are exact";
    EXPECT_LE((found.contact_force[k] - expected.contact_force[k]).norm(),
              found.greens_error[k] + 1e-4 * expected.largest)
        << "tick " << k;
    largest = std::max(largest, found.greens_error[k]);
  }
  EXPECT_GT(largest, 1e-4 * expected.largest);
  EXPECT_LT(largest, 20.0 * tolerance * expected.largest);
}

TEST(Compressed, AStifferBodyIsStiffer) {
  Model twice = compressed();
  scale_stiffness(twice, 2.0);
  const Slide once = slide(compressed()), stiff = slide(std::move(twice));
  EXPECT_NEAR(stiff.largest, 2.0 * once.largest, 1e-6 * once.largest);
}

// Its forces answer to some displacements a hundred times as much as to others.
TEST(Compressed, ANearlyIncompressibleBodyKeepsItsTolerance) {
  std::string rubber = small;
  rubber.replace(rubber.find("= 0.3"), 5, "= 0.49");
  rubber.replace(rubber.find("[10, 10, 4]"), 11, "[16, 16, 5]");
  const Model model = test::BakedBody().bake_body(stored(rubber, "compression = \"h2\""), 2);
  ASSERT_GT(model.compressed->far_pair.size(), 50U);
  for (std::size_t row = 0; row < 4; ++row)
    EXPECT_LE(model.compressed->certificate[6 * row + 4], tolerance) << row;
}

/// A file of its own for each test, baked once for all.
class AlteredFile : public testing::Test, public test::BakedBody {
 protected:
  AlteredFile() {
    static const std::string text = stored(small, "compression = \"h2\"");
    static const std::string baked = (bake_body(text), bytes());
    std::ofstream(folder_ / "model.toml") << text;
    std::ofstream(file_, std::ios::binary) << baked;
  }
};

TEST_F(AlteredFile, IsVerifiedUntilThen) {
  const VerifyReport report = verify(load_model(file_), file_);
  EXPECT_TRUE(report.passed()) << to_text(report);
}

TEST_F(AlteredFile, EveryDatasetIsWatched) {
  const std::string whole = bytes();
  int watched = 0;
  for (const std::string& dataset : test::checked_datasets(file_)) {
    if (!dataset.starts_with("/greens/")) continue;
    ++watched;
    const char flipped = 0x55;
    ASSERT_TRUE(test::set_bytes(file_, dataset, 0, &flipped, 1)) << dataset;
    if (bytes() == whole) continue;
    const std::string said = refusal([&] { load_model(file_); });
    EXPECT_NE(said.find(dataset), std::string::npos) << dataset << ": " << said;
    std::ofstream(file_, std::ios::binary) << whole;
  }
  EXPECT_EQ(watched, 11);
}

/// Resealed, so that the checksums are right.
TEST_F(AlteredFile, WhatWasMadeUpIsRefused) {
  const std::string whole = bytes();
  const auto expect_refused = [&](const std::string& what, auto&& change) {
    change();
    test::reseal(file_);
    const std::string said = refusal([&] { load_model(file_); });
    EXPECT_NE(said.find(what), std::string::npos) << what << ": " << said;
    std::ofstream(file_, std::ios::binary) << whole;
  };
  const auto set = [&](const char* dataset, std::uint64_t at, auto value) {
    ASSERT_TRUE(test::set_entry(file_, dataset, at, value)) << dataset;
  };
  expect_refused("/greens/levels", [&] { set("/greens/levels", 0, std::int32_t{25}); });
  expect_refused("/greens/levels", [&] { set("/greens/levels", 0, std::int32_t{-1}); });
  expect_refused("/greens/tolerance", [&] { set("/greens/tolerance", 0, 0.0); });
  expect_refused("/greens/near_pairs", [&] { set("/greens/near_pairs", 0, std::int32_t{0}); });
  expect_refused("/greens/near_pairs", [&] { set("/greens/near_pairs", 2, std::int32_t{1 << 30}); });
  expect_refused("/greens/far_pairs", [&] { set("/greens/far_pairs", 0, std::int32_t{-7}); });
  expect_refused("/greens/ranks", [&] { set("/greens/ranks", 9, std::int32_t{most_rank + 1}); });
  expect_refused("/greens/bases", [&] { set("/greens/ranks", 30, std::int32_t{0}); });
  expect_refused("/greens/couplings",
                 [&] { set("/greens/couplings", 3, std::numeric_limits<float>::quiet_NaN()); });
  expect_refused("/greens/near: diagonal", [&] { set("/greens/near", 0, -1.0F); });
  expect_refused("/greens/certificate", [&] { set("/greens/certificate", 4, -1.0); });
  expect_refused("/greens/pair_errors", [&] { set("/greens/pair_errors", 7, -1e-3); });
  expect_refused("/greens/pair_errors",
                 [&] { set("/greens/pair_errors", 0, std::numeric_limits<double>::infinity()); });
}

TEST_F(AlteredFile, VerifyFindsCouplingsOfNothing) {
  const auto bytes = static_cast<std::size_t>(4 * load_model(file_).compressed->coupling_at.back());
  const std::vector<char> zeros(bytes, 0);
  ASSERT_TRUE(test::set_bytes(file_, "/greens/couplings", 0, zeros.data(), bytes));
  test::reseal(file_);
  const VerifyReport report = verify(load_model(file_), file_);
  EXPECT_FALSE(report.passed());
  EXPECT_NE(to_text(report).find("far pairs       FAILED"), std::string::npos) << to_text(report);
}

TEST_F(AlteredFile, BytesDependOnNoJobs) {
  const std::string once = bytes();
  bake_body(stored(small, "compression = \"h2\""), 3);
  EXPECT_TRUE(bytes() == once);
}

/// A run that was killed leaves near pairs; the next one takes them, and what it did not leave is solved.
TEST_F(AlteredFile, AKilledRunGoesOn) {
  const Model model = load_model(file_);
  const std::string once = bytes();
  std::filesystem::remove(file_);
  const HierarchicalMatrix& matrix = *model.compressed;
  const auto entries = [&](Index leaf) {
    const std::int64_t first = matrix.near_at[static_cast<std::size_t>(matrix.first_near_pair(leaf))],
                       end = matrix.near_at[static_cast<std::size_t>(matrix.first_near_pair(leaf + 1))];
    return std::vector<float>(matrix.near.get() + first, matrix.near.get() + end);
  };
  {
    ModelWriter killed(file_, model, Precision::single_precision);
    EXPECT_FALSE(killed.has_near(0));
    for (Index leaf = 0; leaf < matrix.tree.leaves(); leaf += 2) killed.write_near(leaf, entries(leaf));
    EXPECT_TRUE(killed.has_near(2));
  }
  bake_body(stored(small, "compression = \"h2\""));
  EXPECT_TRUE(bytes() == once);
}

// Whatever the cut: rounding to single is too much for it.
TEST_F(AlteredFile, IsNotWrittenWhereForcesAreOffByMoreThanTheTolerance) {
  std::filesystem::remove(file_);
  const std::string said = refusal(
      [&] { bake_body(std::string(test::thread) + "[storage]\ncompression = \"h2\"\ntolerance = 1e-4\n"); });
  testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("forces of random touches are off by up to"), std::string::npos) << said;
  EXPECT_FALSE(std::filesystem::exists(file_));
  EXPECT_FALSE(std::filesystem::exists(file_.string() + ".partial"));
}

TEST(CompressedDescription, RefusesWhatDoesNotGoTogether) {
  const auto said = [&](const std::string& text) {
    return refusal(
        [&] { wants_compression(parse_description(std::string(small) + text, "model.toml"), 100); });
  };
  EXPECT_NE(said("[storage]\ncompression = \"h3\"\n").find("compression"), std::string::npos);
  EXPECT_NE(said("[storage]\ncompression = \"h2\"\nprecision = \"double\"\n").find("precision applies"),
            std::string::npos);
  EXPECT_NE(said("[storage]\ncompression = \"none\"\ntolerance = 0.01\n").find("tolerance applies"),
            std::string::npos);
  EXPECT_NE(said("[storage]\ncompression = \"h2\"\ntolerance = 1e-9\n").find("1e-4 to 1"), std::string::npos);
  EXPECT_NE(said("[dynamics]\nmethod = \"packed\"\n[storage]\nscope = \"full\"\ncompression = \"h2\"\n")
                .find("does not go with"),
            std::string::npos);
}

TEST(CompressedDescription, DecidesByTheNumberOfNodes) {
  const auto wants = [&](const std::string& text, std::int64_t nodes) {
    return wants_compression(parse_description(std::string(small) + text, "model.toml"), nodes);
  };
  EXPECT_FALSE(wants("", 4999));
  EXPECT_TRUE(wants("", 5000));
  EXPECT_TRUE(wants("[storage]\ncompression = \"auto\"\n", 5000));
  EXPECT_FALSE(wants("[storage]\ncompression = \"none\"\n", 500000));
  EXPECT_FALSE(wants("[storage]\nprecision = \"double\"\n", 5000));
  EXPECT_TRUE(wants("[storage]\ncompression = \"h2\"\n", 10));
}

}  // namespace
}  // namespace palpate::compressed_test
