// Atomic writing of files.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string_view>

#include "base/file_io.h"

namespace palpate {

/// A new file under the first free name beside `target`. Files that a killed run or another program left
/// there are neither followed nor touched. Removed by the destructor unless it has taken the target's place.
class TemporaryFile {
 public:
  /// Creates the file with mode `mode` (less the umask). Throws Error with the system's reason, as do all
  /// members.
  explicit TemporaryFile(std::filesystem::path target, mode_t mode = 0666);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  void write(std::string_view bytes);
  /// Renames the file to the target, once. With `keeps`, throws Error if the target exists.
  void take_its_place(bool keeps = false);

 private:
  std::filesystem::path target_, path_;
  int fd_ = -1;
};

/// A file written piece by piece, with the guarantee of `write_file`: a regular file is replaced whole or not
/// at all. Throws Error.
class FileWriter {
 public:
  explicit FileWriter(const std::filesystem::path& file);

  void write(std::string_view bytes);
  void finish();  ///< replaces the regular file; without this call it stays as it was
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }  ///< bytes written so far

 private:
  std::optional<TemporaryFile> temporary_;  // for a regular file
  FileDescriptor stream_;
  std::size_t bytes_ = 0;
};

/// Writes `bytes` to `file`. A regular file is written under a new temporary name beside it and renamed, so
/// that it is complete or unchanged. A symbolic link to a file is followed. Pipes, terminals and other
/// character devices are written to directly, and so is `/dev/stdout` when redirected to a file. Throws Error
/// with the system's reason; a regular file is then unchanged.
void write_file(const std::filesystem::path& file, std::string_view bytes);

/// Writes a new regular file, whole or not at all. Throws Error if the name exists, even as a dangling link.
void write_new_file(const std::filesystem::path& file, std::string_view bytes);

/// Writes a regular file under a new temporary name beside it, with mode `mode` (less the umask), and renames
/// it over an existing file or symbolic link. Throws Error with the system's reason; the existing file is
/// then unchanged.
void replace_file(const std::filesystem::path& file, std::string_view bytes, mode_t mode = 0666);

/// Kind of file that a path is written to.
enum class WriteTarget {
  regular,          ///< a regular file, or nothing yet
  standard_stream,  ///< destination of this program's standard output or error stream
  stream,           ///< a pipe or a character device, as `/dev/null`
};

/// Kind of file at a path. Throws Error if it cannot be written: a folder, a socket, a block device, a
/// dangling link.
[[nodiscard]] WriteTarget write_target(const std::filesystem::path& file);

/// The file at the end of a symbolic link, with its folder; any other path unchanged. Throws Error for a
/// dangling link.
[[nodiscard]] std::filesystem::path link_target(const std::filesystem::path& file);

/// Opens a pipe or character device for writing. Throws Error for a pipe without a reader instead of waiting
/// for one. The caller closes the descriptor.
[[nodiscard]] int open_stream(const std::filesystem::path& file);

/// Creates and removes a temporary file beside `file`. Throws Error with the reason if that fails: a missing
/// folder, no permission to write, a read-only disk.
void expect_writable_folder(const std::filesystem::path& file);

}  // namespace palpate
