// Files below HDF5: positioned reads and writes, mappings, free space, durable renames (POSIX).
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace palpate {

/// An open file, closed by the destructor.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  FileDescriptor(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {}
  FileDescriptor(FileDescriptor&& other) noexcept;
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;
  ~FileDescriptor() { close(); }

  [[nodiscard]] int get() const noexcept { return fd_; }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  void close() noexcept;

 private:
  int fd_ = -1;
  std::filesystem::path path_;
};

enum class OpenMode : std::uint8_t {
  read,         ///< must exist
  write,        ///< must exist and be no symbolic link; reads too
  read_append,  ///< made when missing, no symbolic link; reads anywhere, writes at the end
};

/// Opens a regular file and nothing else, without waiting. Throws Error with the reason.
FileDescriptor open_file(const std::filesystem::path& path, OpenMode mode);

/// Locks the file for this program (flock) until it is closed. False if another program still has the lock
/// after two seconds: a killed program keeps it until the last process that it forked has ended. True where
/// the file system has no locks.
bool lock_file(const FileDescriptor& file);

/// True if a program holds the lock now.
bool is_locked(const FileDescriptor& file);

/// Size of the file [byte].
std::int64_t file_size(const FileDescriptor& file);

/// Reads up to `into.size()` bytes at `offset`; returns how many, 0 at the end of the file. Throws Error.
std::size_t read_some(const FileDescriptor& file, std::span<std::byte> into, std::int64_t offset);

/// Reads exactly `into.size()` bytes at `offset`. Throws Error if the file ends earlier.
void read_exactly(const FileDescriptor& file, std::span<std::byte> into, std::int64_t offset);

/// Writes all of `bytes` at the descriptor's position. Returns 0, or the system's reason (errno).
int write_all(int fd, std::string_view bytes) noexcept;

/// Writes all of `bytes` at `offset`. Throws Error with the system's reason (full disk, ...).
void write_exactly(const FileDescriptor& file, std::span<const std::byte> bytes, std::int64_t offset);

/// Adds a line to a file opened with read_append. Throws Error.
void append_text(const FileDescriptor& file, std::string_view text);

/// Maps bytes [offset, offset + bytes) read-only; the mapping lives as long as the pointer. `bytes` > 0 and
/// inside the file.
std::shared_ptr<const void> map_file(const FileDescriptor& file, std::int64_t offset, std::int64_t bytes);

/// Name of the file that `map_file` has mapped at an address, made printable; null if there is none, or if
/// too many were mapped to keep its name. Async-signal-safe.
const char* mapped_file_at(const void* address) noexcept;

/// Throws Error (needed, free) unless `needed` bytes fit beside `path`; the space of a file at `path` counts
/// as free.
void check_free_space(const std::filesystem::path& path, std::int64_t needed);

/// Reserves the disk space of [offset, offset + bytes) if the file system can. Throws Error if the disk is
/// full.
void reserve_space(const FileDescriptor& file, std::int64_t offset, std::int64_t bytes);

/// Creates an empty file with mode `mode` (less the umask) and opens it for writing. An existing file of that
/// name is neither opened, followed nor replaced. Returns the descriptor, which the caller closes, or -1 with
/// errno set.
[[nodiscard]] int make_new_file(const std::filesystem::path& path, mode_t mode = 0666) noexcept;

/// Creates an empty temporary file in place of one that a killed run may have left. Throws Error if the name
/// belongs to anything but a regular file, which is neither followed nor removed.
void make_anew(const std::filesystem::path& temporary);

/// Renames. Throws Error with the system's reason.
void rename_file(const std::filesystem::path& from, const std::filesystem::path& to);

/// Renames without replacing: returns false if `to` exists, even as a dangling link. Throws Error with the
/// system's reason.
[[nodiscard]] bool rename_new(const std::filesystem::path& from, const std::filesystem::path& to);

/// Flushes written data to the disk; on a network file system, to where all machines see it. Throws Error.
void flush(const FileDescriptor& file);

/// Flushes `from` to the disk, then renames it. With `keeps`, an existing file is not replaced but an Error.
/// Throws Error.
void rename_durably(const std::filesystem::path& from, const std::filesystem::path& to, bool keeps = false);

/// The path with a suffix appended: "liver.palpate.hdf" + ".partial".
std::filesystem::path with_suffix(const std::filesystem::path& path, const char* suffix);

}  // namespace palpate
