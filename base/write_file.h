// Files that appear whole or not at all.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string_view>

#include "base/file_io.h"

namespace palpate {

/// A new file that nothing else has opened, under the first free name beside `target`: what a killed run or a
/// stranger left there is neither followed nor touched. Is removed again unless it takes the target's place.
class TemporaryFile {
 public:
  /// With the rights `mode` (less the umask). Throws Error with the system's reason, as the others.
  explicit TemporaryFile(std::filesystem::path target, mode_t mode = 0666);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  void write(std::string_view bytes);
  /// Renames it to the target, once. With `keeps` Error where a file is there.
  void take_its_place(bool keeps = false);

 private:
  std::filesystem::path target_, path_;
  int fd_ = -1;
};

/// A file that is written piece by piece, and else as `write_file` does it: a regular file is whole or as it
/// was. Throws Error.
class FileWriter {
 public:
  explicit FileWriter(const std::filesystem::path& file);

  void write(std::string_view bytes);
  void finish();  ///< a regular file takes its place; without this it does not
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }  ///< that were written

 private:
  std::optional<TemporaryFile> temporary_;  // of a regular file
  FileDescriptor stream_;
  std::size_t bytes_ = 0;
};

/// Writes `bytes` to `file`. A regular file is written under a fresh temporary name beside it and renamed, so
/// that it is whole or as it was. Of a symbolic link to a file the target is written. Pipes, terminals and
/// other character devices are written to directly, also `/dev/stdout` when it is redirected to a file.
/// Throws Error with the system's reason; then a regular file is as it was.
void write_file(const std::filesystem::path& file, std::string_view bytes);

/// Writes a new regular file, whole or not at all: what has the name already, a link to nothing too, stays,
/// and an Error is thrown.
void write_new_file(const std::filesystem::path& file, std::string_view bytes);

/// Writes a regular file under a fresh temporary name beside it, with the rights `mode` (less the umask), and
/// renames it, in the place of what was there, a symbolic link too. Throws Error with the system's reason;
/// then what was there is as it was.
void replace_file(const std::filesystem::path& file, std::string_view bytes, mode_t mode = 0666);

/// What becomes of the bytes that are written to a path.
enum class WriteTarget {
  regular,          ///< a file, or nothing yet
  standard_stream,  ///< what this program's standard output or error stream goes to
  stream,           ///< a pipe or a character device, as `/dev/null`
};

/// Throws Error where a path leads to nothing that can be written: a folder, a socket, a block device, a
/// symbolic link to nothing.
[[nodiscard]] WriteTarget write_target(const std::filesystem::path& file);

/// The file that a symbolic link leads to in the end, with its folder; every other path as it is. Throws
/// Error for a link to nothing.
[[nodiscard]] std::filesystem::path link_target(const std::filesystem::path& file);

/// Opens a pipe or character device to write to it. Throws Error for a pipe that no program reads, rather
/// than wait for one. The caller closes it.
[[nodiscard]] int open_stream(const std::filesystem::path& file);

/// Makes and removes a temporary file beside `file`. Throws Error with the reason where that cannot be: a
/// missing folder, no right to write there, a disk that is read-only.
void expect_writable_folder(const std::filesystem::path& file);

}  // namespace palpate
