#include "formats/journal.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "base/error.h"
#include "formats/output_kind.h"

namespace palpate {
namespace {

constexpr std::string_view first_word = "palpate-progress ";
constexpr std::string_view first_line = "palpate-progress 2";

/// Words of a line.
std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(' '), line.size());
    result.push_back(line.substr(0, end));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return result;
}

/// Upper limit of bytes, columns and rows, so that no sum of a journal's numbers overflows.
constexpr std::int64_t beyond_all = std::int64_t{1} << 48;

bool to_number(std::string_view text, std::int64_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && value >= 0 && value < beyond_all;
}

/// Complete lines; text after the last line end was cut off.
std::vector<std::string_view> lines(std::string_view text) {
  std::vector<std::string_view> result;
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
    result.push_back(text.substr(0, end));
    text.remove_prefix(end + 1);
  }
  return result;
}

std::string text_of(const FileDescriptor& file) {
  std::string text(static_cast<std::size_t>(file_size(file)), '\0');
  read_exactly(file, std::as_writable_bytes(std::span(text)), 0);
  return text;
}

std::optional<JournalFrame> read_frame(std::string_view line) {
  JournalFrame frame;
  const auto w = words(line);
  if (w.size() < 4 || w[0] != "model" || !to_number(w[2], frame.file_bytes)) return {};
  frame.key = w[1];
  frame.checksum = w[3];
  for (std::size_t i = 4; i < w.size(); ++i)
    if (!to_number(w[i], frame.packed_at.emplace_back())) return {};
  return frame;
}

std::optional<BakePart> read_part(std::string_view line) {
  BakePart part;
  const auto w = words(line);
  if (w.size() < 5 || w.size() % 2 == 0 || w[0] != "part" || !to_number(w[1], part.number) ||
      !to_number(w[2], part.parts) || part.number < 1 || part.number > part.parts || part.parts > most_parts)
    return {};
  for (std::size_t i = 3; i < w.size(); i += 2) {
    PieceRange& pieces = part.pieces.emplace_back();
    if (!to_number(w[i], pieces.first) || !to_number(w[i + 1], pieces.end) || pieces.end < pieces.first)
      return {};
  }
  return part;
}

/// True unless the file was deleted or replaced between opening and locking it.
bool is_still_there(const FileDescriptor& file) {
  struct stat opened = {};
  struct stat named = {};
  return ::fstat(file.get(), &opened) == 0 && ::stat(file.path().c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino;
}

/// True if a regular file exists there. Throws Error if it is something else.
bool is_there(const std::filesystem::path& file) {
  struct stat status = {};
  if (::lstat(file.c_str(), &status) != 0) return false;
  if (!S_ISREG(status.st_mode))
    throw Error("is in the way: it is no file of palpate-precompute's", file.string(),
                "Remove it, or choose another place with --output");
  return true;
}

/// Throws Error unless a file is a journal, or empty.
void expect_journal(const FileDescriptor& file) {
  std::string start(first_word.size(), '\0');
  start.resize(read_some(file, std::as_writable_bytes(std::span(start)), 0));
  if (!first_word.starts_with(start))  // a kill may have cut it off
    throw Error("is in the way: it is not what palpate-precompute writes there", file.path().string(),
                "Remove it, or choose another place with --output");
}

}  // namespace

void expect_own_journal(const std::filesystem::path& model) {
  const std::filesystem::path progress = with_suffix(model, ".progress"),
                              partial = with_suffix(model, ".partial");
  const bool has_journal = is_there(progress);
  if (has_journal) expect_journal(open_file(progress, OpenMode::read));
  if (is_there(partial) && !has_journal && !is_ours(partial, OutputKind::model))
    throw Error("is in the way: it is not what palpate-precompute writes there", partial.string(),
                "Remove it, or choose another place with --output");
}

Journal::Journal(const std::filesystem::path& path) {
  do {
    file_ = open_file(path, OpenMode::read_append);
    if (!lock_file(file_))
      throw Error("another palpate-precompute is writing this file", path.string(),
                  "Wait for it, or choose another place with --output");
  } while (!is_still_there(file_));
  expect_journal(file_);
}

std::string line_of(const JournalRange& range) {
  return "columns " + std::to_string(range.matrix) + ' ' + std::to_string(range.first) + ' ' +
         std::to_string(range.count) + ' ' + range.checksum + '\n';
}

std::string text_of(const JournalContents& contents) {
  const JournalFrame& frame = contents.frame;
  std::string text = std::string(first_line) + "\nmodel " + frame.key + ' ' +
                     std::to_string(frame.file_bytes) + ' ' + frame.checksum;
  for (const std::int64_t at : frame.packed_at) text += ' ' + std::to_string(at);
  text += '\n';
  if (frame.part) {
    text += "part " + std::to_string(frame.part->number) + ' ' + std::to_string(frame.part->parts);
    for (const PieceRange& pieces : frame.part->pieces)
      text += ' ' + std::to_string(pieces.first) + ' ' + std::to_string(pieces.end);
    text += '\n';
  }
  for (const JournalRange& range : contents.ranges) text += line_of(range);
  return text;
}

std::optional<JournalRange> read_range(std::string_view line) {
  const auto w = words(line);
  JournalRange range;
  if (w.size() != 5 || w[0] != "columns" || !to_number(w[1], range.matrix) || !to_number(w[2], range.first) ||
      !to_number(w[3], range.count))
    return {};
  range.checksum = w[4];
  return range;
}

std::optional<JournalContents> read_journal(std::string_view text) {
  const std::vector<std::string_view> all = lines(text);
  if (all.size() < 2 || all[0] != first_line) return {};
  std::optional<JournalFrame> frame = read_frame(all[1]);
  if (!frame) return {};
  std::size_t next = 2;
  if (all.size() > next && all[next].starts_with("part ")) {
    frame->part = read_part(all[next++]);
    if (!frame->part || frame->part->pieces.size() != frame->packed_at.size()) return {};
  }
  JournalContents contents{*std::move(frame), {}};
  for (; next < all.size(); ++next) {
    std::optional<JournalRange> range = read_range(all[next]);
    if (!range) break;
    contents.ranges.push_back(*std::move(range));
  }
  return contents;
}

std::optional<JournalContents> peek_journal(const std::filesystem::path& path) {
  return read_journal(text_of(open_file(path, OpenMode::read)));
}

std::optional<JournalContents> Journal::read() const {
  return read_journal(text_of(file_));
}

void Journal::write(const JournalContents& contents) {
  empty();
  append_text(file_, text_of(contents));
}

void Journal::empty() {
  if (::ftruncate(file_.get(), 0) != 0)
    throw Error("cannot be emptied", file_.path().string(), "Delete this file");
}

void Journal::add(const JournalRange& range) {
  append_text(file_, line_of(range));
}

void Journal::remove() noexcept {
  ::unlink(file_.path().c_str());
}

}  // namespace palpate
