// Files that were altered with all checksums and probes made right again: `verify` must find them.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "precompute/verify.h"
#include "tests/support/bodies/baked_body.h"
#include "tests/support/files/formats_tamper.h"

namespace palpate::precision_tamper_test {
namespace {

constexpr const char* block = R"(name = "block"
[geometry]
box = {size = [0.1, 0.1, 0.1], cells = [5, 5, 5]}
[material]
youngs_modulus = 5000
poissons_ratio = 0.4
friction = 0.3
[[fixed]]
lowest = {axis = "z", percent = 1}
[[load]]
gravity = [0, 0, -9.81]
)";

class Tampered : public testing::TestWithParam<const char*>, public test::BakedBody {
 protected:
  /// Doubles entry (i, j) of Xi and computes probes and checksums again.
  void double_entry(const Model& model, std::int64_t i, std::int64_t j) {
    const auto at = static_cast<std::uint64_t>(packed_index(i, j, model.stored_dofs()));
    const double smooth = model.greens(i, j) - model.greens.stored(i, j);
    const double doubled = 2.0 * model.greens(i, j) - smooth;
    if (has_float_entries(model.greens.precision())) {
      ASSERT_TRUE(test::set_entry(file_, "/greens/packed", at, static_cast<float>(doubled)));
    } else {
      ASSERT_TRUE(test::set_entry(file_, "/greens/packed", at, doubled));
    }
    test::reseal(file_);
    const Model altered = load_model(file_);
    const std::int64_t n = model.stored_dofs();
    std::vector<double> displacements;
    for (const Probe& probe : model.probes) {
      for (std::int64_t row = 0; row < n; ++row) {
        double u = 0.0;
        for (std::int64_t k = 0; k < n; ++k)
          u += altered.greens(row, k) * probe.force[static_cast<std::size_t>(k)];
        displacements.push_back(u);
      }
    }
    ASSERT_TRUE(test::set_bytes(file_, "/probes/displacements", 0, displacements.data(),
                                displacements.size() * sizeof(double)));
    test::reseal(file_);
  }

  [[nodiscard]] std::vector<std::string> failures() const {
    std::vector<std::string> names;
    for (const Check& check : verify(load_model(file_), file_).checks)
      if (!check.passed()) names.push_back(check.name);
    return names;
  }
};

TEST_P(Tampered, AGreensEntryThatIsDoubledIsFound) {
  const Model model = bake_body(std::string(block) + "[storage]\nprecision = \"" + GetParam() + "\"\n");
  ASSERT_EQ(failures(), std::vector<std::string>());
  // The smallest of the entries that are a thousandth of their row's largest: of 1e5, no sample of some
  // columns is likely to meet it.
  const std::int64_t n = model.stored_dofs(), j = n / 3;
  std::int64_t smallest = j + 1;
  for (std::int64_t i = j + 1; i < n; ++i) {
    const double entry = std::abs(model.greens(i, j));
    if (entry > 1e-3 * model.greens(j, j) && entry < std::abs(model.greens(smallest, j))) smallest = i;
  }
  double_entry(model, smallest, j);
  const std::vector<std::string> found = failures();
  EXPECT_NE(std::find(found.begin(), found.end(), "rows"), found.end());
  EXPECT_EQ(std::find(found.begin(), found.end(), "probes"), found.end()) << "these are the file's own";
}

INSTANTIATE_TEST_SUITE_P(Precisions, Tampered, testing::Values("single", "split", "double"),
                         [](const auto& precision) { return std::string(precision.param); });

struct FieldEdit {
  void (*apply)(const std::filesystem::path&);
  const char* says;
};

class TamperedField : public Tampered {};

TEST_P(TamperedField, IsFound) {
  static const std::map<std::string, FieldEdit> edits = {
      {"Friction",
       {[](const std::filesystem::path& p) { test::set_entry(p, "/material/friction", 0, 0.9); },
        "/material/friction"}},
      {"Density",
       {[](const std::filesystem::path& p) { test::set_entry(p, "/material/isotropic", 2, 900.0); },
        "/material/isotropic"}},
      {"Name", {[](const std::filesystem::path& p) { test::set_text(p, "name", "brick"); }, "name is brick"}},
      {"Load",
       {[](const std::filesystem::path& p) { test::set_entry(p, "/rest/force", 3 * 200 + 2, -0.5); },
        "/rest/force"}},
      {"Held",
       {[](const std::filesystem::path& p) { test::set_entry(p, "/rest/displacement", 0, 1e-3); },
        "/rest/displacement"}},
      {"Description",
       {[](const std::filesystem::path& p) { test::set_entry(p, "/model_toml", 0, std::uint8_t{'x'}); },
        "/model_toml"}},
  };
  const FieldEdit& edit = edits.at(GetParam());
  bake_body(block);
  ASSERT_TRUE(verify(load_model(file_), file_).passed()) << to_text(verify(load_model(file_), file_));
  edit.apply(file_);
  test::reseal(file_);
  const VerifyReport report = verify(load_model(file_), file_);
  EXPECT_FALSE(report.passed());
  ASSERT_EQ(report.differences.size(), 1U);
  EXPECT_NE(report.differences[0].find(edit.says), std::string::npos) << report.differences[0];
}

INSTANTIATE_TEST_SUITE_P(Fields, TamperedField,
                         testing::Values("Friction", "Density", "Name", "Load", "Held", "Description"),
                         [](const auto& field) { return std::string(field.param); });

class IllConditioned : public Tampered {};

TEST_P(IllConditioned, AFreshFileInDoublePasses) {
  bake_body(std::string(test::thread) + "[storage]\nprecision = \"double\"\n");
  const VerifyReport report = verify(load_model(file_), file_);
  EXPECT_TRUE(report.passed()) << to_text(report);
}

TEST_P(IllConditioned, AnAlteredEntryIsFoundAllTheSame) {
  const Model model = bake_body(std::string(test::thread) + "[storage]\nprecision = \"double\"\n");
  double_entry(model, model.stored_dofs() / 2, model.stored_dofs() / 3);
  const std::vector<std::string> found = failures();
  EXPECT_NE(std::find(found.begin(), found.end(), "rows"), found.end());
}

INSTANTIATE_TEST_SUITE_P(Precisions, IllConditioned, testing::Values("double"));

}  // namespace
}  // namespace palpate::precision_tamper_test
