#include "base/error.h"
#include "formats/checksum.h"
#include "formats/model_file.h"

namespace palpate {
namespace {

/// Folder of a file; for a symbolic link that of the file it points to.
std::filesystem::path folder_of(const std::filesystem::path& file) {
  return std::filesystem::weakly_canonical(std::filesystem::absolute(file)).parent_path();
}

/// Description of the change of an existing source; empty if it is unchanged.
std::string change_of(const SourceFile& source, const std::filesystem::path& file, const std::string& baked) {
  const std::string name = source.path + " (" + source.role + ")";
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) return name + " cannot be read: " + error.message();
  if (bytes != static_cast<std::uintmax_t>(source.bytes))
    return name + " changed since " + baked + " was precomputed: it had " + std::to_string(source.bytes) +
           " bytes, now it has " + std::to_string(bytes) + "; precompute it again";
  try {
    if (checksum_file(file) == source.checksum) return {};
  } catch (const Error& unreadable) {
    return name + " cannot be compared: " + unreadable.what();
  }
  return name + " changed since " + baked +
         " was precomputed (same size, other contents); precompute it again";
}

}  // namespace

std::filesystem::path source_path(const SourceFile& source, const std::filesystem::path& model_path) {
  return folder_of(model_path) / source.path;
}

std::vector<std::string> stale_sources(const Model& model, const std::filesystem::path& model_path) {
  const std::string baked = model_path.filename().string();
  std::vector<std::string> changes;
  std::string gone;
  for (const SourceFile& source : model.sources) {
    const std::filesystem::path file = source_path(source, model_path);
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) {
      gone += (gone.empty() ? "" : ", ") + source.path + " (" + source.role + ")";
      continue;
    }
    std::string change = change_of(source, file, baked);
    if (!change.empty()) changes.push_back(std::move(change));
  }
  if (!gone.empty())
    changes.push_back("what " + baked +
                      " was made from is not there, and needed only to make it again: " + gone);
  return changes;
}

SourceFile describe_source(const std::string& role, const std::filesystem::path& file,
                           const std::filesystem::path& model_path) {
  SourceFile source;
  source.role = role;
  source.checksum = checksum_file(file);
  source.bytes = static_cast<std::int64_t>(std::filesystem::file_size(file));
  source.path = std::filesystem::proximate(file, folder_of(model_path)).generic_string();
  if (source.path.find('\n') != std::string::npos)
    throw Error("has a line end in its name", file.string(), "Rename the file");
  return source;
}

}  // namespace palpate
