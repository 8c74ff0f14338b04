// What there is in a folder to push, to look at or to make a body of.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Told by the name's ending.
enum class GalleryKind : std::uint8_t {
  body,       ///< NAME.palpate.hdf
  recording,  ///< SESSION.mcap
  source,     ///< what palpate-runtime push makes a body of: a surface, a labelled image, a description
};

struct GalleryItem {
  std::string name;  ///< of the file in the folder
  GalleryKind kind = GalleryKind::body;
  std::int64_t bytes = 0;
  double modified = 0.0;  ///< [s] since 1970
};

/// What a file of this name is; nothing for a name that is none of a file here: hidden, with a folder in it,
/// or with another ending.
[[nodiscard]] std::optional<GalleryKind> gallery_kind(std::string_view name);

/// Bodies, then recordings, then sources that no body there was made of by name, without pictures; each by
/// name. Throws Error where the folder cannot be read.
[[nodiscard]] std::vector<GalleryItem> list_gallery(const std::filesystem::path& folder);

/// The body that is made of a source of this name: NAME.palpate.hdf for NAME.stl and for NAME.model.toml,
/// whatever name that gives itself.
[[nodiscard]] std::string baked_name(std::string_view source);

/// A name like `wanted` for a new file of the folder: `wanted` itself, or with a number before its ending.
/// Nothing there begins with what is before the ending and a dot, so that neither the file nor what is made
/// of it and lands beside it (NAME.model.toml, NAME.palpate.hdf, ...) meets another one.
[[nodiscard]] std::string free_name(const std::filesystem::path& folder, const std::string& wanted);

}  // namespace palpate
