#include "base/regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <vector>

#include "base/error.h"

namespace palpate {
namespace {

const char* hint_to_read(int error) {
  switch (error) {
    case EACCES:
    case EPERM:
    case EROFS:
      return "Check the permissions of the file and its folder";
    case ENOSPC:
    case EDQUOT:
      return "Free some disk space or choose another place with --output";
    default:
      return "Check the name, and that it is a file that you may read";
  }
}

[[noreturn]] void fail(const char* doing, const std::filesystem::path& file, int error,
                       const char* if_missing) {
  throw Error(std::string("cannot ") + doing + " the file: " + std::generic_category().message(error),
              file.string(), error == ENOENT || error == ENOTDIR ? if_missing : hint_to_read(error));
}

const char* kind_of(mode_t mode) {
  switch (mode & S_IFMT) {
    case S_IFDIR:
      return "a folder";
    case S_IFIFO:
      return "a FIFO (pipe)";
    case S_IFSOCK:
      return "a socket";
    case S_IFCHR:
    case S_IFBLK:
      return "a device";
    default:
      return "something else";
  }
}

void check_kind(mode_t mode, const std::filesystem::path& file) {
  if (S_ISREG(mode)) return;
  throw Error(std::string("is ") + kind_of(mode) + ", not a file", file.string(),
              S_ISDIR(mode) ? "Give the path of a file in it" : "Save what it gives as a file first");
}

/// A descriptor, closed by the destructor.
struct Descriptor {
  int fd;
  explicit Descriptor(int opened) : fd(opened) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { ::close(fd); }
};

}  // namespace

int open_regular_file(const std::filesystem::path& file, int flags, const char* if_missing) {
  struct stat status = {};
  // before opening, which alone can make a device start something
  if (::stat(file.c_str(), &status) == 0) check_kind(status.st_mode, file);
  // O_NONBLOCK: do not wait for a FIFO that took its place
  const int fd = ::open(file.c_str(), flags | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0666);
  if (fd < 0) fail("open", file, errno, if_missing);
  const int problem = ::fstat(fd, &status) == 0 ? 0 : errno;
  if (problem == 0 && S_ISREG(status.st_mode)) return fd;
  ::close(fd);
  if (problem != 0) fail("read", file, problem, if_missing);
  check_kind(status.st_mode, file);
  return -1;  // not reached: it is no regular file
}

void check_regular_file(const std::filesystem::path& file, const char* if_missing) {
  const Descriptor closed_again(open_regular_file(file, O_RDONLY, if_missing));
}

std::string read_all(const std::filesystem::path& file, const char* if_missing, std::int64_t most) {
  const Descriptor descriptor(open_regular_file(file, O_RDONLY, if_missing));
  struct stat status = {};
  if (::fstat(descriptor.fd, &status) != 0) fail("read", file, errno, if_missing);
  if (status.st_size > most) {
    throw Error("the file has " + std::to_string(status.st_size) + " bytes, of " + std::to_string(most) +
                    " that are read at most",
                file.string(), if_missing);
  }
  std::string text;
  text.reserve(static_cast<std::size_t>(status.st_size));
  std::vector<char> chunk(65536);  // not on the stack, which may be as small
  for (;;) {
    const ssize_t size = ::read(descriptor.fd, chunk.data(), chunk.size());
    if (size == 0) return text;
    if (size > 0) {
      text.append(chunk.data(), static_cast<std::size_t>(size));
    } else if (errno != EINTR) {
      fail("read", file, errno, if_missing);
    }
  }
}

}  // namespace palpate
