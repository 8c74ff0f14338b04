// Which columns of a half-written model are done: PATH.progress, a text file that a killed run leaves behind.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/file_io.h"

namespace palpate {

/// The part of PATH.partial that is finished before the columns arrive.
struct JournalFrame {
  std::string key;  ///< of the model that is being written
  std::int64_t file_bytes = 0;
  std::string checksum;                 ///< of all bytes but the packed matrices
  std::vector<std::int64_t> packed_at;  ///< first byte of each packed matrix
};

/// Columns [first, first + count) of a packed matrix and the checksum of their bytes.
struct JournalRange {
  std::int64_t matrix = 0;
  std::int64_t first = 0;
  std::int64_t count = 0;
  std::string checksum;
};

struct JournalContents {
  JournalFrame frame;
  std::vector<JournalRange> ranges;
};

/// Throws Error where PATH.partial or PATH.progress, beside the model PATH, is something that no killed run
/// of ours can have left: another's file, a link.
void expect_own_journal(const std::filesystem::path& model);

/// An open journal, held by one process at a time.
class Journal {
 public:
  /// Opens or makes it. Throws Error when another process holds it, or it is another's file.
  explicit Journal(const std::filesystem::path& path);

  /// What a killed run left; nothing when there is no complete frame. A line that was cut off by the kill
  /// ends the list.
  [[nodiscard]] std::optional<JournalContents> read() const;

  void write(const JournalContents& contents);  ///< in place of what it held
  void empty();                                 ///< forgets everything
  void add(const JournalRange& range);          ///< one more line, in one write
  void remove() noexcept;                       ///< deletes the file

 private:
  FileDescriptor file_;
};

}  // namespace palpate
