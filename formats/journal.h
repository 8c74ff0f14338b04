// Which columns of a half-written model are done: PATH.progress, a text file that a killed run leaves behind.
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

/// Parts that a bake may have.
constexpr std::int64_t most_parts = 100'000;

/// A part of a bake, with a file of its own: number `number` of `parts`, from 1.
struct BakePart {
  std::int64_t number = 1;
  std::int64_t parts = 1;
  std::vector<PieceRange> pieces;  ///< that it has of each matrix
  friend bool operator==(const BakePart&, const BakePart&) = default;
};

/// The part of PATH.partial that is finished before the columns arrive.
struct JournalFrame {
  std::string key;  ///< of the model that is being written
  std::int64_t file_bytes = 0;
  std::string checksum;                 ///< of all bytes but the packed matrices
  std::vector<std::int64_t> packed_at;  ///< first byte of each packed matrix
  std::optional<BakePart> part;         ///< nothing of a whole model
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

/// A range as a line of a journal, with its end.
[[nodiscard]] std::string line_of(const JournalRange& range);
/// A frame and ranges as the text of a journal.
[[nodiscard]] std::string text_of(const JournalContents& contents);

/// Reads a line without its end; nothing when it is no range.
[[nodiscard]] std::optional<JournalRange> read_range(std::string_view line);
/// Reads what `text_of` gave, of which a kill may have cut off the end; nothing when there is no complete
/// frame. A line that was cut off ends the list.
[[nodiscard]] std::optional<JournalContents> read_journal(std::string_view text);
/// Reads a journal that another process may be writing. Throws Error where the file cannot be read.
[[nodiscard]] std::optional<JournalContents> peek_journal(const std::filesystem::path& path);

/// Throws Error where PATH.partial or PATH.progress, beside the model PATH, is something that no killed run
/// of ours can have left: another's file, a link.
void expect_own_journal(const std::filesystem::path& model);

/// An open journal, held by one process at a time.
class Journal {
 public:
  /// Opens or makes it. Throws Error when another process holds it, or it is another's file.
  explicit Journal(const std::filesystem::path& path);

  /// What a killed run left, as read_journal takes it.
  [[nodiscard]] std::optional<JournalContents> read() const;

  void write(const JournalContents& contents);  ///< in place of what it held
  void empty();                                 ///< forgets everything
  void add(const JournalRange& range);          ///< one more line, in one write
  void remove() noexcept;                       ///< deletes the file

 private:
  FileDescriptor file_;
};

}  // namespace palpate
