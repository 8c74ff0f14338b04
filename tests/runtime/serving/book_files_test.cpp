// Which files of the book's folder are served.
#include "runtime/serving/book_files.h"

#include <gtest/gtest.h>

#include "tests/support/files/meshes_files.h"

namespace palpate::book_files_test {
namespace {

namespace fs = std::filesystem;

class BookFiles : public testing::Test {
 protected:
  test::ScratchFolder folder_;
  fs::path book_ = folder_.path() / "html";

  BookFiles() {
    fs::create_directories(book_ / "tutorials");
    fs::create_directories(book_ / ".private");
    for (const char* name :
         {"html/index.html", "html/tutorials/push-a-liver.html", "html/book.css", "html/.buildinfo",
          "html/.private/x.html", "html/data.bin", "html/with space.html", "secret.html"})
      (void)folder_.write(name, name);
  }
  [[nodiscard]] bool is_served(std::string_view name) const {
    return read_book_file(book_, name).has_value();
  }
};

TEST_F(BookFiles, AreServedByTheirTypes) {
  const std::optional<BookFile> page = read_book_file(book_, "tutorials/push-a-liver.html");
  ASSERT_TRUE(page.has_value());
  EXPECT_EQ(page->bytes, "html/tutorials/push-a-liver.html");
  EXPECT_EQ(page->content_type, "text/html; charset=utf-8");
  EXPECT_EQ(read_book_file(book_, "book.css")->content_type, "text/css; charset=utf-8");
  EXPECT_EQ(read_book_file(book_, "data.bin")->content_type, "application/octet-stream");
}

TEST_F(BookFiles, AreBelowTheFolderOnly) {
  ASSERT_TRUE(is_served("index.html"));
  for (const char* name : {"",
                           ".",
                           "..",
                           "/",
                           "/index.html",
                           "//index.html",
                           "../secret.html",
                           "tutorials/../../secret.html",
                           "tutorials/../index.html",
                           "./index.html",
                           "tutorials//push-a-liver.html",
                           "%2e%2e/secret.html",
                           "index.html%00",
                           "tutorials",
                           "tutorials/",
                           "missing.html",
                           ".buildinfo",
                           ".private/x.html",
                           "with space.html",
                           "with%20space.html",
                           "..\\secret.html"})
    EXPECT_FALSE(is_served(name)) << name;
  EXPECT_FALSE(is_served(std::string_view("index.html\0", 11)));
  EXPECT_FALSE(is_served((folder_.path() / "secret.html").string()));
  EXPECT_FALSE(read_book_file({}, "index.html").has_value());
  EXPECT_FALSE(read_book_file(folder_.path() / "missing", "index.html").has_value());
}

TEST_F(BookFiles, AreNoLinks) {
  fs::create_symlink(folder_.path() / "secret.html", book_ / "link.html");
  fs::create_symlink(book_ / "index.html", book_ / "inside.html");
  fs::create_directory_symlink(folder_.path(), book_ / "up");
  for (const char* name : {"link.html", "inside.html", "up/secret.html", "up/html/index.html"})
    EXPECT_FALSE(is_served(name)) << name;
  fs::create_directory_symlink(book_, folder_.path() / "installed");  // the folder itself may be one
  EXPECT_TRUE(read_book_file(folder_.path() / "installed", "index.html").has_value());
}

TEST_F(BookFiles, AreOfABoundedSize) {
  fs::resize_file(book_ / "data.bin", 16U << 20U);
  EXPECT_EQ(read_book_file(book_, "data.bin")->bytes.size(), 16U << 20U);
  fs::resize_file(book_ / "data.bin", (16U << 20U) + 1);
  EXPECT_FALSE(is_served("data.bin"));
}

}  // namespace
}  // namespace palpate::book_files_test
