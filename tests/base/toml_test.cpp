// TOML that would overflow the parser's stack, or take it for ever, is refused before.
#include <gtest/gtest.h>

#include "base/toml_text.h"
#include "base/words.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::toml_test {
namespace {

using test::contains;
using test::error_of;

std::string repeated(const std::string& text, int times) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

Error refusal(const std::string& text) {
  return error_of([&] { parse_toml(text, "model.toml"); });
}

void expect_refused(const std::string& text, const std::string& piece) {
  const Error error = refusal(text);
  EXPECT_TRUE(contains(error.what(), piece)) << error.what();
  EXPECT_LT(std::string(error.what()).size(), 300U);
  EXPECT_TRUE(error.where().starts_with("model.toml")) << error.where();
  EXPECT_FALSE(error.hint().empty());
}

TEST(TomlText, KeysOfManyPartsAreRefused) {
  const std::string deep = repeated("a.", 100'000) + "a";
  for (const std::string& text :
       {deep + " = 1\n", "[" + deep + "]\n", "[[" + deep + "]]\n", "x = {" + deep + " = 1}\n",
        "x = 1\ny = [{" + deep + " = 1}]\n", repeated("\"a,=[\" . ", 100'000) + "b = 1\n",
        repeated("'a\"'.", 100'000) + "b = 1\n", "x = {y = [1], " + deep + " = 1}\n",
        "x = \"\"\"\n\" ''' \\\"\"\"\"\"\n" + deep + " = 1\n", "x = '''\n'' # \"\"\" '''\n" + deep + " = 1\n",
        "x = \"\" # \"\n" + deep + " = 1\n"}) {
    expect_refused(text, "more than 16 parts");
  }
  EXPECT_EQ(refusal("x = 1\n\n" + deep + " = 1\n").where(), "model.toml:3");
}

TEST(TomlText, DeepNestingIsRefused) {
  expect_refused("x = " + repeated("[", 100'000), "more than 32 deep");
  expect_refused("x = " + repeated("{a = ", 100'000), "more than 32 deep");
  expect_refused("x = " + repeated("[{a.b.c = ", 1000), "more than 32 deep");
}

TEST(TomlText, TooManyTablesAndDotsAreRefused) {
  std::string headers, dotted, lists;
  for (int i = 0; i < 60'000; ++i) {
    headers += "[a" + std::to_string(i) + "]\n";
    lists += "[[a" + std::to_string(i) + "]]\n";
    dotted += "a.b" + std::to_string(i) + " = 1\n";
  }
  expect_refused(headers, "more than 50000 tables");
  expect_refused(lists, "more than 50000 tables");
  expect_refused(dotted, "more than 50000 dots");
  expect_refused("x = [" + repeated("{},", 60'000) + "]\n", "more than 50000 tables");
  expect_refused(repeated("# comment\n", 1'700'000), "17000000 bytes");
}

TEST(TomlText, WhatLooksDeepButIsNotIsRead) {
  const std::string dots = repeated(".", 100), brackets = repeated("[", 100);
  const toml::table table = parse_toml(
      "a = \"" + dots + brackets + "\" # " + dots + brackets + "\nb = '" + dots + "\"'\nc = \"\"\"\n" + dots +
          "\n\\\"" + brackets + "\n\"\"\"\"\"\nd = [" + repeated("[0.1, 0.2], ", 1000) +
          "]\ne.f.g = {h.i = 1, j = [{k.l = 2.5}]}\n[m.\"n.o\"]\np = '''" + brackets + "'''\n",
      "model.toml");
  EXPECT_EQ(table["b"].value<std::string>(), dots + "\"");
  EXPECT_EQ(table["d"].as_array()->size(), 1000U);
  EXPECT_EQ(table["e"]["f"]["g"]["j"][0]["k"]["l"].value<double>(), 2.5);
  EXPECT_EQ(table["m"]["n.o"]["p"].value<std::string>(), brackets);
}

TEST(TomlText, StringsAreReadAsTheyWere) {
  const std::string text = "a \"quoted\" \\ path\nof two lines\t\x7F ü";
  EXPECT_EQ(parse_toml("name = " + toml_string(text), "model.toml")["name"].value<std::string>(), text);
}

TEST(TomlText, SyntaxErrorsSayLineAndColumnInShort) {
  const Error error = refusal("a = 1\nb = ?\n");
  EXPECT_EQ(error.where(), "model.toml:2:5");
  expect_refused("[" + std::string(70'000, 'x') + "]\n[" + std::string(70'000, 'x') + "]\n",
                 "not valid TOML");
}

TEST(Words, LongTokensAreShortened) {
  EXPECT_EQ(shortened("edge_length"), "edge_length");
  EXPECT_EQ(shortened(std::string(70'000, 'x')), std::string(60, 'x') + "...");
  EXPECT_EQ(shortened("ab\xc3\xa4z", 3), "ab...");  // no half of a letter
}

}  // namespace
}  // namespace palpate::toml_test
