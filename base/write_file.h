// Files that appear whole or not at all.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string_view>

namespace palpate {

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
