// Journal of the finished columns of a half-written model: PATH.progress, a text file that outlives a killed
// run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/file_io.h"

namespace palpate {

/// Columns of a packed matrix, or leaves of near pairs: [first, end).
struct PieceRange {
  std::int64_t first = 0;
  std::int64_t end = 0;
  friend bool operator==(const PieceRange&, const PieceRange&) = default;
};

/// Largest number of parts of a bake.
constexpr std::int64_t most_parts = 100'000;

/// A part of a bake, with a file of its own: number `number` of `parts`, from 1.
struct BakePart {
  std::int64_t number = 1;
  std::int64_t parts = 1;
  std::vector<PieceRange> pieces;  ///< pieces of each matrix in this part
  friend bool operator==(const BakePart&, const BakePart&) = default;
};

/// Part of PATH.partial that is complete before columns arrive.
struct JournalFrame {
  std::string key;  ///< key of the model being written
  std::int64_t file_bytes = 0;
  std::string checksum;                 ///< of all bytes except the packed matrices
  std::vector<std::int64_t> packed_at;  ///< first byte of each packed matrix
  std::optional<BakePart> part;         ///< nullopt for a whole model
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

/// Journal line of a range, including its end.
[[nodiscard]] std::string line_of(const JournalRange& range);
/// Journal text of a frame and ranges.
[[nodiscard]] std::string text_of(const JournalContents& contents);

/// Reads a line without its end; nullopt if it is no range.
[[nodiscard]] std::optional<JournalRange> read_range(std::string_view line);
/// Reads a text made by `text_of`, which a kill may have cut off; nullopt without a complete frame. A
/// truncated line ends the list.
[[nodiscard]] std::optional<JournalContents> read_journal(std::string_view text);
/// Reads a journal that another process may be writing. Throws Error if the file cannot be read.
[[nodiscard]] std::optional<JournalContents> peek_journal(const std::filesystem::path& path);

/// Throws Error if PATH.partial or PATH.progress, beside the model PATH, is something that no killed run of
/// ours can have left: another program's file, a link.
void expect_own_journal(const std::filesystem::path& model);

/// An open journal, locked by one process at a time.
class Journal {
 public:
  /// Opens or creates it. Throws Error if another process has locked it, or it is another program's file.
  explicit Journal(const std::filesystem::path& path);

  /// Contents left by a killed run, as read_journal returns them.
  [[nodiscard]] std::optional<JournalContents> read() const;

  void write(const JournalContents& contents);  ///< replaces the contents
  void empty();                                 ///< removes the contents
  void add(const JournalRange& range);          ///< appends a line, in one write
  void remove() noexcept;                       ///< deletes the file

 private:
  FileDescriptor file_;
};

}  // namespace palpate
