// Split precision and force errors in the file: stored, read, and refused where they were made up.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "formats/contents.h"
#include "formats/model_file.h"
#include "formats/writer/model_writer.h"
#include "tests/support/files/formats_sample.h"
#include "tests/support/files/formats_tamper.h"

namespace palpate::test::precision_test {
namespace {

using Path = std::filesystem::path;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

void expect_entries(const PackedGreens& matrix, double factor) {
  ASSERT_EQ(matrix.precision(), Precision::split_precision);
  ASSERT_NE(matrix.smooth(), nullptr);
  for (std::int64_t j = 0; j < matrix.order(); ++j) {
    for (std::int64_t i = j; i < matrix.order(); ++i) {
      const double entry = factor * sample_entry(i, j), smooth = (*matrix.smooth())(i, j);
      ASSERT_NEAR(matrix(i, j), entry, 0x1p-24 * std::abs(entry - smooth) + 1e-18) << i << ", " << j;
      ASSERT_EQ(matrix(j, i), matrix(i, j));
    }
  }
}

class SplitFile : public testing::TestWithParam<DynamicsMethod> {};

TEST_P(SplitFile, HoldsTheMatricesButForTheRoundingOfTheRemainder) {
  const Folder folder;
  const Model written = write_split_sample(folder / "a.palpate.hdf", GetParam());
  const Model read = load_model(folder / "a.palpate.hdf");
  expect_entries(read.greens, 1.0);
  EXPECT_EQ(read.greens.smooth()->rows, sample_smooth(written).rows);
  EXPECT_EQ(read.force_errors.of_precision, written.force_errors.of_precision);
  EXPECT_EQ(read.dynamics.force_errors.of_precision, written.dynamics.force_errors.of_precision);
  if (GetParam() == DynamicsMethod::packed) expect_entries(read.dynamics.inverse, 0.125);
}

INSTANTIATE_TEST_SUITE_P(Dynamics, SplitFile,
                         testing::Values(DynamicsMethod::none, DynamicsMethod::packed,
                                         DynamicsMethod::modal));

TEST(SplitFile, IsContinuedAfterAKill) {
  const Folder folder;
  write_split_sample(folder / "whole.palpate.hdf");
  const Model model = split_sample(DynamicsMethod::none);
  const std::int64_t n = model.stored_dofs();
  {
    ModelWriter killed(folder / "a.palpate.hdf", model, Precision::split_precision);
    killed.write_columns(0, 10, sample_columns(0, 10, n));
  }
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::split_precision);
  EXPECT_TRUE(writer.has_columns(0, 10));
  writer.write_columns(10, n - 10, sample_columns(10, n - 10, n));
  writer.finish(model.probes);
  EXPECT_EQ(read_bytes(folder / "a.palpate.hdf"), read_bytes(folder / "whole.palpate.hdf"));
}

TEST(SplitFile, IsNotContinuedWithAnotherSmoothPart) {
  const Folder folder;
  Model model = split_sample(DynamicsMethod::none);
  const std::int64_t n = model.stored_dofs();
  {
    ModelWriter killed(folder / "a.palpate.hdf", model, Precision::split_precision);
    killed.write_columns(0, 10, sample_columns(0, 10, n));
  }
  SmoothPart other = sample_smooth(model);
  other.rows.front() *= 1.0 + 1e-15;
  model.greens =
      PackedGreens(nullptr, n, Precision::split_precision, std::make_shared<const SmoothPart>(other));
  EXPECT_FALSE(ModelWriter(folder / "a.palpate.hdf", model, Precision::split_precision).has_columns(0, 10));
}

/// Who knows float32 and float64 only would take R for Xi.
TEST(SplitFile, SaysSo) {
  const Folder folder;
  write_split_sample(folder / "a.palpate.hdf");
  EXPECT_EQ(Contents::read(folder / "a.palpate.hdf").text_attribute("/", "scalar"), "float32+smooth");
}

TEST(ForceErrors, AreNotInOlderFiles) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  EXPECT_FALSE(load_model(folder / "a.palpate.hdf").force_errors.any());
}

TEST(PrecisionWarning, IsThereWhereTheStoredPrecisionIsNotGoodEnough) {
  Model model = sample_model();
  EXPECT_EQ(precision_warning(model, Precision::single_precision), "");
  model.force_errors = {{0.03, 1e-4, ForceErrors::not_measured}};
  EXPECT_NE(precision_warning(model, Precision::single_precision).find("3.0e-02"), std::string::npos);
  EXPECT_EQ(precision_warning(model, Precision::split_precision), "");
  EXPECT_EQ(precision_warning(model, Precision::double_precision), "");
  model.dynamics.force_errors = {{ForceErrors::not_measured, std::numeric_limits<double>::infinity(), 0.0}};
  EXPECT_NE(precision_warning(model, Precision::split_precision), "");
}

/// An edit whose checksums are made right again, and what the refusal must say.
struct Edit {
  const char* name;
  void (*apply)(const Path&);
  const char* says;
};

void PrintTo(const Edit& edit, std::ostream* out) {
  *out << edit.name;
}

class HostileSplit : public testing::TestWithParam<Edit> {};

TEST_P(HostileSplit, IsRefusedByName) {
  const Folder folder;
  const Path path = folder / "x.palpate.hdf";
  write_split_sample(path, DynamicsMethod::packed);
  GetParam().apply(path);
  reseal(path);
  const std::string text = refusal([&] { load_model(path); });
  EXPECT_NE(text.find(GetParam().says), std::string::npos) << text;
}

constexpr hsize_t dofs = 54;  // of the sample

const Edit edits[] = {
    {"NoSmoothPart", [](const Path& p) { remove_object(p, "/greens/smooth"); }, "/greens/smooth is missing"},
    {"NoSmoothPartOfTheInverse", [](const Path& p) { remove_object(p, "/dynamics/smooth"); },
     "/dynamics/smooth is missing"},
    {"FewerRows",
     [](const Path& p) {
       replace(p, "/greens/smooth", H5T_IEEE_F64LE, {dofs - 1, 3});
     },
     "/greens/smooth has size 53, 54 is expected"},
    {"NoTerms",
     [](const Path& p) {
       replace(p, "/greens/smooth", H5T_IEEE_F64LE, {dofs, 0});
     },
     "/greens/smooth has 0 entries, at least 1"},
    {"TooManyTerms",
     [](const Path& p) {
       replace(p, "/greens/smooth", H5T_IEEE_F64LE, {dofs, 257});
       replace(p, "/dynamics/smooth", H5T_IEEE_F64LE, {dofs, 257});
     },
     "/greens/smooth has 257 terms, only 1 to 256"},
    {"AsMuchAsMemory",
     [](const Path& p) {
       replace(p, "/greens/smooth", H5T_IEEE_F64LE, {dofs, hsize_t{1} << 40});
     },
     "/greens/smooth"},
    {"OtherTermsOfTheInverse",
     [](const Path& p) {
       replace(p, "/dynamics/smooth", H5T_IEEE_F64LE, {dofs, 2});
     },
     "/dynamics/smooth has size 2, 3 is expected by /greens/smooth"},
    {"NotANumber", [](const Path& p) { set_entry(p, "/greens/smooth", 7, nan); },
     "/greens/smooth holds a value that is not finite (entry 7)"},
    {"Infinite", [](const Path& p) { set_entry(p, "/dynamics/smooth", 8, HUGE_VAL); },
     "/dynamics/smooth holds a value that is not finite (entry 8)"},
    {"ProductsThatAreNotFinite", [](const Path& p) { set_entry(p, "/greens/smooth", 7, 1e200); },
     "/greens/packed: diagonal entry 2 is not positive"},
    {"ScalarWithoutIt", [](const Path& p) { set_text(p, "scalar", "float32"); }, "diagonal entry"},
    {"ErrorNotANumber", [](const Path& p) { set_entry(p, "/greens/force_error", 0, nan); },
     "/greens/force_error holds a value that is not finite"},
    {"NegativeError", [](const Path& p) { set_entry(p, "/greens/force_error", 1, -0.5); },
     "/greens/force_error holds -0.5"},
    {"NoneOfWhatIsStored", [](const Path& p) { set_entry(p, "/greens/force_error", 1, -1.0); },
     "/greens/force_error has none of the precision that is stored"},
    {"NoneOfTheInverse", [](const Path& p) { set_entry(p, "/dynamics/force_error", 1, -1.0); },
     "/dynamics/force_error has none of the precision that is stored"},
};

INSTANTIATE_TEST_SUITE_P(Edits, HostileSplit, testing::ValuesIn(edits),
                         [](const auto& edit) { return edit.param.name; });

TEST(HostileSplit, RowsOfHeldDofsAreZero) {
  const Folder folder;
  Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  model.fixed[static_cast<std::size_t>(model.stored_nodes[1])] = 2;  // dof 4
  model.greens = PackedGreens(nullptr, n, Precision::split_precision,
                              std::make_shared<const SmoothPart>(sample_smooth(sample_model())));
  const std::string text =
      refusal([&] { ModelWriter(folder / "a.palpate.hdf", model, Precision::split_precision); });
  EXPECT_NE(text.find("/greens/smooth: row 4 is not zero, though its dof is held"), std::string::npos)
      << text;
}

}  // namespace
}  // namespace palpate::test::precision_test
