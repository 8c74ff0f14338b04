#include "formats/outputs/output_paths.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <system_error>

#include "base/error.h"
#include "base/write_file.h"
#include "formats/journal.h"

namespace palpate {
namespace {

bool same_file(const std::optional<struct stat>& a, const std::optional<struct stat>& b) {
  return a && b && a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

/// True if `path` is `folder` or inside it.
bool is_inside(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const auto [end, ignored] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return end == folder.end();
}

/// Throws Error unless an existing file may be replaced.
void check_existing(const std::filesystem::path& file, OutputKind kind, std::optional<bool> force) {
  if (force.value_or(false) || ::access(file.c_str(), F_OK) != 0) return;
  const std::string elsewhere = std::string("write to another file, or ") +
                                (force ? "replace this one with --force" : "remove this one first");
  if (::access(file.c_str(), W_OK) != 0 && errno == EACCES)
    throw Error("is there and write-protected", file.string(), elsewhere);
  if (!is_ours(file, kind))
    throw Error("is there already and is not a " + std::string(name_of(kind)) + " of Palpate's",
                file.string(), elsewhere);
  if (kind == OutputKind::recording && holds_ticks(file))
    throw Error("is a recording already, which could not be made again", file.string(), elsewhere);
}

/// Ending of a name with its dot, in small letters; empty if it is no word.
std::string ending_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const auto is_plain = [](unsigned char c) { return std::isalnum(c) != 0; };
  const bool is_word = ending.size() > 1 && std::isalpha(static_cast<unsigned char>(ending[1])) != 0 &&
                       std::all_of(ending.begin() + 1, ending.end(), is_plain);
  return is_word ? ending : "";
}

}  // namespace

void expect_ending(const std::filesystem::path& file, OutputKind kind, const std::string& what) {
  const std::string ending = ending_of(file);
  const auto endings = endings_of(kind);
  if (ending.empty() || std::find(endings.begin(), endings.end(), ending) != endings.end()) return;
  const std::string usual(endings.front());
  throw Error("ends in " + ending + ", and " + what + " is a " + usual + " file", file.string(),
              "name it " + std::filesystem::path(file).replace_extension(usual).filename().string());
}

OutputPaths::Known OutputPaths::known(const std::filesystem::path& path, const std::string& what) {
  std::error_code failed;
  std::filesystem::path absolute = std::filesystem::absolute(path, failed);
  if (failed) absolute = path;  // the working directory is gone
  Known result{.path = std::filesystem::weakly_canonical(absolute, failed), .status = {}, .what = what};
  if (failed) result.path = absolute;
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && (S_ISREG(status.st_mode) || S_ISDIR(status.st_mode)))
    result.status = status;
  return result;
}

void OutputPaths::refuse_inputs(const Known& output) const {
  for (const Known& input : inputs_) {
    if (!is_inside(output.path, input.path) && !same_file(output.status, input.status)) continue;
    throw Error("is " + input.what + ", which this run reads: it would be lost", output.path.string(),
                "write " + output.what + " to another file");
  }
}

void OutputPaths::refuse_outputs(const Known& output) const {
  for (const Known& other : outputs_) {
    if (!is_inside(output.path, other.path) && !is_inside(other.path, output.path) &&
        !same_file(output.status, other.status))
      continue;
    throw Error("is both " + other.what + " and " + output.what, output.path.string(),
                "give each a file of its own");
  }
}

void OutputPaths::add_input(const std::filesystem::path& path, const std::string& what) {
  Known input = known(path, what);
  if (!input.status) return;
  inputs_.push_back(std::move(input));
  for (const Known& output : outputs_) refuse_inputs(output);
}

std::filesystem::path OutputPaths::add(const std::filesystem::path& path, OutputKind kind,
                                       const std::string& option) {
  if (path.empty()) throw Error("is an empty file name", option, "give the name of a file");
  const std::string what = "the " + std::string(name_of(kind)) + " (" + option + ")";
  const WriteTarget target = write_target(path);
  if (target != WriteTarget::regular) {
    if (needs_regular_file(kind))
      throw Error("is not a regular file, and " + what + " needs one", path.string(),
                  "give the name of a file");
    if (target == WriteTarget::stream) pipes_.emplace_back(open_stream(path), path);
    return path;
  }
  std::filesystem::path file = link_target(path);
  Known output = known(file, what);
  refuse_inputs(output);
  refuse_outputs(output);
  outputs_.push_back(output);
  if (keep_ && output.status)
    throw Error("is there already, and is kept", path.string(), "write to another file");
  check_existing(file, kind, force_);
  expect_ending(path, kind, what);
  expect_ending(file, kind, what);
  if (kind == OutputKind::model) {
    add_beside(with_suffix(file, ".partial"), what);
    add_beside(with_suffix(file, ".progress"), what);
    expect_own_journal(file);
  }
  if (kind == OutputKind::recording) add_beside(with_suffix(file, ".partial"), what);
  expect_writable_folder(file);
  return file;
}

/// Adds the intermediate file of an output.
void OutputPaths::add_beside(const std::filesystem::path& path, const std::string& what) {
  Known beside = known(path, what + "'s unfinished part");
  refuse_inputs(beside);
  refuse_outputs(beside);
  outputs_.push_back(std::move(beside));
}

}  // namespace palpate
