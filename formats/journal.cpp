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

/// The words of a line.
std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(' '), line.size());
    result.push_back(line.substr(0, end));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return result;
}

bool to_number(std::string_view text, std::int64_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && value >= 0;
}

/// Complete lines only: what follows the last line end was cut off.
std::vector<std::string_view> lines(std::string_view text) {
  std::vector<std::string_view> result;
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
    result.push_back(text.substr(0, end));
    text.remove_prefix(end + 1);
  }
  return result;
}

std::string line_of(const JournalRange& range) {
  return "columns " + std::to_string(range.matrix) + ' ' + std::to_string(range.first) + ' ' +
         std::to_string(range.count) + ' ' + range.checksum + '\n';
}

/// False when the file was deleted or replaced between opening and locking it.
bool is_still_there(const FileDescriptor& file) {
  struct stat opened = {};
  struct stat named = {};
  return ::fstat(file.get(), &opened) == 0 && ::stat(file.path().c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino;
}

/// Whether a regular file stands there. Throws Error where something else does.
bool is_there(const std::filesystem::path& file) {
  struct stat status = {};
  if (::lstat(file.c_str(), &status) != 0) return false;
  if (!S_ISREG(status.st_mode))
    throw Error("is in the way: it is no file of palpate-precompute's", file.string(),
                "Remove it, or choose another place with --output");
  return true;
}

/// What a killed run has left: a journal, or nothing yet.
void expect_journal(const FileDescriptor& file) {
  std::string start(first_word.size(), '\0');
  start.resize(read_some(file, std::as_writable_bytes(std::span(start)), 0));
  if (!first_word.starts_with(start))  // which a kill may have cut off
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

std::optional<JournalContents> Journal::read() const {
  std::string text(static_cast<std::size_t>(file_size(file_)), '\0');
  read_exactly(file_, std::as_writable_bytes(std::span(text)), 0);
  const std::vector<std::string_view> all = lines(text);
  if (all.size() < 2 || all[0] != first_line) return {};

  JournalContents contents;
  JournalFrame& frame = contents.frame;
  const auto frame_words = words(all[1]);
  if (frame_words.size() < 4 || frame_words[0] != "model" || !to_number(frame_words[2], frame.file_bytes))
    return {};
  frame.key = frame_words[1];
  frame.checksum = frame_words[3];
  for (std::size_t i = 4; i < frame_words.size(); ++i)
    if (!to_number(frame_words[i], frame.packed_at.emplace_back())) return {};

  for (std::size_t i = 2; i < all.size(); ++i) {
    const auto w = words(all[i]);
    JournalRange range;
    if (w.size() != 5 || w[0] != "columns" || !to_number(w[1], range.matrix) ||
        !to_number(w[2], range.first) || !to_number(w[3], range.count))
      break;
    range.checksum = w[4];
    contents.ranges.push_back(std::move(range));
  }
  return contents;
}

void Journal::write(const JournalContents& contents) {
  const JournalFrame& frame = contents.frame;
  std::string text = std::string(first_line) + "\nmodel " + frame.key + ' ' +
                     std::to_string(frame.file_bytes) + ' ' + frame.checksum;
  for (const std::int64_t at : frame.packed_at) text += ' ' + std::to_string(at);
  text += '\n';
  for (const JournalRange& range : contents.ranges) text += line_of(range);
  empty();
  append_text(file_, text);
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
