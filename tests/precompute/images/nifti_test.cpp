// Labelled images in NIfTI: bytes written here by the format's definition, against the same image as INR.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include "precompute/images/labelled_image.h"
#include "precompute/images/nifti_image.h"
#include "tests/support/bodies/geometry_shapes.h"
#include "tests/support/bodies/labelled_sample.h"

namespace palpate::nifti_test {
namespace {

using test::inr;
using test::label_at;
using test::origin;
using test::size;
using test::spacing;
using testing::error_of;
using testing::expect_mentions;
using testing::TempFolder;

/// How the image lies in a file.
struct Layout {
  std::array<int, 3> axis = {0, 1, 2};  // of space, along which each of the file's runs
  std::array<bool, 3> backwards{};
  int version = 1;
  bool swapped = false;                    // byte order
  int datatype = 2;                        // 2 uint8, 4 int16, 16 float32
  float slope = 0.0F;                      // 0: values are labels
  int units = 2;                           // 1 metres, 2 millimetres, 3 micrometres
  double unit = 1.0;                       // of the file's lengths [mm]
  double turn = 0.0;                       // of the whole about z [rad]
  double shear = 0.0;                      // steps along z also move so much along y [mm]
  std::array<int, 4> more = {1, 1, 1, 1};  // dimensions beyond three
};

class Writer {
 public:
  explicit Writer(bool swapped) : swapped_(swapped) {}

  template <class T>
  void put(std::size_t offset, T value) {
    auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (swapped_) std::ranges::reverse(bytes);
    text_.resize(std::max(text_.size(), offset + sizeof(T)), '\0');
    std::ranges::copy(bytes, text_.begin() + static_cast<std::ptrdiff_t>(offset));
  }
  template <class T>
  void add(T value) {
    put(text_.size(), value);
  }
  void text(std::size_t offset, const std::string& what) {
    for (std::size_t i = 0; i < what.size(); ++i) put(offset + i, what[i]);
  }
  [[nodiscard]] const std::string& bytes() const { return text_; }

 private:
  bool swapped_;
  std::string text_;
};

/// Rows of the file's matrix, from voxel numbers to space.
std::array<std::array<double, 4>, 3> matrix_of(const Layout& layout) {
  Eigen::Matrix3d columns = Eigen::Matrix3d::Zero();
  Vec3 corner = origin;
  for (int s = 0; s < 3; ++s) {
    const auto at = static_cast<std::size_t>(s);
    const int axis = layout.axis.at(at);
    columns(axis, s) = (layout.backwards.at(at) ? -1.0 : 1.0) * spacing[axis];
    if (layout.backwards.at(at))
      corner[axis] += (size.at(static_cast<std::size_t>(axis)) - 1) * spacing[axis];
  }
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(layout.turn, Vec3::UnitZ()).toRotationMatrix();
  columns(1, 2) += layout.shear;
  columns = turn * columns / layout.unit;
  corner = turn * corner / layout.unit;
  std::array<std::array<double, 4>, 3> rows{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 4; ++c)
      rows.at(r).at(c) =
          c < 3 ? columns(static_cast<int>(r), static_cast<int>(c)) : corner[static_cast<int>(r)];
  }
  return rows;
}

std::string nifti(const Layout& layout) {
  Writer file(layout.swapped);
  const bool first = layout.version == 1;
  const int bits = layout.datatype == 2 ? 8 : layout.datatype == 4 ? 16 : 32;
  std::array<std::int64_t, 8> dim = {3};
  for (std::size_t s = 0; s < 3; ++s) dim.at(s + 1) = size.at(static_cast<std::size_t>(layout.axis.at(s)));
  for (std::size_t s = 0; s < 4; ++s) dim.at(s + 4) = layout.more.at(s);
  if (layout.more != std::array<int, 4>{1, 1, 1, 1}) dim[0] = 7;
  const auto rows = matrix_of(layout);
  std::array<double, 8> sides = {1.0};
  for (std::size_t s = 0; s < 3; ++s) sides.at(s + 1) = spacing[layout.axis.at(s)] / layout.unit;
  if (first) {
    file.put<std::int32_t>(0, 348);
    for (std::size_t i = 0; i < 8; ++i) {
      file.put(40 + 2 * i, static_cast<std::int16_t>(dim.at(i)));
      file.put(76 + 4 * i, static_cast<float>(sides.at(i)));
    }
    file.put(70, static_cast<std::int16_t>(layout.datatype));
    file.put(72, static_cast<std::int16_t>(bits));
    file.put(108, 352.0F);
    file.put(112, layout.slope);
    file.put(123, static_cast<char>(layout.units));
    file.put<std::int16_t>(254, 1);  // sform_code: scanner
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 4; ++c)
        file.put(280 + 16 * r + 4 * c, static_cast<float>(rows.at(r).at(c)));
    file.text(344, std::string("n+1\0", 4));
    file.put<std::int32_t>(348, 0);
  } else {
    file.put<std::int32_t>(0, 540);
    file.text(4, std::string("n+2\0\r\n\x1a\n", 8));
    file.put(12, static_cast<std::int16_t>(layout.datatype));
    file.put(14, static_cast<std::int16_t>(bits));
    for (std::size_t i = 0; i < 8; ++i) {
      file.put(16 + 8 * i, dim.at(i));
      file.put(104 + 8 * i, sides.at(i));
    }
    file.put<std::int64_t>(168, 544);
    file.put(176, static_cast<double>(layout.slope));
    file.put<std::int32_t>(348, 1);  // sform_code
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 4; ++c) file.put(400 + 32 * r + 8 * c, rows.at(r).at(c));
    file.put<std::int32_t>(500, layout.units);
    file.put<std::int32_t>(540, 0);
  }
  const double slope = layout.slope == 0.0F ? 1.0 : static_cast<double>(layout.slope);
  std::array<int, 3> at{};  // in space
  const auto run = [&](std::size_t s, int number) {
    const auto axis = static_cast<std::size_t>(layout.axis.at(s));
    at.at(axis) = layout.backwards.at(s) ? size.at(axis) - 1 - number : number;
  };
  for (int c = 0; c < dim[3]; ++c) {
    for (int b = 0; b < dim[2]; ++b) {
      for (int a = 0; a < dim[1]; ++a) {
        run(0, a);
        run(1, b);
        run(2, c);
        const double value = label_at(at[0], at[1], at[2]) / slope;
        if (layout.datatype == 2) file.add(static_cast<unsigned char>(value));
        if (layout.datatype == 4) file.add(static_cast<std::int16_t>(value));
        if (layout.datatype == 16) file.add(static_cast<float>(value));
      }
    }
  }
  return file.bytes();
}

class NiftiImage : public ::testing::Test {
 protected:
  VoxelBody read(const std::string& name, const std::string& bytes) {
    return read_labelled_image({folder_.write(name, bytes), {}, true}, 10.0, notes_);
  }

  void expect_same(const VoxelBody& body) {
    EXPECT_EQ(body.size, expected_.size);
    EXPECT_EQ(body.inside, expected_.inside);
    EXPECT_EQ(body.labels, expected_.labels);
    EXPECT_LT((body.spacing - expected_.spacing).norm(), 1e-5);
    EXPECT_LT((body.origin - expected_.origin).norm(), 1e-4);
  }

  std::string error(const std::string& bytes) {
    return error_of([&] { read("a.nii", bytes); });
  }

  TempFolder folder_;
  std::vector<std::string> notes_;
  VoxelBody expected_ = read("scan.inr", inr());
};

/// All 48 ways in which a file's axes can run along those of space; half of them would mirror the body.
TEST_F(NiftiImage, LiesInSpaceAsItsMatrixSays) {
  Layout layout;
  do {
    for (int flips = 0; flips < 8; ++flips) {
      for (std::size_t s = 0; s < 3; ++s) layout.backwards.at(s) = ((flips >> s) & 1) != 0;
      expect_same(read("a.nii", nifti(layout)));
    }
  } while (std::next_permutation(layout.axis.begin(), layout.axis.end()));
}

TEST_F(NiftiImage, OfEachKindIsTheSame) {
  for (const int version : {1, 2}) {
    for (const bool swapped : {false, true}) {
      for (const int datatype : {2, 4, 16}) {
        Layout layout;
        layout.version = version;
        layout.swapped = swapped;
        layout.datatype = datatype;
        SCOPED_TRACE(testing::at(version * 100 + datatype));
        expect_same(read("a.nii", nifti(layout)));
      }
    }
  }
}

TEST_F(NiftiImage, HasLengthsInMillimetresAndScaledValues) {
  Layout layout;
  layout.units = 1;
  layout.unit = 1e3;
  layout.datatype = 16;
  layout.slope = 0.5F;
  expect_same(read("metres.nii", nifti(layout)));
  layout.units = 3;
  layout.unit = 1e-3;
  expect_same(read("micrometres.nii", nifti(layout)));
}

TEST_F(NiftiImage, SaysItsUnitWhereTheHeaderDoes) {
  Layout layout;
  for (const auto& [units, unit] : {std::pair{0, 0.0}, {1, 1e3}, {2, 1.0}, {3, 1e-3}}) {
    layout.units = units;
    layout.unit = unit > 0.0 ? unit : 1.0;
    layout.datatype = 16;
    const VoxelBody body = read("a.nii", nifti(layout));
    EXPECT_EQ(body.file_unit, unit);
    EXPECT_LT((body.spacing - expected_.spacing).norm(), 1e-5);
  }
}

/// Slices that lie each further along y, as of a scanner whose gantry was tilted: the voxels of the body lie
/// where the matrix says.
TEST_F(NiftiImage, VoxelsOfShearedSlicesAreWhereTheyAre) {
  for (const auto& [shear, turn] : {std::pair{1.5, 0.0}, {-1.5, 0.0}, {0.7, 0.3}}) {
    for (const std::array<bool, 3> backwards : {std::array{false, false, false}, {false, true, true}}) {
      Layout layout;
      layout.shear = shear;
      layout.turn = turn;
      layout.backwards = backwards;
      notes_.clear();
      const VoxelBody body = read("a.nii", nifti(layout));
      expect_mentions(notes_.at(0), {"sheared by", "and so is the body"});
      EXPECT_NEAR(body.spacing.prod(), expected_.spacing.prod(), 1e-5) << "volume";
      const auto rows = matrix_of(layout);
      const Eigen::Matrix3d columns{{rows[0][0], rows[0][1], rows[0][2]},
                                    {rows[1][0], rows[1][1], rows[1][2]},
                                    {rows[2][0], rows[2][1], rows[2][2]}};
      const Vec3 corner(rows[0][3], rows[1][3], rows[2][3]);
      std::size_t held = 0;
      for (std::size_t v = 0; v < body.voxels(); ++v) {
        if (body.inside[v] == 0) continue;
        const Vec3 number = columns.inverse() * (body.in_space(body.center(v)) - corner);
        Vec3 whole = number.array().round();
        EXPECT_LT((number - whole).norm(), 1e-4);
        for (int s = 0; s < 3; ++s)
          if (backwards.at(static_cast<std::size_t>(s)))
            whole[s] = size.at(static_cast<std::size_t>(s)) - 1 - whole[s];
        EXPECT_NE(
            label_at(static_cast<int>(whole[0]), static_cast<int>(whole[1]), static_cast<int>(whole[2])), 0);
        ++held;
      }
      EXPECT_EQ(held, static_cast<std::size_t>(std::ranges::count(expected_.inside, 1)));
    }
  }
}

/// libnifti would take 1 for them.
TEST_F(NiftiImage, SidesThatAreNotPositiveAreRefused) {
  for (const int version : {1, 2}) {
    Layout layout;
    layout.version = version;
    std::string bytes = nifti(layout);
    const auto put = [&]<class T>(std::size_t offset, T value) {
      const auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
      std::ranges::copy(raw, bytes.begin() + static_cast<std::ptrdiff_t>(offset));
    };
    const auto set_side = [&](double side) {
      version == 1 ? put(84, static_cast<float>(side)) : put(120, side);
    };
    set_side(-1.5);
    read("a.nii", bytes);  // the matrix counts
    version == 1 ? put(254, std::int16_t{0}) : put(348, std::int32_t{0});
    for (const double side : {-1.5, 0.0, std::numeric_limits<double>::quiet_NaN()}) {
      set_side(side);
      expect_mentions(error(bytes), {"a.nii", "pixdim[2]", "must be positive"});
    }
  }
}

TEST_F(NiftiImage, AxesThatAreNoneAreRefused) {
  for (const int version : {1, 2}) {
    Layout layout;
    layout.version = version;
    layout.shear = 40.0 * spacing[2];
    expect_mentions(error(nifti(layout)), {"a.nii", "from a right angle", "correct the header"});
    layout.shear = 0.0;
    for (const double no_number :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      for (std::size_t entry = 0; entry < 12; ++entry) {
        std::string bytes = nifti(layout);
        const auto put = [&](std::size_t offset, auto value) {
          const auto raw = std::bit_cast<std::array<char, sizeof(value)>>(value);
          std::ranges::copy(raw, bytes.begin() + static_cast<std::ptrdiff_t>(offset));
        };
        version == 1 ? put(280 + 4 * entry, static_cast<float>(no_number)) : put(400 + 8 * entry, no_number);
        expect_mentions(error(bytes), {"a.nii", "correct the header"});
      }
    }
  }
}

/// A scan in the place of a segmentation.
TEST_F(NiftiImage, GreyImageIsNoneOfLabelsUntilARangeIsSaid) {
  Layout layout;
  layout.datatype = 16;
  std::string bytes = nifti(layout);
  const std::size_t voxels = 352;
  const auto set = [&](std::size_t v, float value) {
    const auto raw = std::bit_cast<std::array<char, 4>>(value);
    std::ranges::copy(raw, bytes.begin() + static_cast<std::ptrdiff_t>(voxels + 4 * v));
  };
  const auto with_range = [&](ValueRange range) {
    return read_labelled_image({folder_.write("grey.nii", bytes), {}, false, range}, 10.0, notes_);
  };
  set(0, -1.0F);  // outside, as some programs mark it
  expect_mentions(error(bytes), {"a.nii", "grey", "-1 to 4", "--range", "labels (-1, 0, 1, 2, 3, 4)"});
  EXPECT_EQ(with_range({1.0, 4.0}).inside, expected_.inside);
  EXPECT_EQ(read_labelled_image({folder_.write("a.nii", bytes), {1, 2, 3, 4}, true}, 10.0, notes_).labels,
            expected_.labels);
  set(0, 0.25F);
  expect_mentions(error(bytes), {"grey", "0 to 4", "not all are whole numbers", "range = [LOW, HIGH]"});
  EXPECT_EQ(with_range({0.5, 4.0}).inside, expected_.inside);
  expect_mentions(error_of([&] { with_range({5.0, 9.0}); }), {"no voxel", "from 5 to 9", "go from 0 to 4"});
  for (std::size_t v = 0; v < 150; ++v) set(v, static_cast<float>(v));
  expect_mentions(error(bytes), {"grey", "0 to 149", "150 different ones"});
}

TEST_F(NiftiImage, LabelsThatAreMergedAreTold) {
  notes_.clear();
  read_labelled_image({folder_.write("a.nii", nifti({})), {}, false}, 10.0, notes_);
  ASSERT_FALSE(notes_.empty());
  expect_mentions(notes_[0], {"labels 1, 2, 3 and 4 are one tissue", "regions"});
  notes_.clear();
  read_labelled_image({folder_.write("a.nii", nifti({})), {1, 2, 3, 4}, false}, 10.0, notes_);
  for (const std::string& note : notes_) EXPECT_EQ(note.find("one tissue"), std::string::npos) << note;
}

TEST_F(NiftiImage, GzippedIsTheSame) {
  const std::string path = (folder_.path() / "A.NII.GZ").string(), bytes = nifti({});
  gzFile_s* const file = gzopen(path.c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
  EXPECT_EQ(check_nifti_header(open_file(path, OpenMode::read)), std::ssize(bytes));
  expect_same(read_labelled_image({path, {}, true}, 10.0, notes_));
}

TEST_F(NiftiImage, ThatIsTurnedIsToldSo) {
  Layout layout;
  layout.turn = 0.2;
  notes_.clear();
  const VoxelBody body = read("a.nii", nifti(layout));
  EXPECT_EQ(body.labels, expected_.labels);
  ASSERT_FALSE(notes_.empty());
  expect_mentions(notes_[0], {"turned by 11.5 degrees"});
}

TEST_F(NiftiImage, HeadersThatLieAreRefused) {
  const std::string whole = nifti({});
  const auto with = [&](std::size_t offset, auto value) {
    std::string bytes = whole;
    const auto raw = std::bit_cast<std::array<char, sizeof value>>(value);
    std::ranges::copy(raw, bytes.begin() + static_cast<std::ptrdiff_t>(offset));
    return error(bytes);
  };
  expect_mentions(with(42, std::int16_t{0}), {"a.nii", "dim[1]", "is 0"});
  expect_mentions(with(44, std::int16_t{-3}), {"dim[2]", "is -3"});
  expect_mentions(with(46, std::int16_t{30'000}), {"asks for", "bytes"});
  expect_mentions(with(72, std::int16_t{-8}), {"bitpix"});
  expect_mentions(with(108, 1e30F), {"vox_offset"});
  expect_mentions(with(108, std::numeric_limits<float>::quiet_NaN()), {"vox_offset"});
  expect_mentions(with(70, std::int16_t{128}), {"a.nii"});  // colours
  expect_mentions(with(280, std::numeric_limits<float>::quiet_NaN()), {"a.nii"});
  expect_mentions(with(280, 1e20F), {"sides"});
  expect_mentions(error(whole.substr(0, whole.size() - 1)), {"only", "bytes"});
  expect_mentions(error(whole.substr(0, 200)), {"not a readable image"});
  expect_mentions(error("this is no image\n"), {"not a readable image"});
  Layout moving;
  moving.more = {2, 1, 1, 1};
  std::string film = nifti(moving);
  film += film.substr(352);
  expect_mentions(error(film), {"several values"});
}

/// A header of the pair NAME.hdr, NAME.img (and of Analyze 7.5, which has no letters there) is none of one
/// file, under whatever name; libnifti and other readers of INR take its own bytes, or those beside it.
TEST_F(NiftiImage, PairsOfHeaderAndVoxelsAreRefused) {
  std::string pair = nifti({});
  const std::string image = pair.substr(352);
  for (const std::string& letters : {std::string("ni1\0", 4), std::string(4, '\0')}) {
    pair.replace(344, 4, letters);
    for (const std::string name : {"x.hdr", "x.nii", "x.img", "x.inr", "x", "x.nhdr", "x.gz"}) {
      SCOPED_TRACE(name);
      folder_.write("x.img", image);
      expect_mentions(error_of([&] { read(name, pair); }), {name, "not a readable image"});
    }
  }
  expect_mentions(error_of([&] { read("x.img", image); }), {"not a readable image"});
}

TEST_F(NiftiImage, ThatIsBlankIsToldUnlessItsValuesAreShifted) {
  std::string blank = nifti({}).substr(0, 352) + std::string(504, '\0');
  expect_mentions(error(blank), {"a.nii", "the image is empty"});
  EXPECT_THROW((void)check_nifti_header(open_file(folder_.path() / "a.nii", OpenMode::read)), Error);
  const auto bytes = std::bit_cast<std::array<char, 4>>(1.0F);
  for (const std::size_t offset : {112U, 116U})  // scl_slope, scl_inter
    std::ranges::copy(bytes, blank.begin() + static_cast<std::ptrdiff_t>(offset));
  const VoxelBody body = read("a.nii", blank);
  EXPECT_EQ(body.labels[body.at(2, 2, 2)], 1);
}

}  // namespace
}  // namespace palpate::nifti_test
