// What a person is told of an exception.
#include "base/error.h"

#include <gtest/gtest.h>

#include <new>

namespace palpate {
namespace {

template <class Exception>
std::string told(const Exception& exception) {
  try {
    throw exception;
  } catch (...) {
    return to_text(handled_error("program", "buy some"));
  }
}

TEST(Error, IsToldInTwoLines) {
  EXPECT_EQ(to_text({"is odd", "a.toml:3", "use 4"}), "error: a.toml:3: is odd\nhint: Use 4\n");
  EXPECT_EQ(to_text({"--odd is unknown", "", "see --help"}), "error: --odd is unknown\nhint: See --help\n");
  EXPECT_EQ(to_text({"is odd", "a", "--even is 4"}), "error: a: is odd\nhint: --even is 4\n");
}

TEST(Error, EveryExceptionBecomesOne) {
  EXPECT_EQ(told(Error("is odd", "a", "use 4")), "error: a: is odd\nhint: Use 4\n");
  EXPECT_EQ(told(std::bad_alloc()), "error: program: no more memory could be had\nhint: Buy some\n");
  EXPECT_EQ(told(std::runtime_error("oh")),
            "error: program: oh\nhint: This is a defect of Palpate; please report it\n");
}

}  // namespace
}  // namespace palpate
