// Files that appear whole or not at all.
#include "base/write_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "base/regular_file.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::write_file_test {
namespace {

using test::error_of;
using test::ScratchFolder;

std::size_t files_in(const ScratchFolder& folder) {
  const std::filesystem::directory_iterator all(folder.path());
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

mode_t rights(const std::filesystem::path& file) {
  struct stat found {};
  EXPECT_EQ(::lstat(file.c_str(), &found), 0) << file;
  return found.st_mode & 07777U;
}

TEST(WriteFile, ReplacesWhatWasThereAndLeavesNothingBeside) {
  const ScratchFolder folder;
  const auto file = folder.path() / "a";
  write_file(file, "first");
  write_file(file, "second");
  EXPECT_EQ(read_all(file), "second");
  EXPECT_EQ(files_in(folder), 1U);
}

TEST(WriteFile, OfALinkTheTargetIsWritten) {
  const ScratchFolder folder;
  const auto file = folder.write("a", "before"), link = folder.path() / "link";
  std::filesystem::create_symlink("a", link);
  write_file(link, "after");
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(read_all(file), "after");
  replace_file(link, "instead");
  EXPECT_FALSE(std::filesystem::is_symlink(link));
  EXPECT_EQ(read_all(link), "instead");
  EXPECT_EQ(read_all(file), "after");
}

TEST(WriteFile, StrangersUnderTheTemporaryNameAreLeftAlone) {
  const ScratchFolder folder;
  const auto victim = folder.write("victim", "precious");
  std::filesystem::create_symlink("victim", folder.path() / "a.partial");
  const auto stranger = folder.write("a.partial2", "mine");
  write_file(folder.path() / "a", "text");
  EXPECT_EQ(read_all(folder.path() / "a"), "text");
  EXPECT_EQ(read_all(victim), "precious");
  EXPECT_EQ(read_all(stranger), "mine");
  EXPECT_EQ(files_in(folder), 4U);
}

TEST(WriteFile, RightsAreThoseAskedForFromTheStart) {
  const ScratchFolder folder;
  const mode_t before = ::umask(0);
  replace_file(folder.path() / "secret", "key", 0600);
  replace_file(folder.path() / "open", "text");
  ::umask(before);
  EXPECT_EQ(rights(folder.path() / "secret"), 0600U);
  EXPECT_EQ(rights(folder.path() / "open"), 0666U);
}

TEST(WriteFile, WhatCannotBeWrittenLeavesWhatWasThere) {
  const ScratchFolder folder;
  const auto file = folder.write("a", "before");
  rlimit whole{};
  getrlimit(RLIMIT_FSIZE, &whole);
  const rlimit few{10, whole.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &few);
  const Error error = error_of([&] { write_file(file, "more than ten bytes"); });
  setrlimit(RLIMIT_FSIZE, &whole);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(error.where(), file.string());
  EXPECT_EQ(std::string(error.what()), "cannot be written: File too large");
  EXPECT_EQ(read_all(file), "before");
  EXPECT_EQ(files_in(folder), 1U);
  EXPECT_THROW(write_file(folder.path() / "none" / "a", ""), Error);
  EXPECT_THROW(write_file(folder.path(), ""), Error);
}

}  // namespace
}  // namespace palpate::write_file_test
