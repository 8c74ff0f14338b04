// What is not a regular file is refused at once, whatever it is.
#include "base/regular_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>

#include "tests/support/files/meshes_files.h"

namespace palpate::regular_file_test {
namespace {

using test::contains;
using test::error_of;
using test::ScratchFolder;

/// Ends the test program in place of a read that waits for ever.
class NoWaiting {
 public:
  NoWaiting() { ::alarm(60); }
  NoWaiting(const NoWaiting&) = delete;
  NoWaiting& operator=(const NoWaiting&) = delete;
  ~NoWaiting() { ::alarm(0); }
};

void expect_refused(const std::filesystem::path& path, const std::string& kind) {
  const NoWaiting limit;
  for (const auto& error : {error_of([&] { read_all(path); }), error_of([&] { check_regular_file(path); }),
                            error_of([&] { open_regular_file(path, O_RDONLY); })}) {
    EXPECT_EQ(error.where(), path.string());
    EXPECT_TRUE(contains(error.what(), "is " + kind + ", not a file")) << error.what();
    EXPECT_FALSE(error.hint().empty());
  }
}

TEST(RegularFile, IsReadWhole) {
  const ScratchFolder folder;
  std::string bytes(200'000, 'x');
  bytes[70'000] = '\0';
  EXPECT_EQ(read_all(folder.write("a.toml", bytes)), bytes);
  EXPECT_EQ(read_all(folder.write("empty.toml", "")), "");
}

TEST(RegularFile, OfMoreBytesThanItsKindHasIsNotRead) {
  const ScratchFolder folder;
  const std::filesystem::path file = folder.write("a.toml", "abc");
  EXPECT_EQ(read_all(file, "", 3), "abc");
  std::filesystem::resize_file(file, std::uintmax_t{1} << 40);  // with holes
  for (const std::int64_t most : {largest_description, largest_read}) {
    const Error error = error_of([&] { read_all(file, "", most); });
    EXPECT_TRUE(contains(error.what(), "1099511627776 bytes")) << error.what();
  }
}

TEST(RegularFile, FifoIsRefusedWithoutWaitingForItsWriter) {
  const ScratchFolder folder;
  ASSERT_EQ(::mkfifo((folder.path() / "fifo").c_str(), 0666), 0);
  expect_refused(folder.path() / "fifo", "a FIFO (pipe)");
  std::filesystem::create_symlink("fifo", folder.path() / "model.toml");
  expect_refused(folder.path() / "model.toml", "a FIFO (pipe)");
}

TEST(RegularFile, DevicesFoldersAndSocketsAreRefused) {
  const ScratchFolder folder;
  expect_refused("/dev/zero", "a device");
  expect_refused(folder.path(), "a folder");

  sockaddr_un address = {AF_UNIX, {}};
  const std::string path = (folder.path() / "socket").string();
  ASSERT_LT(path.size(), sizeof(address.sun_path));
  std::strcpy(address.sun_path, path.c_str());
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  expect_refused(path, "a socket");
  ::close(listener);
}

TEST(RegularFile, MissingFileHasTheCallersHint) {
  const ScratchFolder folder;
  const Error error = error_of([&] { read_all(folder.path() / "none.toml", "Check surface = \"...\"."); });
  EXPECT_TRUE(contains(error.what(), "No such file or directory")) << error.what();
  EXPECT_EQ(error.hint(), "Check surface = \"...\".");
}

}  // namespace
}  // namespace palpate::regular_file_test
