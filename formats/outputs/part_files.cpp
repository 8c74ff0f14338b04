#include "formats/outputs/part_files.h"

#include <algorithm>
#include <map>
#include <string>
#include <system_error>

#include "base/error.h"
#include "base/file_io.h"
#include "formats/journal.h"

namespace palpate {
namespace {

constexpr std::size_t most_told = 8;  // missing parts in a message

struct PartFile {
  std::filesystem::path path;
  JournalFrame frame;
  std::int64_t pieces = 0, done = 0;  // of all matrices
};

std::string name_of(std::int64_t number, std::int64_t parts) {
  return "part " + std::to_string(number) + " of " + std::to_string(parts);
}

/// Adds the parts of a model in a folder.
void find_in(const std::filesystem::path& folder, const std::filesystem::path& model,
             std::vector<std::filesystem::path>& found) {
  const std::string start = model.filename().string() + ".part-";
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, failed)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(start) && !name.ends_with(".progress"))
      found.push_back(folder.empty() ? std::filesystem::path(name) : entry.path());
  }
  if (failed)
    throw Error("cannot be searched for parts: " + failed.message(), folder.string(), "Name another folder");
}

PartFile read_part(const std::filesystem::path& path) {
  const std::filesystem::path progress = with_suffix(path, ".progress");
  std::error_code failed;
  if (!std::filesystem::exists(path, failed))
    throw Error("is not there", path.string(), "Name files that --part has written, or their folder");
  if (!std::filesystem::exists(progress, failed))
    throw Error("is not there, which says what " + path.filename().string() + " holds", progress.string(),
                "Copy both files of a part");
  const std::optional<JournalContents> contents = peek_journal(progress);
  if (!contents || !contents->frame.part)
    throw Error("is no journal of a part, or was cut off", progress.string(),
                "Copy it again, or give its --part again");
  PartFile part{path, contents->frame};
  std::map<std::pair<std::int64_t, std::int64_t>, std::int64_t> counts;  // by matrix and first piece
  for (const JournalRange& range : contents->ranges) counts[{range.matrix, range.first}] = range.count;
  for (const auto& [place, count] : counts) part.done += count;
  for (const PieceRange& pieces : part.frame.part->pieces) part.pieces += pieces.end - pieces.first;
  return part;
}

void expect_finished(const PartFile& part) {
  const auto& [number, parts, pieces] = *part.frame.part;
  if (part.done < part.pieces) {
    throw Error(name_of(number, parts) + " is not finished: " + std::to_string(part.done) + " of " +
                    std::to_string(part.pieces) + " columns are there",
                part.path.string(),
                "Give --part " + std::to_string(number) + '/' + std::to_string(parts) + " again: it goes on");
  }
}

void expect_one_bake(const PartFile& first, const PartFile& other) {
  if (other.frame.part->parts != first.frame.part->parts) {
    throw Error("is one of " + std::to_string(other.frame.part->parts) + " parts, and " +
                    first.path.filename().string() + " one of " + std::to_string(first.frame.part->parts),
                other.path.string(), "Remove the parts that are not wanted");
  }
  if (other.frame.key != first.frame.key) {
    throw Error("is of another model or version than " + first.path.filename().string() +
                    ", or was made on another kind of processor",
                other.path.string(), "Make both parts again with the same program from the same files");
  }
  if (other.frame.part->number == first.frame.part->number) {
    throw Error("is " + name_of(other.frame.part->number, other.frame.part->parts) + ", and " +
                    first.path.string() + " is too",
                other.path.string(), "Name each part once");
  }
}

void expect_all(const std::filesystem::path& model, const std::vector<PartFile>& found) {
  const std::int64_t parts = found.front().frame.part->parts;
  std::vector<std::string> missing;
  for (std::int64_t number = 1; number <= parts; ++number) {
    if (std::none_of(found.begin(), found.end(),
                     [&](const PartFile& part) { return part.frame.part->number == number; }))
      missing.push_back(std::to_string(number) + '/' + std::to_string(parts));
  }
  if (missing.empty()) return;
  const std::size_t count = missing.size();
  std::string told;
  for (std::size_t k = 0; k < std::min(count, most_told); ++k) told += (k > 0 ? ", " : "") + missing[k];
  throw Error((count == 1 ? "a part is missing: " : std::to_string(count) + " parts are missing: ") + told +
                  (count > most_told ? ", ..." : ""),
              model.string(), "Run palpate-precompute with --part " + missing.front() + ", or copy it here");
}

}  // namespace

std::filesystem::path part_path(const std::filesystem::path& model, std::int64_t number, std::int64_t parts) {
  const std::string suffix = ".part-" + std::to_string(number) + "-of-" + std::to_string(parts);
  return with_suffix(model, suffix.c_str());
}

std::vector<std::filesystem::path> find_parts(const std::filesystem::path& model,
                                              const std::vector<std::filesystem::path>& named) {
  std::vector<std::filesystem::path> paths;
  std::error_code failed;
  if (named.empty()) find_in(model.parent_path(), model, paths);
  for (const auto& name : named) {
    if (std::filesystem::is_directory(name, failed)) {
      find_in(name, model, paths);
    } else {
      paths.push_back(name);
    }
  }
  if (paths.empty()) {
    throw Error(
        "there are no parts of it", model.string(),
        "Run palpate-precompute with --part 1/N to N/N first, or name the folders where the parts are");
  }
  std::sort(paths.begin(), paths.end());
  std::vector<PartFile> found;
  for (const auto& path : paths) {
    PartFile part = read_part(path);
    for (const PartFile& other : found) expect_one_bake(other, part);
    found.push_back(std::move(part));
  }
  expect_all(model, found);
  std::sort(found.begin(), found.end(),
            [](const PartFile& a, const PartFile& b) { return a.frame.part->number < b.frame.part->number; });
  paths.clear();
  for (const PartFile& part : found) {
    expect_finished(part);
    paths.push_back(part.path);
  }
  return paths;
}

void remove_parts(const std::vector<std::filesystem::path>& parts) noexcept {
  std::error_code ignored;
  for (const auto& part : parts) {
    std::filesystem::remove(part, ignored);
    std::filesystem::remove(with_suffix(part, ".progress"), ignored);
  }
}

}  // namespace palpate
