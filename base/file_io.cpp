#include "base/file_io.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <system_error>
#include <thread>
#include <utility>

#include "base/error.h"
#include "base/printable.h"
#include "base/regular_file.h"

namespace palpate {
namespace {

std::string reason(int error) {
  return std::generic_category().message(error);
}

const char* hint_for(int error) {
  switch (error) {
    case ENOENT:
      return "Check the path";
    case EACCES:
    case EPERM:
    case EROFS:
      return "Check the permissions of the file and its folder";
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "Free some disk space or choose another place with --output";
    default:
      return "Check the disk and the folder";
  }
}

[[noreturn]] void fail(const std::string& doing, const std::filesystem::path& path, int error) {
  throw Error("cannot " + doing + ": " + reason(error), path.string(), hint_for(error));
}

/// A mapping and its file's name as a signal handler can read them: without locks, in static memory.
struct NamedMapping {
  std::atomic<bool> taken = false;
  std::atomic<std::uintptr_t> begin = 0, end = 0;  // no mapping while end is 0
  std::array<char, 512> name = {};

  [[nodiscard]] bool holds(const void* address) const noexcept {
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    return at < end.load(std::memory_order_acquire) && at >= begin.load(std::memory_order_relaxed);
  }
  void forget() noexcept {
    end = 0;
    taken = false;
  }
};
std::array<NamedMapping, 32> named_mappings;

/// Records the name of a mapping; null if there are too many.
NamedMapping* name_mapping(const void* base, std::size_t length, const std::filesystem::path& file) {
  for (NamedMapping& mapping : named_mappings) {
    if (mapping.taken.exchange(true)) continue;
    const std::string name = printable(file.string());
    mapping.name[name.copy(mapping.name.data(), mapping.name.size() - 1)] = '\0';
    mapping.begin = reinterpret_cast<std::uintptr_t>(base);
    mapping.end.store(mapping.begin + length, std::memory_order_release);
    return &mapping;
  }
  return nullptr;
}

/// Throws Error: the name of our temporary file belongs to something that no run of ours can have left.
[[noreturn]] void refuse_stranger(const std::filesystem::path& path) {
  throw Error(
      std::string("is in the way: it is ") +
          (std::filesystem::is_symlink(path) ? "a symbolic link, which is not followed" : "not a file"),
      path.string(), "Remove it, or write elsewhere");
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

int flags_of(OpenMode mode) {
  switch (mode) {
    case OpenMode::read:
      return O_RDONLY;
    case OpenMode::write:
      return O_RDWR | O_NOFOLLOW;
    case OpenMode::read_append:
      break;
  }
  return O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW;
}

std::int64_t megabytes(std::int64_t bytes) {
  return (bytes + 999'999) / 1'000'000;
}

}  // namespace

FileDescriptor::FileDescriptor(FileDescriptor&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), path_(std::move(other.path_)) {}

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  close();
  fd_ = std::exchange(other.fd_, -1);
  path_ = std::move(other.path_);
  return *this;
}

void FileDescriptor::close() noexcept {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

FileDescriptor open_file(const std::filesystem::path& path, OpenMode mode) {
  if (mode != OpenMode::read && std::filesystem::is_symlink(path)) refuse_stranger(path);
  return {open_regular_file(path, flags_of(mode)), path};
}

bool lock_file(const FileDescriptor& file) {
  using namespace std::chrono_literals;
  const auto deadline = std::chrono::steady_clock::now() + 2s;
  while (::flock(file.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(10ms);
  }
  return true;
}

bool is_locked(const FileDescriptor& file) {
  if (::flock(file.get(), LOCK_SH | LOCK_NB) != 0) return errno == EWOULDBLOCK;
  ::flock(file.get(), LOCK_UN);
  return false;
}

std::int64_t file_size(const FileDescriptor& file) {
  struct stat status = {};
  if (::fstat(file.get(), &status) != 0) fail("read the file's size", file.path(), errno);
  return status.st_size;
}

std::size_t read_some(const FileDescriptor& file, std::span<std::byte> into, std::int64_t offset) {
  for (;;) {
    const ssize_t got = ::pread(file.get(), into.data(), into.size(), offset);
    if (got >= 0) return static_cast<std::size_t>(got);
    if (errno != EINTR) fail("read the file", file.path(), errno);
  }
}

void read_exactly(const FileDescriptor& file, std::span<std::byte> into, std::int64_t offset) {
  while (!into.empty()) {
    const std::size_t got = read_some(file, into, offset);
    if (got == 0) throw Error("ends too early", file.path().string(), "Copy or make the file again");
    into = into.subspan(got);
    offset += static_cast<std::int64_t>(got);
  }
}

int write_all(int fd, std::string_view bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t put = ::write(fd, bytes.data(), bytes.size());
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(put));
  }
  return 0;
}

void write_exactly(const FileDescriptor& file, std::span<const std::byte> bytes, std::int64_t offset) {
  while (!bytes.empty()) {
    const ssize_t put = ::pwrite(file.get(), bytes.data(), bytes.size(), offset);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) fail("write " + std::to_string(bytes.size()) + " bytes", file.path(), errno);
    bytes = bytes.subspan(static_cast<std::size_t>(put));
    offset += put;
  }
}

void append_text(const FileDescriptor& file, std::string_view text) {
  if (const int error = write_all(file.get(), text)) fail("write to the file", file.path(), error);
}

std::shared_ptr<const void> map_file(const FileDescriptor& file, std::int64_t offset, std::int64_t bytes) {
  const std::int64_t page = ::sysconf(_SC_PAGESIZE);
  const std::int64_t lead = offset % page;
  const auto length = static_cast<std::size_t>(bytes + lead);
  void* base = ::mmap(nullptr, length, PROT_READ, MAP_PRIVATE, file.get(), offset - lead);
  if (base == MAP_FAILED) fail("map " + std::to_string(bytes) + " bytes", file.path(), errno);
  ::madvise(base, length, MADV_WILLNEED);
  NamedMapping* const named = name_mapping(base, length, file.path());
  const std::shared_ptr<const void> mapping(base, [length, named](void* p) {
    if (named != nullptr) named->forget();
    ::munmap(p, length);
  });
  return {mapping, static_cast<const char*>(base) + lead};
}

const char* mapped_file_at(const void* address) noexcept {
  for (const NamedMapping& mapping : named_mappings)
    if (mapping.holds(address)) return mapping.name.data();
  return nullptr;
}

void check_free_space(const std::filesystem::path& path, std::int64_t needed) {
  struct statvfs disk = {};
  if (::statvfs(folder_of(path).c_str(), &disk) != 0) fail("write into the folder", folder_of(path), errno);
  auto available = static_cast<std::int64_t>(disk.f_bavail) * static_cast<std::int64_t>(disk.f_frsize);
  struct stat status = {};
  if (::stat(path.c_str(), &status) == 0) available += status.st_blocks * 512;
  if (needed > available) {
    throw Error("the disk is too full: " + std::to_string(megabytes(needed)) + " MB are needed, " +
                    std::to_string(available / 1'000'000) + " MB are free",
                path.string(), hint_for(ENOSPC));
  }
}

void reserve_space(const FileDescriptor& file, std::int64_t offset, std::int64_t bytes) {
  if (::fallocate(file.get(), 0, offset, bytes) == 0 || errno == EOPNOTSUPP || errno == ENOSYS) return;
  fail("reserve " + std::to_string(megabytes(bytes)) + " MB", file.path(), errno);
}

int make_new_file(const std::filesystem::path& path, mode_t mode) noexcept {
  return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
}

void make_anew(const std::filesystem::path& temporary) {
  struct stat status = {};
  if (::lstat(temporary.c_str(), &status) == 0) {
    if (!S_ISREG(status.st_mode)) refuse_stranger(temporary);
    if (::unlink(temporary.c_str()) != 0) fail("remove what an earlier run left", temporary, errno);
  }
  const FileDescriptor made(make_new_file(temporary), temporary);
  if (made.get() < 0) fail("make the file", temporary, errno);
}

void rename_file(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code failed;
  std::filesystem::rename(from, to, failed);
  if (failed) fail("rename " + from.string(), to, failed.value());
}

bool rename_new(const std::filesystem::path& from, const std::filesystem::path& to) {
  int result = ::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE);
  if (result != 0 && (errno == EINVAL || errno == ENOSYS)) {  // a file system without that has links
    result = ::link(from.c_str(), to.c_str());
    if (result == 0) ::unlink(from.c_str());
  }
  if (result != 0 && errno != EEXIST) fail("rename " + from.string(), to, errno);
  return result == 0;
}

void flush(const FileDescriptor& file) {
  if (::fsync(file.get()) != 0) fail("write the file to the disk", file.path(), errno);
}

void rename_durably(const std::filesystem::path& from, const std::filesystem::path& to, bool keeps) {
  flush(open_file(from, OpenMode::write));
  if (!keeps) rename_file(from, to);
  if (keeps && !rename_new(from, to))
    throw Error("is there already, and is kept", to.string(), "Write to another file");
  const int folder = ::open(folder_of(to).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;  // the file is complete; only the rename's place on the disk is left to the system
  ::fsync(folder);
  ::close(folder);
}

std::filesystem::path with_suffix(const std::filesystem::path& path, const char* suffix) {
  std::filesystem::path result = path;
  result += suffix;
  return result;
}

}  // namespace palpate
