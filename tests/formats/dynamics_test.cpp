// Dynamics in NAME.palpate.hdf: written, continued, read, and refused where it cannot be.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "formats/model_file.h"
#include "formats/writer/model_writer.h"
#include "tests/support/files/formats_sample.h"
#include "tests/support/files/formats_tamper.h"

namespace palpate::test::dynamics_test {
namespace {

using Path = std::filesystem::path;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr auto packed = DynamicsMethod::packed;
constexpr auto modal = DynamicsMethod::modal;

const Path& good_file(DynamicsMethod method) {
  static const Folder folder;
  static const std::pair<Path, Path> paths = [] {
    write_swinging_sample(folder / "packed.palpate.hdf", packed);
    write_swinging_sample(folder / "modal.palpate.hdf", modal);
    return std::pair{folder / "packed.palpate.hdf", folder / "modal.palpate.hdf"};
  }();
  return method == packed ? paths.first : paths.second;
}

TEST(DynamicsFile, WhatIsWrittenIsRead) {
  for (const DynamicsMethod method : {packed, modal}) {
    for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
      for (const ElementType element : body_elements) {
        const Folder folder;
        const Model written = write_swinging_sample(folder / "a.palpate.hdf", method, precision, element);
        Model read = load_model(folder / "a.palpate.hdf");
        const std::int64_t n = written.stored_dofs();
        const PackedGreens inverse = read.dynamics.inverse;
        EXPECT_EQ(read.dynamics.modes(), method == modal ? 5 : 0);
        read.greens = {};
        read.dynamics.inverse = {};
        EXPECT_EQ(difference(written, read), "");
        if (method == modal) continue;
        ASSERT_EQ(inverse.order(), n);
        ASSERT_EQ(inverse.precision(), precision);
        const std::vector<double> expected = sample_inverse_columns(0, n, n);
        for (std::int64_t j = 0; j < n; ++j) {
          for (std::int64_t i = j; i < n; ++i)
            EXPECT_NEAR(inverse(i, j), expected[static_cast<std::size_t>(packed_index(i, j, n))],
                        precision == Precision::single_precision ? 1e-10 : 0.0);
        }
      }
    }
  }
}

TEST(DynamicsFile, AllModesAreFollowedByInfinity) {
  const Folder folder;
  const Index n = 54;
  const Model written = swinging_sample(modal, ElementType::tet4, n);
  ModelWriter writer(folder / "a.palpate.hdf", written, Precision::double_precision);
  writer.write_columns(0, n, sample_columns(0, n, n));
  writer.finish(written.probes);
  const Model read = load_model(folder / "a.palpate.hdf");
  EXPECT_EQ(read.dynamics.modes(), n);
  EXPECT_EQ(read.dynamics.omega.back(), infinity);
}

TEST(DynamicsFile, AKilledRunIsContinuedInBothMatrices) {
  const Folder folder;
  const Path path = folder / "a.palpate.hdf";
  const Model model = swinging_sample(packed);
  const std::int64_t n = model.stored_dofs();
  {
    ModelWriter killed(path, model, Precision::double_precision);
    killed.write_columns(0, n, sample_columns(0, n, n));
    killed.write_columns(20, 10, sample_inverse_columns(20, 10, n), PackedMatrix::inverse);
  }
  {
    ModelWriter writer(path, model, Precision::double_precision);
    EXPECT_TRUE(writer.has_columns(0, n));
    EXPECT_TRUE(writer.has_columns(20, 10, PackedMatrix::inverse));
    EXPECT_FALSE(writer.has_columns(19, 2, PackedMatrix::inverse));
    const std::string missing = refusal([&] { writer.finish(model.probes); });
    EXPECT_NE(missing.find("column 0 of the inverse of K_bar was not written"), std::string::npos) << missing;
    writer.write_columns(0, 20, sample_inverse_columns(0, 20, n), PackedMatrix::inverse);
  }
  set_entry(folder / "a.palpate.hdf.partial", "/dynamics/inverse", 3, 5.0);  // in columns 0 to 19
  ModelWriter writer(path, model, Precision::double_precision);
  EXPECT_FALSE(writer.has_columns(0, 1, PackedMatrix::inverse));
  EXPECT_TRUE(writer.has_columns(20, 10, PackedMatrix::inverse));
  EXPECT_TRUE(writer.has_columns(0, n));
  writer.write_columns(0, 20, sample_inverse_columns(0, 20, n), PackedMatrix::inverse);
  writer.write_columns(30, n - 30, sample_inverse_columns(30, n - 30, n), PackedMatrix::inverse);
  writer.finish(model.probes);
  EXPECT_EQ(read_bytes(path), read_bytes(good_file(packed)));
}

TEST(DynamicsFile, OtherDynamicsStartAnew) {
  const Folder folder;
  const Path path = folder / "a.palpate.hdf";
  const Model model = swinging_sample(packed);
  const std::int64_t n = model.stored_dofs();
  const auto leave = [&] {
    ModelWriter killed(path, model, Precision::double_precision);
    killed.write_columns(0, n, sample_columns(0, n, n));
  };
  const auto starts_anew = [&](const Model& other) {
    leave();
    return !ModelWriter(path, other, Precision::double_precision).has_columns(0, 1);
  };
  EXPECT_FALSE(starts_anew(model));
  Model other = model;
  other.dynamics.newmark.time_step = 0.001;
  EXPECT_TRUE(starts_anew(other));
  other = model;
  other.dynamics.matrices.mass[7] *= 2.0;
  EXPECT_TRUE(starts_anew(other));
  EXPECT_TRUE(starts_anew(swinging_sample(modal)));
  other = model;
  other.dynamics = {};
  EXPECT_TRUE(starts_anew(other));
}

TEST(DynamicsFile, OnlyPackedDynamicsHasAnInverse) {
  const Folder folder;
  const Model model = swinging_sample(modal);
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::double_precision);
  EXPECT_FALSE(writer.has_columns(0, 1, PackedMatrix::inverse));
  EXPECT_NE(refusal([&] { writer.write_columns(0, n, sample_columns(0, n, n), PackedMatrix::inverse); }), "");
}

TEST(DynamicsFile, SubnormalEntriesAreStoredAsZero) {
  const Folder folder;
  const Model model = swinging_sample(packed);
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::single_precision);
  writer.write_columns(0, n, sample_columns(0, n, n));
  std::vector<double> columns = sample_inverse_columns(0, n, n);
  columns[3] = -1e-40;
  columns[4] = 1.5e-38;
  writer.write_columns(0, n, columns, PackedMatrix::inverse);
  writer.finish(model.probes);
  const Model read = load_model(folder / "a.palpate.hdf");
  EXPECT_EQ(read.dynamics.inverse(3, 0), 0.0);
  EXPECT_EQ(read.dynamics.inverse(4, 0), static_cast<double>(1.5e-38F));
}

TEST(DynamicsFile, MayBeWithoutThem) {
  const Folder folder;
  std::filesystem::copy_file(good_file(modal), folder / "x.hdf");
  remove_object(folder / "x.hdf", "/dynamics");
  reseal(folder / "x.hdf");
  const Model read = load_model(folder / "x.hdf");
  EXPECT_EQ(read.dynamics.method, DynamicsMethod::none);
  EXPECT_EQ(difference(load_model(good_file(modal)), read), "dynamics");
}

TEST(DynamicsFile, EveryAlteredDatasetIsNamed) {
  for (const DynamicsMethod method : {packed, modal}) {
    const auto datasets = checked_datasets(good_file(method));
    EXPECT_EQ(datasets.size(), method == packed ? 43U : 40U);
    for (const std::string& dataset : datasets) {
      const Folder folder;
      std::filesystem::copy_file(good_file(method), folder / "x.hdf");
      ASSERT_TRUE(set_entry(folder / "x.hdf", dataset, 0, std::uint8_t{0xa7}));
      const std::string text = refusal([&] { load_model(folder / "x.hdf"); });
      EXPECT_NE(text.find(dataset + " was altered"), std::string::npos) << text;
    }
  }
}

/// An edit whose checksums are made right again, and what the refusal must say.
struct Edit {
  const char* name;
  DynamicsMethod method;
  void (*apply)(const Path&);
  std::string says;
};

void PrintTo(const Edit& edit, std::ostream* out) {
  *out << edit.name;
}

class HostileDynamics : public testing::TestWithParam<Edit> {};
TEST_P(HostileDynamics, IsRefusedByName) {
  const Folder folder;
  const Path path = folder / "x.palpate.hdf";
  std::filesystem::copy_file(good_file(GetParam().method), path);
  GetParam().apply(path);
  reseal(path);
  const std::string text = refusal([&] { load_model(path); });
  EXPECT_NE(text.find(GetParam().says), std::string::npos) << text;
  EXPECT_NE(text.find("x.palpate.hdf"), std::string::npos) << text;
}

// Stored dof 0 is the first of node 26; n = 54.
const Edit edits[] = {
    {"NoMethod", packed, [](const Path& p) { remove_object(p, "/dynamics/method"); },
     "/dynamics/method is missing"},
    {"MethodNone", packed, [](const Path& p) { set_entry(p, "/dynamics/method", 0, std::int32_t{0}); },
     "/dynamics/method is 0, not 1 (packed) or 2 (modal)"},
    {"MethodUnknown", modal, [](const Path& p) { set_entry(p, "/dynamics/method", 0, std::int32_t{3}); },
     "/dynamics/method is 3"},
    {"MethodWithoutItsModes", packed,
     [](const Path& p) { set_entry(p, "/dynamics/method", 0, std::int32_t{2}); },
     "/dynamics/modes/omega is missing"},
    {"LumpedTwo", modal, [](const Path& p) { set_entry(p, "/dynamics/lumped", 0, std::uint8_t{2}); },
     "/dynamics/lumped holds 2"},
    {"LumpedButNotDiagonal", packed,
     [](const Path& p) { set_entry(p, "/dynamics/lumped", 0, std::uint8_t{1}); },
     "/dynamics/matrices/mass: column 0 is not diagonal"},
    {"NewmarkOfTwo", packed, [](const Path& p) { replace(p, "/dynamics/newmark", H5T_IEEE_F64LE, {2}); },
     "/dynamics/newmark has size 2, 3 is expected"},
    {"NoTime", packed, [](const Path& p) { set_entry(p, "/dynamics/newmark", 2, 0.0); },
     "/dynamics/newmark: the time step is 0"},
    {"TimeBackwards", modal, [](const Path& p) { set_entry(p, "/dynamics/newmark", 2, -0.001); },
     "/dynamics/newmark: the time step is -0.001"},
    {"AlphaNan", modal, [](const Path& p) { set_entry(p, "/dynamics/newmark", 0, nan); },
     "/dynamics/newmark holds a value that is not finite (entry 0)"},
    {"AlphaUnstable", modal, [](const Path& p) { set_entry(p, "/dynamics/newmark", 0, 0.3); },
     "are not unconditionally stable"},
    {"DeltaUnstable", packed, [](const Path& p) { set_entry(p, "/dynamics/newmark", 1, 0.4); },
     "are not unconditionally stable"},
    {"DampingNegative", packed, [](const Path& p) { set_entry(p, "/dynamics/damping", 1, -1e-9); },
     "/dynamics/damping is negative"},
    {"DampingInfinite", packed, [](const Path& p) { set_entry(p, "/dynamics/damping", 0, infinity); },
     "/dynamics/damping holds a value that is not finite"},

    {"NotAllStored", packed, [](const Path& p) { set_entry(p, "/dofs/fixed", 0, std::uint8_t{3}); },
     "/dynamics/method is packed, but not every node that can move is stored"},
    {"ScopeNotFull", packed, [](const Path& p) { set_text(p, "scope", "surface"); },
     "/dynamics/method is packed, but not every node that can move is stored"},
    {"StartTooShort", packed,
     [](const Path& p) { replace(p, "/dynamics/matrices/start", H5T_STD_I64LE, {54}); },
     "/dynamics/matrices/start has size 54, 55 is expected by /dofs/stored_nodes"},
    {"StartNotAtZero", packed,
     [](const Path& p) { set_entry(p, "/dynamics/matrices/start", 0, std::int64_t{1}); },
     "/dynamics/matrices/start does not go from 0 to 107"},
    {"StartEndsEarly", packed,
     [](const Path& p) { set_entry(p, "/dynamics/matrices/start", 54, std::int64_t{106}); },
     "/dynamics/matrices/start does not go from 0 to 107"},
    {"StartDescends", packed,
     [](const Path& p) { set_entry(p, "/dynamics/matrices/start", 5, std::int64_t{7}); },
     "/dynamics/matrices/start descends at entry 5"},
    {"StartBeyond", packed,
     [](const Path& p) { set_entry(p, "/dynamics/matrices/start", 5, std::int64_t{1} << 40); },
     "/dynamics/matrices/start holds 1099511627776 (entry 5), only 0 to 107"},
    {"EmptyColumn", packed,
     [](const Path& p) { set_entry(p, "/dynamics/matrices/start", 1, std::int64_t{0}); },
     "/dynamics/matrices/row: column 0 does not begin on the diagonal"},
    {"EntriesOfAHeldDof", packed, [](const Path& p) { set_entry(p, "/dofs/fixed", 26, std::uint8_t{1}); },
     "/dynamics/matrices/start: column 0 has entries, though its dof is held"},
    {"RowOfAHeldDof", packed, [](const Path& p) { set_entry(p, "/dofs/fixed", 25, std::uint8_t{1}); },
     "/dynamics/matrices/row: column 2 has an entry of a held dof"},
    {"RowOutside", packed, [](const Path& p) { set_entry(p, "/dynamics/matrices/row", 3, std::int32_t{54}); },
     "/dynamics/matrices/row holds 54 (entry 3), only 0 to 53"},
    {"RowNegative", packed,
     [](const Path& p) { set_entry(p, "/dynamics/matrices/row", 3, std::int32_t{-1}); },
     "/dynamics/matrices/row holds -1"},
    {"RowTwice", packed, [](const Path& p) { set_entry(p, "/dynamics/matrices/row", 3, std::int32_t{1}); },
     "/dynamics/matrices/row: column 1 does not ascend"},
    {"RowAboveTheDiagonal", packed,
     [](const Path& p) { set_entry(p, "/dynamics/matrices/row", 4, std::int32_t{0}); },
     "/dynamics/matrices/row: column 2 does not begin on the diagonal"},
    {"MassTooShort", packed,
     [](const Path& p) { replace(p, "/dynamics/matrices/mass", H5T_IEEE_F64LE, {106}); },
     "/dynamics/matrices/mass has size 106, 107 is expected by /dynamics/matrices/row"},
    {"NoMass", packed, [](const Path& p) { set_entry(p, "/dynamics/matrices/mass", 2, 0.0); },
     "/dynamics/matrices/mass: column 1 has no positive mass"},
    {"MassNan", packed, [](const Path& p) { set_entry(p, "/dynamics/matrices/mass", 9, nan); },
     "/dynamics/matrices/mass holds a value that is not finite (entry 9)"},
    {"DampingPullsAlong", packed, [](const Path& p) { set_entry(p, "/dynamics/matrices/damping", 2, -1.0); },
     "/dynamics/matrices/damping: column 1 has a negative diagonal"},
    {"DampingOfAnotherType", packed,
     [](const Path& p) { replace(p, "/dynamics/matrices/damping", H5T_IEEE_F32LE, {107}); },
     "/dynamics/matrices/damping holds float32"},
    {"NoInverse", packed, [](const Path& p) { remove_object(p, "/dynamics/inverse"); },
     "/dynamics/inverse is missing"},
    {"InverseTooShort", packed,
     [](const Path& p) { replace(p, "/dynamics/inverse", H5T_IEEE_F64LE, {1484}); },
     "/dynamics/inverse has 1484 entries, 1485 are expected"},
    {"InverseOfAnotherPrecision", packed,
     [](const Path& p) { replace(p, "/dynamics/inverse", H5T_IEEE_F32LE, {1485}); },
     "/dynamics/inverse holds float32"},
    {"InverseNan", packed, [](const Path& p) { set_entry(p, "/dynamics/inverse", 1000, nan); },
     "/dynamics/inverse holds a value that is not finite (entry 1000)"},
    {"InverseNotPositive", packed, [](const Path& p) { set_entry(p, "/dynamics/inverse", 54, 0.0); },
     "/dynamics/inverse: diagonal entry 1 is not positive"},

    {"NoModes", modal, [](const Path& p) { replace(p, "/dynamics/modes/omega", H5T_IEEE_F64LE, {1}); },
     "/dynamics/modes/omega has 0 entries, at least 1"},
    {"NoFrequencies", modal, [](const Path& p) { replace(p, "/dynamics/modes/omega", H5T_IEEE_F64LE, {0}); },
     "/dynamics/modes/omega has -1 entries, at least 1"},
    {"MoreModesThanDofs", modal,
     [](const Path& p) {
       replace(p, "/dynamics/modes/omega", H5T_IEEE_F64LE, {56});
       replace(p, "/dynamics/modes/shapes", H5T_IEEE_F64LE, {55, 54});
     },
     "/dynamics/modes/omega has 55 modes of a body with 54 free dofs"},
    {"OmegaZero", modal, [](const Path& p) { set_entry(p, "/dynamics/modes/omega", 0, 0.0); },
     "/dynamics/modes/omega is not positive and ascending (entry 0)"},
    {"OmegaDescends", modal, [](const Path& p) { set_entry(p, "/dynamics/modes/omega", 3, 10.5); },
     "/dynamics/modes/omega is not positive and ascending (entry 3)"},
    {"OmegaNan", modal, [](const Path& p) { set_entry(p, "/dynamics/modes/omega", 2, nan); },
     "/dynamics/modes/omega holds a value that is not finite (entry 2)"},
    {"OmegaInfinite", modal, [](const Path& p) { set_entry(p, "/dynamics/modes/omega", 5, infinity); },
     "/dynamics/modes/omega: entry 5 is infinite"},
    {"OmegaMinusInfinity", modal, [](const Path& p) { set_entry(p, "/dynamics/modes/omega", 0, -infinity); },
     "/dynamics/modes/omega is not positive and ascending (entry 0)"},
    {"ShapesOfFewerDofs", modal,
     [](const Path& p) {
       replace(p, "/dynamics/modes/shapes", H5T_IEEE_F64LE, {5, 53});
     },
     "/dynamics/modes/shapes has size 53, 54 is expected by /dofs/stored_nodes"},
    {"ShapesOfFewerModes", modal,
     [](const Path& p) {
       replace(p, "/dynamics/modes/shapes", H5T_IEEE_F64LE, {4, 54});
     },
     "/dynamics/modes/shapes has size 4, 5 is expected by /dynamics/modes/omega"},
    {"ShapesHuge", modal,
     [](const Path& p) {
       replace(p, "/dynamics/modes/shapes", H5T_IEEE_F64LE, {5, hsize_t{1} << 40});
     },
     "more than the file holds"},
    {"ShapesInfinite", modal, [](const Path& p) { set_entry(p, "/dynamics/modes/shapes", 60, infinity); },
     "/dynamics/modes/shapes holds a value that is not finite (entry 60)"},
    {"ShapeMovesAHeldDof", modal, [](const Path& p) { set_entry(p, "/dofs/fixed", 26, std::uint8_t{1}); },
     "/dynamics/modes/shapes: mode 0 moves dof 0, which is held"},
};

INSTANTIATE_TEST_SUITE_P(Files, HostileDynamics, testing::ValuesIn(edits),
                         [](const auto& edit) { return std::string(edit.param.name); });

}  // namespace
}  // namespace palpate::test::dynamics_test
