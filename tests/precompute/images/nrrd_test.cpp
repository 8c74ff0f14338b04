// Labelled images in NRRD: text and bytes written here by the format's definition, against the same image as
// INR.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string>

#include "precompute/images/labelled_image.h"
#include "precompute/images/nrrd_image.h"
#include "tests/support/bodies/geometry_shapes.h"
#include "tests/support/bodies/labelled_sample.h"

namespace palpate::nrrd_test {
namespace {

using test::inr;
using test::label_at;
using testing::error_of;
using testing::expect_mentions;
using testing::TempFolder;

/// How the image lies in a file.
struct Layout {
  std::array<std::size_t, 3> axis = {0, 1, 2};  // of space, along which each of the file's runs
  std::array<bool, 3> backwards{};
  std::string space = "right-anterior-superior";
  std::array<double, 3> signs = {1.0, 1.0, 1.0};  // of its axes, from those of NIfTI
  std::string type = "uint8";
  bool big_endian = false;
  std::string units;   // of space
  double unit = 1.0;   // of them [mm]
  double turn = 0.0;   // of the whole about z [rad]
  std::string before;  // a line of the header
  std::string list;    // an axis that does not lie in space: its size
};

template <class T>
std::string bytes_of(T value, bool big_endian) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (big_endian) std::ranges::reverse(bytes);
  return {bytes.begin(), bytes.end()};
}

std::string number(const Layout& layout, int label) {
  if (layout.type == "short") return bytes_of(static_cast<std::int16_t>(label), layout.big_endian);
  if (layout.type == "float") return bytes_of(static_cast<float>(label), layout.big_endian);
  if (layout.type == "unsigned long long")
    return bytes_of(static_cast<std::uint64_t>(label), layout.big_endian);
  return bytes_of(static_cast<std::uint8_t>(label), false);
}

std::string voxels(const Layout& layout) {
  std::array<int, 3> at{};  // in space
  const auto run = [&](std::size_t s, int count) {
    const std::size_t axis = layout.axis.at(s);
    at.at(axis) = layout.backwards.at(s) ? test::size.at(axis) - 1 - count : count;
  };
  std::string bytes;
  for (int c = 0; c < test::size.at(layout.axis[2]); ++c) {
    for (int b = 0; b < test::size.at(layout.axis[1]); ++b) {
      for (int a = 0; a < test::size.at(layout.axis[0]); ++a) {
        run(0, a);
        run(1, b);
        run(2, c);
        bytes += number(layout, label_at(at[0], at[1], at[2]));
      }
    }
  }
  return bytes;
}

std::string vector_text(const Vec3& v) {
  return fmt::format("({},{},{})", v.x(), v.y(), v.z());
}

std::string header(const Layout& layout, const std::string& encoding = "raw") {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(layout.turn, Vec3::UnitZ()).toRotationMatrix();
  const Vec3 signs(layout.signs[0], layout.signs[1], layout.signs[2]);
  Vec3 corner = test::origin;
  std::string directions, sizes;
  for (std::size_t s = 0; s < 3; ++s) {
    const std::size_t axis = layout.axis.at(s);
    const auto row = static_cast<Eigen::Index>(axis);
    Vec3 along = Vec3::Zero();
    along[row] = (layout.backwards.at(s) ? -1.0 : 1.0) * test::spacing[row];
    if (layout.backwards.at(s)) corner[row] += (test::size.at(axis) - 1) * test::spacing[row];
    directions += " " + vector_text(signs.cwiseProduct(turn * along) / layout.unit);
    sizes += fmt::format(" {}", test::size.at(axis));
  }
  const bool lists = !layout.list.empty();
  std::string text = fmt::format("NRRD0004\n# made by hand\n{}type: {}\ndimension: {}\nspace: {}\n",
                                 layout.before, layout.type, lists ? 4 : 3, layout.space);
  text += fmt::format("sizes:{}{}\nspace directions:{}{}\n", lists ? " " + layout.list : "", sizes,
                      lists ? " none" : "", directions);
  text += fmt::format("kinds:{} domain domain domain\nendian: {}\nencoding: {}\n", lists ? " list" : "",
                      layout.big_endian ? "big" : "little", encoding);
  text += "space origin: " + vector_text(signs.cwiseProduct(turn * corner) / layout.unit) + "\n";
  if (!layout.units.empty()) text += fmt::format("space units: \"{0}\" \"{0}\" \"{0}\"\n", layout.units);
  return text + "Segment0_Name:=liver\n\n";
}

std::string nrrd(const Layout& layout) {
  return header(layout) + voxels(layout);
}

std::string gzipped(const std::string& bytes, const std::filesystem::path& scratch) {
  gzFile_s* const file = gzopen(scratch.c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
  std::ifstream stream(scratch, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class NrrdImage : public ::testing::Test {
 protected:
  VoxelBody read(const std::string& name, const std::string& bytes) {
    return read_labelled_image({folder_.write(name, bytes), {}, true}, 10.0, notes_);
  }

  void expect_same(const VoxelBody& body) {
    EXPECT_EQ(body.size, expected_.size);
    EXPECT_EQ(body.inside, expected_.inside);
    EXPECT_EQ(body.labels, expected_.labels);
    EXPECT_LT((body.spacing - expected_.spacing).norm(), 1e-9);
    EXPECT_LT((body.origin - expected_.origin).norm(), 1e-9);
  }

  std::string error(const std::string& bytes) {
    return error_of([&] { read("a.nrrd", bytes); });
  }

  TempFolder folder_;
  std::vector<std::string> notes_;
  VoxelBody expected_ = read("scan.inr", inr());
};

/// All 48 ways in which a file's axes can run along those of space, in each space that names them.
TEST_F(NrrdImage, LiesInSpaceAsItsDirectionsSay) {
  struct Space {
    const char* name;
    std::array<double, 3> signs;
  };
  for (const Space& space :
       {Space{"right-anterior-superior", {1, 1, 1}}, Space{"RAS", {1, 1, 1}},
        Space{"left-posterior-superior", {-1, -1, 1}}, Space{"left-anterior-superior", {-1, 1, 1}}}) {
    SCOPED_TRACE(space.name);
    Layout layout;
    layout.space = space.name;
    layout.signs = space.signs;
    do {
      for (int flips = 0; flips < 8; ++flips) {
        for (std::size_t s = 0; s < 3; ++s) layout.backwards.at(s) = ((flips >> s) & 1) != 0;
        expect_same(read("a.nrrd", nrrd(layout)));
      }
    } while (std::next_permutation(layout.axis.begin(), layout.axis.end()));
  }
}

TEST_F(NrrdImage, OfEachKindIsTheSame) {
  for (const bool big_endian : {false, true}) {
    for (const char* const type : {"uint8", "short", "float", "unsigned long long"}) {
      Layout layout;
      layout.big_endian = big_endian;
      layout.type = type;
      SCOPED_TRACE(type);
      expect_same(read("a.nrrd", nrrd(layout)));
    }
  }
}

TEST_F(NrrdImage, HasLengthsInItsUnits) {
  Layout layout;
  layout.units = "m";
  layout.unit = 1e3;
  expect_same(read("metres.nrrd", nrrd(layout)));
  layout.units = "mm";
  layout.unit = 1.0;
  expect_same(read("MILLIMETRES.NRRD", nrrd(layout)));
}

TEST_F(NrrdImage, GzippedVoxelsAreTheSame) {
  const Layout layout;
  const std::string packed = gzipped(voxels(layout), folder_.path() / "packed");
  const std::string head = header(layout, "gzip");
  expect_same(read("a.nrrd", head + packed));
  EXPECT_EQ(check_nrrd_header(open_file(folder_.path() / "a.nrrd", OpenMode::read)),
            std::max(std::ssize(voxels(layout)), std::ssize(head + packed)));
  expect_mentions(error(head + packed.substr(0, packed.size() / 2)), {"a.nrrd", "504", "bytes"});
}

TEST_F(NrrdImage, WithoutASpaceHasItsSpacings) {
  std::string text =
      "NRRD0001\ntype: uint8\ndimension: 3\nsizes: 9 8 7\nspacings: 1 1.5 2\nencoding: raw\n\n";
  const VoxelBody body = read("a.nrrd", text + voxels({}));
  EXPECT_EQ(body.labels, expected_.labels);
  EXPECT_EQ(body.spacing, expected_.spacing);
}

TEST_F(NrrdImage, ThatIsTurnedIsToldSo) {
  Layout layout;
  layout.turn = 0.2;
  notes_.clear();
  EXPECT_EQ(read("a.nrrd", nrrd(layout)).labels, expected_.labels);
  ASSERT_FALSE(notes_.empty());
  expect_mentions(notes_[0], {"turned by 11.5 degrees"});
}

TEST_F(NrrdImage, AnAxisOfOneListItemIsNone) {
  Layout layout;
  layout.list = "1";
  expect_same(read("a.nrrd", nrrd(layout)));
  layout.list = "2";  // segments that overlap
  expect_mentions(error(header(layout) + voxels(layout) + voxels(layout)), {"several values"});
}

TEST_F(NrrdImage, HeadersThatLieAreRefused) {
  const std::string whole = nrrd({});
  const auto with = [&](const std::string& old, const std::string& by) {
    std::string bytes = whole;
    const std::size_t at = bytes.find(old);
    EXPECT_NE(at, std::string::npos) << old;
    return error(bytes.replace(at, old.size(), by));
  };
  expect_mentions(with("sizes: 9 8 7", "sizes: 9 0 7"), {"a.nrrd", "sizes", "\"0\""});
  expect_mentions(with("sizes: 9 8 7", "sizes: 9 -8 7"), {"sizes", "\"-8\""});
  expect_mentions(with("sizes: 9 8 7", "sizes: 9 x 7"), {"sizes", "\"x\""});
  expect_mentions(with("sizes: 9 8 7", "sizes: 9000 8000 7000"), {"voxels", "at most"});
  expect_mentions(with("sizes: 9 8 7", "sizes: 9 8 8"), {"576 bytes", "504 bytes"});
  expect_mentions(with("type: uint8", "type: block"), {"a.nrrd"});
  expect_mentions(with("(1,0,0)", "(0,0,0)"), {"sides"});
  expect_mentions(error(whole.substr(0, 60)), {"not a readable image"});
  expect_mentions(error("this is no image\n"), {"not a readable image"});
}

/// Whatever the field is called and however voxels are written: with enough bytes behind the header, so that
/// a reader which overlooks the field would make a body of them or of the other file.
TEST_F(NrrdImage, VoxelsInAnotherFileAreRefused) {
  const std::string other = folder_.write("other.raw", voxels({})).string();
  for (const std::string field :
       {"data file: ", "Data File: ", "DATA FILE: ", "datafile: ", "DataFile: ", "DATAFILE: ", "data  file: ",
        " data file: ", "data file : ", "data_file: ", "data-file: ", "data file:\t", "Data File:"}) {
    for (const std::string& file : {other, std::string("/etc/passwd"), std::string("LIST"),
                                    std::string("LIST 3"), std::string("slice%03d.raw 1 9 1")}) {
      for (const char* const encoding : {"raw", "gzip", "gz", "hex", "ascii", "txt", "bzip2"}) {
        Layout detached;
        detached.before = field + file + "\n" + (file == other ? "" : "byte skip: -1\n");
        SCOPED_TRACE(detached.before + encoding);
        expect_mentions(error(header(detached, encoding) + std::string(2000, '1')),
                        {"another file", "one file"});
      }
    }
  }
}

TEST_F(NrrdImage, WrittenInDigitsIsTheSameAndCountedBefore) {
  std::string hex, ascii;
  for (const char c : voxels({})) {
    hex += fmt::format("{:02x}", static_cast<int>(c));
    ascii += fmt::format("{} ", static_cast<int>(c));
  }
  expect_same(read("hex.nrrd", header({}, "hex") + hex));
  expect_same(read("ascii.nrrd", header({}, "ascii") + ascii));
  expect_mentions(error(header({}, "hex") + hex.substr(1)), {"only 1007 bytes"});
  expect_mentions(error(header({}, "ascii") + ascii.substr(0, 1006)), {"only 1006 bytes"});
}

/// teem knows more formats than its own.
TEST_F(NrrdImage, OtherFormatsUnderItsNameAreRefused) {
  const std::string raster = "P5\n9 56\n255\n" + voxels({});
  const std::string table = "0 1 0\n1 1 1\n0 1 0\n";
  for (const std::string& bytes : {raster, table, std::string("# vtk DataFile Version 2.0\n"), test::inr()})
    expect_mentions(error(bytes), {"not a readable image"});
}

TEST_F(NrrdImage, ThatIsBlankIsToldWithoutReadingIt) {
  Layout layout;
  const std::string head = header(layout, "gzip");
  const std::string packed = gzipped(std::string(504, '\0'), folder_.path() / "packed");
  expect_mentions(error(head + packed), {"a.nrrd", "the image is empty"});
  EXPECT_THROW((void)check_nrrd_header(open_file(folder_.path() / "a.nrrd", OpenMode::read)), Error);
}

}  // namespace
}  // namespace palpate::nrrd_test
