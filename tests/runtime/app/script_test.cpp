#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "runtime/app/script_device.h"
#include "runtime/loop/numbers.h"

namespace palpate::script_test {
namespace {

TEST(Numbers, AreReadWholeAndFinite) {
  EXPECT_EQ(parse_number(" -1.5e-3 "), -0.0015);
  EXPECT_EQ(parse_number("+2"), 2.0);
  for (const char* text : {"", " ", "1,5", "1.5x", "nan", "inf", "-inf", "1e999", "0x10", "+-1", "--1"}) {
    EXPECT_FALSE(parse_number(text)) << text;
  }
}

TEST(Numbers, VectorsHaveTwoOrThreeParts) {
  EXPECT_EQ(parse_vector("1, -2,.5"), (std::vector<double>{1.0, -2.0, 0.5}));
  EXPECT_EQ(parse_vector("1e-3,2"), (std::vector<double>{0.001, 2.0}));
  for (const char* text : {"1", "1,2,3,4", "1,2,", "1,2,nan", "1 2 3", ""})
    EXPECT_FALSE(parse_vector(text)) << text;
}

TEST(Numbers, IndicesAreWholeNumbersFromZero) {
  EXPECT_EQ(parse_index("17"), 17);
  for (const char* text : {"-1", "1.0", "x", "", "99999999999"}) EXPECT_FALSE(parse_index(text)) << text;
}

TEST(Script, MovesInStraightLinesAndGrabsByTheRowBefore) {
  const ScriptDevice device =
      ScriptDevice::parse("t,x,y,z,grab\n0.5,1,2,3,1\n1.5,2,4,3,0\n2,0,0,0,1\n", "touch.csv");
  EXPECT_EQ(device.end_time(), 2.0);
  EXPECT_EQ(device.pose(0.0).position, Vec3(1.0, 2.0, 3.0));
  EXPECT_FALSE(device.pose(0.499).grab);
  EXPECT_TRUE(device.pose(0.5).grab);
  EXPECT_EQ(device.pose(0.75).position, Vec3(1.25, 2.5, 3.0));
  EXPECT_TRUE(device.pose(1.499).grab);
  EXPECT_FALSE(device.pose(1.5).grab);
  EXPECT_EQ(device.pose(1.5).position, Vec3(2.0, 4.0, 3.0));
  EXPECT_TRUE(device.pose(2.0).grab);
  EXPECT_EQ(device.pose(99.0).position, Vec3::Zero());
}

TEST(Script, TakesWhatSpreadsheetsWrite) {
  const ScriptDevice device =
      ScriptDevice::parse("\xEF\xBB\xBFt, x, y, z\r\n\r\n0, 1, 2, 3\r\n1, 1, 2, 4", "touch.csv");
  EXPECT_EQ(device.end_time(), 1.0);
  EXPECT_FALSE(device.pose(0.5).grab) << "without a column it never is set";
  EXPECT_EQ(device.pose(0.5).position.z(), 3.5);
}

class Tables : public testing::TestWithParam<const char*> {};

TEST_P(Tables, AreReadByTheNamesOfTheirColumns) {
  const ScriptDevice device = ScriptDevice::parse(GetParam(), "touch.csv");
  EXPECT_EQ(device.end_time(), 1.5);
  EXPECT_EQ(device.pose(0.0).position, Vec3(0.25, 1.0, -2.0));
  EXPECT_EQ(device.pose(1.5).position, Vec3(0.5, 1.0, -2.0));
  EXPECT_EQ(device.pose(1.5).grab, std::string_view(GetParam()).find("rab") != std::string_view::npos);
}

INSTANTIATE_TEST_SUITE_P(
    All, Tables,
    testing::Values(
        "x,y,z,t\n.25,1,-2,0\n.5,1,-2,1.5\n", "t;x;y;z\n0;0.25;1;-2\n1.5;0.5;1;-2\n",
        "t;x;y;z;Grab\n0;0,25;1;-2;0\n1,5;0,5;1;-2;1\n", "t\tx\ty\tz\n0\t0,25\t1\t-2\n1.5\t.5\t1\t-2\n",
        "  t   x  y  z \n 0  .25  1  -2 \n1.5 .5   1 -2\n",
        "\"T\",\"X\",\"Y\",\"Z\"\r\n\"0\",\"0,25\",\"1\",\"-2\"\r\n1.5,0.5,1,-2\r\n",
        "\xEF\xBB\xBF# it's mine, x and x\nsep=;\nT;X;Y;Z;;\n0;.25;1;-2;;\n# then\n1.5;.5;1;-2;;\n",
        "# t x y z\n0 .25 1 -2\n1.5 .5 1 -2\n", "t,who,x,y,z\r0,\"me, too\",.25,1,-2\r1.5,,.5,1,-2\r"));

TEST(Script, TellsColumnsThatItDoesNotRead) {
  EXPECT_EQ(ScriptDevice::parse("t,x,y,z,Foo,,grab,force\n0,0,0,0,a,,1,2\n", "touch.csv").unread(),
            (std::vector<std::string>{"Foo", "force"}));
}

// Slerp by hand: half of a quarter turn about z is an eighth turn, from whatever length it is given in.
TEST(Script, TurnsAtConstantSpeedTheShorterWay) {
  const ScriptDevice device = ScriptDevice::parse(
      "t,x,y,z,qw,qx,qy,qz,grab\n0,0,0,0,5,0,0,0,1\n1,0,0,0,1e-200,0,0,1e-200,0\n"
      "2,0,0,0,-1e308,0,0,-1e308,0\n",
      "touch.csv");
  const auto about_z = [](double angle) {
    return Eigen::Quaterniond(std::cos(angle / 2), 0.0, 0.0, std::sin(angle / 2));
  };
  constexpr double quarter = 1.5707963267948966;
  for (const double share : {0.0, 0.25, 0.5, 0.9, 1.0}) {
    EXPECT_LT(device.pose(share).orientation.angularDistance(about_z(share * quarter)), 1e-12) << share;
    EXPECT_LT(device.pose(1 + share).orientation.angularDistance(about_z(quarter)), 1e-12) << share;
  }
  EXPECT_EQ(device.pose(0.5).orientation.coeffs().allFinite(), true);
  EXPECT_TRUE(device.pose(0.5).grab);
  EXPECT_FALSE(device.pose(1.0).grab);
}

struct BadScript {
  const char* name;
  const char* text;
  const char* where;
  const char* says;
};

class BadScripts : public testing::TestWithParam<BadScript> {};

TEST_P(BadScripts, AreRefusedWithTheirLine) {
  try {
    ScriptDevice::parse(GetParam().text, "touch.csv");
    FAIL() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), GetParam().where);
    EXPECT_NE(std::string(error.what()).find(GetParam().says), std::string::npos) << error.what();
    EXPECT_FALSE(error.hint().empty());
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, BadScripts,
    testing::Values(
        BadScript{"empty", "", "touch.csv", "no rows"},
        BadScript{"only_header", "t,x,y,z\n", "touch.csv", "no rows"},
        BadScript{"no_header", "0,1,2,3\n", "touch.csv:1", "header"},
        BadScript{"no_y", "# mine\nt,x,z\n0,0,0\n", "touch.csv:2", "no column y"},
        BadScript{"twice", "t,x,y,z,X\n0,0,0,0,1\n", "touch.csv:1", "column x twice"},
        BadScript{"decimal_commas", "t,x,y,z\n0,5,0,5,0,5,0,5\n", "touch.csv:2", "8 fields"},
        BadScript{"thousands", "t;x;y;z\n0;0;1.000,5;0\n", "touch.csv:2", "'1.000,5'"},
        BadScript{"open_quote", "t,x,y,z\n0,\"0,0,0\n", "touch.csv:2", "2 fields"},
        BadScript{"utf16", "\xFF\xFEt", "touch.csv", "UTF-16"},
        BadScript{"short_row", "t,x,y,z\n0,0,0,0\n1,0,0\n", "touch.csv:3", "3 fields"},
        BadScript{"long_row", "t,x,y,z\n0,0,0,0,1\n", "touch.csv:2", "5 fields"},
        BadScript{"word", "t,x,y,z\n0,0,oops,0\n", "touch.csv:2", "'oops'"},
        BadScript{"nan", "t,x,y,z\n0,0,nan,0\n", "touch.csv:2", "'nan'"},
        BadScript{"back_in_time", "t,x,y,z\n1,0,0,0\n0.5,0,0,0\n", "touch.csv:3", "0.5"},
        BadScript{"same_time", "t,x,y,z\n1,0,0,0\n\n1,0,0,0\n", "touch.csv:4", "not after"},
        BadScript{"negative_time", "t,x,y,z\n-1,0,0,0\n", "touch.csv:2", "-1"},
        BadScript{"milliseconds", "t,x,y,z\n0,0,0,0\n1e6,0,0,0\n", "touch.csv:3", "more than a day"},
        BadScript{"no_orientation", "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,0,0,0,0,0,0,0\n", "touch.csv:3",
                  "quaternion is zero"},
        BadScript{"half_an_orientation", "t,x,y,z,qw,qx\n0,0,0,0,1,0\n", "touch.csv:1", "no column qy, qz"},
        BadScript{"half_a_grab", "t,x,y,z,grab\n0,0,0,0,0.5\n", "touch.csv:2", "0.5"}),
    [](const testing::TestParamInfo<BadScript>& bad) { return bad.param.name; });

TEST(Script, AMissingFileIsNamed) {
  try {
    ScriptDevice::read("no/such/touch.csv");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), "no/such/touch.csv");
  }
}

}  // namespace
}  // namespace palpate::script_test
