// Input files: opened without waiting, read whole.
#pragma once

#include <cstdint>
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

inline constexpr std::int64_t largest_read = std::int64_t{8} << 30;          ///< [bytes] that is read whole
inline constexpr std::int64_t largest_description = std::int64_t{64} << 20;  ///< [bytes] of a TOML file

/// All bytes of a regular file. Throws Error as check_regular_file does, and if it has more than `most`
/// bytes.
std::string read_all(const std::filesystem::path& file, const char* if_missing = "Check the path",
                     std::int64_t most = largest_read);

}  // namespace palpate
