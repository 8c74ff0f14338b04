// Files of one user: in which folder, for whose eyes, and never through a link.
#include "base/private_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"

namespace palpate::private_file_test {
namespace {

/// With folders of its own in place of this user's.
class PrivateFile : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_);
    for (const char* name : {"XDG_RUNTIME_DIR", "XDG_STATE_HOME", "HOME"}) {
      const char* value = getenv(name);
      before_.emplace_back(name, value == nullptr ? std::nullopt : std::optional<std::string>(value));
      unsetenv(name);
    }
  }
  void TearDown() override {
    for (const auto& [name, value] : before_) {
      if (value) {
        setenv(name.c_str(), value->c_str(), 1);
      } else {
        unsetenv(name.c_str());
      }
    }
    std::filesystem::remove_all(folder_);
  }

  [[nodiscard]] static mode_t mode_of(const std::filesystem::path& path) {
    struct stat found {};
    EXPECT_EQ(lstat(path.c_str(), &found), 0) << path;
    return found.st_mode & 07777U;
  }

  const std::filesystem::path folder_ = testing::TempDir() + "/palpate_private." + std::to_string(getpid());
  std::vector<std::pair<std::string, std::optional<std::string>>> before_;
};

TEST_F(PrivateFile, IsInTheFirstFolderThatThereIs) {
  EXPECT_THROW(static_cast<void>(private_file("a.token")), Error);
  setenv("HOME", "/home/a", 1);
  EXPECT_EQ(private_file("a.token"), "/home/a/.local/state/palpate/a.token");
  setenv("XDG_STATE_HOME", "/state", 1);
  EXPECT_EQ(private_file("a.token"), "/state/palpate/a.token");
  setenv("XDG_RUNTIME_DIR", "/run/user/7", 1);
  EXPECT_EQ(private_file("a.token"), "/run/user/7/palpate/a.token");
  setenv("XDG_RUNTIME_DIR", "relative", 1);
  EXPECT_EQ(private_file("a.token"), "/state/palpate/a.token");
}

TEST_F(PrivateFile, IsForThisUserAlone) {
  const std::filesystem::path file = folder_ / "deeper" / "palpate" / "a.token";
  const mode_t before = umask(0);
  write_private_file(file, "a secret");
  umask(before);
  EXPECT_EQ(mode_of(file), 0600U);
  EXPECT_EQ(mode_of(file.parent_path()), 0700U);
  EXPECT_EQ(read_private_file(file), "a secret");
  write_private_file(file, "another");
  EXPECT_EQ(read_private_file(file), "another");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(file.parent_path()), {}), 1);
}

TEST_F(PrivateFile, IsNotWrittenWhereOthersMayWrite) {
  const std::filesystem::path open_to_all = folder_ / "palpate";
  std::filesystem::create_directory(open_to_all);
  std::filesystem::permissions(open_to_all, std::filesystem::perms::all);
  EXPECT_THROW(write_private_file(open_to_all / "a.token", ""), Error);
  std::filesystem::permissions(open_to_all, std::filesystem::perms::owner_all);
  std::filesystem::create_symlink(open_to_all, folder_ / "link");
  EXPECT_THROW(write_private_file(folder_ / "link" / "a.token", ""), Error);
  EXPECT_TRUE(std::filesystem::is_empty(open_to_all));
}

TEST_F(PrivateFile, IsNotReadWhereOthersCouldHaveReadIt) {
  const std::filesystem::path file = folder_ / "palpate" / "a.token";
  EXPECT_EQ(read_private_file(file), "");
  write_private_file(file, "a secret");
  std::filesystem::permissions(file, std::filesystem::perms(0640));
  EXPECT_EQ(read_private_file(file), "");
  std::filesystem::permissions(file, std::filesystem::perms(0600));
  std::filesystem::create_symlink(file, folder_ / "link");
  EXPECT_EQ(read_private_file(folder_ / "link"), "");
  EXPECT_EQ(read_private_file(file), "a secret");
}

TEST_F(PrivateFile, TakesThePlaceOfALinkAndLeavesWhatItLedTo) {
  const std::filesystem::path file = folder_ / "palpate" / "a.token";
  std::filesystem::create_directory(file.parent_path());
  std::filesystem::permissions(file.parent_path(), std::filesystem::perms::owner_all);
  std::ofstream(folder_ / "precious") << "precious";
  std::filesystem::create_symlink(folder_ / "precious", file);
  std::filesystem::create_symlink(folder_ / "precious", file.string() + ".partial");
  write_private_file(file, "");
  EXPECT_FALSE(std::filesystem::is_symlink(file));
  std::ifstream stream(folder_ / "precious");
  std::string text;
  stream >> text;
  EXPECT_EQ(text, "precious");
}

}  // namespace
}  // namespace palpate::private_file_test
