// Tables of a TOML file: what is read, and what is said of what cannot be.
#include "base/toml_table.h"

#include <gtest/gtest.h>

#include "base/toml_text.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::toml_table_test {
namespace {

using test::error_of;

const std::string file = "a.toml";

/// "WHERE: WHAT | HINT" of the error that reading the table [t] ends with.
std::string told(const std::string& lines, const std::function<void(const TomlTable&)>& read,
                 const Keys& known = {"k", "other"}) {
  const toml::table root = parse_toml("[t]\n" + lines, file);
  const Error error = error_of([&] { read(TomlTable(root, "", file, {"t"}).table("t", known)); });
  return error.where() + ": " + error.what() + " | " + error.hint();
}

TEST(TomlTable, ReadsEachType) {
  const toml::table root = parse_toml(
      "number = 1.5\nwhole = 3\nyes = true\ntext = \"a\"\nnumbers = [1, 2.5]\nwholes = [1, -2]\n"
      "flags = [true, false]\nvector = [1, 2, 3]\npoints = [[0, 0], [1, 0], [0, 1]]\n"
      "[table]\nk = 1\n[[list]]\nk = 1\n[[list]]\nk = 2\n",
      file);
  const TomlTable table(
      root, "", file,
      {"number", "whole", "yes", "text", "numbers", "wholes", "flags", "vector", "points", "table", "list"});
  EXPECT_EQ(table.number("number"), 1.5);
  EXPECT_EQ(table.number("whole"), 3.0);
  EXPECT_EQ(table.number("none", 7.0), 7.0);
  EXPECT_EQ(table.positive("none", 7.0), 7.0);
  EXPECT_EQ(table.within("number", 1.5, 1.5), 1.5);
  EXPECT_EQ(table.within("none", 0.0, 1.0, 7.0), 7.0);
  EXPECT_EQ(table.integer("whole", 3, 3), 3);
  EXPECT_EQ(table.integer("none", 0, 3, 7), 7);
  EXPECT_EQ(table.count("whole"), 3);
  EXPECT_TRUE(table.boolean("yes", false));
  EXPECT_TRUE(table.boolean("none", true));
  EXPECT_EQ(table.text("text"), "a");
  EXPECT_EQ(table.choice("text", {"a", "b"}), "a");
  EXPECT_EQ(table.numbers("numbers", 2), (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(table.integers("wholes"), (std::vector<std::int32_t>{1, -2}));
  EXPECT_EQ(table.integers("wholes", 2, -2, 1), (std::vector<std::int32_t>{1, -2}));
  EXPECT_EQ(table.booleans("flags", 2), (std::vector<bool>{true, false}));
  EXPECT_EQ(table.vector("vector", 3), Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(table.positive_vector("numbers", 2), Eigen::Vector3d(1.0, 2.5, 0.0));
  EXPECT_EQ(table.points("points")[1], Eigen::Vector3d(1.0, 0.0, 0.0));
  EXPECT_EQ(table.table("table", {"k"}).title(), "[table]");
  const auto list = table.tables("list", {"k"}, "");
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[1].count("k"), 2);
  EXPECT_EQ(list[1].title(), "[[list]]");
}

TEST(TomlTable, UnknownKeysComeWithTheNearest) {
  const auto nothing = [](const TomlTable&) {};
  EXPECT_EQ(told("othre = 1\n", nothing),
            "a.toml:2:1: unknown key \"othre\" in [t] | the nearest known key is \"other\" of k, other");
}

TEST(TomlTable, MissingKeysAndTypesNameTableAndKey) {
  const auto number = [](const TomlTable& t) { static_cast<void>(t.number("k")); };
  EXPECT_EQ(told("", number), "a.toml:1:1: [t] k is missing | add it to [t]");
  EXPECT_EQ(told("k = true\n", number), "a.toml:2:5: [t] k must be a number | write k = a number");
  EXPECT_EQ(told("k = -inf\n", number),
            "a.toml:2:5: [t] k is not a finite number | replace nan or inf by a number");
  EXPECT_EQ(told("k = 1\n", [](const TomlTable& t) { static_cast<void>(t.text("k")); }),
            "a.toml:2:5: [t] k must be a text in quotes | write k = a text in quotes");
  EXPECT_EQ(told("k = [1]\n", [](const TomlTable& t) { static_cast<void>(t.numbers("k", 2)); }),
            "a.toml:2:5: [t] k must be [two numbers] | write k = [two numbers]");
  EXPECT_EQ(told("k = [1]\n", [](const TomlTable& t) { static_cast<void>(t.vector("k", 2, "so")); }),
            "a.toml:2:5: [t] k must be [two numbers] | so");
  EXPECT_EQ(told("k = [true, 1]\n", [](const TomlTable& t) { static_cast<void>(t.booleans("k", 2)); }),
            "a.toml:2:12: [t] k must be [two of true or false] | write k = [two of true or false]");
}

TEST(TomlTable, RangesIncludeTheirEnds) {
  const auto within = [](const TomlTable& t) { static_cast<void>(t.within("k", 0.5, 1.5)); };
  EXPECT_EQ(told("k = 1.6\n", within),
            "a.toml:2:5: [t] k must be from 0.5 to 1.5, not 1.6 | choose a value in that range");
  EXPECT_EQ(told("k = 0.4\n", within),
            "a.toml:2:5: [t] k must be from 0.5 to 1.5, not 0.4 | choose a value in that range");
  EXPECT_EQ(told("k = 0\n", [](const TomlTable& t) { static_cast<void>(t.positive("k")); }),
            "a.toml:2:5: [t] k must be greater than 0, not 0 | give a positive number");
  EXPECT_EQ(told("k = [1, 0]\n", [](const TomlTable& t) { static_cast<void>(t.positives("k", 2)); }),
            "a.toml:2:5: [t] k must be greater than 0, not 0 | give positive numbers");
  const auto integer = [](const TomlTable& t) { static_cast<void>(t.integer("k", -1, 4)); };
  EXPECT_EQ(told("k = 5\n", integer),
            "a.toml:2:5: [t] k must be from -1 to 4, not 5 | choose a value in that range");
  EXPECT_EQ(told("k = -2\n", integer),
            "a.toml:2:5: [t] k must be from -1 to 4, not -2 | choose a value in that range");
  EXPECT_EQ(told("k = 0\n", [](const TomlTable& t) { static_cast<void>(t.count("k")); }),
            "a.toml:2:5: [t] k must be at least 1, not 0 | give a larger whole number");
  EXPECT_EQ(told("k = -2147483649\n", [](const TomlTable& t) { static_cast<void>(t.integer("k")); }),
            "a.toml:2:5: [t] k is out of range: -2147483649 | whole numbers here have 32 bits");
}

TEST(TomlTable, OfSeveralKeysOneIsGiven) {
  const auto one = [](const TomlTable& t) { static_cast<void>(t.only_one_of({"k", "other"})); };
  EXPECT_EQ(told("", one), "a.toml:1:1: [t] has none of k, other | give one of them");
  EXPECT_EQ(told("k = 1\nother = 1\n", one), "a.toml:3:9: [t] has both k and other | keep one of them");
}

}  // namespace
}  // namespace palpate::toml_table_test
