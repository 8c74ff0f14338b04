// Input files: opened without waiting, read whole.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// Opens a regular file with the flags of open(2), O_CLOEXEC added, and returns its descriptor, which the
/// caller closes. Never waits and never opens a device. Throws Error with the reason when the file is missing
/// (hint: `if_missing`), may not be opened, or is a folder, FIFO, socket or device.
int open_regular_file(const std::filesystem::path& file, int flags,
                      const char* if_missing = "Check the path");

/// Throws Error with the reason unless `file` is a regular file that may be read; `if_missing` is the hint if
/// it does not exist.
void check_regular_file(const std::filesystem::path& file, const char* if_missing = "Check the path");

/// All bytes of a regular file. Throws Error as check_regular_file does.
std::string read_all(const std::filesystem::path& file, const char* if_missing = "Check the path");

}  // namespace palpate
