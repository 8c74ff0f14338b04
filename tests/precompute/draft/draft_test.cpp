// A model.toml for a surface or an image.
#include "precompute/draft/draft.h"

#include <gtest/gtest.h>

#include <numbers>
#include <sstream>

#include "precompute/description/description.h"
#include "precompute/description/read_description.h"
#include "precompute/draft/questions.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::draft_test {
namespace {

using testing::ball;
using testing::cube;
using testing::error_of;
using testing::expect_mentions;
using testing::off;
using testing::TempFolder;

TEST(LengthUnit, IsGuessedByTheSize) {
  const std::vector<std::pair<double, std::string>> cases = {
      {150.0, "mm"}, {20.0, "mm"}, {1900.0, "mm"}, {0.15, "m"}, {0.5, "m"}, {15.0, "cm"}, {2.0, "cm"}};
  for (const auto& [longest, name] : cases) EXPECT_EQ(guess_unit(longest).unit.name, name) << longest;
  for (const double longest : {1.0, 1.7, 5e4, 3e-3, 1e-9}) {
    const double metres = longest * guess_unit(longest).unit.metres;
    EXPECT_GE(metres, 0.1 * (1 - 1e-12)) << longest;
    EXPECT_LE(metres, 1.0) << longest;
  }
  expect_mentions(guess_unit(150.0).why, {"150", "15 cm in mm"});
}

TEST(LengthUnit, IsReadByNameOrInMetres) {
  EXPECT_EQ(read_unit("in")->metres, 0.0254);
  EXPECT_EQ(read_unit("0.1")->metres, 0.1);
  for (const char* const wrong : {"", "miles", "-1", "0", "1x", "inf", "nan"})
    EXPECT_FALSE(read_unit(wrong)) << wrong;
}

class DraftTest : public ::testing::Test {
 protected:
  /// A ball with a hole, of radius 60, with corners of so many refinements.
  std::filesystem::path open_ball(const std::string& name) {
    TriangleSurface surface = ball(3);
    for (Vec3& x : surface.nodes) x *= 60.0;
    surface.triangles.resize(surface.triangles.size() - 4);
    return folder_.write(name, off(surface));
  }

  Tell tell() {
    return [this](const std::string& line) { told_ += line + "\n"; };
  }

  static std::string text_of(const std::filesystem::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }

  TempFolder folder_;
  std::string told_;
};

TEST_F(DraftTest, SaysWhatItDecided) {
  DraftOptions options;
  options.shape.nodes = 1000;
  const std::filesystem::path file = draft(open_ball("organ.off"), options, false, tell());
  EXPECT_EQ(file, folder_.path() / "organ.model.toml");
  expect_mentions(told_, {"repaired: a hole was filled", "unit: mm", "12 cm", "1000 surface nodes",
                          "E = 5000 Pa", "organ.repaired.off", "organ.model.toml"});
  const Description description = read_description(file);
  EXPECT_EQ(description.name, "organ");
  EXPECT_EQ(std::get<SurfaceGeometry>(description.geometry).file, folder_.path() / "organ.repaired.off");
  EXPECT_EQ(description.scale, 0.001);
  EXPECT_TRUE(description.mesh.remesh);
  // Equilateral triangles, two per node, on 4 pi 0.06^2 m^2.
  const double edge = std::sqrt(4.0 * std::numbers::pi * 0.0036 / 1000.0 * 2.0 / std::sqrt(3.0));
  EXPECT_NEAR(*description.mesh.edge_length, edge, 0.02 * edge);
  EXPECT_EQ(description.materials.front().material.youngs_modulus, 5e3);
  EXPECT_EQ(description.materials.front().material.poissons_ratio, 0.45);
  EXPECT_EQ(description.fixed.size(), 1U);
}

TEST_F(DraftTest, KeptFilesAreNotReplacedByARepairedSurface) {
  DraftOptions options = {.shape = {.nodes = 300}};
  const std::filesystem::path surface = open_ball("organ.off");
  const std::filesystem::path first = folder_.path() / "organ.repaired.off";
  draft(surface, options, false, tell());
  const std::string earlier = text_of(first) + "\n";
  std::ofstream(first) << earlier;  // of Palpate's, by its mark
  std::filesystem::remove(draft_file(surface));
  options.keep = true;
  const std::filesystem::path second = folder_.path() / "organ.repaired-2.off";
  EXPECT_EQ(std::get<SurfaceGeometry>(read_description(draft(surface, options, false, tell())).geometry).file,
            second);
  EXPECT_TRUE(std::filesystem::exists(second));
  EXPECT_EQ(text_of(first), earlier);
}

TEST_F(DraftTest, WholeSurfaceIsUsedItself) {
  const std::filesystem::path file =
      draft(folder_.write("box.off", off(cube(100.0))), {.shape = {.nodes = 300}}, false, tell());
  EXPECT_EQ(std::get<SurfaceGeometry>(read_description(file).geometry).file, folder_.path() / "box.off");
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "box.repaired.off"));
}

TEST_F(DraftTest, DescriptionThatIsThereIsAPersons) {
  const std::filesystem::path surface = folder_.write("box.off", off(cube(100.0)));
  DraftOptions options = {.shape = {.nodes = 300}};
  const std::filesystem::path file = draft(surface, options, false, tell());
  std::ofstream(file, std::ios::app) << "# mine\n";
  told_.clear();
  EXPECT_EQ(draft(surface, options, false, tell()), file);
  expect_mentions(told_, {"is there and is used as it is", "--renew"});
  expect_mentions(text_of(file), {"# mine"});
  options.unit = read_unit("cm");
  expect_mentions(error_of([&] { draft(surface, options, true, tell()); }),
                  {"box.model.toml", "is there already", "--renew"});
  options.renew = true;
  draft(surface, options, true, tell());
  expect_mentions(told_, {"anew"});
  EXPECT_EQ(text_of(file).find("# mine"), std::string::npos);
  EXPECT_EQ(read_description(file).scale, 0.01);
}

TEST_F(DraftTest, StrictRefusesWhatNeedsARepair) {
  const DraftOptions strict = {.shape = {.strict = true, .nodes = 300}};
  const std::filesystem::path open = open_ball("open.off");
  expect_mentions(error_of([&] { draft(open, strict, true, tell()); }), {"open.off", "is open"});
  TriangleSurface flipped = cube(100.0);
  std::swap(flipped.triangles[3][0], flipped.triangles[3][1]);
  const std::filesystem::path file = folder_.write("flipped.off", off(flipped));
  expect_mentions(error_of([&] { draft(file, strict, true, tell()); }),
                  {"flipped.off", "needs a repair", "turned"});
  EXPECT_FALSE(std::filesystem::exists(draft_file(file)));
  draft(folder_.write("whole.off", off(cube(100.0))), strict, true, tell());
}

TEST_F(DraftTest, NamesAreWrittenAsTomlWantsThem) {
  const std::filesystem::path file = draft(folder_.write("an \"organ\" of\\mine.off", off(cube(100.0))),
                                           {.shape = {.nodes = 300}}, false, tell());
  EXPECT_EQ(read_description(file).name, "an \"organ\" of\\mine");
}

TEST_F(DraftTest, NamesThatAreNotUtf8AreRefused) {
  const std::filesystem::path file = folder_.write("K\xF6rper.off", off(cube(100.0)));
  expect_mentions(error_of([&] { draft(file, {.shape = {.nodes = 300}}, false, tell()); }),
                  {"is not UTF-8", "rename the file"});
  EXPECT_FALSE(std::filesystem::exists(draft_file(file)));
}

/// A block of 8 x 6 x 5 voxels of 1 unit, with `more` lines in the header.
std::string small_nrrd(const std::string& more) {
  std::string text = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 6 5\nencoding: raw\n" + more + "\n";
  return text + std::string(8UL * 6 * 5, '\x01');
}

TEST_F(DraftTest, UnitOfAnImageIsThatOfItsHeader) {
  const auto drafted = [&](const std::string& more, const char* unit) {
    told_.clear();
    const std::filesystem::path image = folder_.write("organ.nrrd", small_nrrd(more));
    DraftOptions options = {.shape = {.nodes = 300}, .renew = true};
    if (unit != nullptr) options.unit = read_unit(unit);
    return read_description(draft(image, options, true, tell())).scale;
  };
  const std::string directions = "space directions: (1,0,0) (0,1,0) (0,0,1)\n";
  const std::string patient = "space: left-posterior-superior\n" + directions;
  EXPECT_EQ(drafted("spacings: 1 1 1\n", nullptr), 0.01);  // 8 cm, as nothing is said
  EXPECT_EQ(drafted("spacings: 1 1 1\nunits: \"mm\" \"mm\" \"mm\"\n", nullptr), 0.001);
  EXPECT_EQ(drafted(patient, nullptr), 0.001);  // as 3D Slicer means it
  expect_mentions(told_, {"unit: mm", "the image's header says its unit"});
  for (const char* unit : {"mm", "cm", "m", "um", "\xC2\xB5m", "Micrometres", "inches"}) {
    const std::string units =
        "space units: \"" + std::string(unit) + "\" \"" + unit + "\" \"" + unit + "\"\n";
    EXPECT_EQ(drafted(patient + units, nullptr), 0.001) << unit;  // read as millimetres
  }
  EXPECT_NEAR(drafted(patient + "space units: \"um\" \"um\" \"um\"\n", "mm"), 1.0, 1e-12);  // who says so
  expect_mentions(error_of([&] { drafted(patient + "space units: \"ell\" \"ell\" \"ell\"\n", nullptr); }),
                  {"organ.nrrd", "\"ell\"", "not known"});
  expect_mentions(error_of([&] { drafted(patient + "space units: \"mm\" \"mm\" \"cm\"\n", nullptr); }),
                  {"\"mm\" along one axis", "\"cm\""});
}

TEST_F(DraftTest, RangeOfAGreyImageIsWritten) {
  std::string image = small_nrrd("spacings: 10 10 10\n");
  image.back() = '\xC8';
  const std::filesystem::path file = folder_.write("scan.nrrd", image);
  DraftOptions options = {.shape = {.range = ValueRange{0.5, 10.0}, .nodes = 300}};
  const Description description = read_description(draft(file, options, true, tell()));
  const auto& geometry = std::get<ImageGeometry>(description.geometry);
  ASSERT_TRUE(geometry.range);
  EXPECT_EQ(geometry.range->low, 0.5);
  EXPECT_EQ(geometry.range->high, 10.0);
}

/// A disc of radius 40 in a picture of 100 x 120 pixels, as a plain PBM: '1' is black.
std::string disc(bool is_dark) {
  std::string text = "P1\n100 120\n";
  for (int row = 0; row < 120; ++row) {
    for (int column = 0; column < 100; ++column)
      text += (std::hypot(column - 49.5, row - 59.5) < 40.0) == is_dark ? '1' : '0';
    text += '\n';
  }
  return text;
}

TEST_F(DraftTest, DrawingBecomesAFreeBodyInThePlane) {
  for (const bool is_dark : {true, false}) {
    const std::string name = is_dark ? "dark" : "light";
    told_.clear();
    const std::filesystem::path file = draft(folder_.write(name + ".pbm", disc(is_dark)), {}, false, tell());
    expect_mentions(told_, {"80 pixels long, and so 10 cm", "60 outline nodes",
                            "what is " + name + " in the picture", "E = 20000 Pa"});
    const Description description = read_description(file);
    EXPECT_EQ(std::get<PictureGeometry>(description.geometry).dark, is_dark);
    EXPECT_EQ(std::get<PictureGeometry>(description.geometry).file, folder_.path() / (name + ".pbm"));
    EXPECT_EQ(description.analysis, Analysis::plane_strain);
    EXPECT_NEAR(description.scale, 0.1 / 80.0, 1e-5);
    // The circle's length, which its pixels show to some per cent.
    const double edge = 0.1 * std::numbers::pi / 60.0;
    EXPECT_NEAR(*description.mesh.edge_length, edge, 0.03 * edge);
    EXPECT_EQ(description.scope, Scope::none);
    EXPECT_TRUE(description.fixed.empty());
  }
}

TEST_F(DraftTest, PictureWithoutABodyIsRefused) {
  const std::filesystem::path paper = folder_.write("paper.pbm", "P1\n3 2\n000000\n");
  expect_mentions(error_of([&] { draft(paper, {}, false, tell()); }), {"paper.pbm", "no body"});
  EXPECT_FALSE(std::filesystem::exists(draft_file(paper)));
}

TEST_F(DraftTest, QuestionsAreAnsweredThroughAPipe) {
  const std::filesystem::path surface = open_ball("organ.off");
  std::istringstream answers(surface.string() + "\nliver\nmm\n8e3\n\ny\n25\n300\n");
  std::ostringstream questions;
  const std::filesystem::path file = draft_by_questions({}, {}, {answers, questions, false});
  const Description description = read_description(file);
  EXPECT_EQ(description.name, "liver");
  EXPECT_EQ(description.materials.front().material.youngs_modulus, 8e3);
  EXPECT_EQ(description.materials.front().material.poissons_ratio, 0.45);
  expect_mentions(text_of(file), {"lowest = {axis = \"y\", percent = 25}"});
  expect_mentions(questions.str(), {"Poisson's ratio", "[0.45]", "repaired: a hole was filled"});
}

TEST_F(DraftTest, WrongAnswersAreAskedForAgainOnATerminal) {
  const std::string file = folder_.write("box.off", off(cube(100.0))).string();
  std::istringstream answers("nothing.txt\nmissing.off\n" + file + "\n\nmiles\ncm\nsoft\n1e4\n\n\n\n300\n");
  std::ostringstream questions;
  draft_by_questions({}, {}, {answers, questions, true});
  expect_mentions(questions.str(), {"'nothing.txt' is no surface", "there is no file 'missing.off'",
                                    "'miles' is no unit", "'soft' is not a number"});
  EXPECT_EQ(read_description(folder_.path() / "box.model.toml").scale, 0.01);
  std::istringstream wrong("liver\nmiles\n");
  expect_mentions(error_of([&] {
                    draft_by_questions(file, {.renew = true}, {wrong, questions, false});
                  }),
                  {"'miles' is no unit", "correct this answer"});
  std::istringstream few("liver\n");
  expect_mentions(error_of([&] {
                    draft_by_questions(file, {.renew = true}, {few, questions, false});
                  }),
                  {"the answers ended", "Unit of the file"});
}

}  // namespace
}  // namespace palpate::draft_test
