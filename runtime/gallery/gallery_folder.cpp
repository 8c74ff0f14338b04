#include "runtime/gallery/gallery_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

#include "base/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t longest_name = 200;

constexpr std::array<std::pair<std::string_view, GalleryKind>, 15> endings = {{
    {".palpate.hdf", GalleryKind::body},
    {".mcap", GalleryKind::recording},
    {".stl", GalleryKind::source},
    {".obj", GalleryKind::source},
    {".ply", GalleryKind::source},
    {".off", GalleryKind::source},
    {".inr", GalleryKind::source},
    {".inr.gz", GalleryKind::source},
    {".nii", GalleryKind::source},
    {".nii.gz", GalleryKind::source},
    {".nrrd", GalleryKind::source},
    {".png", GalleryKind::source},
    {".pbm", GalleryKind::source},
    {".model.toml", GalleryKind::source},
    {"model.toml", GalleryKind::source},
}};

std::string_view ending_of(std::string_view name) {
  std::string_view longest;
  for (const auto& [ending, kind] : endings)
    if (name.ends_with(ending) && ending.size() > longest.size()) longest = ending;
  return longest;
}

/// Most pictures in a folder are unrelated; only dropped ones become bodies.
bool is_picture(std::string_view name) {
  return ending_of(name) == ".png" || ending_of(name) == ".pbm";
}

/// Returns NAME of NAME.palpate.hdf, NAME.stl, NAME.model.toml; "model" of "model.toml".
std::string_view stem_of(std::string_view name) {
  const std::string_view ending = ending_of(name) == "model.toml" ? ".toml" : ending_of(name);
  return name.substr(0, name.size() - ending.size());
}

/// True if the folder has a file whose name begins with the stem and a dot, as all files derived from one do.
bool has_any_of(const fs::path& folder, const std::string& stem) {
  std::error_code problem;
  for (fs::directory_iterator at(folder, problem), end; !problem && at != end; at.increment(problem))
    if (at->path().filename().string().starts_with(stem + ".")) return true;
  return false;
}

double seconds_since_1970(fs::file_time_type time) {
  const auto system = std::chrono::file_clock::to_sys(time);
  return std::chrono::duration<double>(system.time_since_epoch()).count();
}

/// Returns nothing if the file is gone or not regular.
std::optional<GalleryItem> item_of(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  const std::optional<GalleryKind> kind = gallery_kind(name);
  std::error_code problem;
  if (!kind || !entry.is_regular_file(problem)) return std::nullopt;
  const auto bytes = static_cast<std::int64_t>(entry.file_size(problem));
  const fs::file_time_type modified = problem ? fs::file_time_type() : entry.last_write_time(problem);
  if (problem) return std::nullopt;
  return GalleryItem{.name = name, .kind = *kind, .bytes = bytes, .modified = seconds_since_1970(modified)};
}

}  // namespace

std::optional<GalleryKind> gallery_kind(std::string_view name) {
  const bool has_control = std::any_of(
      name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; });
  if (name.empty() || name.size() > longest_name || name.front() == '.' || has_control ||
      name.find('/') != std::string_view::npos)
    return std::nullopt;
  const std::string_view ending = ending_of(name);
  for (const auto& [known, kind] : endings)
    if (known == ending && !ending.empty()) return kind;
  return std::nullopt;
}

std::vector<GalleryItem> list_gallery(const fs::path& folder) {
  std::error_code problem;
  fs::directory_iterator entries(folder, problem);
  if (problem)
    throw Error("cannot be read: " + problem.message(), folder.string(),
                "give a folder with bodies or recordings: palpate-runtime view FOLDER");
  std::vector<GalleryItem> items;
  for (const fs::directory_entry& entry : entries)
    if (std::optional<GalleryItem> item = item_of(entry)) items.push_back(std::move(*item));
  std::set<std::string_view> bodies;
  for (const GalleryItem& item : items)
    if (item.kind == GalleryKind::body) bodies.insert(stem_of(item.name));
  std::vector<GalleryItem> shown;
  for (const GalleryItem& item : items)
    if (item.kind != GalleryKind::source || (!bodies.contains(stem_of(item.name)) && !is_picture(item.name)))
      shown.push_back(item);
  std::sort(shown.begin(), shown.end(), [](const GalleryItem& a, const GalleryItem& b) {
    return std::tie(a.kind, a.name) < std::tie(b.kind, b.name);
  });
  return shown;
}

std::string baked_name(std::string_view source) {
  return std::string(stem_of(source)) + ".palpate.hdf";
}

std::string free_name(const fs::path& folder, const std::string& wanted) {
  if (!has_any_of(folder, std::string(stem_of(wanted)))) return wanted;
  const std::string_view ending = ending_of(wanted) == "model.toml" ? ".model.toml" : ending_of(wanted);
  std::string stem;
  for (int k = 2; stem.empty() || has_any_of(folder, stem); ++k)
    stem = fmt::format("{}-{}", stem_of(wanted), k);
  return stem + std::string(ending);
}

}  // namespace palpate
