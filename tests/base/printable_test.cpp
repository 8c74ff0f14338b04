#include "base/printable.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace palpate::test::printable_test {
namespace {

TEST(Printable, LeavesOrdinaryTextAsItIs) {
  for (const char* const text : {"", "liver.palpate.hdf", "Größe 3 µm, ν = 0.49 — 肝臓", "a\\b \"c\""})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, WritesOutWhatATerminalWouldObey) {
  EXPECT_EQ(printable("\x1b]0;owned\x07"), "\\x1b]0;owned\\x07");
  EXPECT_EQ(printable("a\r\nb\tc"), "a\\r\\nb\\tc");
  EXPECT_EQ(printable(std::string("a\0b\x7f", 4)), "a\\x00b\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\x9b31m");  // one-character CSI
  EXPECT_EQ(printable("abc\xe2\x80\xae"
                      "fed"),
            "abc\\u202efed");  // right-to-left override
  EXPECT_EQ(printable("\xe2\x81\xa6\xe2\x81\xa9"), "\\u2066\\u2069");
  EXPECT_EQ(printable("\xf3\xa0\x81\x81"), "\\U000e0041");  // a tag
}

TEST(Printable, WritesOutBytesThatAreNotUtf8) {
  EXPECT_EQ(printable("a\xff"
                      "b"),
            "a\\xffb");
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b");           // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // a surrogate
  EXPECT_EQ(printable("\xf5\x80\x80\x80"), "\\xf5\\x80\\x80\\x80");
  EXPECT_EQ(printable("x\xe2\x82"), "x\\xe2\\x82");  // cut off
}

TEST(Printable, CutsTheMiddleOutOfLongText) {
  const std::string text = "from" + std::string(70'000, 'a') + "to";
  const std::string shown = printable(text);
  EXPECT_EQ(shown.size(), longest_printable - 1 + std::string("…").size());
  EXPECT_EQ(shown.find("from"), 0U);
  EXPECT_NE(shown.find("…"), std::string::npos);
  EXPECT_TRUE(shown.ends_with("to"));
  EXPECT_EQ(printable("äöüß", 3), "ä…ß");
}

TEST(Printable, QuotesAWordThatAShellWouldTakeApart) {
  for (const char* const word : {"liver.palpate.hdf", "../a/b-c_d:1,2=3@4+5%", "Größe"})
    EXPECT_EQ(shell_word(word), word);
  EXPECT_EQ(shell_word("my liver.stl"), "'my liver.stl'");
  EXPECT_EQ(shell_word("a;b"), "'a;b'");
  EXPECT_EQ(shell_word("$HOME"), "'$HOME'");
  EXPECT_EQ(shell_word("it's"), "'it'\\''s'");
  EXPECT_EQ(shell_word(""), "''");
  EXPECT_EQ(shell_word("a\nb"), "'a\\nb'");
}

TEST(Printable, KeepsLinesWhereItIsAskedTo) {
  EXPECT_EQ(printable_lines("a\n\x1b[2J\nb"), "a\n\\x1b[2J\nb");
  EXPECT_EQ(printable_lines("a\nhint: b", "  "), "a\n  hint: b");
}

TEST(Printable, ErrorsAreClean) {
  const Error error("'\x1b[31m" + std::string(70'000, 'x') + "' is no number\nhint: none", "f\x1b[0mile",
                    "look");
  const std::string text = to_text(error);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_LT(text.size(), 2000U);
  EXPECT_EQ(text.find("error: f\\x1b[0mile: '\\x1b[31m"), 0U) << text;
  EXPECT_EQ(text.find("\nhint: none"), std::string::npos) << text;
  EXPECT_TRUE(text.ends_with("\nhint: Look\n")) << text;
}

}  // namespace
}  // namespace palpate::test::printable_test
